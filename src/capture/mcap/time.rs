//! The times of a recording: one wall-clock anchor and what a monotonic clock has gone on since.

use crate::time::{SECOND, Timestamp};

/// 2000-01-01T00:00:00Z: what has no times, or earlier ones, is shown in viewers from then on.
pub(super) const YEAR_2000: Timestamp = Timestamp::from_ns(946_684_800 * SECOND);

/// Ties the monotonic clock of a host to wall-clock time, once for a session.
///
/// Every time of the session is `realtime` and what the clock has gone on since, so that a step of the wall
/// clock reorders nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Anchor {
    /// What the monotonic clock showed, in nanoseconds.
    pub monotonic_ns: u64,
    /// What the wall clock showed.
    pub realtime: Timestamp,
}

impl Anchor {
    /// Makes the anchor of input that has wall-clock times only, of which `first` is the first.
    ///
    /// The times then stand in place of the clock; only those before 1970 need an anchor of their own.
    pub(super) fn of_wall_clock(first: Timestamp) -> Self {
        match u64::try_from(first.as_ns()) {
            Ok(monotonic_ns) => Anchor { monotonic_ns, realtime: first },
            Err(_) => Anchor { monotonic_ns: 0, realtime: Timestamp::MIN },
        }
    }

    /// Returns the time at which the monotonic clock shows `monotonic_ns`; ends where timestamps end.
    pub fn time(self, monotonic_ns: u64) -> Timestamp {
        let realtime = self.realtime.as_ns();
        Timestamp::from_ns(match monotonic_ns.checked_sub(self.monotonic_ns) {
            Some(since) => realtime.saturating_add_unsigned(since),
            None => realtime.saturating_sub_unsigned(self.monotonic_ns - monotonic_ns),
        })
    }

    /// Returns what the monotonic clock shows at a time; ends where the clock does.
    pub fn monotonic_ns(self, time: Timestamp) -> u64 {
        let elapsed = i128::from(time.as_ns()) - i128::from(self.realtime.as_ns());
        let ns = (i128::from(self.monotonic_ns) + elapsed).clamp(0, u64::MAX.into());
        ns as u64 // clamped just now
    }
}

/// Gives log times: those of a recording's messages as viewers show them.
#[derive(Clone, Copy, Debug)]
pub(super) struct LogTime {
    /// How much later than the truth times are shown, in nanoseconds: 0 unless they begin before 2000.
    shift: i128,
    last: u64,
}

impl LogTime {
    pub(super) fn new(first: Timestamp) -> Self {
        let shift = i128::from(YEAR_2000.as_ns()) - i128::from(first.as_ns());
        LogTime { shift: shift.max(0), last: 1 }
    }

    /// Returns a time as it is shown.
    pub(super) fn shown(self, time: Timestamp) -> u64 {
        // At most 2^63 + 2^63, and at least 0: times before the first are shown as the first nanosecond.
        (i128::from(time.as_ns()) + self.shift).clamp(1, u64::MAX.into()) as u64
    }

    /// Returns the log time of a message of this time; log times never go back.
    pub(super) fn next(&mut self, time: Timestamp) -> u64 {
        self.last = self.last.max(self.shown(time));
        self.last
    }

    /// Returns the log time of the message before.
    pub(super) fn last(self) -> u64 {
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wall_clock_times_survive_to_the_nanosecond_from_1677_to_2262() {
        for first in [i64::MIN, -1, 0, 1, YEAR_2000.as_ns(), 1_767_225_600_123_456_789, i64::MAX] {
            let anchor = Anchor::of_wall_clock(Timestamp::from_ns(first));
            for elapsed in [0, 1, SECOND, i64::MAX] {
                let time = Timestamp::from_ns(first) + elapsed;
                assert_eq!(anchor.time(anchor.monotonic_ns(time)), time, "{first} + {elapsed}");
            }
        }
    }

    #[test]
    fn log_times_never_go_back_and_never_lie_before_2000() {
        let mut log = LogTime::new(Timestamp::from_ns(-5));
        assert_eq!(log.next(Timestamp::from_ns(-5)), YEAR_2000.as_ns() as u64);
        assert_eq!(log.next(Timestamp::from_ns(5)), YEAR_2000.as_ns() as u64 + 10);
        assert_eq!(log.next(Timestamp::from_ns(0)), YEAR_2000.as_ns() as u64 + 10);
        let mut late = LogTime::new(YEAR_2000 + 7);
        assert_eq!(late.next(YEAR_2000 + 7), YEAR_2000.as_ns() as u64 + 7);
    }
}
