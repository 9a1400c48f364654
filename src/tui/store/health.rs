//! How a bus is: counts, a series of seconds, histograms.

use super::pages::Pages;
use crate::decode::chunk::{LineErrorKind, LostKind};
use crate::decode::frame::Reason;
use crate::decode::transaction::Outcome;
use crate::time::{SECOND, Timestamp};

/// How many seconds are kept: a day.
const MOST_SECONDS: u64 = 86_400;

/// Is what happened within a second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Second {
    /// Seconds since the Unix epoch.
    pub at: i64,
    /// How long bytes were on the wire, in nanoseconds.
    pub busy_ns: i64,
    /// Frames with a good CRC.
    pub frames: u32,
    /// Damaged runs, and requests without a good answer.
    pub errors: u32,
}

/// Holds the counts and series of a bus.
#[derive(Clone, Debug, Default)]
pub struct Health {
    /// What happened in each second, those without anything left out.
    pub seconds: Pages<Second>,
    /// From a request's end to its response's start.
    pub latency: Histogram,
    /// From the end of a frame to the start of the next.
    pub gaps: Histogram,
    /// The `±` of the times of frames.
    pub blur: Histogram,
    /// The largest of them, in nanoseconds.
    pub worst_blur_ns: i64,
    /// Transactions by outcome, in the order of [`Outcome::ALL`].
    pub outcomes: [u64; Outcome::ALL.len()],
    /// Damaged runs by [`Reason`], in the order of its declaration.
    pub reasons: [u64; 4],
    /// Line errors by [`LineErrorKind`], in the order of its declaration.
    pub line_errors: [u64; 3],
    /// Bytes lost by [`LostKind`], in the order of its declaration.
    pub lost: [u64; 4],
    /// How often bytes were lost.
    pub losses: u64,
    /// Frames with a good CRC.
    pub frames: u64,
    /// All bytes.
    pub bytes: u64,
    /// Bytes in damaged runs.
    pub damaged_bytes: u64,
    /// Stray bytes: beside frames, or noise.
    pub stray_bytes: u64,
}

impl Health {
    /// Returns how many damaged runs there were.
    pub fn damaged(&self) -> u64 {
        self.reasons.iter().sum()
    }

    /// Returns how many transactions there were.
    pub fn transactions(&self) -> u64 {
        self.outcomes.iter().sum()
    }

    /// Returns how far the adapter blurs times: nineteen of twenty are within `±` this, in nanoseconds.
    pub fn blur_ns(&self) -> i64 {
        self.blur.quantile(0.95).map_or(0, |quantile| quantile.min(self.worst_blur_ns))
    }

    /// Takes a frame or damaged run that ended then.
    pub(super) fn run(&mut self, end: Option<Timestamp>, length: usize, busy_ns: i64, is_damaged: bool) {
        self.bytes = self.bytes.saturating_add(length as u64);
        if let Some(second) = self.second(end) {
            second.busy_ns = second.busy_ns.saturating_add(busy_ns);
            second.frames += u32::from(!is_damaged);
            second.errors += u32::from(is_damaged);
        }
    }

    /// Counts something that went wrong.
    pub(super) fn error(&mut self, at: Option<Timestamp>) {
        if let Some(second) = self.second(at) {
            second.errors = second.errors.saturating_add(1);
        }
    }

    /// Returns the second of a time; an earlier one counts to the last there is.
    fn second(&mut self, time: Option<Timestamp>) -> Option<&mut Second> {
        let at = time?.as_ns().div_euclid(SECOND);
        if self.seconds.last().is_none_or(|last| last.at < at) {
            self.seconds.push(Second { at, ..Second::default() });
            self.seconds.keep(MOST_SECONDS);
        }
        let before = |second: &Second| second.at > at;
        // What is decided late belongs to one of the last few seconds.
        let mut number = self.seconds.total().checked_sub(1)?;
        while self.seconds.get(number).is_some_and(before) && number > self.seconds.first_kept() {
            number -= 1;
        }
        self.seconds.get_mut(number)
    }

    /// Sums up the seconds from `from` on, `step` seconds at a time, up to `until`; silent seconds count.
    pub fn steps(&self, from: i64, step: i64, until: i64) -> Vec<Second> {
        let step = step.max(1);
        let count = usize::try_from(until.saturating_sub(from) / step).unwrap_or(0).min(10_000);
        let mut steps: Vec<Second> = (0..count)
            .map(|index| Second { at: from.saturating_add(step * index as i64), ..Second::default() })
            .collect();
        for second in self.seconds.iter().rev().take_while(|second| second.at >= from) {
            let index = usize::try_from((second.at - from) / step).unwrap_or(usize::MAX);
            if let Some(sum) = steps.get_mut(index) {
                sum.busy_ns = sum.busy_ns.saturating_add(second.busy_ns);
                sum.frames = sum.frames.saturating_add(second.frames);
                sum.errors = sum.errors.saturating_add(second.errors);
            }
        }
        steps
    }

