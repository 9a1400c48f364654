//! The summary of a recording: times, line, devices, counts.

mod parts;

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use serde::Serialize;

use super::Clock;
use super::redact::REMARK_KEY;
use super::words;
use crate::decode::frame::Place;
use crate::decode::transaction::Outcome;
use crate::device::Profiles;
use crate::line::LineSettings;
use crate::pipeline::{Event, Lost};
use crate::time::{SECOND, Timestamp};
pub use parts::Recording;

/// Counts what a recording holds; its counts equal those of `decode`.
#[derive(Debug, Default)]
pub struct Info {
    bytes: u64,
    frames: u64,
    damaged: u64,
    damaged_bytes: u64,
    /// Bytes that are missing, as far as anybody counted.
    lost: u64,
    /// How often an unknown number of bytes is missing.
    holes: u64,
    /// How long it took until bytes came again after those, in nanoseconds.
    holes_ns: i64,
    /// Counts by outcome, in the order of its declaration.
    outcomes: [u64; Outcome::ALL.len()],
    /// By bus, in the order of their names, a place for each unit address.
    units: Vec<(String, Vec<Option<Unit>>)>,
    /// For each bus of each input its line settings, and its first and last time.
    inputs: Vec<Stretch>,
    /// What recordings in MCAP say of themselves.
    pub recordings: Vec<Recording>,
    /// At which addresses every device answers: no device of its own.
    service_addresses: ServiceAddresses,
}

/// Says of each address whether every device answers at it.
#[derive(Debug)]
struct ServiceAddresses([bool; 256]);

impl Default for ServiceAddresses {
    fn default() -> Self {
        ServiceAddresses([false; 256])
    }
}

/// Is a bus of an input, read with the same settings throughout.
#[derive(Debug)]
struct Stretch {
    bus: String,
    line: LineSettings,
    /// Nanoseconds of a character.
    character_ns: i64,
    span: Option<(Timestamp, Timestamp)>,
    /// How long bytes with times were on the wire, in nanoseconds.
    busy_ns: i64,
    /// Since when bytes are missing of which nobody knows the number.
    hole_since: Option<Timestamp>,
}

/// Is what is known about a unit address.
#[derive(Debug, Default)]
struct Unit {
    answers: u64,
    device: Option<String>,
    serial_number: Option<String>,
    evidence: Option<String>,
    frames: Vec<u64>,
    /// The address that the device took instead.
    moved_to: Option<u8>,
}

#[derive(Serialize)]
struct DeviceRow<'a> {
    bus: &'a str,
    address: u8,
    device: Option<&'a str>,
    serial_number: Option<&'a str>,
    evidence: Option<&'a str>,
    frames: &'a [u64],
    answers: u64,
    moved_to: Option<u8>,
}

#[derive(Serialize)]
struct Summary<'a> {
    bytes: u64,
    frames: u64,
    damaged: u64,
    damaged_bytes: u64,
    transactions: BTreeMap<&'static str, u64>,
    devices: Vec<DeviceRow<'a>>,
    start_ns: Option<i64>,
    end_ns: Option<i64>,
    line: Option<String>,
    complete: bool,
    lost_bytes: u64,
    holes: u64,
    busy: Option<f64>,
    recordings: &'a [Recording],
}

/// Returns the last stretch of a bus that has begun; mostly there is but one bus.
fn stretch<'a>(inputs: &'a mut [Stretch], bus: &str) -> Option<&'a mut Stretch> {
    match inputs {
        [only] => Some(only),
        _ => inputs.iter_mut().rfind(|stretch| stretch.bus == bus),
    }
}

impl Info {
    /// Makes a summary of nothing yet; the profiles say at which addresses every device answers.
    pub fn new(profiles: &Profiles) -> Self {
        let mut service_addresses = ServiceAddresses::default();
        for address in profiles.iter().filter_map(|profile| profile.service_address) {
            service_addresses.0[usize::from(address)] = true;
        }
        Info { service_addresses, ..Info::default() }
    }

    /// Begins a bus of an input with these line settings.
    pub fn begin(&mut self, bus: &str, line: LineSettings) {
        let (bus, character_ns) = (bus.to_owned(), line.character_ns());
        self.inputs.push(Stretch { bus, line, character_ns, span: None, busy_ns: 0, hole_since: None });
    }

