//! Judges what comes out of a bus, one row after the other.

use std::collections::VecDeque;

use super::Finding;
use crate::decode::chunk::Lost;
use crate::decode::frame::{Damaged, Frame};
use crate::decode::stamp::Stamper;
use crate::decode::transaction::Transaction;
use crate::device::Meaning;
use crate::line::LineSettings;

/// Judges one bus.
#[derive(Clone, Debug)]
pub struct Verifier {
    line: LineSettings,
    found: VecDeque<Finding>,
}

impl Verifier {
    /// Begins with a bus of which nothing was seen.
    pub fn new(line: LineSettings) -> Self {
        Verifier { line, found: VecDeque::new() }
    }

    /// Judges a frame.
    pub fn frame(&mut self, frame: &Frame<'_>, stamper: &Stamper) {
        let _ = (self.line, frame, stamper);
    }

    /// Judges a damaged run.
    pub fn damaged(&mut self, damaged: &Damaged<'_>, stamper: &Stamper) {
        let _ = (damaged, stamper);
    }

    /// Takes note of a hole.
    pub fn lost(&mut self, lost: &Lost) {
        let _ = lost;
    }

    /// Judges a transaction.
    pub fn transaction(&mut self, transaction: &Transaction<'_>, meaning: &Meaning<'_>) {
        let _ = (transaction, meaning);
    }

    /// Returns what the last row proved, not yet taken.
    pub fn found(&self) -> impl Iterator<Item = &Finding> {
        self.found.iter()
    }

    /// Takes the next finding of the rows so far.
    pub fn pop(&mut self) -> Option<Finding> {
        self.found.pop_front()
    }
}
