//! Transactions from decided frames: which answers which, and when an answer can no longer come.

use std::collections::VecDeque;

use crate::decode::frame::{Reason, Role};
use crate::decode::pairing::hypothesis::{Choice, LAG_NS};
use crate::decode::pairing::item::{Item, Part, What};
use crate::decode::transaction::Outcome;
use crate::time::{SECOND, Timestamp};

/// Nanoseconds after which a request that nothing followed counts as unanswered.
const RESPONSE_TIMEOUT_NS: i64 = 5 * SECOND;
/// Nanoseconds after the next request within which a late response is still looked for.
const LATE_WINDOW_NS: i64 = 3 * SECOND / 2;
// An item decided late may supersede a request as of when it came: what is due then was not due before the item was.
const _: () = assert!(LAG_NS <= LATE_WINDOW_NS);
/// Answered requests after which, without times, an earlier one counts as unanswered.
const UNTIMED_WINDOW: u32 = 2;
/// Requests kept open at most.
const MOST_OPEN: usize = 16;

/// Is a transaction with its sides by place, before it is given bytes.
#[derive(Clone, Copy, Debug)]
pub struct Assembled {
    /// The request, or a damaged run that may be it.
    pub request: Option<Part>,
    /// The response, or a damaged run that may be it.
    pub response: Option<Part>,
    /// How it ended.
    pub outcome: Outcome,
}

/// Is a request that may still be answered.
#[derive(Clone, Copy, Debug)]
struct Open {
    part: Part,
    address: u8,
    /// Time of the read that decided it.
    at: Timestamp,
    /// A damaged run that may be the answer.
    damaged: Option<Part>,
    /// When the next request had been read, if there was one.
    superseded: Option<Timestamp>,
    /// Requests answered since, of those that came later.
    answered_since: u32,
}

impl Open {
    fn closes(&self) -> Timestamp {
        match self.superseded {
            Some(at) => at + LATE_WINDOW_NS,
            None => gives_up(self.at),
        }
    }

    fn close(self) -> Assembled {
        let outcome = if self.damaged.is_some() { Outcome::Damaged } else { Outcome::NoResponse };
        Assembled { request: Some(self.part), response: self.damaged, outcome }
    }
}

/// Joins decided frames into transactions.
#[derive(Clone, Debug, Default)]
pub struct Assembler {
    open: Vec<Open>,
    /// A damaged run just before, which may be a request.
    run_before: Option<(Part, Role)>,
    ready: VecDeque<Assembled>,
}

impl Assembler {
    /// Returns the next transaction.
    pub fn next(&mut self) -> Option<Assembled> {
        self.ready.pop_front()
    }

    /// Returns the oldest item a later transaction may still use.
    pub fn oldest(&self) -> Option<&Part> {
        let open = self.open.iter().map(|open| &open.part);
        open.chain(self.run_before.iter().map(|(part, _)| part)).min_by_key(|part| part.id)
    }

    /// Tells whether the request with this id can no longer be answered.
    pub fn is_closed(&self, id: u64) -> bool {
        !self.open.iter().any(|open| open.part.id == id)
    }

    /// Returns when the next open request is given up.
    pub fn deadline(&self) -> Option<Timestamp> {
        self.open.iter().map(Open::closes).min()
    }

    /// Tells whether no request is open and no transaction waits.
    pub fn is_idle(&self) -> bool {
        self.open.is_empty() && self.ready.is_empty()
    }

    /// Forgets the run before: a request and its answer came by.
    pub fn exchanged(&mut self) {
        self.run_before = None;
    }

    /// Takes in an item with what was decided of it; `address` is its first byte.
    pub fn push(&mut self, item: &Item, choice: Choice, address: u8) {
        let run_before = self.run_before.take();
        match choice {
            Choice::Request => self.request(item, address),
            Choice::Echo => {}
            Choice::Response(id) | Choice::Mismatch(id) => self.response(item, id, run_before),
            Choice::Unsolicited => self.unsolicited(item, run_before),
            Choice::Run => self.run(item),
        }
    }

