//! CSV for spreadsheets: a row a poll, a column a quantity.

use std::io::{self, Read, Write};

use super::Clock;
use super::csv::plain;
use crate::device::Reading;
use crate::pipeline::Event;

/// The columns before the quantities.
const KEYS: [&str; 6] = ["t_ns", "bus", "address", "device", "serial_number", "transaction"];

/// Gathers the readings of each poll into a row.
///
/// Which columns there are is known at the end only, so rows are written short, and filled up then.
pub struct Wide {
    clock: Clock,
    /// Quantity and unit of each column after `KEYS`, as they came up.
    columns: Vec<(String, Option<String>)>,
    row: Vec<Vec<u8>>,
    transaction: Option<u64>,
}

impl Wide {
    /// Makes a table whose times are shown by `clock`.
    pub fn new(clock: Clock) -> Self {
        Wide { clock, columns: Vec::new(), row: Vec::new(), transaction: None }
    }

    /// Takes note of the time of an event, for relative times.
    pub fn note_time(&mut self, event: &Event<'_>) {
        self.clock.note(event);
    }

    /// Takes an event; appends a row to `out` once its poll is over.
    pub fn event(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        let Event::Reading { reading, time, address, transaction } = event else { return };
        if self.transaction != Some(*transaction) {
            self.finish_row(out);
            self.transaction = Some(*transaction);
            let text = |text: Option<&str>| text.unwrap_or_default().as_bytes().to_vec();
            self.row.push(time.map_or_else(Vec::new, |time| self.clock.exact(time).to_string().into()));
            self.row.push(text(Some(bus)));
            self.row.push(address.to_string().into());
            self.row.push(text(reading.device));
            self.row.push(text(reading.serial_number));
            self.row.push(transaction.to_string().into());
        }
        let column = KEYS.len() + self.column(reading);
        if self.row.len() <= column {
            self.row.resize(column + 1, Vec::new());
        }
        if let Some(cell) = self.row.get_mut(column) {
            plain(&reading.value, cell);
        }
    }

    fn column(&mut self, reading: &Reading<'_>) -> usize {
        let known = self
            .columns
            .iter()
            .position(|(quantity, unit)| quantity == reading.quantity && unit.as_deref() == reading.unit);
        known.unwrap_or_else(|| {
            self.columns.push((reading.quantity.to_owned(), reading.unit.map(str::to_owned)));
            self.columns.len() - 1
        })
    }

    /// Appends the row of the last poll.
    pub fn finish_row(&mut self, out: &mut Vec<u8>) {
        if self.transaction.take().is_some() {
            record(&self.row, out);
            self.row.clear();
        }
    }

    /// Writes the whole table: the heading, then the rows filled up; `remark` is a column of its own.
    ///
    /// # Errors
    /// When the rows cannot be read back or the table cannot be written.
    pub fn finish(&self, rows: impl Read, table: impl Write, remark: Option<(&str, &str)>) -> io::Result<()> {
        let mut table = csv::Writer::from_writer(table);
        let quantities = self.columns.iter().map(|(quantity, unit)| match unit {
            Some(unit) => format!("{quantity} [{unit}]"),
            None => quantity.clone(),
        });
        let heading = KEYS.into_iter().map(str::to_owned).chain(quantities);
        table.write_record(heading.chain(remark.map(|(key, _)| key.to_owned())))?;
        let width = KEYS.len() + self.columns.len();
        let mut rows = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(rows);
        let mut row = csv::ByteRecord::new();
        while rows.read_byte_record(&mut row)? {
            while row.len() < width {
                row.push_field(b"");
            }
            if let Some((_, value)) = remark {
                row.push_field(value.as_bytes());
            }
            table.write_byte_record(&row)?;
        }
        table.flush()
    }
}

/// Writes one record into memory, which cannot fail.
fn record(row: &[Vec<u8>], out: &mut Vec<u8>) {
    let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(out);
    let _ = writer.write_record(row);
    let _ = writer.flush();
}
