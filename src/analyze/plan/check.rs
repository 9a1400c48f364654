//! Holds a master against a plan.

use super::pace::Tally;
use super::{Device, Plan};
use crate::analyze::verify::{Finding, P01, P02, P03, P04, P05, P06, P07, P08, Rule};
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::Meaning;
use crate::time::{MILLISECOND, SECOND, Timestamp};

/// By how many nanoseconds a listener may be late without anybody knowing: its host may pause for once.
const STALL_NS: i64 = 50 * MILLISECOND;
/// The same behind an adapter of which nothing is known.
const UNKNOWN_HOLD_NS: i64 = 100 * MILLISECOND;
/// How many answers in a row have to be slow to be no pause of the host.
const REPEATED: u32 = 3;

/// Is what was seen of a device of the plan.
#[derive(Clone, Debug, Default)]
struct Seen {
    /// All requests.
    any: Tally,
    /// For each of its commands.
    commands: Vec<Tally>,
    /// The last request, unless something may hide another: id and command.
    last: Option<(u64, usize)>,
    /// From when on it is listened to without a hole.
    since: Option<Timestamp>,
    /// How many answers in a row were slow.
    slow: u32,
}

/// Holds one bus against a plan.
#[derive(Clone, Debug)]
pub struct Check {
    plan: Plan,
    is_hold_known: bool,
    /// For each device of the plan.
    seen: Vec<Seen>,
    /// All requests of the bus.
    any: Tally,
    /// From the first request, and from the first one after the last hole.
    begin: Option<Timestamp>,
    since: Option<Timestamp>,
    end: Option<Timestamp>,
}

impl Check {
    /// Begins with nothing seen; `is_hold_known` tells whether the adapter is known, and not estimated from its reads.
    pub fn new(plan: Plan, is_hold_known: bool) -> Self {
        let seen = plan.devices.iter().map(|device| Seen {
            commands: vec![Tally::default(); device.commands.len()],
            ..Seen::default()
        });
        let seen = seen.collect();
        Check { seen, plan, is_hold_known, any: Tally::default(), begin: None, since: None, end: None }
    }

    /// Notes that a request may be hidden here.
    pub fn damaged(&mut self) {
        self.seen.iter_mut().for_each(|seen| seen.last = None);
    }

    /// Notes that any number of requests may be hidden before what comes next.
    pub fn lost(&mut self) {
        self.damaged();
        self.since = None;
        for seen in &mut self.seen {
            seen.since = None;
            seen.commands.iter_mut().for_each(Tally::hole);
        }
    }

    /// Judges a transaction.
    pub fn transaction(&mut self, t: &Transaction<'_>, meaning: &Meaning<'_>, found: &mut Vec<Finding>) {
        let Some(request) = t.request.filter(|side| !side.damaged) else { return };
        let time = request.time.map(|time| time.end.midpoint());
        let start = request.time.map(|time| time.start.midpoint());
        self.any.add(request.id, start);
        self.begin = self.begin.or(start);
        self.since = self.since.or(start);
        self.end = self.end.max(time);
        self.seen.iter_mut().for_each(|seen| seen.since = seen.since.or(start));
        let about = |rule, message: String| {
            let subject = u32::from(t.function.0) << 16 | u32::from(t.start_register.unwrap_or(0));
            Finding::new(rule, time, message).at(t.address).about(subject).shown_by([request.id])
        };
        let Some(at) = self.plan.devices.iter().position(|device| device.address == t.address) else {
            found.push(about(&P02, format!("{} was asked, which is not in the plan", t.address)));
            return;
        };
        let (device, seen) = (&self.plan.devices[at], &mut self.seen[at]); // one for each device
        found.extend(slow(device, seen, self.is_hold_known, t, about));
        found
            .extend(start.and_then(|start| silence(device, seen, start)).map(|message| about(&P01, message)));
        seen.any.add(request.id, start);
        seen.since = start.or(seen.since);
        if let (Some(planned), Some(is)) = (&device.device, meaning.device())
            && planned != is
        {
            found.push(about(&P08, format!("{} is {is}; the plan has {planned}", t.address)).about(0_u8));
        }
        let Some(command) = device.commands.iter().position(|command| command.is(t)) else {
            let register = t.start_register.map_or_else(String::new, |register| format!(" 0x{register:04x}"));
            let quantity = t.quantity.map_or_else(String::new, |quantity| format!(" ×{quantity}"));
            found.push(about(&P04, format!("FC{:02}{register}{quantity} is not in the plan", t.function.0)));
            return;
        };
        found.extend(order(device, seen, command, request.id).map(|message| about(&P06, message)));
        seen.commands[command].add(request.id, start); // one for each command
    }

