//! D: addresses: given up, reserved for service, or for all.

use super::bus::{Asked, Bus};
use super::catalogue::{D15, D16, D21, D22};
use super::finding::Finding;
use super::verifier::Found;
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::device::Meaning;
use crate::time::SECOND;

/// How often a service request has to be repeated for nothing.
const REPEATED: usize = 3;
/// Nanoseconds within which one who does not see the answer asks again.
const AGAIN_NS: i64 = 5 * SECOND;

pub(super) fn transaction(t: &Transaction<'_>, meaning: &Meaning<'_>, bus: &Bus, found: &mut Found) {
    let Some(request) = t.request.filter(|side| !side.damaged) else { return };
    let time = request.time.map(|time| time.end.midpoint());
    if bus.shapes.is_service_address(t.address) {
        found.extend(service(t, &request, bus));
    } else if t.outcome == Outcome::Broadcast && matches!(t.function.0, 5 | 6 | 15 | 16) {
        let what = meaning.command().unwrap_or("a write");
        let message = format!("{what} went to address 0, on which these devices never act");
        let finding = Finding::new(&D22, time, message).at(0).about(t.start_register.unwrap_or(0));
        found.push_back(finding.shown_by([request.id]).within(0..1));
    } else if t.outcome == Outcome::NoResponse {
        found.extend(old(t, &request, bus));
    }
}

/// Judges a request to the address at which every sensor answers.
fn service(t: &Transaction<'_>, request: &Side<'_>, bus: &Bus) -> impl Iterator<Item = Finding> {
    let time = request.time.map(|time| time.end.midpoint());
    let present = bus.present();
    let shared = (present > 1).then(|| {
        let message = format!("0x{:02X} was used while {present} devices are on the bus", t.address);
        Finding::new(&D16, time, message).at(t.address).shown_by([request.id]).within(0..1)
    });
    let answer = t.response.filter(|side| !side.damaged && t.outcome == Outcome::Answered);
    let ignored = answer.and_then(|answer| {
        let at = bus.requests.iter().position(|asked| asked.id == request.id)?;
        let mut later = request.time;
        let is_again = |asked: &&Asked| {
            let gap = asked.time.zip(later).map(|(asked, later)| asked.end.until(later.start).least);
            later = asked.time;
            asked.bytes == request.bytes && gap.is_none_or(|gap| gap <= AGAIN_NS)
        };
        let count = bus.requests.iter().take(at + 1).rev().take_while(is_again).count();
        let message = format!(
            "the same was asked at 0x{:02X} {count} times in a row, although it was answered",
            t.address
        );
        let end = answer.time.map(|time| time.end.midpoint());
        let finding = Finding::new(&D21, end, message).at(t.address);
        (count >= REPEATED).then(|| finding.shown_by([request.id, answer.id]))
    });
    shared.into_iter().chain(ignored)
}

/// Judges an unanswered request to an address that a device gave up, or to one that is mistaken for its new one.
fn old(t: &Transaction<'_>, request: &Side<'_>, bus: &Bus) -> Option<Finding> {
    let moved = bus.moved.filter(|moved| moved.mark.id < request.id)?;
    let unit = bus.unit(t.address);
    let is_elsewhere = unit.last_answer.is_some_and(|answer| answer.id > moved.mark.id);
    if is_elsewhere || bus.may_hide(moved.mark.id, request.id) {
        return None;
    }
    let (from, to) = (moved.from, moved.to);
    let confused = format!("{to:x}").parse() == Ok(t.address)
        || u8::from_str_radix(&to.to_string(), 16) == Ok(t.address);
    let message = if t.address == from {
        format!("the device at {from} has acknowledged the address {to}; {from} is still asked")
    } else if confused && unit.answered == 0 {
        format!(
            "{} was asked; the device has {to} (0x{to:02x}): decimal and hexadecimal may be confused",
            t.address
        )
    } else {
        return None;
    };
    let time = request.time.map(|time| time.end.midpoint());
    Some(Finding::new(&D15, time, message).at(t.address).shown_by([moved.mark.id, request.id]).within(0..1))
}