    fn request(&mut self, item: &Item, address: u8) {
        self.supersede(item.at);
        let part = item.part();
        if address == 0 {
            let outcome = Outcome::Broadcast;
            return self.ready.push_back(Assembled { request: Some(part), response: None, outcome });
        }
        if self.open.len() >= MOST_OPEN {
            let oldest = self.open.remove(0);
            self.ready.push_back(oldest.close());
        }
        self.open.push(Open {
            part,
            address,
            at: item.at,
            damaged: None,
            superseded: None,
            answered_since: 0,
        });
    }

    /// Marks the open requests as followed by another; those with a damaged answer are done.
    fn supersede(&mut self, at: Timestamp) {
        for open in &mut self.open {
            open.superseded.get_or_insert(at);
        }
        if self.open.iter().any(|open| open.damaged.is_some()) {
            self.close_where(|open| open.damaged.is_some());
        }
    }

    fn close_where(&mut self, closed: impl Fn(&Open) -> bool) {
        let ready = &mut self.ready;
        self.open.retain(|open| {
            let done = closed(open);
            if done {
                ready.push_back(open.close());
            }
            !done
        });
    }

    fn response(&mut self, item: &Item, id: u64, run_before: Option<(Part, Role)>) {
        let Some(index) = self.open.iter().position(|open| open.part.id == id) else {
            return self.unsolicited(item, None);
        };
        let open = self.open.remove(index);
        // It had its answer, damaged; what is answered here is the damaged request after that.
        if let Some((answer, (run, Role::Request))) = open.damaged.zip(run_before)
            && answer.id != run.id
        {
            self.ready.push_back(open.close());
            return self.unsolicited(item, run_before);
        }
        if !self.open.is_empty() {
            self.close_where(|other| other.part.id < id && other.address == open.address);
            self.close_untimed(id);
        }
        let outcome = match (open.superseded, is_exception(item)) {
            (Some(_), _) => Outcome::Late,
            (None, true) => Outcome::Exception,
            (None, false) => Outcome::Answered,
        };
        self.ready.push_back(Assembled { request: Some(open.part), response: Some(item.part()), outcome });
    }

    /// Without times a request is given up once later ones were answered.
    fn close_untimed(&mut self, answered: u64) {
        for open in &mut self.open {
            open.answered_since += u32::from(open.part.id < answered && open.part.time.is_none());
        }
        self.close_where(|open| open.answered_since >= UNTIMED_WINDOW);
    }

    fn unsolicited(&mut self, item: &Item, run_before: Option<(Part, Role)>) {
        let request = run_before.filter(|(_, role)| *role != Role::Response).map(|(run, _)| run);
        if let Some(run) = request {
            for open in &mut self.open {
                open.damaged = open.damaged.filter(|damaged| damaged.id != run.id);
            }
        }
        let outcome = if request.is_some() { Outcome::Damaged } else { Outcome::Unsolicited };
        self.ready.push_back(Assembled { request, response: Some(item.part()), outcome });
    }

    fn run(&mut self, item: &Item) {
        let What::Run { reason, role, .. } = item.what else { return };
        if reason == Reason::Stray {
            return;
        }
        let current = self.open.iter_mut().find(|open| open.superseded.is_none());
        if let Some(open) = current
            && role != Role::Request
        {
            open.damaged.get_or_insert(item.part());
        }
        self.run_before = Some((item.part(), role));
    }

    /// Gives up what can no longer be answered by `now`.
    pub fn expire(&mut self, now: Timestamp) {
        if self.deadline().is_some_and(|due| due <= now) {
            self.close_where(|open| open.closes() <= now);
        }
    }

    /// Gives up everything: the input has ended.
    pub fn finish(&mut self) {
        self.run_before = None;
        self.close_where(|_| true);
    }
}

/// Returns when a request that nothing followed counts as unanswered, by when it was decided.
pub fn gives_up(at: Timestamp) -> Timestamp {
    at + RESPONSE_TIMEOUT_NS
}

fn is_exception(item: &Item) -> bool {
    matches!(item.what, What::Frame { function, .. } if function.is_exception())
}
