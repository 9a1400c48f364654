//! What is known about one address, and how evidence changes it.

use std::sync::Arc;

use super::exchange::Exchange;
use super::registry::Set;

/// Names the strongest evidence about an address, weakest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
enum Basis {
    #[default]
    Nothing,
    Registers,
    Fingerprint,
    SerialNumber,
}

/// Holds what is known about one address.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Known {
    /// What the user said.
    assigned: Option<usize>,
    basis: Basis,
    /// The profiles that fit; means nothing while the basis is `Nothing`.
    fits: Set,
    serial_number: Option<Arc<str>>,
    /// The sentence that named the device.
    pub(super) evidence: Arc<str>,
}

/// Says what came of an exchange.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Learnt {
    /// Whether device or serial number are new, and the device is known.
    pub(super) is_news: bool,
    pub(super) is_new_device: bool,
    pub(super) is_new_serial_number: bool,
    /// Whether the serial number has named the device.
    pub(super) by_serial_number: bool,
}

impl Known {
    pub(super) fn assign(&mut self, device: usize) {
        self.assigned = Some(device);
    }

    pub(super) fn is_assigned(&self) -> bool {
        self.assigned.is_some()
    }

    /// Tells whether no exchange was seen yet.
    pub(super) fn is_unknown(&self) -> bool {
        self.basis == Basis::Nothing
    }

    pub(super) fn serial_number(&self) -> Option<&str> {
        self.serial_number.as_deref()
    }

    /// Returns the device's profile, when it is known: registers alone name none.
    pub(super) fn device(&self) -> Option<usize> {
        self.assigned.or_else(|| self.fits.single().filter(|_| self.basis >= Basis::Fingerprint))
    }

    /// Returns the profiles that fit while the device is not known: at first, those that declare what is asked.
    pub(super) fn candidates(&self, declaring: Set) -> Set {
        match (self.device(), self.basis) {
            (Some(_), _) => Set::default(),
            (None, Basis::Nothing) => declaring,
            (None, _) => self.fits,
        }
    }

    /// Learns from an accepted exchange.
    pub(super) fn learn(&mut self, exchange: &Exchange<'_>) -> Learnt {
        let before = self.device();
        let is_new_serial_number = self.note_serial_number(exchange);
        let by_serial_number = self.learn_from_serial_number(exchange, is_new_serial_number);
        if !by_serial_number {
            self.learn_from_registers(exchange);
        }
        let device = self.device();
        let is_new_device = device != before;
        let is_news = device.is_some() && (is_new_device || is_new_serial_number);
        let by_serial_number = by_serial_number && self.assigned.is_none();
        Learnt { is_news, is_new_device, is_new_serial_number, by_serial_number }
    }

    /// Keeps the serial number; another one than before means another device.
    fn note_serial_number(&mut self, exchange: &Exchange<'_>) -> bool {
        let Some(serial_number) = &exchange.serial_number else { return false };
        if self.serial_number.as_deref() == Some(serial_number.text) {
            return false;
        }
        if self.serial_number.is_some() {
            self.start_afresh();
        }
        self.serial_number = Some(serial_number.text.into());
        true
    }

    /// Forgets everything but what the user said.
    fn start_afresh(&mut self) {
        *self = Known { assigned: self.assigned, ..Known::default() };
    }

    /// Follows the type code of a serial number; `false` when it does not tell.
    fn learn_from_serial_number(&mut self, exchange: &Exchange<'_>, is_new: bool) -> bool {
        let Some(serial_number) = &exchange.serial_number else { return false };
        if self.basis == Basis::SerialNumber && !is_new {
            return false; // judged when it was new
        }
        let (claiming, denying) = exchange.judge(serial_number);
        let here = claiming.and(exchange.declaring);
        let possible = if self.is_unknown() { exchange.declaring } else { self.fits };
        self.fits = if !here.is_empty() {
            here.narrowed_to(possible)
        } else if !exchange.fingerprint.is_empty() {
            return false; // no other kind answers this register, whatever its serial number looks like
        } else if !claiming.is_empty() {
            claiming
        } else if !denying.is_empty() && (possible.is_empty() || !possible.and(denying).is_empty()) {
            possible.without(denying) // the maker's, of a kind that no profile describes
        } else {
            return false;
        };
        self.basis = Basis::SerialNumber;
        true
    }

    /// Follows what the device answers: the profiles that declare it, if any, and a fingerprint.
    fn learn_from_registers(&mut self, exchange: &Exchange<'_>) {
        let Exchange { declaring, fingerprint, .. } = *exchange;
        let fits_here = self.fits.and(declaring);
        match self.basis {
            // A kind that no profile describes stays so, until another serial number is read.
            Basis::SerialNumber if self.fits.is_empty() => {}
            Basis::Nothing | Basis::Registers => {
                // When nothing fits all that was answered, the kind is one that no profile describes.
                self.fits = if self.is_unknown() { declaring } else { fits_here };
                self.basis = Basis::Registers;
                if !fingerprint.is_empty() {
                    self.fits = fingerprint.narrowed_to(self.fits);
                    self.basis = Basis::Fingerprint;
                }
            }
            // A device does not have the fingerprint of another kind: it was swapped.
            _ if fits_here.is_empty() && !fingerprint.is_empty() => {
                let serial_number = exchange.serial_number.as_ref().and_then(|_| self.serial_number.take());
                *self = Known {
                    serial_number,
                    basis: Basis::Fingerprint,
                    fits: fingerprint,
                    assigned: self.assigned,
                    ..Known::default()
                };
            }
            _ => self.fits = self.fits.narrowed_to(declaring).narrowed_to(fingerprint),
        }
    }

    /// Tells whether the device may be of a kind that obeys the exchange.
    pub(super) fn may_obey(&self, exchange: &Exchange<'_>) -> bool {
        let is_assigned = self.assigned.is_some_and(|device| exchange.declaring.contains(device));
        is_assigned || self.basis == Basis::SerialNumber || !self.fits.and(exchange.declaring).is_empty()
    }

    /// Gives away what was learnt, when the device leaves the address.
    pub(super) fn leave(&mut self) -> Known {
        let moved = std::mem::take(self);
        self.assigned = moved.assigned;
        moved
    }

    /// Takes what was learnt at another address; what the user said about this one stays.
    pub(super) fn arrive(&mut self, moved: Known) {
        *self = Known { assigned: self.assigned.or(moved.assigned), ..moved };
    }
}
