//! From frames and damaged runs to transactions: [`hypothesis`] decides who sent each frame, [`assemble`] joins
//! requests with their answers.

mod assemble;
mod hypothesis;
mod item;

use std::collections::VecDeque;

use crate::decode::framer::Experience;
use crate::decode::store::Store;
use crate::decode::transaction::Outcome;
use crate::time::Timestamp;

pub use assemble::Assembled;
use assemble::Assembler;
pub use hypothesis::Choice;
use hypothesis::{Beam, View, lag_ends};
pub use item::{Item, What, frame_readings};

/// Is what pairing hands out, in the order in which it was decided.
#[derive(Clone, Copy, Debug)]
pub enum Settled {
    /// A frame or run, with what was decided of it; in stream order.
    Item(Item, Choice),
    /// A transaction, after its last frame.
    Transaction(Assembled),
}

/// Decides roles and pairs; pure, with time as an argument.
#[derive(Clone, Debug)]
pub struct Pairing {
    beam: Beam,
    undecided: VecDeque<Item>,
    assembler: Assembler,
    settled: VecDeque<Settled>,
}

impl Pairing {
    /// Makes a pairing that has seen nothing.
    pub fn new() -> Self {
        Pairing {
            beam: Beam::new(),
            undecided: VecDeque::new(),
            assembler: Assembler::default(),
            settled: VecDeque::new(),
        }
    }

    /// Takes in the next frame or run.
    pub fn push(&mut self, item: Item, store: &Store, experience: &Experience) {
        let bytes = store.slice(item.offset, item.end());
        let view = View { item: &item, bytes, experience };
        match self.beam.push(&view) {
            Some(choice) => self.decided(item, choice),
            None => {
                self.undecided.push_back(item);
                self.settle(false);
            }
        }
    }

    fn settle(&mut self, forced: bool) {
        while let Some(choice) = self.beam.settle(forced) {
            let Some(item) = self.undecided.pop_front() else { return };
            self.decided(item, choice);
        }
    }

    fn decided(&mut self, item: Item, choice: Choice) {
        self.assembler.push(item, choice);
        self.settled.push_back(Settled::Item(item, choice));
        self.collect();
    }

    fn collect(&mut self) {
        let mut any = false;
        while let Some(transaction) = self.assembler.next() {
            any |=
                !matches!(transaction.outcome, Outcome::Answered | Outcome::Exception | Outcome::Unsolicited);
            self.settled.push_back(Settled::Transaction(transaction));
        }
        if any {
            let assembler = &self.assembler;
            let undecided = self.undecided.front().map_or(u64::MAX, |item| item.id);
            self.beam.forget(|id| id < undecided && assembler.is_closed(id));
        }
    }

    /// Returns what was settled next.
    pub fn next(&mut self) -> Option<Settled> {
        self.settled.pop_front()
    }

    /// Returns the oldest item that a later row may still need.
    pub fn oldest(&self) -> Option<&Item> {
        match (self.assembler.oldest(), self.undecided.front()) {
            (Some(a), Some(b)) => Some(if a.id < b.id { a } else { b }),
            (a, b) => a.or(b),
        }
    }

    /// Returns the offset of the first byte of what is settled and not yet taken.
    pub fn waiting(&self) -> Option<u64> {
        let offset = |item: &Item| item.offset;
        let of = |settled: &Settled| match settled {
            Settled::Item(item, _) => Some(item.offset),
            Settled::Transaction(t) => t.request.iter().chain(&t.response).map(offset).min(),
        };
        self.settled.iter().filter_map(of).min()
    }

    /// Returns when silence decides something.
    pub fn deadline(&self) -> Option<Timestamp> {
        // Nothing is given up while an item before is undecided.
        self.undecided.front().map(lag_ends).or_else(|| self.assembler.deadline())
    }

    /// Decides what is due by `now`.
    pub fn expire(&mut self, now: Timestamp) {
        while self.undecided.front().is_some_and(|item| lag_ends(item) <= now) {
            let Some(choice) = self.beam.settle(true) else { break };
            let Some(item) = self.undecided.pop_front() else { break };
            self.decided(item, choice);
            self.settle(false);
        }
        if self.undecided.is_empty() {
            self.assembler.expire(now);
            self.collect();
        }
    }

    /// Decides everything: the input has ended.
    pub fn finish(&mut self) {
        self.settle(true);
        self.assembler.finish();
        self.collect();
    }
}
