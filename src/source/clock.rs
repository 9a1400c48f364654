//! The clocks that reads are stamped with.

use rustix::time::{ClockId, Timespec, clock_gettime};

use crate::time::{SECOND, Timestamp};

/// Shows time; an argument so that tests can set it.
pub trait Clock: Send + Sync {
    /// Returns what a clock shows that is never set and runs on in suspend, in nanoseconds.
    fn monotonic_ns(&self) -> u64;

    /// Returns wall-clock time.
    fn realtime(&self) -> Timestamp;
}

/// Shows the time of this host.
#[derive(Clone, Copy, Debug, Default)]
pub struct SystemClock;

fn ns(time: Timespec) -> i64 {
    time.tv_sec.saturating_mul(SECOND).saturating_add(time.tv_nsec)
}

impl Clock for SystemClock {
    fn monotonic_ns(&self) -> u64 {
        u64::try_from(ns(clock_gettime(ClockId::Boottime))).unwrap_or_default()
    }

    fn realtime(&self) -> Timestamp {
        Timestamp::from_ns(ns(clock_gettime(ClockId::Realtime)))
    }
}
