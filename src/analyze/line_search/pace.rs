//! How often a bus is polled, as far as anybody can tell without understanding a byte.

use crate::time::{MILLISECOND, SECOND, Timestamp};

/// The silence in nanoseconds that parts bursts: longer than sensors think (up to 42 ms were seen on a real bus) and
/// adapters hold back, shorter than masters pause that do not poll all the time.
pub(super) const QUIET_NS: i64 = 100 * MILLISECOND;
/// How many of the latest bursts are looked at.
const LATEST: usize = 8;
/// The time between bursts in nanoseconds as long as it is not known, and at most.
const USUAL_NS: i64 = SECOND;
const MOST_NS: i64 = 30 * SECOND;

/// Measures the time between the beginnings of bursts.
#[derive(Clone, Debug, Default)]
pub(super) struct Pace {
    last_byte: Option<Timestamp>,
    last_burst: Option<Timestamp>,
    periods: [Option<i64>; LATEST],
    next: usize,
}

impl Pace {
    /// Takes in that bytes came.
    pub(super) fn handle_bytes(&mut self, now: Timestamp) {
        let begins = self.last_byte.is_none_or(|last| now - last >= QUIET_NS);
        self.last_byte = Some(now);
        if !begins {
            return;
        }
        if let Some(before) = self.last_burst.replace(now) {
            self.periods[self.next % LATEST] = Some((now - before).min(MOST_NS));
            self.next = (self.next + 1) % LATEST;
        }
    }

    /// Returns the longest time between the latest bursts, in nanoseconds.
    pub(super) fn period_ns(&self) -> i64 {
        self.periods.iter().copied().flatten().max().unwrap_or(USUAL_NS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_period_is_that_of_the_slowest_of_the_latest_polls() {
        let mut pace = Pace::default();
        assert_eq!(pace.period_ns(), SECOND);
        let mut poll = |at: i64| {
            for byte in 0..8 {
                pace.handle_bytes(Timestamp::from_ns(at + byte * MILLISECOND));
            }
            pace.period_ns()
        };
        assert_eq!(poll(0), SECOND);
        assert_eq!(poll(10 * SECOND), 10 * SECOND);
        assert_eq!(poll(13 * SECOND), 10 * SECOND);
        assert_eq!(poll(1000 * SECOND), MOST_NS);
        let last = (1..=8).map(|n| poll((1000 + 2 * n) * SECOND)).last();
        assert_eq!(last, Some(2 * SECOND), "a silence is forgotten");
    }
}
