//! The bytes that somebody still needs, by their offset in the bus's stream.

use crate::decode::chunk::LineError;

/// Keeps a stretch of the stream: bytes, and what the UART said about them.
#[derive(Clone, Debug, Default)]
pub struct Store {
    /// Stream offset of `bytes[dropped]`.
    base: u64,
    bytes: Vec<u8>,
    /// Bytes at the front that nobody needs any more; moved out now and then.
    dropped: usize,
    /// Line errors with stream offsets, in order.
    errors: Vec<(u64, LineError)>,
}

impl Store {
    /// Returns the offset just after the last byte.
    pub fn end(&self) -> u64 {
        self.base + (self.bytes.len() - self.dropped) as u64
    }

    /// Returns how many bytes are kept.
    pub fn length(&self) -> usize {
        self.bytes.len() - self.dropped
    }

    /// Appends received bytes with their line errors.
    pub fn push(&mut self, bytes: &[u8], errors: &[LineError]) {
        if !errors.is_empty() {
            let end = self.end();
            self.errors.extend(errors.iter().map(|error| (end + u64::from(error.offset), *error)));
        }
        self.bytes.extend_from_slice(bytes);
    }

    /// Returns the bytes from `offset` up to `end`, cut to what is there.
    #[inline]
    pub fn slice(&self, offset: u64, end: u64) -> &[u8] {
        // Nearly all questions are about bytes that are kept.
        if offset >= self.base {
            let from = (offset - self.base) as usize + self.dropped;
            let to = from.wrapping_add(end.wrapping_sub(offset) as usize);
            if let Some(bytes) = self.bytes.get(from..to) {
                return bytes;
            }
        }
        self.slice_of_some(offset, end)
    }

    #[cold]
    fn slice_of_some(&self, offset: u64, end: u64) -> &[u8] {
        let at = |offset: u64| {
            let index = (offset.saturating_sub(self.base) as usize).saturating_add(self.dropped);
            index.clamp(self.dropped, self.bytes.len())
        };
        let (from, to) = (at(offset), at(end));
        &self.bytes[from..to.max(from)]
    }

    /// Collects the line errors of a stretch, with offsets counted from its first byte.
    pub fn errors(&self, offset: u64, end: u64, into: &mut Vec<LineError>) {
        into.clear();
        if self.errors.is_empty() {
            return;
        }
        let from = self.errors.partition_point(|(at, _)| *at < offset);
        let inside = self.errors[from..].iter().take_while(|(at, _)| *at < end);
        into.extend(inside.map(|(at, error)| LineError { offset: (at - offset) as u32, kind: error.kind }));
    }

    /// Forgets everything before `offset`.
    pub fn forget_before(&mut self, offset: u64) {
        let count = offset.saturating_sub(self.base) as usize;
        self.base += count.min(self.bytes.len() - self.dropped) as u64;
        self.dropped = (self.dropped + count).min(self.bytes.len());
        if self.dropped == self.bytes.len() {
            self.bytes.clear();
            self.dropped = 0;
        } else if self.dropped > 4096 && self.dropped * 2 > self.bytes.len() {
            self.bytes.drain(..self.dropped);
            self.dropped = 0;
        }
        let stale = self.errors.partition_point(|(at, _)| *at < self.base);
        self.errors.drain(..stale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::chunk::LineErrorKind;

    #[test]
    fn slices_stay_right_while_the_front_is_forgotten() {
        let mut store = Store::default();
        for value in 0..=255u8 {
            store.push(&[value; 100], &[LineError { offset: 99, kind: LineErrorKind::Break }]);
            store.forget_before(u64::from(value) * 100 - u64::from(value.min(1)) * 50);
            let at = u64::from(value) * 100;
            assert_eq!(store.slice(at, at + 100), [value; 100]);
            let mut errors = Vec::new();
            store.errors(at + 90, at + 100, &mut errors);
            assert_eq!(errors, [LineError { offset: 9, kind: LineErrorKind::Break }]);
        }
        assert!(store.bytes.capacity() < 100_000);
        assert!(store.slice(0, 10).is_empty());
    }
}
