//! Keeps the last minutes in memory, and lets them through around what is worth it.

use std::collections::VecDeque;

use super::entry::Entry;
use crate::time::{SECOND, Timestamp};

/// How long to wait for a settled moment, in nanoseconds: a busy bus seen through a slow adapter has none.
const PATIENCE: i64 = 2 * SECOND;

/// Keeps entries until they are too old, too many, or wanted.
///
/// They are dropped by stretches that begin where nothing was undecided, as far as there is such a moment, so that what
/// is written begins with a whole frame.
#[derive(Debug)]
pub(super) struct Ring {
    /// How long before and after a match is wanted, in nanoseconds.
    span_ns: i64,
    /// How much memory it takes at most, in bytes.
    most: usize,
    stretches: VecDeque<Stretch>,
    size: usize,
    /// Until when all is let through.
    open_until: Option<Timestamp>,
    /// Whether wanted minutes were dropped for want of memory.
    was_short: bool,
}

/// Is what was received from one settled moment to the next.
#[derive(Debug, Default)]
struct Stretch {
    entries: Vec<Entry>,
    size: usize,
    first: Option<Timestamp>,
    last: Option<Timestamp>,
}

/// Tells what a moment changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// Nothing.
    None,
    /// All is kept back from now on.
    Closed,
}

impl Ring {
    /// Makes a ring that keeps `span_ns` nanoseconds, but no more than `most` bytes.
    pub(super) fn new(span_ns: i64, most: usize) -> Self {
        let stretches = VecDeque::from([Stretch::default()]);
        Ring { span_ns, most, stretches, size: 0, open_until: None, was_short: false }
    }

    /// Takes an entry; returns it while all is let through.
    pub(super) fn push(&mut self, entry: Entry) -> Option<Entry> {
        if self.open_until.is_some() {
            return Some(entry);
        }
        let size = entry.size();
        if let Some(stretch) = self.stretches.back_mut() {
            stretch.entries.push(entry);
            stretch.size += size;
        }
        self.size += size;
        None
    }

    /// Takes note of a match: hands out what is kept, in order, and lets all through until well after.
    pub(super) fn trigger(&mut self, now: Timestamp, mut out: impl FnMut(Entry)) {
        self.drop_old(now, &mut out);
        self.open_until = self.open_until.max(Some(now + self.span_ns));
        self.stretches.drain(..).flat_map(|stretch| stretch.entries).for_each(&mut out);
        self.stretches.push_back(Stretch::default());
        self.size = 0;
    }

    /// Takes note of the time; drops what is too old. Settings that are dropped go to `settings`: they still hold.
    pub(super) fn pass(
        &mut self,
        now: Timestamp,
        is_settled: bool,
        mut settings: impl FnMut(Entry),
    ) -> Change {
        let patience = if is_settled { 0 } else { PATIENCE };
        let mut change = Change::None;
        if self.open_until.is_some_and(|until| until + patience < now) {
            self.open_until = None;
            change = Change::Closed;
        }
        if let Some(last) = self.stretches.back_mut() {
            last.last = Some(now);
            let first = *last.first.get_or_insert(now);
            if now - first >= patience && !last.entries.is_empty() {
                self.stretches.push_back(Stretch::default());
            }
        }
        self.drop_old(now, &mut settings);
        change
    }

    fn drop_old(&mut self, now: Timestamp, settings: &mut impl FnMut(Entry)) {
        let oldest = now - self.span_ns;
        while self.stretches.len() > 1 {
            let Some(first) = self.stretches.front() else { break };
            let is_old = first.last.is_none_or(|last| last < oldest);
            if !is_old && self.size <= self.most {
                break;
            }
            self.was_short |= !is_old;
            let Some(first) = self.stretches.pop_front() else { break };
            self.size -= first.size;
            let kept = first.entries.into_iter().filter(|entry| matches!(entry, Entry::Begin(_)));
            kept.for_each(&mut *settings);
        }
    }

    /// Tells whether all is let through.
    pub(super) fn is_open(&self) -> bool {
        self.open_until.is_some()
    }

    /// Tells, once, that the memory did not suffice for all that was wanted.
    pub(super) fn take_shortage(&mut self) -> bool {
        std::mem::take(&mut self.was_short)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::chunk::ReadTime;

    fn at(seconds: i64) -> Timestamp {
        Timestamp::from_ns(seconds * SECOND)
    }

    fn chunk(second: i64) -> Entry {
        let bytes = vec![second as u8; 8].into();
        let time = ReadTime::At(at(second));
        Entry::Chunk { bus: "bus0".into(), time, ready: None, bytes, line_errors: [].into() }
    }

    fn second_of(entry: &Entry) -> i64 {
        match entry {
            Entry::Chunk { time: ReadTime::At(time), .. } => time.as_ns() / SECOND,
            other => panic!("{other:?}"),
        }
    }

    /// Feeds a chunk a second, with matches at some of them; returns the seconds that were let through.
    fn let_through(ring: &mut Ring, seconds: std::ops::Range<i64>, matches: &[i64]) -> Vec<i64> {
        let mut out = Vec::new();
        for second in seconds {
            if let Some(entry) = ring.push(chunk(second)) {
                out.push(second_of(&entry));
            }
            if matches.contains(&second) {
                ring.trigger(at(second), |entry| out.push(second_of(&entry)));
            }
            ring.pass(at(second), true, |_| {});
        }
        out
    }

    #[test]
    fn what_is_within_the_span_before_and_after_matches_is_let_through_once_and_in_order() {
        let mut ring = Ring::new(10 * SECOND, usize::MAX);
        let seconds = let_through(&mut ring, 0..100, &[30, 35, 90]);
        assert_eq!(seconds, (20..=46).chain(80..100).collect::<Vec<_>>());
    }

    #[test]
    fn memory_stays_bounded_and_the_shortage_is_told() {
        let mut ring = Ring::new(1000 * SECOND, 20 * chunk(0).size());
        let seconds = let_through(&mut ring, 0..100, &[99]);
        assert_eq!(seconds, (80..100).collect::<Vec<_>>());
        assert!(ring.take_shortage() && !ring.take_shortage());
    }

    #[test]
    fn a_stretch_is_dropped_as_a_whole_and_its_settings_are_not_lost() {
        let mut ring = Ring::new(10 * SECOND, usize::MAX);
        let mut settings = 0;
        ring.push(Entry::Begin(Default::default()));
        for second in 0..30 {
            ring.push(chunk(second));
            // Within a frame until second 5.
            ring.pass(at(second), second >= 5, |_| settings += 1);
        }
        assert_eq!(settings, 1);
        let mut out = Vec::new();
        ring.trigger(at(29), |entry| out.push(second_of(&entry)));
        assert_eq!(out, (19..30).collect::<Vec<_>>());
    }
}
