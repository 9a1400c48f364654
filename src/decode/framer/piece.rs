//! What the framer hands over.

use crate::decode::frame::{Boundary, Role};
use crate::decode::framer::outstanding::Outstanding;
use crate::decode::framer::reading::Readings;
use crate::time::Timestamp;

/// Is a stretch of the stream that is decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece {
    /// A frame with a good CRC and a possible shape.
    Frame {
        /// Stream offset of its address.
        offset: u64,
        /// Bytes, address to CRC.
        length: u16,
        /// How it can be read; pairing decides with hindsight.
        readings: Readings,
        /// What showed its end.
        boundary: Boundary,
        /// From 0 to 0.99.
        confidence: f32,
    },
    /// One side of an exchange.
    Half(Half),
    /// A request and its answer, both beyond doubt at once: by far the commonest.
    Exchange {
        /// Stream offset of the request's address.
        offset: u64,
        /// Bytes of the request and of the answer right behind it.
        lengths: [u16; 2],
        /// Likewise, from 0 to 0.99.
        confidence: [f32; 2],
    },
    /// Bytes that belong to no frame.
    Junk {
        /// Stream offset of the first.
        offset: u64,
        /// Stream offset after the last.
        end: u64,
        /// The request that was outstanding before.
        outstanding: Option<Outstanding>,
    },
}

/// Is a request that waits for its answer, or the full answer to the request just before, beyond doubt: pairing need not
/// weigh it while nothing is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Half {
    /// Stream offset of its address.
    pub offset: u64,
    /// Bytes, address to CRC; they show its end.
    pub length: u16,
    /// Which of both it is.
    pub role: Role,
    /// From 0 to 0.99.
    pub confidence: f32,
    /// The estimate of a request's end; [`super::Framer::readings`] wants it.
    pub end: Option<Timestamp>,
}
