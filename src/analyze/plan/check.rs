//! Holds a master against a plan.

use super::{Device, Plan};
use crate::analyze::verify::{Finding, P01, P02, P03, P04, P05, P06, P07, P08};
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::Meaning;
use crate::time::{MILLISECOND, SECOND, Timestamp};

/// How often a command has to come before its pace is judged.
const HABIT: u64 = 3;

/// Counts a command of the plan.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    count: u64,
    first: Option<Timestamp>,
    last: Option<Timestamp>,
}

/// Holds one bus against a plan.
#[derive(Clone, Debug)]
pub struct Check {
    plan: Plan,
    /// For each device of the plan, for each of its commands.
    counts: Vec<Vec<Count>>,
    /// For each device of the plan its last request: id and command, unless something may hide another.
    last: Vec<Option<(u64, usize)>>,
    begin: Option<Timestamp>,
    end: Option<Timestamp>,
}

impl Check {
    /// Begins with nothing seen.
    pub fn new(plan: Plan) -> Self {
        let counts =
            plan.devices.iter().map(|device| vec![Count::default(); device.commands.len()]).collect();
        let last = vec![None; plan.devices.len()];
        Check { plan, counts, last, begin: None, end: None }
    }

    /// Notes that something may be hidden here.
    pub fn hole(&mut self) {
        self.last.fill(None);
    }

    /// Judges a transaction.
    pub fn transaction(&mut self, t: &Transaction<'_>, meaning: &Meaning<'_>, found: &mut Vec<Finding>) {
        let Some(request) = t.request.filter(|side| !side.damaged) else { return };
        let time = request.time.map(|time| time.end.midpoint());
        self.begin = self.begin.or(time);
        self.end = time.or(self.end);
        let about = |rule, message: String| {
            let subject = u32::from(t.function.0) << 16 | u32::from(t.start_register.unwrap_or(0));
            Finding::new(rule, time, message).at(t.address).about(subject).shown_by([request.id])
        };
        let Some(at) = self.plan.devices.iter().position(|device| device.address == t.address) else {
            found.push(about(&P02, format!("{} was asked, which is not in the plan", t.address)));
            return;
        };
        let device = &self.plan.devices[at]; // just found
        found.extend(slow(device, t, about));
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
        found.extend(self.order(at, command, request.id).map(|message| about(&P06, message)));
        let start = request.time.map(|time| time.start.midpoint());
        let count = &mut self.counts[at][command]; // one for each device and command
        count.count += 1;
        count.first = count.first.or(start);
        count.last = start.or(count.last);
    }

    /// Tells of a step that the plan does not have.
    fn order(&mut self, at: usize, command: usize, id: u64) -> Option<String> {
        let (device, last) = (self.plan.devices.get(at)?, self.last.get_mut(at)?);
        // An unanswered request is decided late.
        if last.is_some_and(|(last, _)| last > id) {
            return None;
        }
        let (_, before) = last.replace((id, command))?;
        let (from, to) = (&device.commands.get(before)?.name, &device.commands.get(command)?.name);
        let is_planned =
            device.order.is_empty() || device.order.iter().any(|step| (&step.0, &step.1) == (from, to));
        (!is_planned).then(|| format!("{to} came after {from}, which the plan does not have"))
    }

    /// Judges what only the end shows: what never came, and how often the rest.
    pub fn finish(&mut self, found: &mut Vec<Finding>) {
        let heard = self.end.zip(self.begin).map_or(0, |(end, begin)| end - begin);
        for (device, counts) in self.plan.devices.iter().zip(&self.counts) {
            if counts.iter().all(|count| count.count == 0)
                && device.commands.iter().any(|it| it.every_ns.is_some())
            {
                let message =
                    format!("{} is in the plan, and was asked nothing that the plan has", device.address);
                found.push(Finding::new(&P01, self.end, message).at(device.address));
                continue;
            }
            for (command, count) in device.commands.iter().zip(counts) {
                let Some((least, most)) = command.every_ns else { continue };
                let about = |rule, message| {
                    let subject =
                        u32::from(command.function) << 16 | u32::from(command.register.unwrap_or(0));
                    Finding::new(rule, self.end, message).at(device.address).about(subject)
                };
                if count.count == 0 {
                    let had_time = heard >= most.saturating_mul(2);
                    let message =
                        format!("{} is due every {} at most, and never came", command.name, seconds(most));
                    found.extend(had_time.then(|| about(&P03, message)));
                    continue;
                }
                let span = count.last.zip(count.first).map(|(last, first)| last - first);
                let mean = span
                    .and_then(|span| span.checked_div(count.count as i64 - 1))
                    .filter(|_| count.count >= HABIT);
                if let Some(mean) = mean.filter(|mean| !(least..=most).contains(mean)) {
                    let (mean, least, most) = (seconds(mean), seconds(least), seconds(most));
                    let message =
                        format!("{} came every {mean}; the plan has {least} to {most}", command.name);
                    found.push(about(&P05, message));
                }
            }
        }
        self.counts.iter_mut().flatten().for_each(|count| *count = Count::default());
    }
}

/// Tells of an answer that is certainly slower than the plan allows.
fn slow(
    device: &Device,
    t: &Transaction<'_>,
    about: impl Fn(&'static crate::analyze::verify::Rule, String) -> Finding,
) -> Option<Finding> {
    let (limit, latency) = (device.latency_ns?, t.latency?);
    let response = t.response.filter(|_| matches!(t.outcome, Outcome::Answered | Outcome::Late))?;
    if latency.least <= limit {
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
