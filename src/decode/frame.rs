//! What the framer hands out: frames with a good CRC, and the damaged runs between them.

use crate::decode::chunk::LineError;
use crate::decode::function::FunctionCode;
use crate::time::{Interval, Span};

/// The longest frame the specification allows: address, 253 bytes of PDU, CRC.
pub const MAX_FRAME: usize = 256;

/// Says who sent a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// A master asked.
    Request,
    /// A device answered.
    Response,
    /// Cannot be told.
    Unknown,
}

impl Role {
    /// Returns the name used in JSON lines.
    pub fn name(self) -> &'static str {
        match self {
            Role::Request => "request",
            Role::Response => "response",
            Role::Unknown => "unknown",
        }
    }
}

/// Says what showed where a frame ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// The length that function code and header ask for.
    Length,
    /// Only the CRC: the function code has no known length.
    Crc,
}

impl Boundary {
    /// Returns the name used in JSON lines.
    pub fn name(self) -> &'static str {
        match self {
            Boundary::Length => "length",
            Boundary::Crc => "crc",
        }
    }
}

/// Says what is wrong with a damaged run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A frame that is whole but for its CRC.
    Crc,
    /// A frame cut at its head or tail.
    Truncated,
    /// Up to three bytes beside a frame.
    Stray,
    /// Everything else.
    Noise,
}

impl Reason {
    /// Returns the name used in JSON lines.
    pub fn name(self) -> &'static str {
        match self {
            Reason::Crc => "crc",
            Reason::Truncated => "truncated",
            Reason::Stray => "stray",
            Reason::Noise => "noise",
        }
    }
}

/// Bounds when a run of bytes was on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WireTime {
    /// Of the first start bit.
    pub start: Interval,
    /// Of the last stop bit.
    pub end: Interval,
}

impl WireTime {
    /// Returns the `±` of both ends in nanoseconds: the larger half width.
    pub fn uncertainty_ns(self) -> i64 {
        self.start.half_width().max(self.end.half_width())
    }
}

/// Holds where and when a run of bytes was received.
#[derive(Clone, Debug, PartialEq)]
pub struct Place<'a> {
    /// Counts frames and damaged runs of a command together, from 0.
    pub id: u64,
    /// Index of the first byte in the bus's stream.
    pub stream_offset: u64,
    /// The bytes as received.
    pub bytes: &'a [u8],
    /// When they were on the wire; `None` where the input has no times.
    pub time: Option<WireTime>,
    /// The silence between the run before and this one; `None` for the first and without times.
    pub gap_before: Option<Span>,
    /// What the UART complained about; offsets count from the first byte.
    pub line_errors: &'a [LineError],
}

/// Is a run of bytes with a good CRC and a possible shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame<'a> {
    /// Where and when.
    pub place: Place<'a>,
    /// Who sent it.
    pub role: Role,
    /// Whether it is the adapter's echo of a request.
    pub echo: bool,
    /// What showed its end.
    pub boundary: Boundary,
    /// From 0 to 1, larger is surer; no more is promised.
    pub confidence: f32,
}

impl Frame<'_> {
    /// Returns the unit address, the first byte.
    pub fn address(&self) -> u8 {
        self.place.bytes[0] // a frame has at least four bytes: address, function, CRC
    }

    /// Returns the function code as on the wire, with the exception bit.
    pub fn function(&self) -> FunctionCode {
        FunctionCode(self.place.bytes[1]) // see `address`
    }
}

/// Is a run of bytes that is no frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Damaged<'a> {
    /// Where and when.
    pub place: Place<'a>,
    /// What is wrong with it.
    pub reason: Reason,
    /// A guess at who sent it.
    pub role: Role,
    /// A guess at the unit address.
    pub address: Option<u8>,
    /// A guess at the function code as on the wire.
    pub function: Option<FunctionCode>,
}
