//! D: what is written: calibration, settings, addresses and clocks.

use super::bus::{Bus, Kept, Mark};
use super::catalogue::{D10, D11, D13, D14, D18, D20, V04};
use super::finding::Finding;
use super::verifier::Found;
use crate::decode::frame::Role;
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::device::{Command, Encoding, Field, Kind, Meaning, Order, Value};

/// How often the same has to be written to be said.
const REPEATED: u32 = 3;
/// Settings remembered of a unit.
const MOST_KEPT: usize = 32;

/// Judges what is written, and remembers what is read and written.
pub(super) fn transaction(t: &Transaction<'_>, meaning: &Meaning<'_>, bus: &mut Bus, found: &mut Found) {
    let (Some(register), Some(request)) = (t.start_register, t.request.filter(|side| !side.damaged)) else {
        return;
    };
    let Some(command) = meaning.agreed_command() else { return };
    if bus.shapes.is_service_address(t.address) {
        return; // no single device answers there
    }
    if command.function == 16 && t.outcome != Outcome::Broadcast && !command.request.is_empty() {
        let write = Write { t, command, register, request, meaning };
        write.judge(bus, found);
    } else if t.outcome == Outcome::Answered && is_writable(meaning, bus, register) {
        read_back(t, command, register, meaning, bus, found);
    }
}

/// Returns the address that a write gives a device, when it is one.
pub(super) fn new_address(meaning: &Meaning<'_>) -> Option<u8> {
    let mut fields = meaning.fields().filter(|field| field.side == Role::Request);
    let value = fields.find(|field| field.name == "new_address")?.value;
    value.as_f64().filter(|address| (1.0..=247.0).contains(address)).map(|address| address as u8)
}

/// Tells whether what is read at a register can also be written.
fn is_writable(meaning: &Meaning<'_>, bus: &Bus, register: u16) -> bool {
    let writes = |command: &Command| command.key() == (16, register);
    match meaning.profile() {
        Some(profile) => profile.commands.iter().any(writes),
        None => bus.commands().any(|(_, command)| writes(command)),
    }
}

/// Joins the fields of one side to a text.
fn text(meaning: &Meaning<'_>, side: Role) -> String {
    let fields = meaning.fields().filter(|field| field.side == side);
    let fields: Vec<String> = fields.map(|field| format!("{} {}", field.name, field.value)).collect();
    fields.join(", ")
}

/// Is a write of values.
struct Write<'a> {
    t: &'a Transaction<'a>,
    command: &'a Command,
    register: u16,
    request: Side<'a>,
    meaning: &'a Meaning<'a>,
}

impl Write<'_> {
    fn judge(&self, bus: &mut Bus, found: &mut Found) {
        let swapped = self.swapped();
        let is_swapped = swapped.is_some();
        found.extend(swapped);
        let new = text(self.meaning, Role::Request);
        let kept = bus.unit(self.t.address).kept.iter().find(|kept| kept.register == self.register).cloned();
        match self.command.kind {
            Kind::Calibration => {
                // A write of nothing changes nothing.
                found.extend((!new.is_empty()).then(|| self.calibration(kept.as_ref(), &new)));
                found.extend(self.implausible().filter(|_| !is_swapped));
            }
            Kind::Address => found.extend(self.address().filter(|_| !is_swapped)),
            Kind::Clock => found.extend(self.clock()),
            _ => {}
        }
        if !matches!(self.t.outcome, Outcome::Answered | Outcome::Late | Outcome::Damaged) {
            return;
        }
        let is_kept = matches!(self.command.kind, Kind::Calibration | Kind::Setting);
        let same = kept.as_ref().filter(|kept| kept.text == new).map_or(0, |kept| kept.writes);
        let writes = same.saturating_add(1);
        if is_kept && !new.is_empty() && writes >= REPEATED {
            let message = format!("{} wrote {new} {writes} times in a row", self.command.name);
            found.push_back(self.finding(&D20, message));
        }
        keep(
            bus,
            self.t.address,
            Kept { register: self.register, text: new, mark: Mark::of(&self.request), writes },
        );
    }

    fn finding(&self, rule: &'static super::Rule, message: String) -> Finding {
        let time = self.request.time.map(|time| time.end.midpoint());
        let data = 7..self.request.bytes.len().saturating_sub(2).max(7);
        Finding::new(rule, time, message)
            .at(self.t.address)
            .about(self.register)
            .shown_by([self.request.id])
            .within(data)
    }

    fn fields(&self) -> impl Iterator<Item = Field<'_>> {
        self.meaning.fields().filter(|field| field.side == Role::Request)
    }

    fn calibration(&self, kept: Option<&Kept>, new: &str) -> Finding {
        let old = match kept {
            Some(kept) => format!("{} was known before (frame {})", kept.text, kept.mark.id),
            None => "what it was before was not read".to_owned(),
        };
        let answer = if self.t.outcome == Outcome::NoResponse { "; not acknowledged" } else { "" };
        self.finding(&D10, format!("{} wrote {new}; {old}{answer}", self.command.name))
    }

    fn implausible(&self) -> Option<Finding> {
        let field = self.fields().find(Field::is_implausible)?;
        let message = format!("{} wrote {} {field}", self.command.name, field.name);
        let finding = self.finding(&D11, message);
        Some(finding.within(field.span.clone()))
    }

    /// Finds a value that makes sense only in another byte order.
    fn swapped(&self) -> Option<Finding> {
        self.fields().find_map(|field| {
            let bytes = self.request.bytes.get(field.span.start..)?;
            let (meant, span) = meant(&field, bytes)?;
            let message = format!(
                "{} wrote {} {}; in the other byte order it is {meant}",
                self.command.name, field.name, field.value
            );
            Some(self.finding(&D13, message).within(field.span.start..field.span.start + span))
        })
    }

    fn address(&self) -> Option<Finding> {
        let field = self.fields().find(|field| field.name == "new_address")?;
        if field.value.as_f64().is_some_and(|address| (1.0..=247.0).contains(&address)) {
            return None;
        }
        let message = format!("a device is to have the address {}", field.value);
        Some(self.finding(&D14, message).within(field.span.clone()))
    }

    fn clock(&self) -> Option<Finding> {
        let field =
            self.fields().find(|field| field.spec.encoding == Encoding::BcdTime && field.value.is_null())?;
        Some(self.finding(&D18, format!("the clock is to show what is {field}")).within(field.span.clone()))
    }
}

