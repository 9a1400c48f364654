//! What pairing looks at: frames and damaged runs, in stream order.

use crate::decode::candidate::{Basis, Candidate, candidates};
use crate::decode::damage::Run;
use crate::decode::frame::{Boundary, Role, WireTime};
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
    pub length: u64,
    /// When it was on the wire; `None` where the input has no times.
    pub time: Option<WireTime>,
    /// The silence before.
    pub gap_before: Option<Span>,
    /// Time of the read that decided it: what deadlines count from.
    pub at: Timestamp,
    /// What it is.
    pub what: What,
}

impl Item {
    /// Returns the stream offset after the last byte.
    pub fn end(&self) -> u64 {
        self.offset + self.length
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
        /// Read as a request.
        request: Option<Asked>,
        /// Read as a response.
        response: Option<Candidate>,
    },
    /// A damaged run.
    Run(Run),
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
) -> (Option<Asked>, Option<Candidate>) {
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
    (request, of(Role::Response))
}
