//! Writes down what a master does.

use super::pace::Tally;
use super::{Command, Device, Pace, Plan};
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::Meaning;
use crate::time::{MILLISECOND, SECOND, Timestamp};

/// Commands of a device that are written down, and steps between them.
const MOST: usize = 500;

/// Is a command as it was seen.
#[derive(Clone, Debug)]
struct Seen {
    command: Command,
    tally: Tally,
}

/// Is a device as it was asked.
#[derive(Clone, Debug)]
struct Asked {
    device: Device,
    commands: Vec<Seen>,
    any: Tally,
    /// The last request: its id and its command.
    last: Option<(u64, usize)>,
    /// The longest latency that an answer can have had, in nanoseconds.
    slowest_ns: i64,
}

/// Gathers what a master does.
#[derive(Clone, Debug, Default)]
pub struct Draft {
    asked: Vec<Asked>,
    begin: Option<Timestamp>,
    end: Option<Timestamp>,
}

impl Draft {
    /// Takes a transaction.
    pub fn transaction(&mut self, t: &Transaction<'_>, meaning: &Meaning<'_>) {
        let Some(request) = t.request.filter(|side| !side.damaged) else { return };
        let start = request.time.map(|time| time.start.midpoint());
        self.begin = self.begin.or(start);
        self.end = self.end.max(request.time.map(|time| time.end.midpoint()));
        let asked = self.asked(t.address);
        asked.any.add(request.id, start);
        if let Some(device) = meaning.device() {
            asked.device.device = Some(device.to_owned());
        }
        if t.outcome == Outcome::Answered {
            asked.slowest_ns = asked.slowest_ns.max(t.latency.map_or(0, |latency| latency.most));
        }
        let Some(at) = asked.command(t, meaning) else { return };
        let seen = &mut asked.commands[at]; // just found or made
        seen.tally.add(request.id, start);
        asked.step(request.id, at);
    }

    fn asked(&mut self, address: u8) -> &mut Asked {
        let at =
            self.asked.binary_search_by_key(&address, |asked| asked.device.address).unwrap_or_else(|at| {
                let device = Device {
                    address,
                    device: None,
                    latency_ns: None,
                    silence_ns: None,
                    order: Vec::new(),
                    commands: Vec::new(),
                };
                let (any, commands) = (Tally::default(), Vec::new());
                self.asked.insert(at, Asked { device, commands, any, last: None, slowest_ns: 0 });
                at
            });
        &mut self.asked[at] // just found or made
    }

    /// Returns the plan of a master that does the same; one without devices when nothing was asked.
    pub fn finish(self) -> Plan {
        let heard = self.begin.zip(self.end);
        let devices = self.asked.into_iter().map(|mut asked| {
            // Half as slow again is not alarming.
            let limit = rounded(asked.slowest_ns.saturating_mul(3) / 2, MILLISECOND);
            asked.device.latency_ns = (asked.slowest_ns > 0).then_some(limit);
            let pace = heard.and_then(|(begin, end)| asked.any.pace(begin, end));
            asked.device.silence_ns = pace.zip(heard).and_then(|((_, most), (begin, end))| {
                let (before, after) = asked.any.edges_ns(begin, end)?;
                let longest = asked.any.longest_ns.max(before).max(after).max(most);
                Some(rounded(longest.saturating_mul(2), SECOND))
            });
            asked.device.commands = asked.commands.into_iter().map(|seen| seen.planned(heard)).collect();
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
        self.commands.push(Seen { command, tally: Tally::default() });
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
    fn planned(self, heard: Option<(Timestamp, Timestamp)>) -> Command {
        let pace = heard.and_then(|(begin, end)| self.tally.pace(begin, end));
        let round = |(least, most): Pace| (least / MILLISECOND * MILLISECOND, rounded(most, MILLISECOND));
        Command { every_ns: pace.map(round), ..self.command }
    }
}

/// Rounds up, by one unit at most.
fn rounded(ns: i64, unit: i64) -> i64 {
    ns / unit * unit + unit
}
