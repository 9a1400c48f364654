//! Where serial numbers lie, by any profile: for whoever wants them blanked.

use std::ops::Range;

use crate::decode::frame::Role;
use crate::decode::transaction::Transaction;

use super::data::data;
use super::profile::{Command, SERIAL_NUMBER};
use super::registry::Profiles;

impl Profiles {
    /// Returns where the good frames of a transaction hold serial numbers, counted from the address byte.
    ///
    /// Every profile is asked, whatever the device is taken for; what is cut off counts as far as it is there.
    pub fn serial_numbers(&self, t: &Transaction<'_>) -> Vec<(Role, Range<usize>)> {
        let mut spans = Vec::new();
        for side in [Role::Request, Role::Response] {
            let Some((start, data)) = data(t, side) else { continue };
            let fields = self.commands_of(t).flat_map(|command| command.fields(side));
            for spec in fields.filter(|spec| &*spec.name == SERIAL_NUMBER) {
                let span = spec.span();
                let (from, to) = (span.start.min(data.len()), span.end.min(data.len()));
                // A field that is whole and yet not there is ruled out by its condition.
                let is_cut = span.end > data.len();
                if from < to && (is_cut || spec.bytes(data).is_some()) {
                    spans.push((side, start + from..start + to)); // both within a frame
                }
            }
        }
        spans
    }

    /// Tells whether a device's answer holds a serial number, by any profile.
    pub fn asks_for_serial_number(&self, t: &Transaction<'_>) -> bool {
        self.commands_of(t).any(|command| command.field(Role::Response, SERIAL_NUMBER).is_some())
    }

    fn commands_of(&self, t: &Transaction<'_>) -> impl Iterator<Item = &Command> {
        let key = t.start_register.map(|register| (t.function.0, register));
        let commands = self.iter().flat_map(|profile| &profile.commands);
        commands.filter(move |command| Some(command.key()) == key)
    }

    /// Returns how many bytes at the start of a serial number tell the maker and the kind of device.
    pub fn telling_part(&self, serial_number: &[u8]) -> usize {
        let rules = self.iter().filter_map(|profile| profile.serial_number.as_ref());
        let lengths = rules.filter_map(|rule| {
            let rest = serial_number.strip_prefix(rule.prefix.as_bytes())?;
            let codes = rule.type_codes.iter().filter(|code| rest.starts_with(code.as_bytes()));
            Some(rule.prefix.len() + codes.map(|code| code.len()).max().unwrap_or(0))
        });
        lengths.max().unwrap_or(0)
    }

    /// Returns what the serial numbers of each maker begin with.
    pub fn serial_number_prefixes(&self) -> impl Iterator<Item = &str> {
        let rules = self.iter().filter_map(|profile| profile.serial_number.as_ref());
        rules.map(|rule| &*rule.prefix).filter(|prefix| !prefix.is_empty())
    }
}
