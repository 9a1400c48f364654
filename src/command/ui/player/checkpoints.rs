//! What the background has found out of a recording, for whoever goes about in it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::decoder::Decoder;
use super::reel::Place;
use crate::tui::timeline::{Series, Timeline};

/// How many checkpoints are kept.
const MOST: usize = 4096;
/// How much memory they take at most, in bytes, by estimate.
const MOST_BYTES: usize = 208 << 20;
/// How many bytes of buses lie between two at least.
const LEAST: u64 = 16 * 1024;
/// What share of the memory is planned for: later checkpoints are a little larger than those before.
const PLANNED: f64 = 0.8;

/// What part of the way to the next checkpoint gives rows enough to look at.
const LEAD: i64 = 8;

/// Is a state to go on from.
pub(super) struct Checkpoint<'a> {
    pub(super) place: Place,
    pub(super) decoder: Decoder<'a>,
}

/// Holds checkpoints in order, as close to each other as the memory for them allows.
pub(super) struct Checkpoints<'a> {
    list: Vec<Arc<Checkpoint<'a>>>,
    least: u64,
    /// How much memory they take, in bytes, by estimate.
    size: usize,
    most_bytes: usize,
}

impl Default for Checkpoints<'_> {
    fn default() -> Self {
        Checkpoints { list: Vec::new(), least: LEAST, size: 0, most_bytes: MOST_BYTES }
    }
}

impl<'a> Checkpoints<'a> {
    /// Returns after how many bytes it is time for another one, where there will be about `total` bytes.
    pub(super) fn due(&self, total: u64) -> u64 {
        let Some(last) = self.list.last() else { return 0 };
        let room =
            (self.most_bytes as f64 * PLANNED / last.decoder.size().max(1) as f64).clamp(1.0, MOST as f64);
        let apart = (total as f64 / room) as u64;
        last.decoder.reached().bytes.saturating_add(apart.max(self.least))
    }

    /// Adds the next one; drops those that are missed least when there are too many.
    pub(super) fn add(&mut self, checkpoint: Checkpoint<'a>) {
        self.size = self.size.saturating_add(checkpoint.decoder.size());
        self.list.push(Arc::new(checkpoint));
        while self.list.len() > MOST || self.size > self.most_bytes {
            let Some(least_missed) = self.least_missed() else { return };
            let dropped = self.list.remove(least_missed);
            self.size = self.size.saturating_sub(dropped.decoder.size());
        }
    }

