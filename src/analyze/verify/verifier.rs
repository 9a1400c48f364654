//! Judges what comes out of a bus, one row after the other.

use std::collections::VecDeque;
use std::sync::Arc;

use super::bus::Bus;
use super::frame::FrameRules;
use super::line::LineRules;
use super::transaction::TransactionRules;
use super::value::ValueRules;
use super::{Finding, address, modbus, order, quirk::QuirkRules, request, setting};
use crate::decode::chunk::Lost;
use crate::decode::frame::{Damaged, Frame};
use crate::decode::stamp::Stamper;
use crate::decode::transaction::Transaction;
use crate::device::{Meaning, Profiles};
use crate::line::LineSettings;

/// Takes findings as rules make them.
pub(super) type Found = VecDeque<Finding>;

/// Judges one bus. Memory stays flat, whatever the length.
#[derive(Clone, Debug)]
pub struct Verifier {
    bus: Bus,
    line: LineRules,
    frames: FrameRules,
    transactions: TransactionRules,
    quirks: QuirkRules,
    values: ValueRules,
    found: Found,
}

impl Verifier {
    /// Begins with a bus of which nothing was seen.
    pub fn new(line: LineSettings, profiles: Arc<Profiles>) -> Self {
        Verifier {
            bus: Bus::new(profiles),
            line: LineRules::new(line),
            frames: FrameRules::default(),
            transactions: TransactionRules::default(),
            quirks: QuirkRules::default(),
            values: ValueRules::default(),
            found: VecDeque::new(),
        }
    }

    /// Judges a frame.
    pub fn frame(&mut self, frame: &Frame<'_>, stamper: &Stamper) {
        self.line.frame(frame, stamper, &mut self.bus, &mut self.found);
        self.frames.frame(frame, &self.bus, &mut self.found);
        self.bus.frame(frame);
    }

    /// Judges a damaged run.
    pub fn damaged(&mut self, damaged: &Damaged<'_>) {
        self.line.damaged(damaged, &mut self.found);
        self.frames.damaged(damaged, &self.bus, &mut self.found);
        self.bus.damaged(damaged);
    }

    /// Judges a hole.
    pub fn lost(&mut self, lost: &Lost) {
        self.line.lost(lost, &mut self.found);
        self.bus.lost();
    }

    /// Judges a transaction.
    pub fn transaction(&mut self, transaction: &Transaction<'_>, meaning: &Meaning<'_>) {
        let Verifier { bus, transactions, quirks, values, found, .. } = self;
        modbus::transaction(transaction, bus, found);
        quirks.transaction(transaction, meaning, bus, found);
        // Manuals are for the devices that have them.
        if bus.look_for_family(transaction, meaning) {
            request::transaction(transaction, meaning, bus, found);
            address::transaction(transaction, meaning, bus, found);
            setting::transaction(transaction, meaning, bus, found);
        }
        let why = transactions.transaction(transaction, meaning, bus, found);
        order::transaction(transaction, meaning, bus, found);
        values.transaction(transaction, meaning, bus, why, found);
        bus.transaction(transaction, meaning);
    }

    /// Returns what was found and not taken yet.
    pub fn found(&self) -> impl Iterator<Item = &Finding> {
        self.found.iter()
    }

    /// Takes the next finding of the rows so far.
    pub fn pop(&mut self) -> Option<Finding> {
        self.found.pop_front()
    }
}
