//! V: what a device says.

use std::collections::BTreeMap;

use super::bus::{Bus, Mark, kind};
use super::catalogue::{V01, V02, V03, V04};
use super::finding::Finding;
use super::line::seconds;
use super::verifier::Found;
use crate::decode::frame::Role;
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::device::{Encoding, Field, Kind, Meaning, Value};
use crate::time::{SECOND, Timestamp};

/// The field of a device's own error flag, the same in every profile.
const ERROR_FLAG: &str = "error_flag";
/// How often in a row a value has to be the same, and how often another has to move meanwhile.
const FROZEN: (u32, u32) = (30, 10);
/// Nanoseconds after a brush start within which silence tells of the supply.
const BRUSH_NS: i64 = 30 * SECOND;
/// Seconds by which a clock may differ from the listener's progress.
const CLOCK_SLACK: i64 = 60;
/// Values watched at most: address, register and place.
const MOST_VALUES: usize = 4096;

/// Is a value that is watched.
#[derive(Clone, Copy, Debug, Default)]
struct Watched {
    bits: u32,
    /// How often it was the same as before, and how often another of the same answer moved meanwhile.
    same: u32,
    others: u32,
}

/// Judges what devices say.
#[derive(Clone, Debug, Default)]
pub(super) struct ValueRules {
    watched: BTreeMap<(u8, u16, usize), Watched>,
    /// The clock of each unit: what it showed in seconds, and when.
    clocks: BTreeMap<u8, (i64, Timestamp, Mark)>,
}

impl ValueRules {
    pub(super) fn transaction(
        &mut self,
        t: &Transaction<'_>,
        meaning: &Meaning<'_>,
        bus: &Bus,
        is_explained: bool,
        found: &mut Found,
    ) {
        match t.outcome {
            Outcome::NoResponse if is_explained => {}
            Outcome::NoResponse => found.extend(silent_after_brush(t, bus)),
            Outcome::Answered | Outcome::Late => {
                if kind(meaning) == Kind::Clock {
                    self.clocks.remove(&t.address);
                }
                if let Some(response) = t.response.filter(|side| !side.damaged) {
                    self.response(t, meaning, &response, bus, found);
                }
            }
            _ => {}
        }
    }

