//! Reads wait here until it is known what becomes of their bytes.

use std::collections::VecDeque;
use std::ops::Range;

use crate::decode::chunk::{Chunk, LineError, ReadTime};
use crate::decode::frame::Place;
use crate::time::Timestamp;

/// Holds reads back until all their frames and damaged runs are settled.
#[derive(Clone, Debug, Default)]
pub struct Held {
    bytes: VecDeque<u8>,
    /// Stream offset of the first byte held.
    base: u64,
    reads: VecDeque<Read>,
    /// Id and stream offset of the frames and runs that are not settled yet.
    items: VecDeque<(u64, u64)>,
    /// Stream offset after the last frame or run.
    framed: u64,
    /// Every byte before is settled.
    settled: u64,
    released: Vec<u8>,
    line_errors: Vec<LineError>,
}

#[derive(Clone, Debug)]
struct Read {
    time: ReadTime,
    ready: Option<Timestamp>,
    length: usize,
    line_errors: Vec<LineError>,
}

/// Is a read that was let go of.
#[derive(Debug)]
pub struct Released<'a> {
    /// The read.
    pub chunk: Chunk<'a>,
    /// When its bytes were first there to be read, where that is known.
    pub ready: Option<Timestamp>,
    /// The stream offsets of its bytes.
    pub offsets: Range<u64>,
}

impl Held {
    /// Takes a read; `ready` is when its bytes were first there, where that is known.
    pub fn push(&mut self, chunk: &Chunk<'_>, ready: Option<Timestamp>) {
        self.bytes.extend(chunk.bytes);
        let line_errors = chunk.line_errors.to_vec();
        self.reads.push_back(Read { time: chunk.time, ready, length: chunk.bytes.len(), line_errors });
    }

    /// Takes note of a frame or damaged run, in stream order.
    pub fn note(&mut self, place: &Place<'_>) {
        self.items.push_back((place.id, place.stream_offset));
        self.framed = place.stream_offset + place.bytes.len() as u64;
    }

    /// Returns the stream offset of a frame or run that is not settled.
    pub fn offset_of(&self, id: u64) -> Option<u64> {
        let at = self.items.binary_search_by_key(&id, |(id, _)| *id).ok()?;
        self.items.get(at).map(|(_, offset)| *offset)
    }

    /// Returns bytes that are held, to be changed; `None` when they are not all there.
    pub fn bytes_mut(&mut self, offset: u64, length: usize) -> Option<&mut [u8]> {
        let from = usize::try_from(offset.checked_sub(self.base)?).ok()?;
        self.bytes.make_contiguous().get_mut(from..from.checked_add(length)?)
    }

    /// Settles all frames and runs with a smaller id.
    pub fn settle(&mut self, settled_frame: u64) {
        while self.items.front().is_some_and(|(id, _)| *id < settled_frame) {
            self.items.pop_front();
        }
        self.settled = self.items.front().map_or(self.framed, |(_, offset)| *offset);
    }

    /// Settles everything: the input has ended.
    pub fn settle_all(&mut self) {
        self.items.clear();
        self.settled = u64::MAX;
    }

    /// Lets go of the next read that is settled.
    pub fn pop(&mut self) -> Option<Released<'_>> {
        let end = self.base + self.reads.front()?.length as u64;
        if end > self.settled {
            return None;
        }
        let read = self.reads.pop_front()?;
        let offsets = self.base..end;
        self.base = end;
        self.released.clear();
        self.released.extend(self.bytes.drain(..read.length.min(self.bytes.len())));
        self.line_errors = read.line_errors;
        let chunk = Chunk { time: read.time, bytes: &self.released, line_errors: &self.line_errors };
        Some(Released { chunk, ready: read.ready, offsets })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(bytes: &[u8]) -> Chunk<'_> {
        Chunk { time: ReadTime::Unknown, bytes, line_errors: &[] }
    }

    fn place(id: u64, stream_offset: u64, bytes: &[u8]) -> Place<'_> {
        Place { id, stream_offset, bytes, time: None, gap_before: None, line_errors: &[] }
    }

    #[test]
    fn a_read_leaves_when_its_last_byte_is_settled() {
        let mut held = Held::default();
        held.push(&chunk(b"abc"), None);
        held.push(&chunk(b"def"), Some(Timestamp::from_ns(7)));
        held.note(&place(0, 0, b"abcd"));
        held.note(&place(1, 4, b"ef"));
        held.settle(0);
        assert!(held.pop().is_none());
        held.settle(1);
        assert_eq!(
            held.pop().map(|read| (read.chunk.bytes.to_vec(), read.offsets)),
            Some((b"abc".to_vec(), 0..3))
        );
        assert!(held.pop().is_none(), "'ef' is not settled");
        assert_eq!(held.offset_of(1), Some(4));
        held.bytes_mut(4, 2).expect("held").fill(b'X');
        assert!(held.bytes_mut(5, 2).is_none() && held.bytes_mut(2, 1).is_none());
        held.settle(2);
        let read = held.pop().map(|read| (read.chunk.bytes.to_vec(), read.ready));
        assert_eq!(read, Some((b"dXX".to_vec(), Some(Timestamp::from_ns(7)))));
    }

    #[test]
    fn what_never_became_a_frame_leaves_at_the_end() {
        let mut held = Held::default();
        held.push(&chunk(b"a"), None);
        held.settle(u64::MAX);
        assert!(held.pop().is_none());
        held.settle_all();
        assert!(held.pop().is_some());
    }
}
