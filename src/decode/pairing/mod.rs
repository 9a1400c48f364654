//! From frames and damaged runs to transactions: `hypothesis` decides who sent each frame, `assemble` joins
//! requests with their answers.

mod assemble;
mod hypothesis;
mod item;

use std::collections::VecDeque;

use crate::decode::framer::{Experience, Readings};
use crate::decode::store::Store;
use crate::time::Timestamp;

pub use assemble::Assembled;
use assemble::Assembler;
pub use hypothesis::Choice;
use hypothesis::{Beam, View, lag_ends};
pub use item::{Item, Part, What};

/// Is what pairing hands out, in the order in which it was decided.
#[derive(Clone, Copy, Debug)]
pub enum Settled {
    /// A frame or run, with what was decided of it; in stream order.
    Item(Item, Choice),
    /// A transaction, after its last frame.
    Transaction(Assembled),
}

/// Decides roles and pairs; pure, with time as an argument.
#[derive(Clone, Debug, Default)]
pub struct Pairing {
    beam: Beam,
    /// Items whose choice is open, each with its first byte.
    undecided: VecDeque<(Item, u8)>,
    assembler: Assembler,
    settled: VecDeque<Settled>,
}

impl Pairing {
    /// Takes in the next frame or run, with how it can be read.
    pub fn push(&mut self, item: Item, readings: &Readings, store: &Store, experience: &Experience) {
        let bytes = store.slice(item.offset, item.end());
        let address = bytes.first().copied().unwrap_or_default();
        let view = View { item: &item, readings, bytes, experience };
        match self.beam.push(&view) {
            Some(choice) => self.decided(item, choice, address),
            None => {
                self.undecided.push_back((item, address));
                self.settle(false);
            }
        }
    }

    /// Returns when a request that nothing followed counts as unanswered, by when it was decided.
    pub fn gives_up(at: Timestamp) -> Timestamp {
        assemble::gives_up(at)
    }

    /// Tells whether nothing is open or waiting: whatever comes next is decided by itself.
    pub fn is_idle(&self) -> bool {
        self.settled.is_empty()
            && self.undecided.is_empty()
            && self.beam.is_idle()
            && self.assembler.is_idle()
    }

    /// Takes in a request and the answer right behind it, by its address, while it is idle: nothing stays open.
    pub fn exchanged(&mut self, request: u64, address: u8) {
        self.beam.exchanged(request, address);
        self.assembler.exchanged();
    }

    fn settle(&mut self, forced: bool) {
        while let Some(choice) = self.beam.settle(forced) {
            let Some((item, address)) = self.undecided.pop_front() else { return };
            self.decided(item, choice, address);
        }
    }

    fn decided(&mut self, item: Item, choice: Choice, address: u8) {
        self.assembler.push(&item, choice, address);
        self.settled.push_back(Settled::Item(item, choice));
        self.collect();
    }

    fn collect(&mut self) {
        let mut any = false;
        while let Some(transaction) = self.assembler.next() {
            any |= transaction.request.is_some();
            self.settled.push_back(Settled::Transaction(transaction));
        }
        if any {
            let assembler = &self.assembler;
            let undecided = self.undecided.front().map_or(u64::MAX, |(item, _)| item.id);
            self.beam.forget(|id| id < undecided && assembler.is_closed(id));
        }
    }

    /// Returns what was settled next.
    pub fn take(&mut self) -> Option<Settled> {
        self.settled.pop_front()
    }

    /// Tells whether all that was settled was taken.
    pub fn is_taken(&self) -> bool {
        self.settled.is_empty()
    }

    /// Returns the id and offset of the oldest item that a later row may still need.
    pub fn oldest(&self) -> Option<(u64, u64)> {
        let open = self.assembler.oldest().map(|part| (part.id, part.offset));
        let undecided = self.undecided.front().map(|(item, _)| (item.id, item.offset));
        [open, undecided].into_iter().flatten().min()
    }

    /// Returns the offset of the first byte of what is settled and not yet taken.
    pub fn waiting(&self) -> Option<u64> {
        let offset = |part: &Part| part.offset;
        let of = |settled: &Settled| match settled {
            Settled::Item(item, _) => Some(item.offset),
            Settled::Transaction(t) => t.request.iter().chain(&t.response).map(offset).min(),
        };
        self.settled.iter().filter_map(of).min()
    }

    /// Returns when silence decides something.
    pub fn deadline(&self) -> Option<Timestamp> {
        // Nothing is given up while an item before is undecided.
        self.undecided.front().map(|(item, _)| lag_ends(item)).or_else(|| self.assembler.deadline())
    }

    /// Returns a time before which there is no deadline, whatever becomes of what is undecided.
    pub fn quiet_until(&self) -> Option<Timestamp> {
        let undecided = self.undecided.front().map(|(item, _)| lag_ends(item));
        [undecided, self.assembler.deadline()].into_iter().flatten().min()
    }

    /// Decides what is due by `now`.
    pub fn expire(&mut self, now: Timestamp) {
        while self.undecided.front().is_some_and(|(item, _)| lag_ends(item) <= now) {
            let Some(choice) = self.beam.settle(true) else { break };
            let Some((item, address)) = self.undecided.pop_front() else { break };
            self.decided(item, choice, address);
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
