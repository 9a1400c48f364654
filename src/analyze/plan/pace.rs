//! How often something comes, and how long it stays away.

use super::{HABIT, Pace};
use crate::time::Timestamp;

/// How many times as long as it may be something stays away before it counts as ended: masters work in bursts.
const ABSENT: i64 = 4;

/// Counts what comes again and again.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    pub(super) count: u64,
    first: Option<Timestamp>,
    /// The last, unless there was a hole since.
    last: Option<Timestamp>,
    /// How many times between two were seen, how long they were together, and the longest, in nanoseconds.
    intervals: i64,
    span_ns: i64,
    pub(super) longest_ns: i64,
    /// The frames of the first and the last.
    pub(super) frames: Option<(u64, u64)>,
}

impl Tally {
    pub(super) fn add(&mut self, frame: u64, time: Option<Timestamp>) {
        self.count += 1;
        if let Some((last, time)) = self.last.zip(time) {
            self.intervals += 1;
            self.span_ns = self.span_ns.saturating_add(time - last);
            self.longest_ns = self.longest_ns.max(time - last);
        }
        self.first = self.first.or(time);
        self.last = time.or(self.last);
        self.frames = Some((self.frames.map_or(frame, |(first, _)| first), frame));
    }

    /// Notes that some may be missing before the next.
    pub(super) fn hole(&mut self) {
        self.last = None;
    }

    /// Returns the mean time between two, in nanoseconds, when there are enough to tell.
    pub(super) fn mean_ns(&self) -> Option<i64> {
        self.span_ns.checked_div(self.intervals).filter(|_| self.count >= HABIT)
    }

    /// Returns for how long it stayed away at the end of what was heard without a hole since `since`, in nanoseconds.
    pub(super) fn away_ns(&self, since: Timestamp, end: Timestamp) -> i64 {
        end - self.last.unwrap_or(since)
    }

    /// Returns for how long it stayed away at the beginning and at the end of what was heard, in nanoseconds.
    pub(super) fn edges_ns(&self, begin: Timestamp, end: Timestamp) -> Option<(i64, i64)> {
        Some((self.first? - begin, self.away_ns(begin, end)))
    }

    /// Returns after how long an absence it has ended, in nanoseconds, when two are at most so far apart on average.
    pub(super) fn absence_ns(&self, most: i64) -> i64 {
        most.saturating_mul(ABSENT).max(self.longest_ns.saturating_mul(2))
    }

    /// Returns the frames of the first and the last.
    pub(super) fn shown_by(&self) -> Vec<u64> {
        let (first, last) = self.frames.unzip();
        first.into_iter().chain(last.filter(|last| Some(*last) != first)).collect()
    }

    /// Returns the pace of what comes from the beginning to the end of what was heard; `None` for what does not.
    pub(super) fn pace(&self, begin: Timestamp, end: Timestamp) -> Option<Pace> {
        let mean = self.mean_ns().filter(|mean| *mean > 0)?;
        // A fifth more or a quarter less often is still the same pace.
        let (least, most) = (mean / 5 * 4, mean / 4 * 5);
        let (before, after) = self.edges_ns(begin, end)?;
        (before.max(after) <= self.absence_ns(most)).then_some((least, most))
    }
}
