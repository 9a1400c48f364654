//! What is polled again and again teaches nothing new: such exchanges are remembered, and told at a glance.

use super::registry::Set;
use crate::decode::transaction::Transaction;

/// Exchanges remembered; a power of two.
const PLACES: usize = 1024;

/// Names a kind of exchange: unit address, function code and start register.
type Key = (u8, u8, u16);

#[derive(Clone, Copy, Debug)]
struct Routine {
    key: Key,
    told: Told,
    /// What was known then.
    epoch: u32,
}

/// Is what is said of an exchange as long as nothing changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Told {
    /// Index of what the profiles declare for it, if they do.
    pub(super) entry: Option<usize>,
    /// The device, when it is known.
    pub(super) device: Option<usize>,
    /// The profiles that fit while it is not.
    pub(super) candidates: Set,
}

/// Remembers exchanges that taught nothing.
#[derive(Clone, Debug)]
pub(super) struct Routines {
    /// Empty until the first is remembered.
    places: Vec<Option<Routine>>,
    /// Counts the changes of what is known of the devices.
    epoch: u32,
}

impl Routines {
    pub(super) fn new() -> Self {
        Routines { places: Vec::new(), epoch: 0 }
    }

    fn place((address, function, register): Key) -> usize {
        let mixed = u32::from(register) ^ u32::from(address) << 16 ^ u32::from(function) << 24;
        // Fibonacci hashing: the upper bits of the product are well mixed.
        (mixed.wrapping_mul(0x9E37_79B9) >> 22) as usize % PLACES
    }

    /// Returns what is said of an exchange of a kind that taught nothing, if nothing has changed since.
    pub(super) fn told(&self, t: &Transaction<'_>) -> Option<&Told> {
        let key = (t.address, t.function.0, t.start_register?);
        let known = self.places.get(Self::place(key))?.as_ref();
        known.filter(|known| known.key == key && known.epoch == self.epoch).map(|known| &known.told)
    }

    /// Remembers an accepted exchange that taught nothing.
    pub(super) fn remember(&mut self, t: &Transaction<'_>, told: Told) {
        let Some(register) = t.start_register else { return };
        let key = (t.address, t.function.0, register);
        if self.places.is_empty() {
            self.places.resize(PLACES, None);
        }
        self.places[Self::place(key)] = Some(Routine { key, told, epoch: self.epoch });
    }

    /// Gives its memory back; what comes again is looked at anew, and told alike.
    pub(super) fn clear(&mut self) {
        self.places = Vec::new();
    }

    /// Notes that something else is known now: what taught nothing may teach something again.
    pub(super) fn forget(&mut self) {
        self.epoch = self.epoch.wrapping_add(1);
    }
}