    /// Returns the one without which the way from the one before to the one after is shortest; never the first or last.
    fn least_missed(&self) -> Option<usize> {
        let bytes = |checkpoint: &Checkpoint<'_>| checkpoint.decoder.reached().bytes;
        let around = self.list.windows(3).enumerate();
        let way = |three: &[Arc<Checkpoint<'a>>]| bytes(&three[2]).saturating_sub(bytes(&three[0])); // three each
        around.min_by_key(|(_, three)| way(three)).map(|(before, _)| before + 1)
    }

    /// Returns the last one for which something holds that holds for all before it.
    pub(super) fn last(&self, is_before: impl Fn(&Decoder<'a>) -> bool) -> Option<Arc<Checkpoint<'a>>> {
        let count = self.list.partition_point(|checkpoint| is_before(&checkpoint.decoder));
        self.list.get(count.checked_sub(1)?).cloned()
    }

    /// Returns the first one.
    pub(super) fn first(&self) -> Option<Arc<Checkpoint<'a>>> {
        self.list.first().cloned()
    }

    /// Returns the one to go on from to where `measure` is `target`, so that there will be rows to look at.
    pub(super) fn near(
        &self,
        measure: &dyn Fn(&Decoder<'a>) -> i64,
        target: i64,
    ) -> Option<Arc<Checkpoint<'a>>> {
        let at = |index: usize| self.list.get(index).map(|checkpoint| measure(&checkpoint.decoder));
        let count = self.list.partition_point(|checkpoint| measure(&checkpoint.decoder) <= target);
        let last = count.checked_sub(1)?;
        let is_far = at(last)
            .zip(at(count))
            .is_some_and(|(here, next)| target.saturating_sub(here) > next.saturating_sub(here) / LEAD);
        self.list.get(if is_far { last } else { last.saturating_sub(1) }).cloned()
    }

    /// Returns how many bytes of buses lie between the one before where `measure` is `target`, and the one after.
    pub(super) fn apart(&self, measure: &dyn Fn(&Decoder<'a>) -> i64, target: i64) -> u64 {
        let bytes = |index: usize| self.list.get(index).map_or(0, |at| at.decoder.reached().bytes);
        let after = self.list.partition_point(|checkpoint| measure(&checkpoint.decoder) <= target);
        let after = after.min(self.list.len().saturating_sub(1));
        bytes(after).saturating_sub(bytes(after.saturating_sub(1)))
    }

    /// Keeps one every so many bytes.
    #[cfg(test)]
    pub(super) fn every(least: u64) -> Self {
        Checkpoints { least, ..Checkpoints::default() }
    }

    /// Keeps no more than fits in so many bytes of memory.
    #[cfg(test)]
    pub(super) fn within(most_bytes: usize) -> Self {
        Checkpoints { least: 1, most_bytes, ..Checkpoints::default() }
    }

    /// Returns after how many bytes of buses each is, and how much memory all take.
    #[cfg(test)]
    pub(super) fn spread(&self) -> (Vec<u64>, usize) {
        (self.list.iter().map(|checkpoint| checkpoint.decoder.reached().bytes).collect(), self.size)
    }

    /// Returns how many there are.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.list.len()
    }
}

/// Names what is looked for in all of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    /// What passes the filter.
    Filter,
    /// What has the words that are searched for.
    Words,
}

/// Is what is known of the whole recording.
#[derive(Default)]
pub(super) struct Known<'a> {
    pub(super) checkpoints: Checkpoints<'a>,
    pub(super) timeline: Timeline,
    /// Counts changes of the timeline.
    pub(super) version: u64,
    /// Counts filters, and words: who looks for earlier ones stops.
    looks: [u64; 2],
    /// Whether everybody is to stop.
    pub(super) is_over: bool,
}

impl Known<'_> {
    fn look(&mut self, what: Look) -> (&mut u64, &mut Option<(Series, i64)>) {
        let [filters, words] = &mut self.looks;
        match what {
            Look::Filter => (filters, &mut self.timeline.hits),
            Look::Words => (words, &mut self.timeline.words),
        }
    }

    /// Begins to look for something else, or for nothing; returns its number.
    pub(super) fn begin_look(&mut self, what: Look, is_any: bool) -> u64 {
        self.version += 1;
        let (number, hits) = self.look(what);
        *number += 1;
        *hits = is_any.then(Default::default);
        *number
    }

    /// Tells what was found up to a place; tells whether that is still looked for.
    pub(super) fn tell_look(&mut self, what: Look, number: u64, series: &Series, until: i64) -> bool {
        let is_over = self.is_over;
        let (known, hits) = self.look(what);
        if *known != number || is_over {
            return false;
        }
        *hits = Some((series.clone(), until));
        self.version += 1;
        true
    }

    /// Tells whether something was not looked for in all of the recording.
    pub(super) fn is_looking(&self) -> bool {
        let mut hits = [&self.timeline.hits, &self.timeline.words].into_iter().flatten();
        hits.any(|(_, until)| *until < self.timeline.decoded_ns)
    }
}

/// Shares what is known among threads.
#[derive(Default)]
pub(super) struct Shared<'a>(Mutex<Known<'a>>);

impl<'a> Shared<'a> {
    /// Looks at what is known, or adds to it; what is done meanwhile is to be little.
    pub(super) fn lock(&self) -> MutexGuard<'_, Known<'a>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes note that the recording cannot be read on.
    pub(super) fn break_off(&self) {
        let mut known = self.lock();
        known.timeline.is_broken = true;
        known.version += 1;
    }
}
