//! The columns of a table: which holds what, by the names in its header.

use csv_core::{Reader, ReaderBuilder};

/// The longest row, in bytes after unquoting, and the most fields of it that are looked at.
const LONGEST: usize = 8 * 1024;
const MOST_FIELDS: usize = 64;

/// Knows which column holds what, and splits rows.
pub(super) struct Columns {
    time: Quantity,
    duration: Option<Quantity>,
    data: usize,
    kind: Option<usize>,
    errors: Vec<usize>,
    names: Vec<String>,
    splitter: Splitter,
}

/// Is a column of numbers in a unit.
#[derive(Clone, Copy)]
struct Quantity {
    index: usize,
    /// A second is ten to this many units.
    decimals: u8,
}

impl Columns {
    /// Finds the columns of a header; `None` without one of times and one of bytes.
    pub(super) fn find(header: &[u8]) -> Option<Columns> {
        [b',', b';', b'\t'].into_iter().find_map(|delimiter| {
            let mut splitter = Splitter::new(delimiter);
            splitter.split(header);
            let name = |index| String::from_utf8_lossy(splitter.field(index)).into_owned();
            let names: Vec<String> = (0..splitter.count).map(name).collect();
            Columns::named(names, splitter)
        })
    }

    fn named(names: Vec<String>, splitter: Splitter) -> Option<Columns> {
        let units: Vec<(String, Option<u8>)> = names.iter().map(|name| name_and_unit(name)).collect();
        let position = |wanted: &dyn Fn(&str) -> bool| units.iter().position(|(name, _)| wanted(name));
        let quantity = |index: usize| units[index].1.map(|decimals| Quantity { index, decimals });
        let time = position(&|name| matches!(name, "time" | "start_time" | "start" | "timestamp"));
        let data = position(&|name| matches!(name, "data" | "value" | "byte") || is_sigrok_uart(name));
        let duration = position(&|name| name == "duration");
        Some(Columns {
            time: quantity(time?)?,
            duration: duration.and_then(quantity),
            data: data?,
            kind: position(&|name| name == "type"),
            errors: (0..units.len()).filter(|&index| units[index].0.contains("error")).collect(),
            names,
            splitter,
        })
    }

    /// Splits a row.
    pub(super) fn row(&mut self, text: &[u8]) -> Row<'_> {
        self.splitter.split(text);
        Row { columns: self }
    }
}

/// Splits a header such as `Time [s]` into its name in lower case and how many decimals make a second.
fn name_and_unit(header: &str) -> (String, Option<u8>) {
    let header = header.trim().to_lowercase();
    let Some((name, unit)) = header.split_once(['[', '(']) else { return (header, Some(0)) };
    let decimals = match unit.trim_end_matches([']', ')']) {
        "s" => Some(0),
        "ms" => Some(3),
        "us" | "µs" | "μs" => Some(6),
        "ns" => Some(9),
        _ => None,
    };
    (name.trim().to_owned(), decimals)
}

/// Tells whether a header is that of a UART decoder of DSView, such as `1:UART: RX/TX`.
fn is_sigrok_uart(name: &str) -> bool {
    name.split_once(':').is_some_and(|(number, rest)| {
        !number.is_empty() && number.bytes().all(|c| c.is_ascii_digit()) && rest.starts_with("uart")
    })
}

/// Is a row of the table.
pub(super) struct Row<'a> {
    columns: &'a Columns,
}

impl<'a> Row<'a> {
    fn cell(&self, index: usize) -> (&'a str, &'a [u8]) {
        let Columns { names, splitter, .. } = self.columns;
        (&names[index], splitter.field(index).trim_ascii())
    }

    /// Returns the name of the column of times, the cell, and how many decimals make a second.
    pub(super) fn time(&self) -> (&'a str, &'a [u8], u8) {
        let Quantity { index, decimals } = self.columns.time;
        let (name, cell) = self.cell(index);
        (name, cell, decimals)
    }

    /// Returns the same of the column that says how long a byte lasted.
    pub(super) fn duration(&self) -> Option<(&'a str, &'a [u8], u8)> {
        let Quantity { index, decimals } = self.columns.duration?;
        let (name, cell) = self.cell(index);
        Some((name, cell, decimals))
    }

    /// Returns the name of the column of bytes, and the cell.
    pub(super) fn data(&self) -> (&'a str, &'a [u8]) {
        self.cell(self.columns.data)
    }

    /// Returns what the row is about, where a column says so.
    pub(super) fn kind(&self) -> Option<&'a [u8]> {
        self.columns.kind.map(|index| self.cell(index).1)
    }

    /// Tells whether a column of errors says anything.
    pub(super) fn has_error(&self) -> bool {
        let nothing: [&[u8]; 4] = [b"", b"0", b"false", b"False"];
        self.columns.errors.iter().any(|&index| !nothing.contains(&self.cell(index).1))
    }
}

/// Splits lines into fields; a field that is missing, or beyond the bounds, is empty.
struct Splitter {
    reader: Reader,
    text: Box<[u8]>,
    ends: [usize; MOST_FIELDS],
    count: usize,
}

impl Splitter {
    fn new(delimiter: u8) -> Self {
        let reader = ReaderBuilder::new().delimiter(delimiter).build();
        Splitter { reader, text: vec![0; LONGEST].into_boxed_slice(), ends: [0; MOST_FIELDS], count: 0 }
    }

    fn split(&mut self, line: &[u8]) {
        self.reader.reset();
        let (_, _, length, count) = self.reader.read_record(line, &mut self.text, &mut self.ends);
        // The end of the line is the end of the record.
        let (text, ends) = (&mut self.text[length..], &mut self.ends[count..]);
        let (_, _, _, more) = self.reader.read_record(b"", text, ends);
        self.count = count + more;
    }

    fn field(&self, index: usize) -> &[u8] {
        if index >= self.count {
            return b"";
        }
        let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        self.text.get(start..self.ends[index]).unwrap_or(b"")
    }
}
