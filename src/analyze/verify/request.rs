//! D: whether a device's manual has what is asked: function, register, quantity, form.

use super::bus::Bus;
use super::catalogue::{D01, D02, D03, D04, D09, D12, D19};
use super::finding::{Finding, Rule};
use super::line::end;
use super::verifier::Found;
use crate::decode::crc::Register;
use crate::decode::frame::{Damaged, Role};
use crate::decode::shape::Form;
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::{Command, Kind, Meaning, Profile};

/// How often a start has to stay unanswered, by a unit that answers others, to be that of another kind of device.
const SURE: u32 = 2;

/// Judges a request.
pub(super) fn transaction(t: &Transaction<'_>, meaning: &Meaning<'_>, bus: &Bus, found: &mut Found) {
    let Some(request) = t.request.filter(|side| !side.damaged) else { return };
    let (Some(register), true) = (t.start_register, t.address != 0) else { return };
    let asked = Asked { t, register, bus };
    let verdict = match meaning.profile() {
        Some(profile) => asked.of(profile),
        None => asked.of_unknown(meaning),
    };
    let Some(Verdict { rule, message, span }) = verdict else { return };
    let time = request.time.map(|time| time.end.midpoint());
    let finding = Finding::new(rule, time, message).at(t.address).about(register).within(span);
    found.push_back(finding.shown_by([request.id]));
}

/// Is what is wrong with a request.
struct Verdict {
    rule: &'static Rule,
    message: String,
    span: std::ops::Range<usize>,
}

impl Verdict {
    fn new(rule: &'static Rule, span: std::ops::Range<usize>, message: String) -> Option<Verdict> {
        Some(Verdict { rule, message, span })
    }
}

/// Is a request that names a register.
struct Asked<'a> {
    t: &'a Transaction<'a>,
    register: u16,
    bus: &'a Bus,
}

impl Asked<'_> {
    fn function(&self) -> u8 {
        self.t.function.0
    }

    /// Judges a request to a device that is known.
    fn of(&self, profile: &Profile) -> Option<Verdict> {
        if let Some(command) = profile.command(self.function(), self.register) {
            return self.quantity(command);
        }
        self.split(profile)
            .or_else(|| self.function_of(profile.commands.iter()))
            .or_else(|| self.other_start(&profile.id))
            .or_else(|| self.beside(profile.commands.iter()))
            .or_else(|| {
                let message = format!("{} is not in the profile of {}", self.text(), profile.id);
                Verdict::new(&D04, 2..4, message)
            })
    }

    /// Judges a request to a device that is not known: only when nobody has it, and nobody answers.
    fn of_unknown(&self, meaning: &Meaning<'_>) -> Option<Verdict> {
        if self.t.outcome != Outcome::NoResponse {
            return None;
        }
        let is_declared =
            self.bus.commands().any(|(_, command)| command.key() == (self.function(), self.register));
        if is_declared {
            let tally = self.bus.tally(self.t);
            let is_refused = tally.answered == 0 && tally.unanswered >= SURE;
            let is_alive = self.bus.unit(self.t.address).answered > 0;
            let is_start = meaning.agreed_command().is_some_and(|command| command.kind == Kind::Start);
            return if is_refused && is_alive && is_start { self.other_start("this device") } else { None };
        }
        let all = || self.bus.commands().map(|(_, command)| command);
        self.function_of(all()).or_else(|| self.beside(all()))
    }

    /// Finds a quantity that no variant of the command takes.
    fn quantity(&self, command: &Command) -> Option<Verdict> {
        let quantity = self.t.quantity.filter(|quantity| !command.quantities.contains(quantity))?;
        let takes: Vec<String> = command.quantities.iter().map(u16::to_string).collect();
        let message = format!("{} takes {} registers, not {quantity}", command.name, takes.join(" or "));
        if command.kind == Kind::Calibration && quantity > 0 {
            return Verdict::new(&D12, 4..6, format!("{message}: what belongs together is written in parts"));
        }
        Verdict::new(&D03, 4..6, message)
    }

    /// Finds a part of a calibration that has to be written whole.
    fn split(&self, profile: &Profile) -> Option<Verdict> {
        let whole = profile.commands.iter().find(|command| {
            let registers = u32::from(command.quantities.last().copied().unwrap_or(0));
            let (first, own) = (u32::from(command.start_register), u32::from(self.register));
            command.kind == Kind::Calibration
                && self.t.quantity != Some(0)
                && command.function == self.function()
                && (first..first + registers).contains(&own)
        })?;
        let message = format!("{} writes a part of {}, which belongs together", self.text(), whole.name);
        Verdict::new(&D12, 2..6, message)
    }

    /// Finds a register that is served with another function.
    fn function_of<'c>(&self, mut commands: impl Iterator<Item = &'c Command>) -> Option<Verdict> {
        let is_write = matches!(self.function(), 5 | 6 | 15 | 16);
        let served = commands.find(|command| {
            let same_way = is_write == matches!(command.function, 6 | 16);
            command.start_register == self.register && command.function != self.function() && same_way
        })?;
        let message =
            format!("{} asks for {}, which takes function {}", self.text(), served.name, served.function);
        Verdict::new(&D01, 1..2, message)
    }

    /// Finds the start of another kind of device.
    fn other_start(&self, device: &str) -> Option<Verdict> {
        let starts = |command: &Command| command.kind == Kind::Start;
        let (profile, _) = self
            .bus
            .commands()
            .find(|(_, command)| starts(command) && command.key() == (self.function(), self.register))?;
        let own =
            self.bus.profiles.get(device).and_then(|own| own.commands.iter().find(|command| starts(command)));
        let instead = match own {
            Some(own) => format!("is started with FC{:02} 0x{:04x}", own.function, own.start_register),
            None => "has no start".to_owned(),
        };
        let message = format!("{} starts {}; {device} {instead}", self.text(), profile.id);
        Verdict::new(&D09, 1..4, message)
    }

    /// Finds a command one register beside.
    fn beside<'c>(&self, mut commands: impl Iterator<Item = &'c Command>) -> Option<Verdict> {
        let meant = commands.find(|command| {
            command.function == self.function()
                && command.start_register.abs_diff(self.register) == 1
                && self.t.quantity.is_none_or(|quantity| command.quantities.contains(&quantity))
        })?;
        let answered =
            if self.t.outcome == Outcome::NoResponse { "nobody answered" } else { "values are shifted" };
        let message = format!(
            "{} is one beside {} at 0x{:04x}; {answered}",
            self.text(),
            meant.name,
            meant.start_register
        );
        Verdict::new(&D02, 2..4, message)
    }

    fn text(&self) -> String {
        let quantity = self.t.quantity.map_or_else(String::new, |quantity| format!(" ×{quantity}"));
        format!("FC{:02} 0x{:04x}{quantity}", self.function(), self.register)
    }
}

