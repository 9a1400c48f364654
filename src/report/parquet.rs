//! Parquet: readings or transactions in typed columns, for DuckDB, Polars or Spark over months of files.
//!
//! Columns have the names and the order of the JSON keys; before the first time stands `t`, the same as
//! `TIMESTAMP(MICROS, UTC)`, for not all that read Parquet know nanoseconds. Bytes are bytes, a value is a
//! 64-bit float; `candidates` and `fields` are JSON text.

use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Type};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;
use parquet::schema::types::ColumnDescPtr;

use super::columns::{self, Cell, Cells, Key};
use super::json;
use crate::device::Value;
use crate::pipeline::Event;

/// Rows of a row group at most.
const GROUP_ROWS: usize = 1 << 17;
/// Bytes of a row group at most, about, before they are encoded.
const GROUP_BYTES: usize = 32 << 20;

const READINGS: &str = "message reading {
    optional binary type (STRING);
    optional binary bus (STRING);
    optional int64 t (TIMESTAMP(MICROS,true));
    optional int64 t_ns;
    optional int32 address (INTEGER(8,false));
    optional binary device (STRING);
    optional binary serial_number (STRING);
    optional binary quantity (STRING);
    optional double value;
    optional binary unit (STRING);
    optional boolean derived;
    optional int64 transaction (INTEGER(64,false));
}";

const TRANSACTIONS: &str = "message transaction {
    optional binary type (STRING);
    optional int64 id (INTEGER(64,false));
    optional binary bus (STRING);
    optional int64 t (TIMESTAMP(MICROS,true));
    optional int64 start_ns;
    optional int64 end_ns;
    optional int32 address (INTEGER(8,false));
    optional int32 function (INTEGER(8,false));
    optional int32 start_register (INTEGER(16,false));
    optional int32 quantity (INTEGER(16,false));
    optional binary outcome (STRING);
    optional int32 exception_code (INTEGER(8,false));
    optional int64 latency_ns;
    optional int64 latency_error_ns;
    optional int64 request (INTEGER(64,false));
    optional int64 response (INTEGER(64,false));
    optional binary request_bytes;
    optional binary response_bytes;
    optional binary device (STRING);
    optional binary candidates (JSON);
    optional binary command (STRING);
    optional binary fields (JSON);
}";

/// Names the tables that can be written: a file holds one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    /// A row a measured or derived value.
    Readings,
    /// A row a request and what became of it.
    Transactions,
}

impl Table {
    fn schema(self) -> &'static str {
        match self {
            Table::Readings => READINGS,
            Table::Transactions => TRANSACTIONS,
        }
    }

    fn includes(self, event: &Event<'_>) -> bool {
        match event {
            Event::Reading { .. } => self == Table::Readings,
            Event::Transaction { .. } => self == Table::Transactions,
            _ => false,
        }
    }
}

/// Writes a Parquet file, a row group at a time.
pub struct Parquet {
    table: Table,
    /// Writes into memory, from where each row group is taken.
    writer: SerializedFileWriter<Vec<u8>>,
    columns: Vec<Column>,
    rows: usize,
    bytes: usize,
}

impl Parquet {
    /// Begins a file; `metadata` are the file's keys and values.
    ///
    /// # Errors
    /// When the library refuses, which no input makes it do.
    pub fn new(table: Table, metadata: Vec<(String, String)>) -> Result<Self, ParquetError> {
        let schema = parse_message_type(table.schema())?;
        let metadata = metadata.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(metadata));
        for field in schema.get_fields().iter().filter(|field| field.get_physical_type() == Type::INT64) {
            // Times and ids go up: their differences are small, and hardly any comes twice.
            let path = parquet::schema::types::ColumnPath::from(field.name());
            properties = properties
                .set_column_dictionary_enabled(path.clone(), false)
                .set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
        }
        let writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties.build()))?;
        let columns = writer.schema_descr().columns().iter().map(Column::new).collect();
        Ok(Parquet { table, writer, columns, rows: 0, bytes: 0 })
    }

    /// Takes an event; what is no row of the table is left out.
    pub fn event(&mut self, bus: &str, event: &Event<'_>) {
        if !self.table.includes(event) {
            return;
        }
        let mut row = Row { columns: self.columns.iter_mut(), bytes: &mut self.bytes };
        columns::write(bus, event, &mut row);
        self.rows += 1;
    }

    /// Appends a row group to `out` when there is enough for one.
    ///
    /// # Errors
    /// As for `new`.
    pub fn drain(&mut self, out: &mut Vec<u8>) -> Result<(), ParquetError> {
        if self.rows < GROUP_ROWS && self.bytes < GROUP_BYTES {
            return Ok(());
        }
        self.write_group()?;
        self.writer.flush()?;
        out.append(self.writer.inner_mut());
        Ok(())
    }

    /// Appends the last row group and the footer to `out`.
    ///
    /// # Errors
    /// As for `new`.
    pub fn finish(&mut self, out: &mut Vec<u8>) -> Result<(), ParquetError> {
        self.write_group()?;
        self.writer.finish()?;
        self.writer.flush()?;
        out.append(self.writer.inner_mut());
        Ok(())
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        if self.rows == 0 {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        for column in &mut self.columns {
            if let Some(mut writer) = group.next_column()? {
                column.write(&mut writer)?;
                writer.close()?;
            }
        }
        group.close()?;
        (self.rows, self.bytes) = (0, 0);
        Ok(())
    }
}

/// Gathers one column of a row group.
enum Column {
    Int32(Optional<i32>),
    Int64(Optional<i64>),
    /// Microseconds since the Unix epoch.
    Time(Optional<i64>),
    Double(Optional<f64>),
    Boolean(Optional<bool>),
    Bytes(Optional<ByteArray>),
}

