//! Findings, folded: the same thing about the same device is one, with a count.

use std::sync::Arc;

use super::row::Row;
use crate::analyze::verify::Finding;

/// How many different findings are kept.
const MOST: usize = 2000;
/// How many of the latest frames of one are remembered.
const MOST_FRAMES: usize = 256;

/// Is something wrong with the traffic, as often as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Index of the bus.
    pub bus: usize,
    /// The latest of its kind, with the count and the times of all; its frames are the latest of all, in order.
    pub finding: Finding,
}

/// Holds what is wrong with the traffic, in the order in which it was first found.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    list: Vec<Arc<Found>>,
    total: u64,
}

impl Findings {
    /// Returns the findings in the order in which they were first found.
    pub fn list(&self) -> &[Arc<Found>] {
        &self.list
    }

    /// Returns how many there were, each counted.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Takes a finding; folds it with others of its kind.
    pub(super) fn take(&mut self, bus: usize, new: &Finding) {
        self.total = self.total.saturating_add(new.count);
        let key = |finding: &Finding| (finding.rule.code, finding.address, finding.party, finding.subject);
        let same = |old: &Arc<Found>| old.bus == bus && key(&old.finding) == key(new);
        match self.list.iter().position(same) {
            Some(at) => {
                let old = &mut Arc::make_mut(&mut self.list[at]).finding; // found there
                let mut frames = std::mem::take(&mut old.frames);
                frames.extend(&new.frames);
                let surplus = frames.len().saturating_sub(MOST_FRAMES);
                frames.drain(..surplus);
                frames.sort_unstable();
                *old = Finding {
                    frames,
                    count: old.count.saturating_add(new.count),
                    first: old.first.or(new.first),
                    severity: old.severity.max(new.severity),
                    ..new.clone()
                };
            }
            None if self.list.len() < MOST => self.list.push(Arc::new(Found { bus, finding: new.clone() })),
            None => {}
        }
    }

    /// Forgets all but the latest frames of each.
    pub(super) fn forget_frames(&mut self, most: usize) {
        for found in self.list.iter_mut().filter(|found| found.finding.frames.len() > most) {
            let frames = &mut Arc::make_mut(found).finding.frames;
            frames.drain(..frames.len() - most);
            frames.shrink_to_fit();
        }
    }

    /// Returns about how many bytes they take.
    pub(super) fn size(&self) -> usize {
        let found = |found: &Arc<Found>| {
            size_of::<Found>() + found.finding.message.len() + found.finding.frames.len() * 8 + 32
        };
        self.list.iter().map(found).sum()
    }

    /// Returns the findings that a row shows.
    pub fn of_row(&self, row: &Row) -> impl Iterator<Item = &Finding> {
        let ids = match row {
            Row::Run(run) => [Some(run.id), None],
            Row::Exchange(exchange) => exchange.ids,
            Row::Remark(_) => [None, None],
        };
        let shows =
            move |finding: &&Finding| ids.iter().flatten().any(|id| finding.frames.binary_search(id).is_ok());
        self.list.iter().map(|found| &found.finding).filter(shows)
    }
}
