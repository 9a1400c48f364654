//! Findings, folded: the same thing about the same device is one, with a count.

use std::sync::Arc;

use super::row::Row;
use crate::time::Timestamp;

/// How many different findings are kept.
const MOST: usize = 2000;
/// How many of the latest frames of one are remembered.
const MOST_FRAMES: usize = 256;

/// Says how bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Doubtful.
    Warning,
    /// Wrong.
    Error,
}

/// Is something wrong with the traffic, as often as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Of its rule, such as `D06`.
    pub code: Arc<str>,
    /// The rule's name.
    pub name: Arc<str>,
    /// How bad it is.
    pub severity: Severity,
    /// Who is the cause, as far as one can say: master, device, line or adapter.
    pub party: &'static str,
    /// Index of the bus.
    pub bus: usize,
    /// The address it is about.
    pub address: Option<u8>,
    /// What was observed last.
    pub message: Box<str>,
    /// What it may mean, and what to check next.
    pub help: Box<str>,
    /// Where to read on.
    pub reference: Box<str>,
    /// How often.
    pub count: u64,
    /// When it was found first.
    pub first: Option<Timestamp>,
    /// When it was found last.
    pub last: Option<Timestamp>,
    /// The ids of the latest frames that show it, in order; one finding's frames stand together.
    pub frames: Vec<u64>,
    /// The bytes it is about in the last of the frames, half-open.
    pub span: Option<(u16, u16)>,
}

/// Holds what is wrong with the traffic, in the order in which it was first found.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    list: Vec<Arc<Finding>>,
    /// How many single findings there were.
    total: u64,
}

impl Findings {
    /// Returns the findings in the order in which they were first found.
    pub fn list(&self) -> &[Arc<Finding>] {
        &self.list
    }

    /// Returns how many there were, each counted.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Takes a finding; folds it with others of its code, bus and address.
    pub(super) fn take(&mut self, new: Finding) {
        self.total = self.total.saturating_add(new.count);
        let same = |old: &Arc<Finding>| {
            old.code == new.code && old.bus == new.bus && old.address == new.address && old.name == new.name
        };
        match self.list.iter().position(same) {
            Some(at) => {
                let old = Arc::make_mut(&mut self.list[at]); // found there
                old.count = old.count.saturating_add(new.count);
                (old.last, old.message, old.span) = (new.last, new.message, new.span);
                old.severity = old.severity.max(new.severity);
                old.frames.extend(new.frames);
                let surplus = old.frames.len().saturating_sub(MOST_FRAMES);
                old.frames.drain(..surplus);
            }
            None if self.list.len() < MOST => self.list.push(Arc::new(new)),
            None => {}
        }
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
        self.list.iter().map(|finding| &**finding).filter(shows)
    }
}
