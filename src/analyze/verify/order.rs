//! D: whether measurements are read when the device's manual has them read.
//!
//! What rests on order keeps silent where damage may hide the frame that matters.

use super::bus::{Bus, Mark, Measured, Unit, kind};
use super::catalogue::{D05, D06, D07, D08, D17};
use super::finding::{Finding, Rule};
use super::line::seconds;
use super::verifier::Found;
use crate::decode::frame::Role;
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::device::{Field, Kind, Meaning, Profile};
use crate::time::MILLISECOND;

/// How often in a row the data of reads have to be the same to show that nothing is measured.
const FROZEN: u32 = 9;
/// How often in a row everything but the temperature has to be 0 for the same.
const ZEROS: u32 = 3;
/// The field that is measured without a start, too, the same in every profile.
const TEMPERATURE: &str = "temperature";
/// Nanoseconds after which a master may have given up on an answer.
const SLOW_NS: i64 = 100 * MILLISECOND;
/// Which part of the manual's cycle is not yet too fast: clocks differ.
const TOLERANCE: (i64, i64) = (98, 100);

/// Judges a read of measurements, and remembers it.
pub(super) fn transaction(t: &Transaction<'_>, meaning: &Meaning<'_>, bus: &mut Bus, found: &mut Found) {
    let (Some(profile), Some(register), Kind::Measurement) =
        (meaning.profile(), t.start_register, kind(meaning))
    else {
        return;
    };
    let Some(request) = t.request.filter(|side| !side.damaged) else { return };
    remember(t, meaning, register, &request, bus);
    let read = Read { profile, t, request, register, unit: bus.unit(t.address), bus };
    let findings = [read.before_start(), read.too_early(), read.after_stop(), read.while_brushing()];
    found.extend(findings.into_iter().flatten());
    if let Some(previous) = read.unit.measured.filter(|_| t.outcome == Outcome::Answered) {
        let first = read.first_attempt(&previous);
        let is_doubtful = bus.is_damaged_between(previous.answered, request.id);
        let is_retry =
            (is_doubtful || previous.latency_ns > SLOW_NS) && read.is_within_cycle(&previous, &first);
        found.extend(read.too_fast(&previous, &first));
        bus.unit_mut(t.address).measured = Some(Measured {
            request: if is_retry { previous.request } else { first },
            is_doubtful,
            answered: request.id,
            register,
            latency_ns: t.latency.map_or(0, |latency| latency.least),
            ..previous
        });
    }
}

/// Counts how often the data stay the same.
fn remember(t: &Transaction<'_>, meaning: &Meaning<'_>, register: u16, request: &Side<'_>, bus: &mut Bus) {
    let Some([.., low, high]) = t.response.filter(|_| t.outcome == Outcome::Answered).map(|side| side.bytes)
    else {
        return;
    };
    let checksum = u16::from_le_bytes([*low, *high]);
    let is_zero = is_zero(meaning, bus.unit(t.address));
    let unit = bus.unit_mut(t.address);
    match &mut unit.measured {
        Some(last) if last.register == register => {
            if last.checksum == checksum {
                last.same = last.same.saturating_add(1);
            } else {
                (last.same, last.same_since) = (0, request.time);
            }
            last.checksum = checksum;
            last.zeros = if is_zero { last.zeros.saturating_add(1) } else { 0 };
        }
        // Far in the past: the first read follows none.
        _ => {
            unit.measured = Some(Measured {
                register,
                request: Mark { id: request.id, time: None },
                answered: request.id,
                checksum,
                same: 0,
                same_since: request.time,
                zeros: u32::from(is_zero),
                latency_ns: 0,
                is_doubtful: false,
            })
        }
    }
}

/// Tells whether nothing but a temperature was measured: everything else is 0.
fn is_zero(meaning: &Meaning<'_>, unit: &Unit) -> bool {
    if unit.start.is_some() || !meaning.profile().is_some_and(|profile| profile.measuring.needs_start) {
        return false; // nobody asks
    }
    let is_value = |field: &Field<'_>| field.side == Role::Response && field.is_quantity;
    let mut values = meaning.fields().filter(is_value).filter(|field| field.name != TEMPERATURE).peekable();
    values.peek().is_some() && values.all(|field| field.value.as_f64() == Some(0.0))
}

/// Is a read of measurements.
struct Read<'a> {
    profile: &'a Profile,
    t: &'a Transaction<'a>,
    request: Side<'a>,
    register: u16,
    unit: &'a Unit,
    bus: &'a Bus,
}

