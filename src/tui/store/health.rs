//! How a bus is: counts, a series of seconds, histograms.

use super::age;
use super::pages::Pages;
use crate::decode::chunk::{LineErrorKind, LostKind};
use crate::decode::frame::Reason;
use crate::decode::transaction::Outcome;
use crate::time::{SECOND, Timestamp};

/// How many stretches are kept; then those of long ago are joined.
const MOST_STRETCHES: usize = 8192;
/// How many stretches there are for each time their age doubles, when they are joined.
const PER_DOUBLING: u64 = 32;

/// Is what happened within a second, or, long ago, within some seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Second {
    /// When it began, in seconds since the Unix epoch.
    pub at: i64,
    /// How many seconds it is long.
    pub length: i64,
    /// How long bytes were on the wire, in nanoseconds.
    pub busy_ns: i64,
    /// Frames with a good CRC.
    pub frames: u32,
    /// Damaged runs, and requests without a good answer.
    pub errors: u32,
}

impl Second {
    fn end(&self) -> i64 {
        self.at.saturating_add(self.length)
    }

    /// Takes in the stretch that follows; silence between them belongs to both.
    fn join(&mut self, next: &Second) {
        self.length = next.end().saturating_sub(self.at);
        self.busy_ns = self.busy_ns.saturating_add(next.busy_ns);
        self.frames = self.frames.saturating_add(next.frames);
        self.errors = self.errors.saturating_add(next.errors);
    }

    /// Adds the part of a stretch that lies within this one; all parts together are the stretch.
    fn take(&mut self, other: &Second) {
        let (from, to) = (self.at.max(other.at), self.end().min(other.end()));
        let length = i128::from(other.length.max(1));
        let part = |count: i64| {
            let until = |at: i64| i128::from(count) * i128::from(at.saturating_sub(other.at)) / length;
            i64::try_from(until(to) - until(from)).unwrap_or(0)
        };
        let few = |count: u32| u32::try_from(part(i64::from(count))).unwrap_or(0);
        self.busy_ns = self.busy_ns.saturating_add(part(other.busy_ns));
        self.frames = self.frames.saturating_add(few(other.frames));
        self.errors = self.errors.saturating_add(few(other.errors));
    }
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
            self.seconds.push(Second { at, length: 1, ..Second::default() });
            if self.seconds.len() > MOST_STRETCHES {
                self.thin();
                self.seconds.keep(MOST_STRETCHES as u64 / 2);
            }
        }
        let before = |second: &Second| second.at > at;
        // What is decided late belongs to one of the last few seconds.
        let mut number = self.seconds.total().checked_sub(1)?;
        while self.seconds.get(number).is_some_and(before) && number > self.seconds.first_kept() {
            number -= 1;
        }
        self.seconds.get_mut(number)
    }

    /// Joins seconds to longer stretches, the longer the longer ago.
    pub(super) fn thin(&mut self) {
        let Some(now) = self.seconds.last().map(|last| last.at) else { return };
        let mut kept: Vec<Second> = Vec::new();
        let mut within = None;
        for second in self.seconds.iter() {
            let bucket = age::bucket(second.at, now, PER_DOUBLING);
            match kept.last_mut().filter(|_| within == Some(bucket)) {
                Some(last) => last.join(second),
                None => kept.push(*second),
            }
            within = Some(bucket);
        }
        self.seconds.replace(&kept);
    }

    /// Returns about how many bytes it takes.
    pub(super) fn size(&self) -> usize {
        size_of::<Health>() + self.seconds.len() * size_of::<Second>()
    }

    /// Sums up the seconds from `from` on, `step` seconds at a time, up to `until`; silent seconds count. What is known
    /// only of a longer stretch is spread evenly over it.
    pub fn steps(&self, from: i64, step: i64, until: i64) -> Vec<Second> {
        let step = step.max(1);
        let count = usize::try_from(until.saturating_sub(from) / step).unwrap_or(0).min(10_000);
        let mut steps: Vec<Second> = (0..count)
            .map(|index| Second {
                at: from.saturating_add(step * index as i64),
                length: step,
                ..Second::default()
            })
            .collect();
        for second in self.seconds.iter().rev().take_while(|second| second.end() > from) {
            let begin = second.at.max(from);
            let first = usize::try_from((begin - from) / step).unwrap_or(usize::MAX);
            let touched = steps.iter_mut().skip(first).take_while(|sum| sum.at < second.end());
            touched.for_each(|sum| sum.take(second));
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

    #[test]
    fn of_a_month_a_few_stretches_are_kept_and_nothing_is_lost_in_them() {
        let mut health = Health::default();
        let month = 30 * 86_400_i64;
        for second in (0..month).step_by(7) {
            health.run(Some(Timestamp::from_ns(second * SECOND)), 8, 7 * MILLISECOND, false);
        }
        health.thin();
        assert!(health.seconds.len() < 600, "{}", health.seconds.len());
        let frames: u32 = health.steps(0, 3600, month).iter().map(|step| step.frames).sum();
        assert_eq!(i64::from(frames), (month + 6) / 7);
        let hour = health.steps(86_400, 3600, 2 * 86_400);
        assert!(hour.iter().all(|step| (500..530).contains(&step.frames)), "{hour:?}");
        let minute = health.steps(month - 60, 1, month);
        assert!(minute.iter().all(|step| step.frames <= 1), "the last minute is kept by the second");
    }
}
