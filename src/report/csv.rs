//! CSV: one kind of row, its keys as the heading; lists joined by `;`, fields as `name=value`.

use std::io::Write;

use super::columns::{self, Cell, Cells, Key};
use super::{Clock, Format, Show, json};
use crate::device::Value;
use crate::pipeline::Event;

/// Writes comma-separated values (RFC 4180) of one kind of row.
pub struct Csv {
    keys: Vec<&'static str>,
    clock: Clock,
    cells: Vec<Vec<u8>>,
    remark: Option<&'static str>,
}

impl Csv {
    /// Makes a writer for the rows of `show`.
    ///
    /// With frames come damaged runs, losses and identifications: what keys a frame has not, follow its own.
    pub fn new(show: Show, clock: Clock) -> Self {
        let mut keys = Vec::new();
        let kinds: &[&[&str]] = match show {
            Show::Frames => &[
                columns::frame::KEYS,
                columns::damaged::KEYS,
                columns::lost::KEYS,
                columns::identified::KEYS,
            ],
            Show::Transactions => &[columns::transaction::KEYS],
            Show::Readings => &[columns::reading::KEYS],
            Show::Findings => &[columns::finding::KEYS],
            Show::Devices => &[columns::identified::KEYS],
        };
        for key in kinds.iter().copied().flatten() {
            if !keys.contains(key) {
                keys.push(*key);
            }
        }
        Csv { cells: vec![Vec::new(); keys.len()], keys, clock, remark: None }
    }

    /// Adds a column that is the same in every row, for what CSV has no other place for.
    pub fn with_remark(mut self, key: &'static str, remark: &'static str) -> Self {
        self.keys.push(key);
        self.cells.push(Vec::new());
        self.remark = Some(remark);
        self
    }
}

impl Format for Csv {
    fn heading(&mut self, out: &mut Vec<u8>) {
        record(&self.keys, out);
    }

    fn row(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        self.cells.iter_mut().for_each(Vec::clear);
        self.clock.note(event);
        columns::write(
            bus,
            event,
            &mut Record { keys: &self.keys, cells: &mut self.cells, clock: &self.clock },
        );
        if let (Some(remark), Some(cell)) = (self.remark, self.cells.last_mut()) {
            cell.extend_from_slice(remark.as_bytes());
        }
        record(&self.cells, out);
    }

    fn note_time(&mut self, event: &Event<'_>) {
        self.clock.note(event);
    }
}

/// Writes one record into memory, which cannot fail.
fn record(fields: impl IntoIterator<Item = impl AsRef<[u8]>>, out: &mut Vec<u8>) {
    let mut writer = csv::WriterBuilder::new().buffer_capacity(1024).from_writer(out);
    let _ = writer.write_record(fields);
    let _ = writer.flush();
}

/// Is a record being filled in.
struct Record<'a> {
    keys: &'a [&'static str],
    cells: &'a mut [Vec<u8>],
    clock: &'a Clock,
}

impl Cells for Record<'_> {
    fn cell(&mut self, key: Key, cell: Cell<'_>) {
        let column = self.keys.iter().position(|name| *name == key.name);
        let Some(out) = column.and_then(|index| self.cells.get_mut(index)) else { return };
        // Writing to memory cannot fail.
        let _ = match cell {
            Cell::Null => Ok(()),
            Cell::Name(name) => out.write_all(name.as_bytes()),
            Cell::Text(text) => out.write_all(text.as_bytes()),
            Cell::Unsigned(number) => write!(out, "{number}"),
            Cell::Nanoseconds(ns) => write!(out, "{ns}"),
            Cell::Time(time) => write!(out, "{}", self.clock.exact(time)),
            Cell::Fraction(number) => write!(out, "{number}"),
            Cell::Boolean(truth) => write!(out, "{truth}"),
            Cell::Bytes(bytes) => {
                json::hex(bytes, out);
                Ok(())
            }
            Cell::LineErrors(errors) => {
                join(errors, out, |error, out| write!(out, "{}={}", error.offset, error.kind.name()))
            }
            Cell::Span(span) => write!(out, "{};{}", span.start, span.end),
            Cell::Ids(ids) => join(ids, out, |id, out| write!(out, "{id}")),
            Cell::Candidates(meaning) => join(meaning.candidates(), out, |id, out| write!(out, "{id}")),
            Cell::Fields(meaning) => join(meaning.fields(), out, |field, out| {
                write!(out, "{}=", field.name)?;
                plain(&field.value, out);
                Ok(())
            }),
            Cell::Value(value) => {
                plain(value, out);
                Ok(())
            }
        };
    }
}

/// Writes a value as JSON does, but text without quotes and nothing for `null`.
pub(super) fn plain(value: &Value<'_>, out: &mut Vec<u8>) {
    match value {
        Value::Null => {}
        Value::Float32(number) if !number.is_finite() => {}
        Value::Float64(number) if !number.is_finite() => {}
        Value::Text(text) => out.extend_from_slice(text.as_bytes()),
        other => json::value(other, out),
    }
}

fn join<T>(
    items: impl IntoIterator<Item = T>,
    out: &mut Vec<u8>,
    mut write: impl FnMut(T, &mut Vec<u8>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    for (index, item) in items.into_iter().enumerate() {
        if index > 0 {
            out.push(b';');
        }
        write(item, out)?;
    }
    Ok(())
}