    /// Returns the place of a reason among the counts.
    pub fn place_of(reason: Reason) -> usize {
        match reason {
            Reason::Crc => 0,
            Reason::Truncated => 1,
            Reason::Stray => 2,
            Reason::Noise => 3,
        }
    }

    /// Returns the place of a kind of line error among the counts.
    pub fn place_of_error(kind: LineErrorKind) -> usize {
        match kind {
            LineErrorKind::ParityOrFraming => 0,
            LineErrorKind::Break => 1,
            LineErrorKind::Overrun => 2,
        }
    }

    /// Returns the place of a kind of loss among the counts.
    pub fn place_of_loss(kind: LostKind) -> usize {
        match kind {
            LostKind::Overrun => 0,
            LostKind::Queue => 1,
            LostKind::Disk => 2,
            LostKind::SourceGone => 3,
        }
    }
}

/// Counts lengths of time in classes, eight to a decade, from 10 µs to 100 s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Histogram {
    counts: [u64; Histogram::CLASSES],
}

impl Default for Histogram {
    fn default() -> Self {
        Histogram { counts: [0; Histogram::CLASSES] }
    }
}

impl Histogram {
    /// How many classes a decade has.
    const PER_DECADE: f64 = 8.0;
    /// How many classes there are.
    pub const CLASSES: usize = 56;
    /// Where the first class begins, in nanoseconds.
    const LEAST: f64 = 10_000.0;

    /// Returns the class of a length of time; what is outside counts to the first or last.
    pub fn class(ns: i64) -> usize {
        let class = ((ns.max(1) as f64 / Self::LEAST).log10() * Self::PER_DECADE).floor();
        class.clamp(0.0, (Self::CLASSES - 1) as f64) as usize
    }

    /// Returns where a class begins, in nanoseconds.
    pub fn begin(class: usize) -> i64 {
        (Self::LEAST * 10_f64.powf(class as f64 / Self::PER_DECADE)) as i64
    }

    /// Takes a length of time in nanoseconds.
    pub(super) fn take(&mut self, ns: i64) {
        let count = &mut self.counts[Self::class(ns)]; // a class is below `CLASSES`
        *count = count.saturating_add(1);
    }

    /// Returns the counts of all classes.
    pub fn counts(&self) -> &[u64] {
        &self.counts
    }

    /// Returns how many were taken.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Returns the upper end of the class below which the share lies, from 0 to 1, in nanoseconds.
    pub fn quantile(&self, share: f64) -> Option<i64> {
        let wanted = (self.total() as f64 * share).ceil().max(1.0);
        let mut sum = 0.0;
        let class = self.counts.iter().position(|count| {
            sum += *count as f64;
            sum >= wanted
        })?;
        Some(Self::begin(class + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::MILLISECOND;

    #[test]
    fn a_length_of_time_is_in_the_class_that_begins_before_it() {
        for ns in [20_000, MILLISECOND, 1_562_500, 3_645_833, 100 * MILLISECOND, 20 * SECOND] {
            let class = Histogram::class(ns);
            assert!(Histogram::begin(class) <= ns + 1 && ns < Histogram::begin(class + 1), "{ns}");
        }
        assert_eq!((Histogram::class(-5), Histogram::class(i64::MAX)), (0, Histogram::CLASSES - 1));
    }

    #[test]
    fn the_median_is_within_a_class_of_the_truth() {
        let mut histogram = Histogram::default();
        (1..=101).for_each(|ms| histogram.take(ms * MILLISECOND));
        let median = histogram.quantile(0.5).expect("some");
        assert!((51 * MILLISECOND..70 * MILLISECOND).contains(&median), "{median}");
        assert_eq!(Histogram::default().quantile(0.5), None);
    }

    #[test]
    fn silent_seconds_are_steps_too() {
        let mut health = Health::default();
        let at = |second: i64| Some(Timestamp::from_ns(second * SECOND));
        health.run(at(100), 8, 8 * MILLISECOND, false);
        health.run(at(103), 8, 8 * MILLISECOND, true);
        health.error(at(100)); // decided late
        let steps = health.steps(100, 1, 105);
        let seen: Vec<_> = steps.iter().map(|step| (step.frames, step.errors)).collect();
        assert_eq!(seen, [(1, 1), (0, 0), (0, 0), (0, 1), (0, 0)]);
        assert_eq!(health.steps(100, 5, 105)[0].busy_ns, 16 * MILLISECOND);
    }
}
