//! What the listener gets: the bytes of one `read()`.

use crate::decode::chunk::{Chunk, LineError, ReadTime};
use crate::time::Timestamp;

/// Is what one `read()` of the serial port returns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Read {
    /// When the read ended.
    pub time: Timestamp,
    /// What was received; never empty.
    pub bytes: Vec<u8>,
    /// What the adapter complained about, in order of their offsets in `bytes`.
    pub line_errors: Vec<LineError>,
}

impl Read {
    /// Returns the read as a source hands it over.
    pub fn chunk(&self) -> Chunk<'_> {
        Chunk { time: ReadTime::At(self.time), bytes: &self.bytes, line_errors: &self.line_errors }
    }
}
