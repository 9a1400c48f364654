//! Drafts a profile of a device that no profile describes, from what was seen of it: a start for whoever has its manual.
//!
//! ```text
//! transactions ──▶ traffic ──▶ guess ──▶ layout ──▶ text
//!                  samples of  types at  which of   TOML, with the evidence
//!                  each        each      them, for  of each guess as comment
//!                  command     place     all data
//! ```
//!
//! Registers, functions and quantities are what was seen. Types are guesses: of all types at all places, those are taken
//! that together explain most. What gives nothing to guess from is left raw.

mod guess;
mod layout;
mod series;
mod text;
mod traffic;

use std::collections::BTreeMap;
use std::sync::Arc;

use thiserror::Error;

use crate::decode::transaction::{Outcome, Transaction};
use crate::device::is_accepted;

use traffic::Traffic;

/// Commands that are kept, over all addresses: a bus has tens.
const MOST_COMMANDS: usize = 1024;

/// Is a profile that was drafted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draft {
    /// The device's unit address.
    pub address: u8,
    /// The profile's id, such as `unknown-3`.
    pub id: String,
    /// Its text, in TOML.
    pub toml: String,
}

/// Says why there is nothing to draft.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum NoDraft {
    /// Nobody answered.
    #[error("no device accepted a request")]
    Silence,
    /// There are profiles for all that answered.
    #[error("every device that answered is known: {0}")]
    AllKnown(String),
    /// More than one device is unknown.
    #[error("more than one device is unknown: {0}")]
    Several(String),
    /// The device asked for was not heard.
    #[error("no device answered at address {address}; those at {heard} did")]
    NotHeard {
        /// The address asked for.
        address: u8,
        /// The addresses that answered.
        heard: String,
    },
    /// What the device accepted is nothing a profile can describe.
    #[error("the device at address {0} accepted no read or write of registers (functions 3, 4, 6 and 16)")]
    NoRegisters(u8),
}

/// Is what was seen of one address.
#[derive(Debug, Default)]
struct Unit {
    /// The profile of the device, when it is known.
    device: Option<Arc<str>>,
    /// The profiles that fit while it is not.
    candidates: Vec<Arc<str>>,
    accepted: u64,
    /// Whether the device was given another address, and nothing has answered here since.
    has_left: bool,
    /// By function code and start register.
    commands: BTreeMap<(u8, u16), Traffic>,
}

/// Collects what devices say, and drafts a profile of one.
#[derive(Debug, Default)]
pub struct Drafter {
    /// By bus and unit address.
    units: BTreeMap<(Box<str>, u8), Unit>,
    commands: usize,
    /// Whether commands were left out, as there were too many.
    is_full: bool,
}

impl Drafter {
    /// Takes in a transaction of a bus, with what is known of its device: its profile, or those that fit.
    pub fn observe<'a>(
        &mut self,
        bus: &str,
        t: &Transaction<'_>,
        device: Option<&str>,
        candidates: impl Iterator<Item = &'a str>,
    ) {
        let (Some(register), 1..=247) = (t.start_register, t.address) else { return };
        let is_answer = is_accepted(t);
        if t.outcome == Outcome::Damaged || t.request.is_none() {
            return;
        }
        let unit = self.units.entry((bus.into(), t.address)).or_default();
        if is_answer {
            unit.accepted = unit.accepted.saturating_add(1);
            unit.has_left = false;
            unit.device = device.map(Arc::from);
            unit.candidates = candidates.map(Arc::from).collect();
        }
        let key = (t.function.0, register);
        if !unit.commands.contains_key(&key) {
            if self.commands >= MOST_COMMANDS {
                self.is_full = true;
                return;
            }
            self.commands += 1;
        }
        unit.commands.entry(key).or_default().take(t, is_answer);
    }

    /// Notes that the device at an address has just accepted another one: nothing is left there to draft.
    pub fn leave(&mut self, bus: &str, address: u8) {
        if let Some(unit) = self.units.get_mut(&(bus.into(), address)) {
            unit.has_left = true;
        }
    }

    /// Drafts the profile of the device at an address, or of the only one that is unknown.
    ///
    /// # Errors
    ///
    /// When no device answered or none at the address, when all are known, or several are not, or when it accepted
    /// nothing that a profile can describe.
    pub fn draft(&self, address: Option<u8>) -> Result<Draft, NoDraft> {
        let (address, unit) = self.choose(address)?;
        let commands: Vec<_> =
            unit.commands.iter().filter(|(key, it)| it.describable(key.0).next().is_some()).collect();
        if commands.is_empty() {
            return Err(NoDraft::NoRegisters(address));
        }
        Ok(text::write(address, unit, &commands, self.is_full))
    }

    fn choose(&self, address: Option<u8>) -> Result<(u8, &Unit), NoDraft> {
        let heard: Vec<_> = self.units.iter().filter(|(_, unit)| unit.accepted > 0).collect();
        if heard.is_empty() {
            return Err(NoDraft::Silence);
        }
        let buses = heard.windows(2).any(|pair| pair[0].0.0 != pair[1].0.0); // windows of two
        let list = |all: &[&(&(Box<str>, u8), &Unit)]| {
            let name = |&&((bus, address), unit): &&(&(Box<str>, u8), &Unit)| {
                let bus = if buses { format!(" on {bus}") } else { String::new() };
                let device = match &unit.device {
                    Some(device) => format!(" ({device})"),
                    None if unit.has_left => " (left for another address)".to_owned(),
                    None => String::new(),
                };
                format!("{address}{bus}{device}")
            };
            all.iter().map(name).collect::<Vec<_>>().join(", ")
        };
        let fits = |unit: &Unit, at: u8| match address {
            Some(address) => at == address,
            None => unit.device.is_none() && !unit.has_left,
        };
        let chosen: Vec<_> = heard.iter().filter(|((_, at), unit)| fits(unit, *at)).collect();
        match (&chosen[..], address) {
            ([((_, at), unit)], _) => Ok((*at, unit)),
            ([], None) => Err(NoDraft::AllKnown(list(&heard.iter().collect::<Vec<_>>()))),
            ([], Some(address)) => {
                Err(NoDraft::NotHeard { address, heard: list(&heard.iter().collect::<Vec<_>>()) })
            }
            (several, _) => Err(NoDraft::Several(list(several))),
        }
    }
}

#[cfg(test)]
mod tests;
