//! The reads that were merged into one message, one after the other again.

use super::schema::{Dating, ErrorKind, RawChunk};
use super::time::Anchor;
use crate::decode::chunk::{Chunk, LineError, LineErrorKind, ReadTime};
use crate::time::Timestamp;

/// Takes a message apart into its reads.
#[derive(Clone, Default)]
pub(super) struct Reads {
    anchor: Option<Anchor>,
    /// The next of the earlier reads; beyond them the last, then none.
    next: usize,
    start: usize,
    end: usize,
    time: Timestamp,
    is_last: bool,
    errors: Vec<LineError>,
    first: Option<Timestamp>,
    last: Option<Timestamp>,
}

impl Reads {
    /// Begins a message.
    pub(super) fn begin(&mut self, raw: &RawChunk, anchor: Anchor) {
        let time = |monotonic_ns| (raw.dating() == Dating::Read).then(|| anchor.time(monotonic_ns));
        let first = raw.earlier.first().map_or(raw.monotonic_ns, |read| read.monotonic_ns);
        self.anchor = Some(anchor);
        (self.next, self.start, self.end) = (0, 0, 0);
        self.first = time(first);
        self.last = time(raw.monotonic_ns);
    }

    /// Returns the time of the first read of the message.
    pub(super) fn first_time(&self) -> Option<Timestamp> {
        self.first
    }

    /// Returns the time of the last read of the message.
    pub(super) fn last_time(&self) -> Option<Timestamp> {
        self.last
    }

    /// Tells whether there is a read in the message: bytes, or at least a line error.
    pub(super) fn is_any(raw: &RawChunk) -> bool {
        // An overrun without a byte to mark is a loss, counted or not.
        let is_mark = |mark: ErrorKind| mark != ErrorKind::Overrun && kind(mark).is_some();
        !raw.data.is_empty() || raw.errors.iter().any(|error| is_mark(error.kind()))
    }

    /// Tells whether more reads are in the message.
    pub(super) fn has_more(&self, raw: &RawChunk) -> bool {
        self.next <= raw.earlier.len()
    }

    /// Goes on to the next read; tells whether there is one.
    pub(super) fn advance(&mut self, raw: &RawChunk) -> bool {
        let Some(anchor) = self.anchor.filter(|_| self.has_more(raw)) else { return false };
        self.start = self.end;
        let (monotonic_ns, is_last) = match raw.earlier.get(self.next) {
            Some(read) => {
                self.end = (read.end as usize).clamp(self.start, raw.data.len());
                (read.monotonic_ns, false)
            }
            None => {
                self.end = raw.data.len();
                (raw.monotonic_ns, true)
            }
        };
        self.next += 1;
        self.time = anchor.time(monotonic_ns);
        self.is_last = is_last;
        self.errors.clear();
        if !raw.errors.is_empty() {
            self.collect_errors(raw, is_last);
        }
        true
    }

    fn collect_errors(&mut self, raw: &RawChunk, is_last: bool) {
        for error in &raw.errors {
            let at = error.offset as usize;
            let within = (self.start..self.end).contains(&at) || (is_last && at >= self.end);
            if let Some(kind) = kind(error.kind()).filter(|_| within) {
                let offset = at.min(self.end).saturating_sub(self.start) as u32; // within a 32-bit offset
                self.errors.push(LineError { offset, kind });
            }
        }
    }

    /// Returns the read gone on to.
    #[inline]
    pub(super) fn chunk<'a>(&'a self, raw: &'a RawChunk) -> Chunk<'a> {
        let time = match raw.dating() {
            Dating::Read => ReadTime::At(self.time),
            Dating::LineSpeed => ReadTime::Unknown,
            Dating::AfterSilence => ReadTime::UnknownAfterSilence,
        };
        Chunk { time, bytes: &raw.data[self.start..self.end], line_errors: &self.errors }
    }

    /// Returns when the bytes of the read gone on to were first there, where that is known.
    #[inline]
    pub(super) fn ready(&self, raw: &RawChunk) -> Option<Timestamp> {
        let anchor = self.anchor.filter(|_| self.is_last && raw.ready_ns > 0)?;
        Some(anchor.time(raw.ready_ns))
    }
}

fn kind(kind: ErrorKind) -> Option<LineErrorKind> {
    match kind {
        ErrorKind::ParityOrFraming => Some(LineErrorKind::ParityOrFraming),
        ErrorKind::Break => Some(LineErrorKind::Break),
        ErrorKind::Overrun => Some(LineErrorKind::Overrun),
        ErrorKind::Unknown | ErrorKind::Lost => None,
    }
}
