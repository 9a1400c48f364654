//! M: what the specification asks of a request.

use super::bus::Bus;
use super::catalogue::{M01, M02, M03};
use super::finding::Finding;
use super::verifier::Found;
use crate::decode::frame::Damaged;
use crate::decode::shape::Form;
use crate::decode::transaction::{Outcome, Transaction};

/// Judges a request that became a transaction.
pub(super) fn transaction(t: &Transaction<'_>, bus: &Bus, found: &mut Found) {
    let Some(request) = t.request.filter(|side| !side.damaged) else { return };
    let function = t.function.0;
    let end = request.time.map(|time| time.end.midpoint());
    if t.outcome == Outcome::Broadcast && is_read(function) {
        let message = format!("{} was sent to address 0, where nobody answers", t.function);
        let finding = Finding::new(&M02, end, message).at(0).about(function);
        found.push_back(finding.shown_by([request.id]).within(0..1));
    }
    let (Some(register), Some(quantity)) = (t.start_register, t.quantity) else { return };
    if quantity == 0 && !bus.declares(function, register, Form::ZeroQuantity) {
        found.push_back(out_of_range(function, register, quantity, end).at(t.address).shown_by([request.id]));
    }
}

/// Judges a run that the framer took for no frame; tells whether it is one all the same, but for its header.
pub(super) fn damaged(damaged: &Damaged<'_>, found: &mut Found) -> bool {
    let place = &damaged.place;
    let &[address, function, s1, s0, q1, q0, ref rest @ ..] = place.bytes else { return false };
    let (register, quantity) = (u16::from_be_bytes([s1, s0]), u16::from_be_bytes([q1, q0]));
    let end = place.time.map(|time| time.end.midpoint());
    let finding = match (function, rest) {
        (1..=4, [_, _]) if quantity > most(function) => out_of_range(function, register, quantity, end),
        (15 | 16, [..]) if quantity > most(function) => out_of_range(function, register, quantity, end),
        (16, [count, ..]) if usize::from(*count) != 2 * usize::from(quantity) => {
            let message =
                format!("FC16 0x{register:04x} writes {quantity} registers and counts {count} bytes");
            Finding::new(&M03, end, message).within(4..7)
        }
        _ => return false,
    };
    found.push_back(finding.at(address).about(register).shown_by([place.id]));
    true
}

fn out_of_range(function: u8, register: u16, quantity: u16, end: Option<crate::time::Timestamp>) -> Finding {
    let message = format!(
        "FC{function:02} 0x{register:04x} names a quantity of {quantity}; 1 to {} is allowed",
        most(function)
    );
    Finding::new(&M01, end, message).about(register).within(4..6)
}

/// Returns the largest quantity of a function (Modbus application protocol V1.1b3, 6.1 to 6.4, 6.11, 6.12).
fn most(function: u8) -> u16 {
    match function {
        1 | 2 => 2000,
        15 => 1968,
        16 => 123,
        _ => 125,
    }
}

fn is_read(function: u8) -> bool {
    matches!(function, 1..=4 | 7 | 11 | 12 | 17 | 20 | 23 | 24 | 43)
}