/// Judges a damaged run, or a frame, that may be a write of no register without its byte count; tells whether it is.
pub(super) fn missing_byte_count(damaged: &Damaged<'_>, bus: &Bus, found: &mut Found) -> bool {
    let place = &damaged.place;
    let &[address, 16, s1, s0, 0, 0, c1, c0] = place.bytes else { return false };
    let register = u16::from_be_bytes([s1, s0]);
    if !bus.has_family || !bus.declares(16, register, Form::ZeroQuantity) {
        return false;
    }
    let whole = [address, 16, s1, s0, 0, 0, 0];
    // Old sketches send the CRC of the whole frame, some that of the whole frame for another address.
    let fits = |address: u8| Register::NEW.after(&[address]).after(&whole[1..]).after(&[c1, c0]).is_zero();
    let Some(of) = [address].into_iter().chain(0..=247).find(|address| fits(*address)) else { return false };
    let which = if of == address { String::new() } else { format!(" to {of}") };
    let message = format!(
        "FC16 0x{register:04x} writes no register, and its byte count is missing; the CRC is that of a whole frame{which}"
    );
    let finding = Finding::new(&D19, end(place), message).at(address).about(register);
    found.push_back(finding.shown_by([place.id]).within(6..8));
    true
}

/// Judges a response that nobody asked for; tells whether it is a request without its byte count.
pub(super) fn looks_like_acknowledgement(t: &Transaction<'_>, bus: &Bus, found: &mut Found) -> bool {
    let Some(response) = t.response.filter(|side| !side.damaged) else { return false };
    let &[address, 16, s1, s0, 0, 0, _, _] = response.bytes else { return false };
    let register = u16::from_be_bytes([s1, s0]);
    let is_lone = response.id == 0 || !bus.is_damaged_after(response.id.saturating_sub(3));
    if !bus.has_family
        || t.outcome != Outcome::Unsolicited
        || !bus.declares(16, register, Form::ZeroQuantity)
        || !is_lone
    {
        return false;
    }
    let message = format!(
        "FC16 0x{register:04x} writes no register, and its byte count is missing: nobody asked for an answer like this"
    );
    let time = response.time.map(|time| time.end.midpoint());
    let finding = Finding::new(&D19, time, message).at(address).about(register);
    found.push_back(finding.shown_by([response.id]).within(6..8));
    true
}

/// Returns how many bytes the answer to a request has, for the functions of which it is known.
pub(super) fn expected_answer(request: &[u8]) -> Option<usize> {
    let quantity = usize::from(crate::decode::pdu::quantity(request, Role::Request).unwrap_or(0));
    Some(match (request.first()?, request.get(1)?) {
        (0, _) => return None,
        (_, 1 | 2) => 5 + quantity.div_ceil(8),
        // A command by a read of one register or none is acknowledged with two bytes or none.
        (_, 3 | 4) => 5 + 2 * quantity.max(1),
        (_, 5 | 6 | 15 | 16) => 8,
        _ => return None,
    })
}