    /// Takes an event.
    pub fn event(&mut self, bus: &str, event: &Event<'_>) {
        match event {
            Event::Frame(frame) => {
                self.frames += 1;
                self.place(bus, &frame.place);
            }
            Event::Damaged(damaged) => {
                self.damaged += 1;
                self.damaged_bytes += damaged.place.bytes.len() as u64;
                self.place(bus, &damaged.place);
            }
            Event::Lost(lost) => self.lost(bus, lost),
            Event::Identified { identified, .. } => {
                let unit = self.unit(bus, identified.address);
                unit.device = Some(identified.device.to_string());
                unit.serial_number.clone_from(&identified.serial_number);
                unit.evidence = Some(identified.evidence.clone());
                unit.frames.clone_from(&identified.frames);
                unit.moved_to = None;
                if let Some(from) = identified.moved_from {
                    self.unit(bus, from).moved_to = Some(identified.address);
                }
            }
            Event::Transaction { transaction, .. } => {
                self.outcomes[transaction.outcome as usize] += 1;
                let is_service = self.service_addresses.0[usize::from(transaction.address)];
                if !is_service && transaction.response.is_some_and(|side| !side.damaged) {
                    self.unit(bus, transaction.address).answers += 1;
                }
            }
            Event::Reading { .. } | Event::Finding(_) => {}
        }
    }

    fn unit(&mut self, bus: &str, address: u8) -> &mut Unit {
        let found = self.units.binary_search_by(|(known, _)| known.as_str().cmp(bus));
        let at = found.unwrap_or_else(|at| {
            self.units.insert(at, (bus.to_owned(), std::iter::repeat_with(|| None).take(256).collect()));
            at
        });
        self.units[at].1[usize::from(address)].get_or_insert_default()
    }

    /// Returns all units with their bus and address.
    fn units(&self) -> impl Iterator<Item = (&str, u8, &Unit)> {
        self.units.iter().flat_map(|(bus, units)| {
            let known = (0..=u8::MAX).zip(units);
            known.filter_map(|(address, unit)| Some((bus.as_str(), address, unit.as_ref()?)))
        })
    }

    fn place(&mut self, bus: &str, place: &Place<'_>) {
        self.bytes += place.bytes.len() as u64;
        let Some(time) = place.time else { return };
        let Some(stretch) = stretch(&mut self.inputs, bus) else { return };
        let on_wire = stretch.character_ns.saturating_mul(place.bytes.len() as i64); // a run is far below 2^63
        stretch.busy_ns = stretch.busy_ns.saturating_add(on_wire);
        if let Some(since) = stretch.hole_since.take() {
            self.holes_ns = self.holes_ns.saturating_add((time.start.midpoint() - since).max(0));
        }
        let end = time.end.midpoint();
        match &mut stretch.span {
            // Its midpoint is not before that either.
            Some((first, last)) if time.start.earliest >= *first => *last = end.max(*last),
            span => {
                let start = time.start.midpoint();
                let (first, last) = span.unwrap_or((start, end));
                *span = Some((first.min(start), last.max(end)));
            }
        }
    }

    /// Takes that bytes are missing; of some nobody knows how many.
    fn lost(&mut self, bus: &str, lost: &Lost) {
        self.lost = self.lost.saturating_add(lost.count);
        if lost.count > 0 {
            return;
        }
        self.holes += 1;
        if let Some(stretch) = stretch(&mut self.inputs, bus) {
            stretch.hole_since = stretch.hole_since.or(lost.time);
        }
    }

    /// Returns the first and the last time of all inputs.
    fn span(&self) -> Option<(Timestamp, Timestamp)> {
        let spans = self.inputs.iter().filter_map(|stretch| stretch.span);
        spans.reduce(|(first, last), (start, end)| (first.min(start), last.max(end)))
    }

    /// Returns how much of the time the line was busy, in percent; `None` without times.
    fn load(&self) -> Option<f64> {
        load(self.inputs.iter())
    }

    /// Returns the names of the buses, in the order of their beginning.
    fn buses(&self) -> Vec<&str> {
        let mut buses: Vec<&str> = Vec::new();
        for stretch in &self.inputs {
            if !buses.contains(&&*stretch.bus) {
                buses.push(&stretch.bus);
            }
        }
        buses
    }

