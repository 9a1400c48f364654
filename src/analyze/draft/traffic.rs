//! What was seen of one command: how often, in which forms, and samples of its data.

use std::collections::BTreeMap;

use crate::decode::frame::Role;
use crate::decode::shape::Form;
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::register_data;
use crate::time::Timestamp;

/// Samples kept of one side of a command: enough for statistics, and bounded.
const MOST_SAMPLES: usize = 128;
/// Registers that one read, and one write, may name (Modbus application protocol V1.1b3, 6.3 and 6.12).
const MOST_READ: u16 = 125;
const MOST_WRITTEN: u16 = 123;
/// Quantities kept of a command.
const MOST_QUANTITIES: usize = 16;

/// Keeps samples evenly over a recording of any length: when full, every other one is let go.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    kept: Vec<Box<[u8]>>,
    seen: u64,
    stride: u64,
}

impl Default for Samples {
    fn default() -> Self {
        Samples { kept: Vec::new(), seen: 0, stride: 1 }
    }
}

impl Samples {
    pub(super) fn push(&mut self, data: &[u8]) {
        if self.seen.is_multiple_of(self.stride) {
            if self.kept.len() >= MOST_SAMPLES {
                let mut keep = false;
                self.kept.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.stride = self.stride.saturating_mul(2);
            }
            if self.seen.is_multiple_of(self.stride) {
                self.kept.push(data.into());
            }
        }
        self.seen = self.seen.saturating_add(1);
    }

    /// Returns what was kept, in the order of time.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[u8]> {
        self.kept.iter().map(|data| &**data)
    }
}

/// Is what was seen of one function and start register at one address.
#[derive(Clone, Debug, Default)]
pub(super) struct Traffic {
    /// How often each quantity was accepted.
    pub(super) quantities: BTreeMap<u16, u64>,
    pub(super) asked: u64,
    pub(super) accepted: u64,
    pub(super) refused: u64,
    /// Frame forms outside the specification.
    pub(super) forms: Vec<Form>,
    pub(super) request: Samples,
    pub(super) response: Samples,
    first: Option<Timestamp>,
    last: Option<Timestamp>,
}

impl Traffic {
    /// Takes in a transaction whose request is whole.
    pub(super) fn take(&mut self, t: &Transaction<'_>, is_accepted: bool) {
        self.asked = self.asked.saturating_add(1);
        let time = t.request.and_then(|side| side.time).map(|time| time.start.midpoint());
        self.first = self.first.or(time);
        self.last = time.or(self.last);
        if t.outcome == Outcome::Exception {
            self.refused = self.refused.saturating_add(1);
        }
        if !is_accepted {
            return;
        }
        self.accepted = self.accepted.saturating_add(1);
        let quantity = if t.function.0 == 6 { 1 } else { t.quantity.unwrap_or(0) };
        if self.quantities.len() < MOST_QUANTITIES || self.quantities.contains_key(&quantity) {
            let count = self.quantities.entry(quantity).or_default();
            *count = count.saturating_add(1);
        }
        if quantity == 0 {
            self.note(Form::ZeroQuantity);
        }
        if let Some((_, data)) = register_data(t, Role::Request) {
            self.request.push(data);
        }
        self.take_response(t, quantity);
    }

    fn take_response(&mut self, t: &Transaction<'_>, quantity: u16) {
        let Some((_, data)) = register_data(t, Role::Response) else { return };
        let count = t.response.and_then(|side| side.bytes.get(2).copied()).map_or(0, usize::from);
        match data.len() {
            0 => return,
            _ if count == 0 => return self.note(Form::UncountedData), // what such an answer holds has no meaning
            length if length != count && count == usize::from(quantity) => self.note(Form::CountsRegisters),
            _ => {}
        }
        self.response.push(data);
    }

    fn note(&mut self, form: Form) {
        if !self.forms.contains(&form) {
            self.forms.push(form);
        }
    }

    /// Returns the accepted quantities that a profile can describe, ascending; none for other functions.
    pub(super) fn describable(&self, function: u8) -> impl Iterator<Item = u16> {
        let most = match function {
            3 | 4 | 6 => Some(MOST_READ),
            16 => Some(MOST_WRITTEN),
            _ => None,
        };
        self.quantities.keys().copied().filter(move |&quantity| most.is_some_and(|most| quantity <= most))
    }

    /// Returns how long it took on average from one request to the next, in seconds.
    pub(super) fn interval_s(&self) -> Option<f64> {
        let (first, last) = (self.first?, self.last?);
        let pauses = self.asked.checked_sub(1).filter(|&pauses| pauses > 0)?;
        let ns = last - first;
        Some(ns as f64 / 1e9 / pauses as f64).filter(|&seconds| seconds > 0.0)
    }
}
