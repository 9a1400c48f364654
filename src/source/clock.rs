//! The clocks that reads are stamped with.

use crate::time::Timestamp;

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

#[cfg(target_os = "linux")]
mod linux {
    use rustix::time::{ClockId, Timespec, clock_gettime};

    use super::{Clock, SystemClock};
    use crate::time::{SECOND, Timestamp};

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
}

#[cfg(not(target_os = "linux"))]
mod elsewhere {
    use std::sync::OnceLock;
    use std::time::{Instant, SystemTime};

    use super::{Clock, SystemClock};
    use crate::time::Timestamp;

    static START: OnceLock<Instant> = OnceLock::new();

    impl Clock for SystemClock {
        #[expect(clippy::disallowed_methods, reason = "the clock itself")]
        fn monotonic_ns(&self) -> u64 {
            let elapsed = START.get_or_init(Instant::now).elapsed();
            u64::try_from(elapsed.as_nanos()).unwrap_or(u64::MAX)
        }

        #[expect(clippy::disallowed_methods, reason = "the clock itself")]
        fn realtime(&self) -> Timestamp {
            let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
            Timestamp::from_ns(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
        }
    }
}
