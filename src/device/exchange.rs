//! What an accepted exchange tells about the device that answered.

use std::borrow::Cow;

use crate::decode::frame::Role;
use crate::decode::transaction::{Outcome, Transaction};

use super::data::data;
use super::field::Field;
use super::profile::{Command, NEW_ADDRESS, SERIAL_NUMBER, TYPE_BYTE, Verdict};
use super::registry::{Entry, Profiles, Set};
use super::value::Value;

/// Unit addresses that a device can have (Modbus serial line V1.02, 2.2).
const DEVICE_ADDRESSES: std::ops::RangeInclusive<i64> = 1..=247;

/// Is a request that a device accepted, and what it tells.
pub(super) struct Exchange<'a> {
    profiles: &'a Profiles,
    /// The profiles that declare its function and start register, whatever the quantity: Yosemitech's probes answer
    /// counts that their manuals do not have.
    pub(super) declaring: Set,
    /// Those of which it is a fingerprint.
    pub(super) fingerprint: Set,
    pub(super) serial_number: Option<SerialNumber<'a>>,
    /// The address that the device has been given.
    pub(super) new_address: Option<u8>,
}

/// Is a serial number that a device sent.
pub(super) struct SerialNumber<'a> {
    pub(super) text: &'a str,
    /// The byte before it.
    type_byte: Option<u8>,
}

impl<'a> Exchange<'a> {
    /// Reads what an accepted transaction tells.
    ///
    /// Without an entry no profile declares its function and start register.
    pub(super) fn read(profiles: &'a Profiles, entry: Option<&'a Entry>, t: &Transaction<'a>) -> Self {
        let declaring = entry.map(|entry| entry.declaring).unwrap_or_default();
        let none = Set::default();
        let mut exchange =
            Exchange { profiles, declaring, fingerprint: none, serial_number: None, new_address: None };
        if let Some(entry) = entry.filter(|entry| entry.is_telling) {
            exchange.look_closer(entry, t);
        }
        exchange
    }

    fn look_closer(&mut self, entry: &'a Entry, t: &Transaction<'a>) {
        for declared in entry.among(entry.declaring) {
            let Some(command) = self.profiles.command(declared) else { continue };
            if command.is_fingerprint && is_as_declared(command, t) {
                self.fingerprint.insert(declared.profile);
            }
            let serial_number = || SerialNumber::read(command, t);
            self.serial_number = self.serial_number.take().or_else(serial_number);
            let new_address = || new_address(command, t);
            self.new_address = self.new_address.or_else(new_address);
        }
    }

    /// Returns the profiles that claim the serial number, and those that deny it.
    pub(super) fn judge(&self, serial_number: &SerialNumber<'_>) -> (Set, Set) {
        let (mut claiming, mut denying) = (Set::default(), Set::default());
        for (index, profile) in self.profiles.iter().enumerate() {
            let rule = profile.serial_number.as_ref();
            match rule.map(|rule| rule.judge(serial_number.text, serial_number.type_byte)) {
                Some(Verdict::Claims(_)) => claiming.insert(index),
                Some(Verdict::Denies) => denying.insert(index),
                Some(Verdict::Silent) | None => {}
            }
        }
        (claiming, denying)
    }

    /// Returns the type code by which a profile claims the serial number.
    pub(super) fn type_code(&self, device: usize) -> Option<&'a str> {
        let serial_number = self.serial_number.as_ref()?;
        let rule = self.profiles.at(device)?.serial_number.as_ref()?;
        match rule.judge(serial_number.text, serial_number.type_byte) {
            Verdict::Claims(code) => Some(code),
            Verdict::Denies | Verdict::Silent => None,
        }
    }
}

impl<'a> SerialNumber<'a> {
    /// Reads the serial number of a response; `None` when there is none, or it is no text.
    fn read(command: &'a Command, t: &Transaction<'a>) -> Option<Self> {
        let type_byte = match field(command, t, Role::Response, TYPE_BYTE) {
            Some(Value::Integer(byte)) => u8::try_from(byte).ok(),
            _ => None,
        };
        match field(command, t, Role::Response, SERIAL_NUMBER)? {
            Value::Text(Cow::Borrowed(text)) if !text.is_empty() => Some(SerialNumber { text, type_byte }),
            _ => None,
        }
    }
}

fn new_address(command: &Command, t: &Transaction<'_>) -> Option<u8> {
    let address = field(command, t, Role::Request, NEW_ADDRESS)?;
    let Value::Integer(address) = address else { return None };
    DEVICE_ADDRESSES.contains(&address).then_some(address as u8)
}

fn field<'a>(command: &'a Command, t: &Transaction<'a>, side: Role, name: &str) -> Option<Value<'a>> {
    let mut specs = command.fields(side).iter().filter(|spec| &*spec.name == name).peekable();
    specs.peek()?; // most commands have none: spare the rest
    let (start, data) = data(t, side)?;
    specs.find_map(|spec| Field::read(spec, side, data, start)).map(|field| field.value)
}

/// Tells whether a device accepted the request; a damaged side has an outcome of its own.
pub(crate) fn is_accepted(t: &Transaction<'_>) -> bool {
    matches!(t.outcome, Outcome::Answered | Outcome::Late) && t.request.is_some() && t.response.is_some()
}

/// Tells whether quantity and response are as a profile declares them.
fn is_as_declared(command: &Command, t: &Transaction<'_>) -> bool {
    let accepts = t.quantity.is_some_and(|quantity| command.quantities.contains(&quantity));
    let asked = 2 * usize::from(t.quantity.unwrap_or(0));
    accepts
        && (!matches!(command.function, 3 | 4)
            || data(t, Role::Response).is_some_and(|(_, data)| data.len() == asked))
}
