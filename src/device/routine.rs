//! What is polled again and again teaches nothing new: such exchanges are remembered, and told at a glance.

use crate::decode::transaction::Transaction;

/// Exchanges remembered; a power of two.
const PLACES: usize = 64;

/// Names a kind of exchange: unit address, function code and start register.
type Key = (u8, u8, u16);

#[derive(Clone, Copy, Debug)]
struct Routine {
    key: Key,
    /// Index of what the profiles declare for it, if they do.
    entry: Option<usize>,
    /// What was known then.
    epoch: u32,
}

/// Remembers exchanges that taught nothing.
#[derive(Clone, Debug)]
pub(super) struct Routines {
    places: Box<[Option<Routine>; PLACES]>,
    /// Counts the changes of what is known of the devices.
    epoch: u32,
}

impl Routines {
    pub(super) fn new() -> Self {
        Routines { places: Box::new([None; PLACES]), epoch: 0 }
    }

    fn place((address, function, register): Key) -> usize {
        let mixed = u32::from(register) ^ u32::from(address) << 16 ^ u32::from(function) << 24;
        // Fibonacci hashing: the upper bits of the product are well mixed.
        (mixed.wrapping_mul(0x9E37_79B9) >> 26) as usize % PLACES
    }

    fn get(&self, t: &Transaction<'_>) -> Option<&Routine> {
        let key = (t.address, t.function.0, t.start_register?);
        self.places[Self::place(key)].as_ref().filter(|routine| routine.key == key)
    }

    /// Tells whether an accepted exchange like this one taught nothing, and nothing has changed since.
    pub(super) fn knows(&self, t: &Transaction<'_>) -> bool {
        self.get(t).is_some_and(|routine| routine.epoch == self.epoch)
    }

    /// Returns what the profiles declare for it, by its index, where that is remembered.
    pub(super) fn entry(&self, t: &Transaction<'_>) -> Option<Option<usize>> {
        self.get(t).map(|routine| routine.entry)
    }

    /// Remembers an accepted exchange that taught nothing.
    pub(super) fn remember(&mut self, t: &Transaction<'_>, entry: Option<usize>) {
        let Some(register) = t.start_register else { return };
        let key = (t.address, t.function.0, register);
        self.places[Self::place(key)] = Some(Routine { key, entry, epoch: self.epoch });
    }

    /// Notes that something else is known now: what taught nothing may teach something again.
    pub(super) fn forget(&mut self) {
        self.epoch = self.epoch.wrapping_add(1);
    }
}
