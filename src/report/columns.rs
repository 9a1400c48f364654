//! The columns of every kind of row: key and value, once for all formats.

use std::ops::Range;

use crate::analyze::verify::Finding;
use crate::decode::chunk::LineError;
use crate::decode::frame::{Damaged, Frame, Place, WireTime};
use crate::decode::transaction::{Side, Transaction};
use crate::device::{Identified, Meaning, Reading, Value};
use crate::pipeline::{Event, Lost};
use crate::time::{Span, Timestamp};

/// Is the value of one column.
pub enum Cell<'a> {
    /// Does not apply, or is not known.
    Null,
    /// A word of the program's own, without characters to escape.
    Name(&'static str),
    /// Any text.
    Text(&'a str),
    /// A count, an index or a code.
    Unsigned(u64),
    /// A length of time in nanoseconds.
    Nanoseconds(i64),
    /// A point in time.
    Time(Timestamp),
    /// A number from 0 to 1.
    Fraction(f32),
    /// True or false.
    Boolean(bool),
    /// Bytes of the bus.
    Bytes(&'a [u8]),
    /// What the UART complained about.
    LineErrors(&'a [LineError]),
    /// Where bytes lie in a frame, the end not included.
    Span(&'a Range<usize>),
    /// Ids of frames.
    Ids(&'a [u64]),
    /// The profiles that fit.
    Candidates(&'a Meaning<'a>),
    /// The decoded fields.
    Fields(&'a Meaning<'a>),
    /// The value of a reading.
    Value(&'a Value<'a>),
}

impl<'a> Cell<'a> {
    fn of<T>(value: Option<T>, cell: impl FnOnce(T) -> Cell<'a>) -> Cell<'a> {
        value.map_or(Cell::Null, cell)
    }
}

/// Is the key of a column.
#[derive(Clone, Copy)]
pub struct Key {
    /// The key itself.
    pub name: &'static str,
    /// The key as it stands before a value in JSON: after a comma, in quotes, with the colon.
    pub quoted: &'static str,
}

/// Receives the cells of a row, one after the other.
pub trait Cells {
    /// Takes the next cell.
    fn cell(&mut self, key: Key, cell: Cell<'_>);
}

/// Defines rows: for each a module with `KEYS`, and `write`, which hands the cells over in that order.
macro_rules! rows {
    ($($(#[$doc:meta])* $row:ident($($name:ident: $type:ty),*) { $($key:literal => $cell:expr,)* })*) => { $(
        $(#[$doc])*
        pub mod $row {
            use super::*;

            /// Lists the keys in order.
            pub const KEYS: &[&str] = &[$($key),*];

            /// Hands over the cells in the order of `KEYS`.
            pub fn write($($name: $type,)* cells: &mut impl Cells) {
                $(cells.cell(Key { name: $key, quoted: concat!(",\"", $key, "\":") }, $cell);)*
            }
        }
    )* };
}

rows! {
    /// Is a frame with a good CRC.
    frame(bus: &str, frame: &Frame<'_>) {
        "type" => Cell::Name("frame"),
        "id" => Cell::Unsigned(frame.place.id),
        "bus" => Cell::Text(bus),
        "start_ns" => start(frame.place.time),
        "end_ns" => end(frame.place.time),
        "uncertainty_ns" => uncertainty(&frame.place),
        "stream_offset" => Cell::Unsigned(frame.place.stream_offset),
        "bytes" => Cell::Bytes(frame.place.bytes),
        "role" => Cell::Name(frame.role.name()),
        "echo" => Cell::Boolean(frame.echo),
        "address" => Cell::Unsigned(frame.address().into()),
        "function" => Cell::Unsigned(frame.function().0.into()),
        "boundary" => Cell::Name(frame.boundary.name()),
        "confidence" => Cell::Fraction(frame.confidence),
        "gap_before_ns" => middle(frame.place.gap_before),
        "gap_error_ns" => error(frame.place.gap_before),
        "line_errors" => Cell::LineErrors(frame.place.line_errors),
    }
    /// Is a run of bytes that is no frame.
    damaged(bus: &str, damaged: &Damaged<'_>) {
        "type" => Cell::Name("damaged"),
        "id" => Cell::Unsigned(damaged.place.id),
        "bus" => Cell::Text(bus),
        "start_ns" => start(damaged.place.time),
        "end_ns" => end(damaged.place.time),
        "uncertainty_ns" => uncertainty(&damaged.place),
        "stream_offset" => Cell::Unsigned(damaged.place.stream_offset),
        "bytes" => Cell::Bytes(damaged.place.bytes),
        "reason" => Cell::Name(damaged.reason.name()),
        "role" => Cell::Name(damaged.role.name()),
        "address" => Cell::of(damaged.address, |address| Cell::Unsigned(address.into())),
        "function" => Cell::of(damaged.function, |function| Cell::Unsigned(function.0.into())),
        "gap_before_ns" => middle(damaged.place.gap_before),
        "gap_error_ns" => error(damaged.place.gap_before),
        "line_errors" => Cell::LineErrors(damaged.place.line_errors),
    }
    /// Is a loss of bytes.
    lost(bus: &str, lost: &Lost) {
        "type" => Cell::Name("lost"),
        "bus" => Cell::Text(bus),
        "t_ns" => Cell::of(lost.time, Cell::Time),
        "stream_offset" => Cell::Unsigned(lost.stream_offset),
        "kind" => Cell::Name(lost.kind.name()),
        "count" => Cell::Unsigned(lost.count),
    }
    /// Is a device that was recognised.
    identified(bus: &str, time: Option<Timestamp>, identified: &Identified) {
        "type" => Cell::Name("identified"),
        "bus" => Cell::Text(bus),
        "t_ns" => Cell::of(time, Cell::Time),
        "address" => Cell::Unsigned(identified.address.into()),
        "device" => Cell::Text(&identified.device),
        "serial_number" => Cell::of(identified.serial_number.as_deref(), Cell::Text),
        "evidence" => Cell::Text(&identified.evidence),
        "frames" => Cell::Ids(&identified.frames),
    }
    /// Is a request and what became of it.
    transaction(bus: &str, transaction: &Transaction<'_>, meaning: &Meaning<'_>) {
        "type" => Cell::Name("transaction"),
        "id" => Cell::Unsigned(transaction.id),
        "bus" => Cell::Text(bus),
        "start_ns" => Cell::of(began(transaction), Cell::Time),
        "end_ns" => Cell::of(ended(transaction), Cell::Time),
        "address" => Cell::Unsigned(transaction.address.into()),
        "function" => Cell::Unsigned(transaction.function.0.into()),
        "start_register" => Cell::of(transaction.start_register, |register| Cell::Unsigned(register.into())),
        "quantity" => Cell::of(transaction.quantity, |quantity| Cell::Unsigned(quantity.into())),
        "outcome" => Cell::Name(transaction.outcome.name()),
        "exception_code" => Cell::of(transaction.exception_code, |code| Cell::Unsigned(code.0.into())),
        "latency_ns" => middle(transaction.latency),
        "latency_error_ns" => error(transaction.latency),
        "request" => Cell::of(transaction.request, |side| Cell::Unsigned(side.id)),
        "response" => Cell::of(transaction.response, |side| Cell::Unsigned(side.id)),
        "request_bytes" => Cell::of(transaction.request, |side| Cell::Bytes(side.bytes)),
        "response_bytes" => Cell::of(transaction.response, |side| Cell::Bytes(side.bytes)),
        "device" => Cell::of(meaning.device(), Cell::Text),
        "candidates" => Cell::Candidates(meaning),
        "command" => Cell::of(meaning.command(), Cell::Text),
        "fields" => Cell::Fields(meaning),
    }
    /// Is one measured or derived value.
    reading(bus: &str, time: Option<Timestamp>, address: u8, transaction: u64, reading: &Reading<'_>) {
        "type" => Cell::Name("reading"),
        "bus" => Cell::Text(bus),
        "t_ns" => Cell::of(time, Cell::Time),
        "address" => Cell::Unsigned(address.into()),
        "device" => Cell::of(reading.device, Cell::Text),
        "serial_number" => Cell::of(reading.serial_number, Cell::Text),
        "quantity" => Cell::Text(reading.quantity),
        "value" => Cell::Value(&reading.value),
        "unit" => Cell::of(reading.unit, Cell::Text),
        "derived" => Cell::Boolean(reading.derived),
        "transaction" => Cell::Unsigned(transaction),
    }
    /// Is something wrong in the traffic.
    finding(bus: &str, finding: &Finding) {
        "type" => Cell::Name("finding"),
        "bus" => Cell::Text(bus),
        "t_ns" => Cell::of(finding.time, Cell::Time),
        "code" => Cell::Name(finding.rule.code),
        "name" => Cell::Name(finding.rule.name),
        "severity" => Cell::Name(finding.severity.name()),
        "party" => Cell::Name(finding.party.name()),
        "address" => Cell::of(finding.address, |address| Cell::Unsigned(address.into())),
        "frames" => Cell::Ids(&finding.frames),
        "span" => Cell::of(finding.span.as_ref(), Cell::Span),
        "count" => Cell::Unsigned(finding.count),
        "first_ns" => Cell::of(finding.first, Cell::Time),
        "last_ns" => Cell::of(finding.last, Cell::Time),
        "message" => Cell::Text(&finding.message),
        "help" => Cell::Text(finding.help()),
        "reference" => Cell::Text(finding.rule.reference),
    }
}

/// Hands over the cells of whatever row an event makes.
pub fn write(bus: &str, event: &Event<'_>, cells: &mut impl Cells) {
    match event {
        Event::Frame(row) => frame::write(bus, row, cells),
        Event::Damaged(row) => damaged::write(bus, row, cells),
        Event::Lost(row) => lost::write(bus, row, cells),
        Event::Identified { identified, time } => identified::write(bus, *time, identified, cells),
        Event::Transaction { transaction, meaning, .. } => {
            transaction::write(bus, transaction, meaning, cells);
        }
        Event::Reading { reading, time, address, transaction } => {
            reading::write(bus, *time, *address, *transaction, reading, cells);
        }
        Event::Finding(row) => finding::write(bus, row, cells),
    }
}

/// Returns the best estimate of a transaction's start: its request's, or an unsolicited response's.
pub fn began(transaction: &Transaction<'_>) -> Option<Timestamp> {
    let side: Option<Side<'_>> = transaction.request.or(transaction.response);
    Some(side?.time?.start.midpoint())
}

/// Returns the best estimate of a transaction's end: that of its last frame.
pub fn ended(transaction: &Transaction<'_>) -> Option<Timestamp> {
    let side: Option<Side<'_>> = transaction.response.or(transaction.request);
    Some(side?.time?.end.midpoint())
}

fn start(time: Option<WireTime>) -> Cell<'static> {
    Cell::of(time, |time| Cell::Time(time.start.midpoint()))
}

fn end(time: Option<WireTime>) -> Cell<'static> {
    Cell::of(time, |time| Cell::Time(time.end.midpoint()))
}

fn uncertainty(place: &Place<'_>) -> Cell<'static> {
    Cell::of(place.time, |time| Cell::Nanoseconds(time.uncertainty_ns()))
}

fn middle(span: Option<Span>) -> Cell<'static> {
    Cell::of(span, |span| Cell::Nanoseconds(span.midpoint()))
}

fn error(span: Option<Span>) -> Cell<'static> {
    Cell::of(span, |span| Cell::Nanoseconds(span.half_width()))
}