/// Holds the values that there are, and for each row whether it has one.
struct Optional<T> {
    values: Vec<T>,
    levels: Vec<i16>,
}

impl<T> Optional<T> {
    const NONE: Optional<T> = Optional { values: Vec::new(), levels: Vec::new() };

    fn push(&mut self, value: Option<T>) {
        self.levels.push(i16::from(value.is_some()));
        self.values.extend(value);
    }

    fn clear(&mut self) {
        self.values.clear();
        self.levels.clear();
    }
}

impl Column {
    fn new(description: &ColumnDescPtr) -> Column {
        match description.physical_type() {
            Type::INT32 => Column::Int32(Optional::NONE),
            Type::INT64 if description.logical_type_ref().is_some_and(is_time) => {
                Column::Time(Optional::NONE)
            }
            Type::INT64 => Column::Int64(Optional::NONE),
            Type::DOUBLE => Column::Double(Optional::NONE),
            Type::BOOLEAN => Column::Boolean(Optional::NONE),
            _ => Column::Bytes(Optional::NONE),
        }
    }

    /// Takes a cell; returns about how many bytes it needs. What does not fit the type is null.
    fn push(&mut self, cell: &Cell<'_>) -> usize {
        match self {
            // Addresses, codes and registers, of at most 16 bits.
            Column::Int32(column) => column.push(match cell {
                Cell::Unsigned(number) => i32::try_from(*number).ok(),
                _ => None,
            }),
            Column::Int64(column) => column.push(match cell {
                Cell::Unsigned(number) => Some(number.cast_signed()),
                Cell::Nanoseconds(ns) => Some(*ns),
                Cell::Time(time) => Some(time.as_ns()),
                _ => None,
            }),
            Column::Time(column) => column.push(match cell {
                Cell::Time(time) => Some(time.as_ns().div_euclid(1000)),
                _ => None,
            }),
            Column::Double(column) => column.push(match cell {
                Cell::Value(value) => number(value),
                _ => None,
            }),
            Column::Boolean(column) => column.push(match cell {
                Cell::Boolean(truth) => Some(*truth),
                _ => None,
            }),
            Column::Bytes(column) => {
                let bytes = bytes(cell);
                let length = bytes.as_ref().map_or(0, Vec::len);
                column.push(bytes.map(ByteArray::from));
                return length + size_of::<ByteArray>();
            }
        }
        size_of::<u64>()
    }

    fn write(&mut self, writer: &mut SerializedColumnWriter<'_>) -> Result<(), ParquetError> {
        macro_rules! write {
            ($column:ident: $type:ty) => {{
                writer.typed::<$type>().write_batch(&$column.values, Some(&$column.levels), None)?;
                $column.clear();
            }};
        }
        match self {
            Column::Int32(column) => write!(column: Int32Type),
            Column::Int64(column) | Column::Time(column) => write!(column: Int64Type),
            Column::Double(column) => write!(column: DoubleType),
            Column::Boolean(column) => write!(column: BoolType),
            Column::Bytes(column) => write!(column: ByteArrayType),
        }
        Ok(())
    }
}

fn is_time(logical_type: &LogicalType) -> bool {
    matches!(logical_type, LogicalType::Timestamp { .. })
}

/// Returns a value as 64-bit float, of a 32-bit float the one that is written alike: 7.9, not 7.900000095….
fn number(value: &Value<'_>) -> Option<f64> {
    match value {
        Value::Float32(number) => ryu::Buffer::new().format(*number).parse().ok(),
        Value::Boolean(truth) => Some(f64::from(u8::from(*truth))),
        other => other.as_f64(),
    }
    .filter(|number| number.is_finite())
}

fn bytes(cell: &Cell<'_>) -> Option<Vec<u8>> {
    match cell {
        Cell::Name(name) => Some(name.as_bytes().to_vec()),
        Cell::Text(text) => Some(text.as_bytes().to_vec()),
        Cell::Bytes(bytes) => Some(bytes.to_vec()),
        Cell::Candidates(_) | Cell::Fields(_) => {
            let mut text = Vec::new();
            json::cell(cell, &mut text, &mut String::new());
            Some(text)
        }
        _ => None,
    }
}

/// Is a row being written: its cells go to the columns in order.
struct Row<'a> {
    columns: std::slice::IterMut<'a, Column>,
    bytes: &'a mut usize,
}

impl Cells for Row<'_> {
    fn cell(&mut self, key: Key, cell: Cell<'_>) {
        if matches!(key.name, "t_ns" | "start_ns")
            && let Some(column) = self.columns.next()
        {
            *self.bytes += column.push(&cell);
        }
        if let Some(column) = self.columns.next() {
            *self.bytes += column.push(&cell);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_keys_in_order() {
        for (table, keys) in
            [(Table::Readings, columns::reading::KEYS), (Table::Transactions, columns::transaction::KEYS)]
        {
            let schema = parse_message_type(table.schema()).expect("a schema");
            let names = schema.get_fields().iter().map(|field| field.name());
            let names: Vec<&str> = names.filter(|name| *name != "t").collect();
            assert_eq!(names, keys);
        }
    }

    #[test]
    fn a_value_is_the_decimal_that_people_see() {
        assert_eq!(number(&Value::Float32(7.9)), Some(7.9));
        assert_eq!(number(&Value::Float32(-1e-30)), Some(-1e-30));
        assert_eq!(number(&Value::Integer(-3)), Some(-3.0));
        assert_eq!(number(&Value::Float32(f32::NAN)), None);
        assert_eq!(number(&Value::Null), None);
    }
}
