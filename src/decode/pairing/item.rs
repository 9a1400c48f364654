//! What pairing looks at: frames and damaged runs, in stream order.

use crate::decode::candidate::{Basis, Candidate, candidates};
use crate::decode::frame::{Boundary, Reason, Role, WireTime};
use crate::decode::framer::Outstanding;
use crate::decode::function::FunctionCode;
use crate::decode::shape::Shapes;
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

/// Is how a frame can be read; a damaged run cannot.
#[derive(Clone, Copy, Debug, Default)]
pub struct Readings {
    /// As a request.
    pub request: Option<Asked>,
    /// As a response.
    pub response: Option<Candidate>,
}

/// Is a frame read as a request.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// The form.
    pub candidate: Candidate,
    /// What an answer must match.
    pub outstanding: Outstanding,
}

/// Reads a frame both ways.
pub fn frame_readings(
    bytes: &[u8],
    offset: u64,
    boundary: Boundary,
    end: Option<Timestamp>,
    shapes: &Shapes,
) -> Readings {
    let list = candidates(bytes, shapes);
    let of = |role: Role| {
        let fits = |c: &&Candidate| {
            c.role == role
                && match boundary {
                    Boundary::Length => usize::from(c.length) == bytes.len(),
                    Boundary::Crc => c.basis == Basis::AnyLength,
                }
        };
        list.as_slice().iter().find(fits).copied()
    };
    let request = of(Role::Request)
        .map(|candidate| Asked { candidate, outstanding: Outstanding::new(offset, bytes, end, shapes) });
    Readings { request, response: of(Role::Response) }
}
