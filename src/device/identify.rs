//! Learns which device is at which address, from traffic alone.
//!
//! Evidence, weakest first: each register that a device answers leaves those profiles possible that have
//! it, none where no profile does; an accepted exchange that a profile declares as its fingerprint names a device; so does the type code
//! in a serial number; what the user says overrides all. The quantity rules out no profile: probes
//! answer counts that their manuals do not have. A request alone proves only what the master
//! believes, so nothing is learnt from one.

use std::sync::Arc;

use thiserror::Error;

use crate::decode::transaction::Transaction;

use super::derive::Environment;
use super::exchange::{Exchange, is_accepted};
use super::known::{Known, Learnt};
use super::meaning::Meaning;
use super::registry::{Profiles, Set};
use super::routine::{Routines, Told};
use crate::section::nearest;

/// Says that the device of an address has become known, or is another than before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identified {
    /// The unit address.
    pub address: u8,
    /// The address that the device gave up for this one.
    pub moved_from: Option<u8>,
    /// The id of the profile.
    pub device: Arc<str>,
    /// The serial number, once it was read.
    pub serial_number: Option<String>,
    /// What shows it, for people: it goes on after 'recognised by'.
    pub evidence: String,
    /// The ids of the frames that show it.
    pub frames: Vec<u64>,
}

/// Says that no profile has the id given for an address.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("no profile is called '{device}'; {hint}")]
pub struct UnknownDevice {
    device: String,
    hint: String,
}

/// Remembers that a transaction moved a device, so that it is still told as the device's.
#[derive(Clone, Copy, Debug)]
struct Move {
    transaction: u64,
    from: u8,
    to: u8,
}

/// Holds what is known about the devices of one bus.
#[derive(Clone, Debug)]
pub struct Devices {
    profiles: Arc<Profiles>,
    environment: Environment,
    /// One for each address; a copy shares those that it has not seen change.
    known: Box<[Arc<Known>; 256]>,
    moved: Option<Move>,
    routines: Routines,
}

impl Devices {
    /// Starts with nothing known.
    pub fn new(profiles: Arc<Profiles>, environment: Environment) -> Self {
        let known = Box::new(std::array::from_fn(|_| Arc::default()));
        Devices { profiles, environment, known, moved: None, routines: Routines::new() }
    }

    /// Says what the device at an address is, whatever the traffic shows.
    ///
    /// # Errors
    ///
    /// When no profile has the id.
    pub fn assign(&mut self, address: u8, device: &str) -> Result<(), UnknownDevice> {
        let Some(index) = self.profiles.position(device) else {
            let ids = || self.profiles.iter().map(|profile| &*profile.id);
            let hint = match nearest(device, ids()) {
                Some(near) => format!("did you mean '{near}'?"),
                None => format!("there are {}", ids().collect::<Vec<_>>().join(", ")),
            };
            return Err(UnknownDevice { device: device.to_owned(), hint });
        };
        Arc::make_mut(&mut self.known[usize::from(address)]).assign(index);
        self.routines.forget();
        Ok(())
    }

    /// Returns the id of the profile of the device at an address, when it is known.
    pub fn device(&self, address: u8) -> Option<&str> {
        self.profiles.id(self.known[usize::from(address)].device()?).map(|id| &**id)
    }

    /// Returns the serial number last read at an address.
    pub fn serial_number(&self, address: u8) -> Option<&str> {
        self.known[usize::from(address)].serial_number()
    }

    /// Returns the profiles in use.
    pub fn profiles(&self) -> &Arc<Profiles> {
        &self.profiles
    }

    /// Learns from a decided transaction; says so when a device has become known or changed.
    pub fn observe(&mut self, t: &Transaction<'_>) -> Option<Identified> {
        self.moved = None;
        if t.address == 0 || self.profiles.is_service_address(t.address) {
            return None; // no single device answers there
        }
        if !is_accepted(t) || self.routines.told(t).is_some() {
            return None;
        }
        let index = self.profiles.find(t.function.0, t.start_register?);
        let entry = index.and_then(|index| self.profiles.entry(index));
        let exchange = Exchange::read(&self.profiles, entry, t);
        let known = Arc::make_mut(&mut self.known[usize::from(t.address)]);
        let before = known.clone();
        let learnt = known.learn(&exchange);
        if *known != before {
            self.routines.forget();
        } else if entry.is_none_or(|entry| !entry.is_telling) {
            let device = known.device();
            let declaring = entry.map(|entry| entry.declaring).unwrap_or_default();
            let candidates = known.candidates(declaring);
            self.routines.remember(t, Told { entry: index, device, candidates });
        }
        let to = exchange.new_address.filter(|&to| to != t.address && known.may_obey(&exchange));
        if let Some(to) = to.filter(|&to| !before.is_unknown() || self.known[usize::from(to)].is_unknown()) {
            return self.relocate(t, to);
        }
        let known = Arc::make_mut(&mut self.known[usize::from(t.address)]);
        let device = known.device().filter(|_| learnt.is_news)?;
        known.evidence = evidence(&self.profiles, known, &exchange, &learnt, device, t).into();
        self.identified(t.address, t)
    }

