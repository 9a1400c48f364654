//! Compares the wall clock with the monotonic one.

use crate::time::{MILLISECOND, SECOND, Timestamp};

/// How often both are compared, in nanoseconds.
const COMPARE_EVERY: u64 = SECOND as u64;
/// How often they are written, in nanoseconds.
const WRITE_EVERY: u64 = 10 * SECOND as u64;
/// By how much the wall clock goes wrong when it is set, not steered, in nanoseconds.
const STEP: i128 = 50 * MILLISECOND as i128;

/// Knows what the clocks showed.
#[derive(Debug, Default)]
pub(super) struct Watch {
    compared_ns: Option<u64>,
    written_ns: u64,
    /// Wall clock less monotonic clock.
    difference: i128,
}

/// Says that the clocks are to be written.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Compared {
    /// What the wall clock shows.
    pub(super) realtime: Timestamp,
    /// By how many nanoseconds the wall clock was set, if it was.
    pub(super) step_ns: Option<i64>,
}

impl Watch {
    /// Compares the clocks when it is time; says when they are to be written.
    pub(super) fn look(
        &mut self,
        monotonic_ns: u64,
        realtime: impl FnOnce() -> Timestamp,
    ) -> Option<Compared> {
        let is_first = self.compared_ns.is_none();
        if self.compared_ns.is_some_and(|last| monotonic_ns.saturating_sub(last) < COMPARE_EVERY) {
            return None;
        }
        self.compared_ns = Some(monotonic_ns);
        let realtime = realtime();
        let difference = i128::from(realtime.as_ns()) - i128::from(monotonic_ns);
        let step = difference - self.difference;
        self.difference = difference;
        let is_step = !is_first && step.abs() > STEP;
        let is_due = is_first || monotonic_ns.saturating_sub(self.written_ns) >= WRITE_EVERY;
        if !is_step && !is_due {
            return None;
        }
        self.written_ns = monotonic_ns;
        let step = step.clamp(i64::MIN.into(), i64::MAX.into()) as i64; // clamped just now
        Some(Compared { realtime, step_ns: is_step.then_some(step) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_are_written_every_ten_seconds_and_when_the_wall_clock_was_set() {
        let mut watch = Watch::default();
        let mut written = Vec::new();
        for ms in (0..30_000).step_by(100) {
            let set = if ms >= 15_000 { 3600 * SECOND } else { 0 };
            let steered = ms * 100; // 100 ppm
            let realtime = Timestamp::from_ns(ms * MILLISECOND + steered + set);
            let compared = watch.look((ms * MILLISECOND) as u64, || realtime);
            written.extend(compared.map(|compared| (ms / 1000, compared.step_ns.map(|ns| ns / SECOND))));
        }
        assert_eq!(written, [(0, None), (10, None), (15, Some(3600)), (25, None)]);
    }
}