    /// Judges what only the end shows: what never came or came no more, and how often the rest.
    pub fn finish(&mut self, found: &mut Vec<Finding>) {
        let heard = self.begin.zip(self.end);
        let shown_by = self.any.shown_by();
        for (device, seen) in self.plan.devices.iter().zip(&self.seen) {
            let about = |rule, message| Finding::new(rule, self.end, message).at(device.address);
            if seen.any.count == 0 && self.any.count > 0 {
                let message = format!("{} is in the plan, and was asked nothing", device.address);
                found.push(about(&P01, message).shown_by(shown_by.clone()));
                continue;
            }
            if let Some(message) = self.end.and_then(|end| silence(device, seen, end)) {
                found.push(about(&P01, message).shown_by(seen.any.shown_by()));
                continue;
            }
            for (command, tally) in device.commands.iter().zip(&seen.commands) {
                let Some((rule, message)) = pace(command, tally, heard, self.since) else { continue };
                let subject = u32::from(command.function) << 16 | u32::from(command.register.unwrap_or(0));
                let frames = if tally.count > 0 { tally.shown_by() } else { seen.any.shown_by() };
                found.push(about(rule, message).about(subject).shown_by(frames));
            }
        }
        *self = Check::new(std::mem::take(&mut self.plan), self.is_hold_known);
    }
}

/// Tells of a device that was asked nothing for longer than the plan allows.
fn silence(device: &Device, seen: &Seen, now: Timestamp) -> Option<String> {
    let (allowed, quiet) = (device.silence_ns?, now - seen.since?);
    let message = || {
        format!(
            "{} was asked nothing for {}; the plan allows {}",
            device.address,
            seconds(quiet),
            seconds(allowed)
        )
    };
    (quiet > allowed).then(message)
}

/// Judges how often a command came while the bus was heard.
fn pace(
    command: &super::Command,
    tally: &Tally,
    heard: Option<(Timestamp, Timestamp)>,
    since: Option<Timestamp>,
) -> Option<(&'static Rule, String)> {
    let ((least, most), (begin, end)) = (command.every_ns?, heard?);
    let planned = format!("the plan has {} to {}", seconds(least), seconds(most));
    let name = &command.name;
    if tally.count == 0 {
        let had_time = end - begin >= most.saturating_mul(2);
        let register = command.register.map(|register| format!(" {register:#06x}")).unwrap_or_default();
        let quantity = command.quantity.map(|quantity| format!(" ×{quantity}")).unwrap_or_default();
        let asked = format!("FC{:02}{register}{quantity}", command.function);
        let heard = seconds(end - begin);
        return had_time.then(|| (&P03, format!("{name} ({asked}) never came in {heard}; {planned}")));
    }
    let away = tally.away_ns(since.unwrap_or(end), end);
    if away > tally.absence_ns(most) {
        let times = if tally.count == 1 { "once".to_owned() } else { format!("{} times", tally.count) };
        let message = format!("{name} came {times}, and not in the last {}; {planned}", seconds(away));
        return Some((&P05, message));
    }
    let mean = tally.mean_ns().filter(|mean| !(least..=most).contains(mean))?;
    Some((&P05, format!("{name} came every {} on average; {planned}", seconds(mean))))
}

/// Tells of a step that the plan does not have.
fn order(device: &Device, seen: &mut Seen, command: usize, id: u64) -> Option<String> {
    // An unanswered request is decided late.
    if seen.last.is_some_and(|(last, _)| last > id) {
        return None;
    }
    let (_, before) = seen.last.replace((id, command))?;
    let (from, to) = (&device.commands.get(before)?.name, &device.commands.get(command)?.name);
    let is_planned =
        device.order.is_empty() || device.order.iter().any(|step| (&step.0, &step.1) == (from, to));
    (!is_planned).then(|| format!("{to} came after {from}, which the plan does not have"))
}

/// Tells of an answer that is certainly slower than the plan allows.
fn slow(
    device: &Device,
    seen: &mut Seen,
    is_hold_known: bool,
    t: &Transaction<'_>,
    about: impl Fn(&'static Rule, String) -> Finding,
) -> Option<Finding> {
    let (limit, latency) = (device.latency_ns?, t.latency?);
    let response = t.response.filter(|_| matches!(t.outcome, Outcome::Answered | Outcome::Late))?;
    if latency.least <= limit {
        seen.slow = 0;
        return None;
    }
    seen.slow = seen.slow.saturating_add(1);
    let doubt = match is_hold_known {
        true if seen.slow >= REPEATED => 0,
        true => STALL_NS,
        false => UNKNOWN_HOLD_NS,
    };
    if latency.least <= limit.saturating_add(doubt) {
        return None;
    }
    let milliseconds = |ns: i64| ns as f64 / MILLISECOND as f64;
    let message = format!(
        "answered after {:.1} ms at least; the plan has {:.1} ms at most",
        milliseconds(latency.least),
        milliseconds(limit)
    );
    let finding = about(&P07, message);
    let frames = finding.frames.iter().copied().chain([response.id]).collect::<Vec<_>>();
    Some(finding.shown_by(frames))
}

fn seconds(ns: i64) -> String {
    format!("{:.3} s", ns as f64 / SECOND as f64)
}