    fn transactions(&self) -> u64 {
        self.outcomes.iter().sum()
    }

    /// Returns what recordings say of the sources of their buses and of what was done to them, each once.
    fn said_of_buses(&self) -> Vec<(&'static str, String)> {
        let mut said = Vec::new();
        for (bus, facts) in self.recordings.iter().flat_map(|recording| &recording.buses) {
            let fact = |key| facts.get(key).map(String::as_str);
            let adapter: Vec<&str> =
                ["driver", "usb_model", "usb_vid_pid", "usb_serial"].into_iter().filter_map(fact).collect();
            let adapter =
                if adapter.is_empty() { String::new() } else { format!(" ({})", adapter.join(", ")) };
            let source = fact("source").map(|source| ("source", format!("{bus}: {source}{adapter}")));
            let remark = fact(REMARK_KEY).map(|remark| ("remark", format!("{bus}: {remark}")));
            for line in source.into_iter().chain(remark) {
                if !said.contains(&line) {
                    said.push(line);
                }
            }
        }
        said
    }

    /// Returns the line settings of all inputs, or `None` when they differ.
    fn line(&self) -> Option<LineSettings> {
        line(self.inputs.iter())
    }

    /// Returns the summary as one JSON object.
    pub fn to_json(&self) -> String {
        let devices = self.units().map(|(bus, address, unit)| DeviceRow {
            bus,
            address,
            device: unit.device.as_deref(),
            serial_number: unit.serial_number.as_deref(),
            evidence: unit.evidence.as_deref(),
            frames: &unit.frames,
            answers: unit.answers,
            moved_to: unit.moved_to,
        });
        let count = |outcome: Outcome| self.outcomes[outcome as usize];
        let summary = Summary {
            bytes: self.bytes,
            frames: self.frames,
            damaged: self.damaged,
            damaged_bytes: self.damaged_bytes,
            transactions: Outcome::ALL.map(|outcome| (outcome.name(), count(outcome))).into(),
            devices: devices.collect(),
            start_ns: self.span().map(|(start, _)| start.as_ns()),
            end_ns: self.span().map(|(_, end)| end.as_ns()),
            line: self.line().map(|line| line.to_string()),
            complete: self.lost == 0
                && self.holes == 0
                && self.recordings.iter().all(|recording| recording.is_complete),
            lost_bytes: self.lost,
            holes: self.holes,
            busy: self.load().map(|percent| percent / 100.0),
            recordings: &self.recordings,
        };
        serde_json::to_string(&summary).unwrap_or_default() // plain data: cannot fail
    }

    /// Returns the summary for people, a line a fact.
    pub fn to_text(&self, clock: Clock) -> String {
        let mut text = String::new();
        let _ = self.write_text(clock, &mut text); // writing to a string cannot fail
        text
    }

    fn write_text(&self, mut clock: Clock, out: &mut String) -> fmt::Result {
        match self.span() {
            Some((start, end)) => {
                clock.begin(start);
                writeln!(out, "from          {}", clock.short(start))?;
                writeln!(out, "to            {}  ({})", clock.short(end), duration(end - start))?;
            }
            None => writeln!(out, "times         none in this recording")?,
        }
        parts::write(&self.recordings, out)?;
        for (label, text) in self.said_of_buses() {
            writeln!(out, "{label:<13} {text}")?;
        }
        let buses = self.buses();
        for bus in &buses {
            let of_bus = || self.inputs.iter().filter(|stretch| stretch.bus == **bus);
            let name = if buses.len() > 1 { format!("{bus}: ") } else { String::new() };
            match line(of_bus()) {
                Some(line) => write!(out, "line          {name}{line}")?,
                None => write!(out, "line          {name}differs between the inputs")?,
            }
            match load(of_bus()) {
                Some(load) => writeln!(out, ", {load:.1} % busy")?,
                None => writeln!(out)?,
            }
        }
        writeln!(out, "bytes         {}", self.bytes)?;
        if let Some(lost) = self.lost_text() {
            writeln!(out, "lost          {lost}")?;
        }
        writeln!(out, "frames        {}", self.frames)?;
        let share = self.damaged_bytes as f64 / self.bytes.max(1) as f64 * 100.0;
        let (runs, bytes) = (plural(self.damaged), plural(self.damaged_bytes));
        let (damaged, damaged_bytes) = (self.damaged, self.damaged_bytes);
        writeln!(out, "damaged       {damaged} run{runs}, {damaged_bytes} byte{bytes}, {share:.2} %")?;
        writeln!(out, "transactions  {}", self.transactions())?;
        for outcome in Outcome::ALL {
            let count = self.outcomes[outcome as usize];
            if count > 0 {
                let share = count as f64 / self.transactions().max(1) as f64 * 100.0;
                writeln!(out, "  {:<14}{count:>8} {share:>6.2} %", outcome.name())?;
            }
        }
        self.write_devices(&buses, out)
    }

