//! Writes down what a master does.

use super::{Command, Device, Plan};
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::Meaning;
use crate::time::{MILLISECOND, Timestamp};

/// Commands of a device that are written down, and steps between them.
const MOST: usize = 500;
/// From how many requests on a command is a habit.
const HABIT: u64 = 3;

/// Is a command as it was seen.
#[derive(Clone, Debug)]
struct Seen {
    command: Command,
    count: u64,
    first: Option<Timestamp>,
    last: Option<Timestamp>,
}

/// Is a device as it was asked.
#[derive(Clone, Debug)]
struct Asked {
    device: Device,
    commands: Vec<Seen>,
    /// The last request: its id and its command.
    last: Option<(u64, usize)>,
    slowest_ns: i64,
}

/// Gathers what a master does.
#[derive(Clone, Debug, Default)]
pub struct Draft {
    asked: Vec<Asked>,
}

impl Draft {
    /// Takes a transaction.
    pub fn transaction(&mut self, t: &Transaction<'_>, meaning: &Meaning<'_>) {
        let Some(request) = t.request.filter(|side| !side.damaged) else { return };
        let asked = self.asked(t.address);
        if let Some(device) = meaning.device() {
            asked.device.device = Some(device.to_owned());
        }
        if t.outcome == Outcome::Answered {
            asked.slowest_ns = asked.slowest_ns.max(t.latency.map_or(0, |latency| latency.least));
        }
        let Some(at) = asked.command(t, meaning) else { return };
        let seen = &mut asked.commands[at]; // just found or made
        seen.count += 1;
        let start = request.time.map(|time| time.start.midpoint());
        seen.first = seen.first.or(start);
        seen.last = start.or(seen.last);
        asked.step(request.id, at);
    }

    fn asked(&mut self, address: u8) -> &mut Asked {
        let at =
            self.asked.binary_search_by_key(&address, |asked| asked.device.address).unwrap_or_else(|at| {
                let device = Device {
                    address,
                    device: None,
                    latency_ns: None,
                    order: Vec::new(),
                    commands: Vec::new(),
                };
                self.asked.insert(at, Asked { device, commands: Vec::new(), last: None, slowest_ns: 0 });
                at
            });
        &mut self.asked[at] // just found or made
    }

    /// Returns the plan of a master that does the same.
    pub fn finish(self) -> Plan {
        let devices = self.asked.into_iter().map(|mut asked| {
            // Half as slow again is not alarming.
            let limit = asked.slowest_ns.saturating_mul(3) / 2 / MILLISECOND * MILLISECOND + MILLISECOND;
            asked.device.latency_ns = (asked.slowest_ns > 0).then_some(limit);
            asked.device.commands = asked.commands.into_iter().map(Seen::planned).collect();
            asked.device
        });
        Plan { devices: devices.collect() }
    }
}

impl Asked {
    /// Finds a request among the commands, or adds it; `None` when there are too many.
    fn command(&mut self, t: &Transaction<'_>, meaning: &Meaning<'_>) -> Option<usize> {
        if let Some(at) = self.commands.iter().position(|seen| seen.command.is(t)) {
            return Some(at);
        }
        if self.commands.len() >= MOST {
            return None;
        }
        let function = t.function.0;
        let plain = || {
            let register = t.start_register.map_or_else(String::new, |register| format!("-0x{register:04x}"));
            format!("fc{function:02}{register}")
        };
        let mut name = meaning.command().map_or_else(plain, str::to_owned);
        while self.commands.iter().any(|seen| seen.command.name == name) {
            name.push_str(&t.quantity.map_or_else(|| "-again".to_owned(), |quantity| format!("-{quantity}")));
        }
        let (register, quantity) = (t.start_register, t.quantity);
        let command = Command { name, function, register, quantity, every_ns: None };
        self.commands.push(Seen { command, count: 0, first: None, last: None });
        Some(self.commands.len() - 1)
    }

    /// Notes which command follows which.
    fn step(&mut self, id: u64, at: usize) {
        // An unanswered request is decided late.
        if self.last.is_some_and(|(last, _)| last > id) {
            return;
        }
        if let Some((_, before)) = self.last.replace((id, at)) {
            let name =
                |at: usize| self.commands.get(at).map_or_else(String::new, |seen| seen.command.name.clone());
            let step = (name(before), name(at));
            let order = &mut self.device.order;
            if order.len() < MOST && !order.contains(&step) {
                order.push(step);
            }
        }
    }
}

impl Seen {
    fn planned(self) -> Command {
        let span = self.last.zip(self.first).map(|(last, first)| last - first);
        let intervals = i64::try_from(self.count.saturating_sub(1)).unwrap_or(i64::MAX);
        let mean = span.and_then(|span| span.checked_div(intervals)).filter(|mean| *mean > 0);
        // A fifth more or a quarter less often is still the same pace.
        let round = |ns: i64| ns / MILLISECOND * MILLISECOND;
        let every = mean
            .filter(|_| self.count >= HABIT)
            .map(|mean| (round(mean / 5 * 4), round(mean / 4 * 5) + MILLISECOND));
        Command { every_ns: every, ..self.command }
    }
}