/// Returns what a written value is worth in the byte order in which alone it makes sense, and how many bytes show it.
fn meant(field: &Field<'_>, bytes: &[u8]) -> Option<(String, usize)> {
    match (field.spec.encoding, &field.value) {
        // Least significant byte first: 00 1E is 7680, where 30 was meant.
        (Encoding::Integer { size: 2, order: Order::Little, .. }, Value::Integer(_)) => match bytes {
            [0, high, ..] if *high != 0 => Some((high.to_string(), 2)),
            _ => None,
        },
        // The address is in the first byte, the second is reserved.
        (Encoding::Integer { size: 1, .. }, Value::Integer(0)) => match bytes {
            [0, low @ 1..=247, ..] if field.name == "new_address" => Some((low.to_string(), 2)),
            _ => None,
        },
        (Encoding::Float32(order), value) => {
            let &[a, b, c, d, ..] = bytes else { return None };
            let is_odd = match value.as_f64() {
                None => true,
                Some(value) => value != 0.0 && !(1e-6..1e9).contains(&value.abs()),
            };
            let orders = [
                (Order::Big, [a, b, c, d]),
                (Order::BigSwapped, [c, d, a, b]),
                (Order::LittleSwapped, [b, a, d, c]),
            ];
            let others = orders
                .into_iter()
                .filter(|(other, _)| *other != order)
                .map(|(_, bytes)| f32::from_be_bytes(bytes));
            let is_sound = |number: &f32| {
                let range = field.spec.range.unwrap_or((-1e6, 1e6));
                number.is_normal()
                    && number.abs() >= 1e-4
                    && (range.0..=range.1).contains(&f64::from(*number))
            };
            let sound = others.filter(|_| is_odd).find(is_sound)?;
            Some((sound.to_string(), 4))
        }
        _ => None,
    }
}

/// Compares what is read with what was known, and remembers it.
fn read_back(
    t: &Transaction<'_>,
    command: &Command,
    register: u16,
    meaning: &Meaning<'_>,
    bus: &mut Bus,
    found: &mut Found,
) {
    let Some(response) = t.response.filter(|side| !side.damaged) else { return };
    let new = text(meaning, Role::Response);
    if new.is_empty() {
        return;
    }
    let kept = bus.unit(t.address).kept.iter().find(|kept| kept.register == register).cloned();
    let is_default =
        |field: &Field<'_>| field.spec.default.is_some_and(|it| field.value.as_f64() == Some(it));
    let is_back = meaning.fields().any(|field| field.side == Role::Response && is_default(&field));
    if let Some(kept) = kept.as_ref().filter(|kept| kept.text != new && is_back)
        && !bus.may_hide(kept.mark.id, response.id)
    {
        let message = format!(
            "{} brought {new}, the default; it was {} before, and nobody wrote it since",
            command.name, kept.text
        );
        let time = response.time.map(|time| time.end.midpoint());
        let finding = Finding::new(&V04, time, message).at(t.address).about(register);
        found.push_back(finding.shown_by([kept.mark.id, response.id]));
    }
    let writes = kept.filter(|kept| kept.text == new).map_or(0, |kept| kept.writes);
    keep(bus, t.address, Kept { register, text: new, mark: Mark::of(&response), writes });
}

fn keep(bus: &mut Bus, address: u8, new: Kept) {
    let kept = &mut bus.unit_mut(address).kept;
    match kept.iter().position(|kept| kept.register == new.register) {
        Some(at) => kept[at] = new, // just found there
        None if kept.len() < MOST_KEPT => kept.push(new),
        None => {}
    }
}
