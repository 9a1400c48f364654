//! What the master does: which commands how often, in which order, and which it never sends.

use std::collections::BTreeMap;

use crate::decode::transaction::{Outcome, Transaction};
use crate::device::{Kind, Meaning};
use crate::time::{SECOND, Timestamp};

/// Kinds of requests, and steps from one to the next, that are kept apart.
const MOST: usize = 2000;

/// Names a request: bus, address, function, register, quantity.
pub(super) type Key = (usize, u8, u8, Option<u16>, Option<u16>);

/// Counts one kind of request.
#[derive(Clone, Debug, Default)]
pub(super) struct Requests {
    pub(super) command: Option<String>,
    pub(super) count: u64,
    pub(super) answered: u64,
    first: Option<Timestamp>,
    last: Option<Timestamp>,
    /// In nanoseconds.
    latency_sum: i64,
    latencies: i64,
}

impl Requests {
    /// Returns how often a minute it came, when there is enough to tell.
    pub(super) fn a_minute(&self) -> Option<f64> {
        let span = self.last? - self.first?;
        let intervals = self.count.checked_sub(1).filter(|count| *count > 1)?;
        (span > 0).then(|| intervals as f64 * 60.0 * SECOND as f64 / span as f64)
    }

    /// Returns the mean latency in nanoseconds.
    pub(super) fn latency_ns(&self) -> Option<i64> {
        self.latency_sum.checked_div(self.latencies)
    }
}

/// Counts steps from one command to the next at an address.
#[derive(Clone, Debug, Default)]
pub(super) struct Step {
    pub(super) count: u64,
    /// From the end of the one before to the start of this one, in nanoseconds, the shortest; `None` without times.
    pub(super) least_ns: Option<i64>,
}

/// Is what is known of an address.
#[derive(Clone, Debug, Default)]
pub(super) struct Unit {
    pub(super) device: Option<String>,
    /// Commands of the profile, and whether they were sent.
    pub(super) commands: Vec<(String, bool)>,
    /// The last command that matters for the order, and when its answer ended.
    last: Option<(usize, Option<Timestamp>)>,
}

/// Gathers what the master does.
#[derive(Debug, Default)]
pub(super) struct Activity {
    pub(super) buses: Vec<String>,
    pub(super) requests: BTreeMap<Key, Requests>,
    /// By bus, address, and the places in `names` of the one before and the one after.
    pub(super) steps: BTreeMap<(usize, u8, usize, usize), Step>,
    /// Names of commands.
    names: Vec<String>,
    pub(super) units: BTreeMap<(usize, u8), Unit>,
}

impl Activity {
    fn bus(&mut self, bus: &str) -> usize {
        self.buses.iter().position(|known| known == bus).unwrap_or_else(|| {
            self.buses.push(bus.to_owned());
            self.buses.len() - 1
        })
    }

    pub(super) fn identified(&mut self, bus: &str, address: u8, device: &str) {
        let bus = self.bus(bus);
        self.units.entry((bus, address)).or_default().device = Some(device.to_owned());
    }

    pub(super) fn transaction(&mut self, bus: &str, t: &Transaction<'_>, meaning: &Meaning<'_>) {
        let Some(request) = t.request.filter(|side| !side.damaged) else { return };
        let bus = self.bus(bus);
        let key = (bus, t.address, t.function.0, t.start_register, t.quantity);
        let start = request.time.map(|time| time.start.midpoint());
        if self.requests.len() < MOST || self.requests.contains_key(&key) {
            let requests = self.requests.entry(key).or_default();
            requests.count += 1;
            requests.first = requests.first.or(start);
            requests.last = start.or(requests.last);
            if matches!(t.outcome, Outcome::Answered | Outcome::Late | Outcome::Exception) {
                requests.answered += 1;
                if let Some(latency) = t.latency {
                    requests.latency_sum = requests.latency_sum.saturating_add(latency.midpoint());
                    requests.latencies += 1;
                }
            }
            if requests.command.is_none() {
                requests.command = meaning.command().map(str::to_owned);
            }
        }
        self.unit(bus, t, meaning);
        self.step(bus, t, meaning, start);
    }

    /// Notes which commands of the device's profile are sent.
    fn unit(&mut self, bus: usize, t: &Transaction<'_>, meaning: &Meaning<'_>) {
        let Some(profile) = meaning.profile() else { return };
        let unit = self.units.entry((bus, t.address)).or_default();
        if unit.device.as_deref() != Some(&*profile.id) || unit.commands.is_empty() {
            unit.device = Some(profile.id.to_string());
            unit.commands =
                profile.commands.iter().map(|command| (command.name.to_string(), false)).collect();
        }
        let Some(command) = meaning.specification() else { return };
        if let Some((_, sent)) = unit.commands.iter_mut().find(|(name, _)| **name == *command.name) {
            *sent = true;
        }
    }

    /// Returns the place of a command's name; profiles have few.
    fn name(&mut self, name: &str) -> usize {
        self.names.iter().position(|known| known == name).unwrap_or_else(|| {
            self.names.push(name.to_owned());
            self.names.len() - 1
        })
    }

    /// Returns the name at a place.
    pub(super) fn named(&self, at: usize) -> &str {
        self.names.get(at).map_or("-", String::as_str)
    }

    /// Counts the steps between starts, reads, stops and brushes.
    fn step(&mut self, bus: usize, t: &Transaction<'_>, meaning: &Meaning<'_>, start: Option<Timestamp>) {
        let Some(command) = meaning.agreed_command() else { return };
        if !matches!(command.kind, Kind::Start | Kind::Stop | Kind::Measurement | Kind::Brush) {
            return;
        }
        let end = t.response.or(t.request).and_then(|side| side.time).map(|time| time.end.midpoint());
        let name = self.name(&command.name);
        let unit = self.units.entry((bus, t.address)).or_default();
        let Some((before, ended)) = unit.last.replace((name, end)) else { return };
        let key = (bus, t.address, before, name);
        if self.steps.len() >= MOST && !self.steps.contains_key(&key) {
            return;
        }
        let step = self.steps.entry(key).or_default();
        step.count += 1;
        // What is damaged is decided late, and then comes after what followed it.
        let wait = ended.zip(start).map(|(ended, start)| start - ended).filter(|wait| *wait >= 0);
        step.least_ns = step.least_ns.into_iter().chain(wait).min();
    }
}