    /// Gives back memory that only saves time.
    pub fn compact(&mut self) {
        self.routines.clear();
    }

    /// Takes what is known along when a device is given another address.
    fn relocate(&mut self, t: &Transaction<'_>, to: u8) -> Option<Identified> {
        let moved = Arc::make_mut(&mut self.known[usize::from(t.address)]).leave();
        Arc::make_mut(&mut self.known[usize::from(to)]).arrive(moved);
        self.routines.forget();
        self.moved = Some(Move { transaction: t.id, from: t.address, to });
        let identified = self.identified(to, t)?;
        let before = Some(&identified.evidence).filter(|before| !before.is_empty());
        let before = before.map(|before| format!(" (there by {before})")).unwrap_or_default();
        let evidence = format!("its move from address {}{before}", t.address);
        Some(Identified { evidence, moved_from: Some(t.address), ..identified })
    }

    fn identified(&self, address: u8, t: &Transaction<'_>) -> Option<Identified> {
        let known = &self.known[usize::from(address)];
        Some(Identified {
            address,
            moved_from: None,
            device: Arc::clone(self.profiles.id(known.device()?)?),
            serial_number: known.serial_number().map(str::to_owned),
            evidence: known.evidence.to_string(),
            frames: [t.request, t.response].into_iter().flatten().map(|side| side.id).collect(),
        })
    }

    /// Returns what a transaction means by what is known now; to be asked after `observe`.
    pub fn meaning<'a>(&'a self, t: &Transaction<'a>) -> Meaning<'a> {
        if let Some(Told { entry, device, candidates }) = self.routines.told(t) {
            let entry = entry.and_then(|index| self.profiles.entry(index));
            let mut meaning = Meaning::new(&self.profiles, entry, self.environment, t);
            (meaning.device, meaning.candidates) = (*device, *candidates);
            meaning.serial_number = self.serial_number(t.address);
            return meaning;
        }
        let address = match self.moved {
            Some(moved) if moved.transaction == t.id && moved.from == t.address => moved.to,
            _ => t.address,
        };
        let known = &self.known[usize::from(address)];
        let entry = t.start_register.and_then(|register| self.profiles.find(t.function.0, register));
        let entry = entry.and_then(|index| self.profiles.entry(index));
        let declaring = entry.map(|entry| entry.declaring).unwrap_or_default();
        let mut meaning = Meaning::new(&self.profiles, entry, self.environment, t);
        // What the user said of the old address holds for the acknowledgement that leaves it.
        meaning.device = self.known[usize::from(t.address)].device().or_else(|| known.device());
        meaning.candidates =
            if meaning.device.is_some() { Set::default() } else { known.candidates(declaring) };
        meaning.serial_number = known.serial_number();
        meaning
    }
}

/// Puts into words why an address has its device, as they go on after 'recognised by'.
fn evidence(
    profiles: &Profiles,
    known: &Known,
    exchange: &Exchange<'_>,
    learnt: &Learnt,
    device: usize,
    t: &Transaction<'_>,
) -> String {
    let serial_number = known.serial_number().unwrap_or_default();
    let id = profiles.id(device).map_or("", |id| id);
    let reason = match learnt {
        Learnt { by_serial_number: true, .. } => {
            let code = exchange.type_code(device).unwrap_or_default();
            let name = profiles.at(device).map_or("", |profile| &profile.name);
            return format!("serial number {serial_number}: type {code}, {name}");
        }
        _ if known.is_assigned() => "assignment".to_owned(),
        Learnt { is_new_device: false, .. } => known.evidence.to_string(),
        _ => {
            let what = if matches!(t.function.0, 3 | 4) { "answer to" } else { "acknowledgement of" };
            let (register, quantity) = (t.start_register.unwrap_or(0), t.quantity.unwrap_or(0));
            let plural = if quantity == 1 { "" } else { "s" };
            format!("its {what} {quantity} register{plural} at {register:#06X}, which only {id} has")
        }
    };
    if learnt.is_new_serial_number { format!("{reason}; serial number {serial_number}") } else { reason }
}
