//! Reads that wait a moment, to be written as one message.

use super::schema::{Dating, ErrorKind, LineError, RawChunk, Read};
use super::time::Anchor;
use crate::decode::chunk::{Chunk, LineErrorKind, ReadTime};
use crate::time::{MILLISECOND, Timestamp};

/// How far apart reads of one message are at most, in nanoseconds.
const MERGED: i64 = 20 * MILLISECOND;
/// How many bytes are merged at most.
const MOST_BYTES: usize = 4096;

/// Is a message to which reads may still be added.
pub(super) struct Pending {
    raw: RawChunk,
    first: Timestamp,
    last: Timestamp,
    is_open: bool,
}

impl Pending {
    /// Begins a message with one read.
    pub(super) fn new(chunk: &Chunk<'_>, time: Timestamp, anchor: Anchor, ready: Option<Timestamp>) -> Self {
        let dating = match chunk.time {
            ReadTime::At(_) => Dating::Read,
            ReadTime::Unknown => Dating::LineSpeed,
            ReadTime::UnknownAfterSilence => Dating::AfterSilence,
        };
        let raw = RawChunk { dating: dating as i32, ..RawChunk::default() };
        let mut pending = Pending { raw, first: time, last: time, is_open: true };
        pending.append(chunk, time, anchor, ready);
        pending.is_open &= dating == Dating::Read;
        pending
    }

    /// Adds a read, if it belongs to the message; tells whether it does.
    pub(super) fn merge(
        &mut self,
        chunk: &Chunk<'_>,
        time: Timestamp,
        anchor: Anchor,
        ready: Option<Timestamp>,
    ) -> bool {
        let fits = self.is_open
            && matches!(chunk.time, ReadTime::At(_))
            && !chunk.bytes.is_empty()
            && (0..=MERGED).contains(&(time - self.first))
            && self.raw.data.len() + chunk.bytes.len() <= MOST_BYTES;
        if fits {
            let end = self.raw.data.len() as u32; // at most `MOST_BYTES`, or one read
            self.raw.earlier.push(Read { end, monotonic_ns: self.raw.monotonic_ns });
            self.append(chunk, time, anchor, ready);
        }
        fits
    }

    fn append(&mut self, chunk: &Chunk<'_>, time: Timestamp, anchor: Anchor, ready: Option<Timestamp>) {
        let start = self.raw.data.len() as u32; // see above
        self.raw.data.extend_from_slice(chunk.bytes);
        let end = self.raw.data.len() as u32;
        for error in chunk.line_errors {
            let kind = match error.kind {
                LineErrorKind::ParityOrFraming => ErrorKind::ParityOrFraming,
                LineErrorKind::Break => ErrorKind::Break,
                LineErrorKind::Overrun => ErrorKind::Overrun,
            };
            // Without bytes a count would say that many were lost.
            let count = u32::from(!chunk.bytes.is_empty());
            let offset = start.saturating_add(error.offset);
            // An error after the last byte would belong to the next read.
            self.is_open &= offset < end;
            self.raw.errors.push(LineError { offset, kind: kind as i32, count });
        }
        self.raw.monotonic_ns = anchor.monotonic_ns(time);
        self.raw.ready_ns = ready.map_or(0, |ready| anchor.monotonic_ns(ready));
        self.last = time;
        self.is_open &= !chunk.bytes.is_empty();
    }

    /// Returns when the last read ended.
    pub(super) fn last_time(&self) -> Timestamp {
        self.last
    }

    /// Returns the message, without its place in the stream.
    pub(super) fn into_message(self) -> RawChunk {
        self.raw
    }
}
