//! What pairing looks at: frames and damaged runs, in stream order.

use crate::decode::frame::{Boundary, Reason, Role, WireTime};
use crate::decode::function::FunctionCode;
use crate::time::{Span, Timestamp};

/// Is a frame or a damaged run with its place and time.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// Counts frames and runs together.
    pub id: u64,
    /// Stream offset of the first byte.
    pub offset: u64,
    /// Bytes.
    pub length: u32,
    /// What it is.
    pub what: What,
    /// When it was on the wire; `None` where the input has no times.
    pub time: Option<WireTime>,
    /// The silence before.
    pub gap_before: Option<Span>,
    /// Time of the read that decided it: what deadlines count from.
    pub at: Timestamp,
}

impl Item {
    /// Returns the stream offset after the last byte.
    pub fn end(&self) -> u64 {
        self.offset + u64::from(self.length)
    }

    /// Returns what a transaction needs of it.
    pub fn part(&self) -> Part {
        let damaged = matches!(self.what, What::Run { .. });
        Part { id: self.id, offset: self.offset, length: self.length, damaged, time: self.time }
    }
}

/// Tells a frame from a run.
#[derive(Clone, Copy, Debug)]
pub enum What {
    /// A frame with a good CRC.
    Frame {
        /// Function code as on the wire.
        function: FunctionCode,
        /// What showed its end.
        boundary: Boundary,
        /// From 0 to 0.99.
        confidence: f32,
    },
    /// A damaged run, with guesses at what it was.
    Run {
        /// What is wrong with it.
        reason: Reason,
        /// Who may have sent it.
        role: Role,
        /// Its unit address.
        address: Option<u8>,
        /// Its function code as on the wire.
        function: Option<FunctionCode>,
    },
}

/// Is one side of a transaction, by its place in the stream.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// The id of the frame or run.
    pub id: u64,
    /// Stream offset of the first byte.
    pub offset: u64,
    /// Bytes.
    pub length: u32,
    /// Whether it is a damaged run.
    pub damaged: bool,
    /// When it was on the wire; `None` where the input has no times.
    pub time: Option<WireTime>,
}

impl Part {
    /// Returns the stream offset after the last byte.
    pub fn end(&self) -> u64 {
        self.offset + u64::from(self.length)
    }
}
