//! What the background has found out of a recording, for whoever goes about in it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::decoder::Decoder;
use super::reel::Place;
use crate::tui::timeline::{Series, Timeline};

/// How many checkpoints are kept.
const MOST: usize = 2048;
/// How much memory they take at most, in bytes, by estimate.
const MOST_BYTES: usize = 64 << 20;
/// How many bytes of buses lie between two at first.
const LEAST: u64 = 16 * 1024;

/// What part of the way to the next checkpoint gives rows enough to look at.
const LEAD: i64 = 8;

/// Is a state to go on from.
pub(super) struct Checkpoint<'a> {
    pub(super) place: Place,
    pub(super) decoder: Decoder<'a>,
}

/// Holds checkpoints in order, ever further apart as there are more, or as they are larger.
pub(super) struct Checkpoints<'a> {
    list: Vec<Arc<Checkpoint<'a>>>,
    apart: u64,
    /// How much memory they take, in bytes, by estimate.
    size: usize,
}

impl Default for Checkpoints<'_> {
    fn default() -> Self {
        Checkpoints { list: Vec::new(), apart: LEAST, size: 0 }
    }
}

impl<'a> Checkpoints<'a> {
    /// Returns after how many bytes it is time for another one.
    pub(super) fn due(&self) -> u64 {
        self.list.last().map_or(0, |last| last.decoder.reached().bytes.saturating_add(self.apart))
    }

    /// Adds the next one; keeps every other one when there are too many.
    pub(super) fn add(&mut self, checkpoint: Checkpoint<'a>) {
        self.size = self.size.saturating_add(checkpoint.decoder.size());
        self.list.push(Arc::new(checkpoint));
        while self.list.len() > MOST || (self.size > MOST_BYTES && self.list.len() > 2) {
            let mut at = 0_usize;
            self.list.retain(|_| {
                at += 1;
                at % 2 == 1
            });
            self.size = self.list.iter().map(|checkpoint| checkpoint.decoder.size()).sum();
            self.apart = self.apart.saturating_mul(2);
        }
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

    /// Keeps one every so many bytes.
    #[cfg(test)]
    pub(super) fn every(apart: u64) -> Self {
        Checkpoints { apart, ..Checkpoints::default() }
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
}
