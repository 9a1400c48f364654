//! The columns of the traffic view: which there are, which are shown, and what they sort by.

use crate::tui::store::Row;

/// Names the columns, in the order in which they stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    /// The row's number in its list.
    Number,
    /// When it began.
    Time,
    /// The bus.
    Bus,
    /// The unit address.
    Address,
    /// The device, or the direction of a frame.
    Device,
    /// Function and command.
    Command,
    /// Latency, or the gap before a frame.
    Latency,
    /// What was said, in words, or the bytes.
    Said,
}

/// Is what a row is sorted by.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SortKey {
    /// It has nothing there.
    Nothing,
    /// A number.
    Number(i64),
    /// A text.
    Text(String),
}

impl Column {
    /// Lists all columns.
    pub const ALL: [Column; 8] = [
        Column::Number,
        Column::Time,
        Column::Bus,
        Column::Address,
        Column::Device,
        Column::Command,
        Column::Latency,
        Column::Said,
    ];

    /// Returns its heading.
    pub fn title(self, is_frames: bool) -> &'static str {
        match (self, is_frames) {
            (Column::Number, _) => "#",
            (Column::Time, _) => "TIME",
            (Column::Bus, _) => "BUS",
            (Column::Address, _) => "ADDR",
            (Column::Device, false) => "DEVICE",
            (Column::Device, true) => "ROLE",
            (Column::Command, false) => "COMMAND",
            (Column::Command, true) => "FUNCTION",
            (Column::Latency, false) => "LATENCY",
            (Column::Latency, true) => "GAP",
            (Column::Said, false) => "VALUES",
            (Column::Said, true) => "BYTES",
        }
    }

    /// Returns what a row is sorted by.
    pub fn sort_key(self, row: &Row) -> SortKey {
        let number = |number: Option<i64>| number.map_or(SortKey::Nothing, SortKey::Number);
        match (self, row) {
            (Column::Number | Column::Time, _) => number(row.time().map(|time| time.as_ns())),
            (Column::Bus, _) => SortKey::Number(row.bus() as i64),
            (Column::Address, _) => number(row.address().map(i64::from)),
            (Column::Latency, _) => number(row.span().map(|span| span.midpoint())),
            (Column::Device, Row::Exchange(row)) => SortKey::Text(row.label.to_string()),
            (Column::Device, Row::Run(row)) => SortKey::Text(row.role.name().to_owned()),
            (Column::Command, Row::Exchange(row)) => SortKey::Text(row.title.to_string()),
            (Column::Command, Row::Run(row)) => number(row.function.map(|code| code.0.into())),
            (Column::Said, Row::Exchange(row)) => SortKey::Text(row.said.to_string()),
            (Column::Said, Row::Run(row)) => SortKey::Number(row.bytes.len() as i64),
            (Column::Said, Row::Remark(row)) => SortKey::Text(row.text.to_string()),
            (Column::Device | Column::Command, Row::Remark(_)) => SortKey::Nothing,
        }
    }
}

/// Says which columns are wanted; those that find no room are left out all the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Columns {
    hidden: Vec<Column>,
}

impl Default for Columns {
    fn default() -> Self {
        Columns { hidden: vec![Column::Number] }
    }
}

impl Columns {
    /// Tells whether a column is wanted.
    pub fn is_shown(&self, column: Column) -> bool {
        !self.hidden.contains(&column)
    }

    /// Shows a column, or hides it.
    pub fn toggle(&mut self, column: Column) {
        match self.hidden.iter().position(|hidden| *hidden == column) {
            Some(at) => drop(self.hidden.remove(at)),
            None => self.hidden.push(column),
        }
    }
}