impl Read<'_> {
    fn finding(&self, rule: &'static Rule, since: Option<&Mark>, message: String) -> Finding {
        let time = self.request.time.map(|time| time.end.midpoint());
        let frames = since.map(|mark| mark.id).into_iter().chain([self.request.id]);
        Finding::new(rule, time, message).at(self.t.address).about(self.register).shown_by(frames)
    }

    /// Tells whether a frame that matters may be hidden since another.
    fn may_hide_since(&self, mark: &Mark) -> bool {
        self.bus.may_hide(mark.id, self.request.id)
    }

    fn before_start(&self) -> Option<Finding> {
        let unit = self.unit;
        let (measuring, measured) = (self.profile.measuring, unit.measured?);
        let has_started = unit.start.is_some() || unit.stop.is_some() || unit.starts_itself;
        if !measuring.needs_start || has_started || measured.register != self.register {
            return None;
        }
        if measured.zeros >= ZEROS {
            let message = format!("no start was seen, and {} reads in a row brought 0", measured.zeros);
            return Some(self.finding(&D05, None, message));
        }
        let span =
            measured.same_since.zip(self.request.time).map(|(from, to)| from.end.until(to.start).least);
        let due = measuring.cycle_ns.unwrap_or(0).saturating_mul(FROZEN.into());
        let is_frozen = measured.same >= FROZEN && span.is_none_or(|span| span >= due);
        let message =
            || format!("no start was seen, and {} reads in a row brought the same values", measured.same + 1);
        is_frozen.then(|| self.finding(&D05, None, message()))
    }

    fn too_early(&self) -> Option<Finding> {
        let (warm_up, start) = (self.profile.measuring.warm_up_ns?, self.unit.start.as_ref()?);
        let is_running = self.unit.stop.is_none_or(|stop| stop.id < start.id);
        let most = self.most_since(start)?;
        if !is_running || most >= warm_up || self.may_hide_since(start) {
            return None;
        }
        let message =
            format!("read at most {} after the start; the manual waits {}", seconds(most), seconds(warm_up));
        Some(self.finding(&D06, Some(start), message))
    }

    fn after_stop(&self) -> Option<Finding> {
        let stop = self.unit.stop.as_ref()?;
        let is_stopped = self.unit.start.is_none_or(|start| start.id < stop.id) && stop.id < self.request.id;
        let message = "read after a stop, with no start between".to_owned();
        (is_stopped && !self.may_hide_since(stop)).then(|| self.finding(&D08, Some(stop), message))
    }

    fn while_brushing(&self) -> Option<Finding> {
        let (sweep, brush) = (self.profile.measuring.brush_sweep_ns?, self.unit.brush.as_ref()?);
        let most = self.most_since(brush)?;
        if most >= sweep || self.may_hide_since(brush) {
            return None;
        }
        let message = format!(
            "read at most {} after the brush was started; it sweeps for {}",
            seconds(most),
            seconds(sweep)
        );
        Some(self.finding(&D17, Some(brush), message))
    }

    /// Returns the first request for the same since the last that was answered: those that follow it are retries.
    fn first_attempt(&self, previous: &Measured) -> Mark {
        let asked = self.bus.requests.iter().find(|asked| {
            asked.id > previous.answered && asked.id < self.request.id && asked.bytes == self.request.bytes
        });
        asked.map_or_else(|| Mark::of(&self.request), |asked| Mark { id: asked.id, time: asked.time })
    }

    /// Tells whether a read comes before the manual's cycle is over.
    fn is_within_cycle(&self, previous: &Measured, first: &Mark) -> bool {
        let cycle = self.profile.measuring.cycle_ns.unwrap_or(0);
        let times = previous.request.time.zip(first.time);
        times.is_some_and(|(before, now)| {
            before.start.until(now.start).most < cycle / TOLERANCE.1 * TOLERANCE.0
        })
    }

    fn too_fast(&self, previous: &Measured, first: &Mark) -> Option<Finding> {
        let cycle = self.profile.measuring.cycle_ns.filter(|_| previous.register == self.register)?;
        let (before, now) = (previous.request.time?, first.time?);
        let most = before.start.until(now.start).most;
        // Whoever gave up on a slow or damaged answer asks again.
        if previous.is_doubtful
            || previous.latency_ns > SLOW_NS
            || self.bus.is_damaged_between(previous.request.id, self.request.id)
        {
            return None;
        }
        if previous.request.id >= self.request.id || !self.is_within_cycle(previous, first) {
            return None;
        }
        let message =
            format!("read again after at most {}; the manual's cycle is {}", seconds(most), seconds(cycle));
        Some(self.finding(&D07, Some(&previous.request), message))
    }

    /// Returns the longest time there can be from a frame's end to this request.
    fn most_since(&self, mark: &Mark) -> Option<i64> {
        let since = mark.time?.end.until(self.request.time?.start).most;
        (mark.id < self.request.id).then_some(since)
    }
}