    fn response(
        &mut self,
        t: &Transaction<'_>,
        meaning: &Meaning<'_>,
        response: &Side<'_>,
        bus: &Bus,
        found: &mut Found,
    ) {
        let register = t.start_register.unwrap_or(0);
        let finding = |rule, message: String, field: &Field<'_>| {
            let time = response.time.map(|time| time.end.midpoint());
            let frames = t.request.map(|side| side.id).into_iter().chain([response.id]);
            let subject = u32::from(register) << 8 | field.span.start as u32 & 0xFF; // a frame has 256 bytes at most
            Finding::new(rule, time, message)
                .at(t.address)
                .about(subject)
                .shown_by(frames)
                .within(field.span.clone())
        };
        let mut moved = 0_u64;
        let mut quantities = 0_u32;
        for (index, field) in meaning.fields().filter(|field| field.side == Role::Response).enumerate() {
            if field.name == ERROR_FLAG && matches!(field.value, Value::Integer(flag) if flag != 0) {
                let flag = finding(&V01, format!("the device reports: {field}"), &field);
                let Value::Integer(value) = field.value else { continue };
                found.push_back(Finding { subject: value as u32, ..flag });
            }
            if field.is_quantity {
                if field.is_implausible() {
                    found.push_back(finding(&V02, format!("{} {field}", field.name), &field));
                }
                quantities += 1;
                let is_moved = self.watch(t.address, register, &field, response.bytes);
                moved |= u64::from(is_moved) << index.min(63);
            } else if field.spec.encoding == Encoding::BcdTime {
                found.extend(self.clock(t, &field, response, bus));
            }
        }
        if (moved.count_ones()) < quantities {
            self.frozen(t, meaning, register, moved, finding, found);
        }
    }

    /// Compares a value's bits with those before; tells whether they moved.
    fn watch(&mut self, address: u8, register: u16, field: &Field<'_>, bytes: &[u8]) -> bool {
        let key = (address, register, field.span.start);
        if self.watched.len() >= MOST_VALUES && !self.watched.contains_key(&key) {
            return false;
        }
        let bits = bytes.get(field.span.clone()).unwrap_or_default();
        let bits = bits.iter().fold(0_u32, |bits, byte| bits << 8 | u32::from(*byte));
        let watched = self.watched.entry(key).or_default();
        if watched.bits == bits {
            watched.same = watched.same.saturating_add(1);
            return false;
        }
        *watched = Watched { bits, same: 0, others: 0 };
        true
    }

    /// Finds values that stay while others of the same answer move.
    fn frozen(
        &mut self,
        t: &Transaction<'_>,
        meaning: &Meaning<'_>,
        register: u16,
        moved: u64,
        finding: impl Fn(&'static super::Rule, String, &Field<'_>) -> Finding,
        found: &mut Found,
    ) {
        if moved == 0 {
            return;
        }
        for field in meaning.fields().filter(|field| field.side == Role::Response && field.is_quantity) {
            let Some(watched) = self.watched.get_mut(&(t.address, register, field.span.start)) else {
                continue;
            };
            if watched.same == 0 || watched.bits == 0 {
                continue; // 0 is a probe that is not fitted
            }
            let was_said = watched.others >= FROZEN.1 && watched.same > FROZEN.0;
            watched.others = watched.others.saturating_add(1);
            if !was_said && watched.others >= FROZEN.1 && watched.same >= FROZEN.0 {
                let message = format!(
                    "{} has been {field} for {} reads, while others moved",
                    field.name,
                    watched.same + 1
                );
                found.push_back(finding(&V03, message, &field));
            }
        }
    }

    /// Compares a clock's progress with the listener's.
    fn clock(
        &mut self,
        t: &Transaction<'_>,
        field: &Field<'_>,
        response: &Side<'_>,
        bus: &Bus,
    ) -> Option<Finding> {
        let Value::Text(text) = &field.value else { return None };
        let (shown, now) = (clock_seconds(text)?, response.time?.end.midpoint());
        let before = self.clocks.insert(t.address, (shown, now, Mark::of(response)));
        let (shown_before, then, mark) = before?;
        let jump = (shown - shown_before).saturating_sub((now - then) / SECOND);
        if jump.abs() <= CLOCK_SLACK || bus.may_hide(mark.id, response.id) {
            return None;
        }
        let message = format!("the clock shows {text}: it jumped by {jump} s, and nobody set it");
        let finding = Finding::new(&V04, Some(now), message).at(t.address).about(1_u8);
        Some(finding.shown_by([mark.id, response.id]).within(field.span.clone()))
    }
}

/// Returns the seconds of a time such as `2016-04-26T13:05:17` since 1970.
fn clock_seconds(text: &str) -> Option<i64> {
    let time = chrono::NaiveDateTime::parse_from_str(text, "%Y-%m-%dT%H:%M:%S").ok()?;
    Some(time.and_utc().timestamp())
}

/// Finds silence right after a brush was started by a unit that answered before.
fn silent_after_brush(t: &Transaction<'_>, bus: &Bus) -> Option<Finding> {
    let (request, unit) = (t.request?, bus.unit(t.address));
    let brush = unit.brush.filter(|brush| brush.id < request.id)?;
    let after = brush.time?.end.until(request.time?.start);
    let answered_since = unit.last_answer.is_some_and(|answer| answer.id > brush.id);
    if after.most > BRUSH_NS
        || answered_since
        || bus.tally(t).answered == 0 // it may not know it
        || bus.may_hide(brush.id, request.id)
        || bus.is_damaged_after(request.id)
    {
        return None;
    }
    let message =
        format!("silent {} after the brush was started, having answered before", seconds(after.midpoint()));
    let time = request.time.map(|time| time.end.midpoint());
    Some(Finding::new(&V04, time, message).at(t.address).about(0_u8).shown_by([brush.id, request.id]))
}