    /// Says how much is missing; `None` when nothing is.
    fn lost_text(&self) -> Option<String> {
        let holes = match (self.holes, self.holes_ns) {
            (0, _) => return (self.lost > 0).then(|| words::bytes(self.lost)),
            (1, 0) => "1 hole".to_owned(),
            (1, ns) => format!("1 hole of {}", duration(ns)),
            (count, 0) => format!("{count} holes"),
            (count, ns) => format!("{count} holes of {} together", duration(ns)),
        };
        let known = if self.lost > 0 { format!("{}, and ", words::bytes(self.lost)) } else { String::new() };
        Some(format!("{known}{} in {holes}", words::bytes(0)))
    }

    fn write_devices(&self, buses: &[&str], out: &mut String) -> fmt::Result {
        let count = self.units().filter(|(_, _, unit)| unit.moved_to.is_none()).count();
        writeln!(out, "devices       {count}")?;
        let width = buses.iter().map(|bus| bus.chars().count()).max().unwrap_or(0);
        for (bus, address, unit) in self.units() {
            if buses.len() > 1 {
                write!(out, "  {bus:<width$}")?;
            }
            let device = unit.device.as_deref().unwrap_or("not recognised");
            let serial = unit.serial_number.as_deref().unwrap_or("-");
            write!(
                out,
                "  {address:>3}  {device:<24} {serial:<13}{:>8} answer{}",
                unit.answers,
                plural(unit.answers)
            )?;
            match (unit.moved_to, &unit.evidence) {
                (Some(to), _) => writeln!(out, "  moved to {to}")?,
                (None, Some(evidence)) => writeln!(out, "  by {evidence}")?,
                (None, None) => writeln!(out)?,
            }
        }
        Ok(())
    }
}

/// Returns the line settings of these, or `None` when they differ.
fn line<'a>(mut stretches: impl Iterator<Item = &'a Stretch>) -> Option<LineSettings> {
    let first = stretches.next()?.line;
    stretches.all(|stretch| stretch.line == first).then_some(first)
}

/// Returns how much of the time the line of these was busy, in percent; `None` without times.
fn load<'a>(stretches: impl Iterator<Item = &'a Stretch>) -> Option<f64> {
    let (mut busy_ns, mut duration) = (0_i64, 0_i64);
    for stretch in stretches {
        busy_ns = busy_ns.saturating_add(stretch.busy_ns);
        duration = duration.saturating_add(stretch.span.map_or(0, |(start, end)| end - start));
    }
    (duration > 0).then(|| busy_ns as f64 / duration as f64 * 100.0)
}

/// Returns what a noun ends in behind a count.
fn plural(count: u64) -> &'static str {
    if count == 1 { "" } else { "s" }
}

/// Writes a length of time for people, in the two largest units that matter.
fn duration(ns: i64) -> String {
    let seconds = ns.max(0) / SECOND;
    let (days, hours, minutes) = (seconds / 86_400, seconds / 3600 % 24, seconds / 60 % 60);
    if days > 0 {
        format!("{days} d {hours} h")
    } else if hours > 0 {
        format!("{hours} h {minutes} min")
    } else if minutes > 0 {
        format!("{minutes} min {} s", seconds % 60)
    } else {
        format!("{:.3} s", ns.max(0) as f64 / SECOND as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_well() {
        for (seconds, text) in [(1, "1.000 s"), (61, "1 min 1 s"), (3660, "1 h 1 min"), (90_000, "1 d 1 h")] {
            assert_eq!(duration(seconds * SECOND), text);
        }
    }
}
