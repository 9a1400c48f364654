//! JSON lines: an object a row, written straight into the buffer.
//!
//! A value from a float keeps its decimal point or exponent (17.0, 1e20); whole numbers have none.

use std::fmt::Write;

use super::Format;
use super::columns::{self, Cell, Cells, Key};
use crate::device::{Field, Meaning, Value};
use crate::pipeline::Event;

/// Writes JSON lines.
#[derive(Debug, Default)]
pub struct Json {
    scratch: String,
    remark: Option<&'static str>,
}

impl Json {
    /// Says something about all rows in a row before them, of type `remark`.
    pub fn with_remark(mut self, remark: &'static str) -> Self {
        self.remark = Some(remark);
        self
    }
}

impl Format for Json {
    fn heading(&mut self, out: &mut Vec<u8>) {
        if let Some(remark) = self.remark {
            out.extend_from_slice(b"{\"type\":\"remark\",\"message\":");
            quote(remark, out);
            out.extend_from_slice(b"}\n");
        }
    }

    fn row(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        let start = out.len();
        columns::write(bus, event, &mut Object { out, scratch: &mut self.scratch });
        if let Some(comma) = out.get_mut(start) {
            *comma = b'{';
        }
        out.extend_from_slice(b"}\n");
    }
}

/// Is an object being written; a comma stands before each key.
struct Object<'a> {
    out: &'a mut Vec<u8>,
    scratch: &'a mut String,
}

impl Cells for Object<'_> {
    // Inlined, most of it is known beforehand: the key's length, and the kind of cell.
    #[inline(always)]
    fn cell(&mut self, key: Key, worth: Cell<'_>) {
        self.out.extend_from_slice(key.quoted.as_bytes());
        cell(&worth, self.out, self.scratch);
    }
}

/// Writes what a cell is worth.
#[inline(always)]
pub(super) fn cell(cell: &Cell<'_>, out: &mut Vec<u8>, scratch: &mut String) {
    match *cell {
        Cell::Null => out.extend_from_slice(b"null"),
        Cell::Name(name) => quote_plain(name, out),
        Cell::Text(text) => quote(text, out),
        Cell::Unsigned(number) => integer(number, out),
        Cell::Nanoseconds(ns) => integer(ns, out),
        Cell::Time(time) => integer(time.as_ns(), out),
        Cell::Fraction(number) => float(number, out),
        Cell::Boolean(truth) => boolean(truth, out),
        Cell::Bytes(bytes) => {
            out.push(b'"');
            hex(bytes, out);
            out.push(b'"');
        }
        Cell::LineErrors(errors) => list(errors, out, |error, out| {
            out.extend_from_slice(b"{\"offset\":");
            integer(error.offset, out);
            out.extend_from_slice(b",\"kind\":");
            quote_plain(error.kind.name(), out);
            out.push(b'}');
        }),
        Cell::Span(span) => list([span.start, span.end], out, integer),
        Cell::Ids(ids) => list(ids, out, |id, out| integer(*id, out)),
        Cell::Candidates(meaning) => list(meaning.candidates(), out, quote),
        Cell::Fields(meaning) => fields(meaning, scratch, out),
        Cell::Value(worth) => value(worth, out),
    }
}

fn fields(meaning: &Meaning<'_>, scratch: &mut String, out: &mut Vec<u8>) {
    list(meaning.fields(), out, |field: Field<'_>, out| {
        out.extend_from_slice(b"{\"name\":");
        quote(field.name, out);
        out.extend_from_slice(b",\"value\":");
        value(&field.value, out);
        out.extend_from_slice(b",\"text\":");
        scratch.clear();
        let _ = write!(scratch, "{field}"); // writing to memory cannot fail
        quote(scratch, out);
        out.extend_from_slice(b",\"unit\":");
        match field.unit {
            Some(unit) => quote(unit, out),
            None => out.extend_from_slice(b"null"),
        }
        out.extend_from_slice(b",\"in\":");
        quote_plain(field.side.name(), out);
        out.extend_from_slice(b",\"span\":[");
        integer(field.span.start, out);
        out.push(b',');
        integer(field.span.end, out);
        out.extend_from_slice(b"]}");
    });
}

fn list<T>(items: impl IntoIterator<Item = T>, out: &mut Vec<u8>, mut write: impl FnMut(T, &mut Vec<u8>)) {
    out.push(b'[');
    for (index, item) in items.into_iter().enumerate() {
        if index > 0 {
            out.push(b',');
        }
        write(item, out);
    }
    out.push(b']');
}

/// Writes a value as JSON has it; what is not finite is `null`.
pub(super) fn value(value: &Value<'_>, out: &mut Vec<u8>) {
    match value {
        Value::Float32(number) if number.is_finite() => float(*number, out),
        Value::Float64(number) if number.is_finite() => float(*number, out),
        Value::Integer(number) => integer(*number, out),
        Value::Text(text) => quote(text, out),
        Value::Boolean(truth) => boolean(*truth, out),
        Value::Float32(_) | Value::Float64(_) | Value::Null => out.extend_from_slice(b"null"),
    }
}

/// Writes a finite float as the shortest decimal that reads back to the same number of its width.
pub(super) fn float(number: impl ryu::Float, out: &mut Vec<u8>) {
    out.extend_from_slice(ryu::Buffer::new().format_finite(number).as_bytes());
}

pub(super) fn integer(number: impl itoa::Integer, out: &mut Vec<u8>) {
    out.extend_from_slice(itoa::Buffer::new().format(number).as_bytes());
}

pub(super) fn boolean(truth: bool, out: &mut Vec<u8>) {
    out.extend_from_slice(if truth { b"true" } else { b"false" });
}

/// Writes lower-case hex without spaces.
pub(super) fn hex(bytes: &[u8], out: &mut Vec<u8>) {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let start = out.len();
    out.resize(start + 2 * bytes.len(), 0);
    for (pair, byte) in out[start..].chunks_exact_mut(2).zip(bytes) {
        pair[0] = DIGITS[usize::from(byte >> 4)];
        pair[1] = DIGITS[usize::from(byte & 15)];
    }
}

fn quote_plain(name: &'static str, out: &mut Vec<u8>) {
    out.push(b'"');
    out.extend_from_slice(name.as_bytes());
    out.push(b'"');
}

fn quote(text: &str, out: &mut Vec<u8>) {
    if text.bytes().any(|byte| ESCAPED[usize::from(byte)]) {
        let _ = serde_json::to_writer(out, text); // a string into memory cannot fail
    } else {
        out.reserve(text.len() + 2);
        out.push(b'"');
        out.extend_from_slice(text.as_bytes());
        out.push(b'"');
    }
}

/// The bytes that cannot stand in a JSON string as they are (RFC 8259, section 7).
static ESCAPED: [bool; 256] = {
    let mut table = [false; 256];
    let mut byte = 0;
    while byte < b' ' as usize {
        table[byte] = true;
        byte += 1;
    }
    table[b'"' as usize] = true;
    table[b'\\' as usize] = true;
    table
};
