//! Turns events into what the views show.

use std::collections::VecDeque;
use std::sync::Arc;

use super::device::{Device, Quantity};
use super::health::Health;
use super::learn::{LOOK_BACK, fields, frame_number, guesses, register, settings};
use super::names::Names;
use super::row::{Exchange, Remark, RemarkKind, Row, Run, RunKind};
use super::{Bus, PROVISIONAL, Pages, Store};
use crate::decode::frame::{Damaged, Frame, Place, Role};
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::{Identified, Meaning, Reading};
use crate::line::LineSettings;
use crate::pipeline::{Event, Lost};
use crate::report::columns;
use crate::report::words::{self, Labels};
use crate::time::Timestamp;

/// How many frames of a finding a checkpoint keeps.
const LATEST_FRAMES: usize = 16;
/// How many damaged runs wait for their transaction.
const MOST_HELD: usize = 256;

/// Says what is known of a bus that begins.
#[derive(Clone, Debug, Default)]
pub struct BusFacts {
    /// What it is called.
    pub name: String,
    /// Speed and character format.
    pub line: LineSettings,
    /// Where it is received from.
    pub source: Option<String>,
    /// The longest time the adapter keeps a byte back, in nanoseconds, where it is known.
    pub hold_ns: Option<i64>,
    /// Facts about the adapter: key and value.
    pub facts: Vec<(String, String)>,
    /// What the adapter tells of line errors, in words.
    pub error_reports: Option<&'static str>,
}

/// Grows a store by what is decoded.
#[derive(Clone, Debug)]
pub struct Feed {
    store: Store,
    labels: Labels,
    names: Names,
    /// Damaged runs that may yet be told by a transaction: number among the frames, and id.
    held: VecDeque<(u64, u64)>,
    /// Whether it began in the middle of traffic.
    is_provisional: bool,
}

impl Feed {
    /// Begins with nothing; `labels` shorten the ids of devices.
    pub fn new(labels: Labels) -> Self {
        Feed {
            store: Store::default(),
            labels,
            names: Names::default(),
            held: VecDeque::new(),
            is_provisional: false,
        }
    }

    /// Returns a feed that begins in the middle of traffic that begins at `origin`, of which nothing before is known: its
    /// rows are numbered from [`PROVISIONAL`]. This one has taken nothing.
    pub fn provisional(&self, origin: Timestamp) -> Self {
        let mut feed = self.clone();
        feed.store.begun = Some(origin);
        feed.store.exchanges.pages = Pages::from_number(PROVISIONAL);
        feed.store.frames.pages = Pages::from_number(PROVISIONAL);
        feed.is_provisional = true;
        feed
    }

    /// Returns what the views show.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// Takes the settings of a bus, at its beginning and when they change.
    pub fn begin(&mut self, facts: BusFacts) {
        self.store.revision += 1;
        let known = self.store.buses.iter_mut().find(|bus| *bus.name == *facts.name);
        let before = known.as_ref().map(|bus| Arc::clone(&bus.health));
        let bus = Bus {
            name: facts.name.into(),
            line: facts.line,
            source: facts.source.map(Into::into),
            hold_ns: facts.hold_ns,
            facts: facts.facts.into(),
            error_reports: facts.error_reports,
            away_since: None,
            health: before.unwrap_or_default(),
        };
        match known {
            Some(known) => *known = Arc::new(bus),
            None => self.store.buses.push(Arc::new(bus)),
        }
    }

    /// Takes note that the source of a bus is gone, since then, or back.
    pub fn set_away(&mut self, bus: &str, since: Option<Timestamp>) {
        self.store.revision += 1;
        let at = self.bus(bus);
        if let Some(bus) = self.store.buses.get_mut(at) {
            Arc::make_mut(bus).away_since = since;
        }
    }

    /// Takes note of the time: everything up to then is in here.
    pub fn pass(&mut self, now: Timestamp) {
        self.store.now = Some(self.store.now.map_or(now, |known| known.max(now)));
    }

    /// Takes what somebody noted.
    pub fn note(&mut self, time: Option<Timestamp>, text: &str) {
        self.store.revision += 1;
        self.remark(Remark { bus: 0, time, address: None, kind: RemarkKind::Note, text: text.into() });
    }

    /// Takes an event of a bus.
    pub fn event(&mut self, bus: &str, event: &Event<'_>) {
        self.store.revision += 1;
        let bus = self.bus(bus);
        match event {
            Event::Frame(frame) => self.frame(bus, frame),
            Event::Damaged(damaged) => self.damaged(bus, damaged),
            Event::Lost(lost) => self.lost(bus, lost),
            Event::Identified { identified, time } => self.identified(bus, identified, *time),
            Event::Transaction { transaction, meaning, codes } => {
                let codes = if self.is_provisional { &[] } else { *codes };
                self.transaction(bus, transaction, meaning, codes);
            }
            // Whoever has not seen all cannot tell what is wrong.
            Event::Finding(_) if self.is_provisional => {}
            Event::Finding(finding) => self.store.findings.take(bus, finding),
            // What is derived comes with its transaction.
            Event::Reading { .. } => {}
        }
    }

    /// Takes note that frames before this id have their transaction, or none.
    pub fn settle(&mut self, settled_frame: u64) {
        while let Some((number, _)) = self.held.front().copied().filter(|(_, id)| *id < settled_frame) {
            self.held.pop_front();
            self.release(number);
        }
    }

    /// Lists a damaged run that belongs to no transaction.
    fn release(&mut self, number: u64) {
        if let Some(row) = self.store.frames.pages.get(number).cloned() {
            let place = self.store.exchanges.push(row);
            if let Some(Row::Run(run)) = self.store.frames.pages.get_mut(number) {
                run.exchange = Some(place);
            }
            self.store.revision += 1;
        }
    }

    /// Returns a copy to go on from later: it knows all that this one knows, but for rows that are no longer open, most
    /// frames of findings, and details of series that are long ago.
    ///
    /// `settled_frame` is as for [`Feed::settle`].
    pub fn checkpoint(&self, settled_frame: u64) -> Feed {
        let mut copy = self.clone();
        let store = &mut copy.store;
        let frames = &store.frames.pages;
        let is_open = |number: &u64| match frames.get(*number) {
            Some(Row::Run(run)) => run.id >= settled_frame,
            _ => false,
        };
        let latest = frames.total().saturating_sub(LOOK_BACK)..frames.total();
        let open = latest.into_iter().find(is_open).unwrap_or(frames.total());
        let held = self.held.iter().map(|(number, _)| *number).min().unwrap_or(u64::MAX);
        store.frames.forget_before(open.min(held));
        store.exchanges.forget_before(u64::MAX);
        store.devices.iter_mut().for_each(|device| Arc::make_mut(device).thin());
        store.buses.iter_mut().for_each(|bus| Arc::make_mut(&mut Arc::make_mut(bus).health).thin());
        store.findings.forget_frames(LATEST_FRAMES);
        copy
    }

    /// Returns a copy that begins here, without what came before: it keeps devices as what they were recognised, and
    /// rows that are open. `settled_frame` is as for [`Feed::settle`].
    pub fn begun_here(&self, settled_frame: u64) -> Feed {
        let mut copy = self.checkpoint(settled_frame);
        let store = &mut copy.store;
        store.known_from = store.now.or(store.begun);
        for device in &mut store.devices {
            let device = Arc::make_mut(device);
            (device.outcomes, device.damaged) = Default::default();
        }
        store.buses.iter_mut().for_each(|bus| Arc::make_mut(bus).health = Arc::default());
        copy
    }

    /// Returns the index of a bus; one that never began gets the usual settings.
    fn bus(&mut self, name: &str) -> usize {
        if let Some(at) = self.store.buses.iter().position(|bus| *bus.name == *name) {
            return at;
        }
        self.begin(BusFacts { name: name.to_owned(), ..BusFacts::default() });
        self.store.buses.len() - 1
    }

    fn health(&mut self, bus: usize) -> Option<&mut Health> {
        let bus = Arc::make_mut(self.store.buses.get_mut(bus)?);
        Some(Arc::make_mut(&mut bus.health))
    }

    /// Returns the device at an address.
    fn device(&mut self, bus: usize, address: u8) -> &mut Device {
        let devices = &mut self.store.devices;
        let at = match devices.binary_search_by_key(&(bus, address), |device| device.key()) {
            Ok(at) => at,
            Err(at) => {
                let label = self.names.get("-");
                devices.insert(at, Arc::new(Device { bus, address, label, ..Device::default() }));
                at
            }
        };
        Arc::make_mut(&mut devices[at]) // found or inserted there
    }

    /// Takes note of a time.
    fn time(&mut self, time: Option<Timestamp>) {
        if let Some(time) = time {
            self.store.begun.get_or_insert(time);
            self.pass(time);
        }
    }

    fn remark(&mut self, remark: Remark) {
        let remark = Row::Remark(Box::new(remark));
        self.store.frames.push(remark.clone());
        self.store.exchanges.push(remark);
    }

    /// Makes the row of a run of bytes, and counts it.
    fn run(&mut self, bus: usize, place: &Place<'_>, kind: RunKind) -> Run {
        let end = place.time.map(|time| time.end.midpoint());
        let run = Run {
            id: place.id,
            bus,
            time: place.time.map(|time| time.start.midpoint()),
            end,
            uncertainty_ns: place.time.map_or(0, |time| time.uncertainty_ns()),
            stream_offset: place.stream_offset,
            gap: place.gap_before,
            bytes: place.bytes.into(),
            line_errors: place.line_errors.into(),
            role: Role::Unknown,
            address: None,
            function: None,
            kind,
            exchange: None,
        };
        self.time(run.time);
        self.time(end);
        let character_ns = self.store.buses.get(bus).map_or(0, |bus| bus.line.character_ns());
        let length = run.bytes.len();
        if let Some(health) = self.health(bus) {
            let busy_ns = character_ns.saturating_mul(i64::try_from(length).unwrap_or(i64::MAX));
            health.run(end, length, busy_ns, matches!(kind, RunKind::Damaged(_)));
            if run.time.is_some() {
                health.blur.take(run.uncertainty_ns);
                health.worst_blur_ns = health.worst_blur_ns.max(run.uncertainty_ns);
            }
            if let Some(gap) = run.gap {
                health.gaps.take(gap.midpoint());
            }
            for error in place.line_errors {
                health.line_errors[Health::place_of_error(error.kind)] += 1;
            }
        }
        run
    }

    fn frame(&mut self, bus: usize, frame: &Frame<'_>) {
        let kind =
            RunKind::Frame { echo: frame.echo, boundary: frame.boundary, confidence: frame.confidence };
        let run = self.run(bus, &frame.place, kind);
        if let Some(health) = self.health(bus) {
            health.frames += 1;
        }
        let (address, function) = (Some(frame.address()), Some(frame.function()));
        self.store.frames.push(Row::Run(Box::new(Run { role: frame.role, address, function, ..run })));
    }

    fn damaged(&mut self, bus: usize, damaged: &Damaged<'_>) {
        let run = self.run(bus, &damaged.place, RunKind::Damaged(damaged.reason));
        if let Some(health) = self.health(bus) {
            let length = damaged.place.bytes.len() as u64;
            health.reasons[Health::place_of(damaged.reason)] += 1;
            health.damaged_bytes = health.damaged_bytes.saturating_add(length);
            if matches!(
                damaged.reason,
                crate::decode::frame::Reason::Stray | crate::decode::frame::Reason::Noise
            ) {
                health.stray_bytes = health.stray_bytes.saturating_add(length);
            }
        }
        if let Some(address) = damaged.address
            && self.store.device(bus, address).is_some()
        {
            self.device(bus, address).damaged += 1;
        }
        let (role, address, function) = (damaged.role, damaged.address, damaged.function);
        let run = Run { role, address, function, ..run };
        let id = run.id;
        let number = self.store.frames.push(Row::Run(Box::new(run)));
        self.held.push_back((number, id));
        if self.held.len() > MOST_HELD
            && let Some((number, _)) = self.held.pop_front()
        {
            self.release(number);
        }
    }

    fn lost(&mut self, bus: usize, lost: &Lost) {
        self.time(lost.time);
        if let Some(health) = self.health(bus) {
            let count = &mut health.lost[Health::place_of_loss(lost.kind)];
            *count = count.saturating_add(lost.count);
            health.losses += 1;
            health.error(lost.time);
        }
        let text = words::lost(lost).into();
        self.remark(Remark { bus, time: lost.time, address: None, kind: RemarkKind::Lost, text });
    }

    fn identified(&mut self, bus: usize, identified: &Identified, time: Option<Timestamp>) {
        let id = self.names.get(&identified.device);
        let label = self.names.get(self.labels.short(&identified.device));
        let serial = identified.serial_number.as_deref().map(|serial| self.names.get(serial));
        let evidence: Arc<str> = identified.evidence.as_str().into();
        let device = self.device(bus, identified.address);
        if device.serial.is_some() && serial.is_some() && device.serial != serial {
            // Another device took the place: what was known is the old one's.
            *device = Device { bus, address: identified.address, ..Device::default() };
        }
        (device.id, device.label, device.evidence) = (Some(id), label, Some(evidence));
        device.serial = serial.or_else(|| device.serial.take());
        if self.is_provisional {
            return; // it may have been known long before
        }
        let text = format!("{} recognised by {}", identified.device, identified.evidence).into();
        let address = Some(identified.address);
        self.remark(Remark { bus, time, address, kind: RemarkKind::Identified, text });
    }

    fn transaction(
        &mut self,
        bus: usize,
        row: &Transaction<'_>,
        meaning: &Meaning<'_>,
        codes: &[&'static str],
    ) {
        let exchange = Exchange { codes: codes.into(), ..self.exchange(bus, row, meaning) };
        self.held.retain(|(_, id)| !exchange.ids.contains(&Some(*id)));
        let is_bad = super::row::Tone::of(row.outcome) >= super::row::Tone::Warn;
        if let Some(health) = self.health(bus) {
            health.outcomes[row.outcome as usize] += 1; // in the order of `Outcome::ALL`
            if let Some(latency) = row.latency {
                health.latency.take(latency.midpoint());
            }
            if is_bad {
                health.error(exchange.end.or(exchange.time));
            }
        }
        self.observe(&exchange, row, meaning);
        let sides = exchange.sides;
        let number = self.store.exchanges.push(Row::Exchange(Box::new(exchange)));
        for side in sides.into_iter().flatten() {
            if let Some(Row::Run(run)) = self.store.frames.pages.get_mut(side) {
                run.exchange = Some(number);
            }
        }
    }

    fn exchange(&mut self, bus: usize, row: &Transaction<'_>, meaning: &Meaning<'_>) -> Exchange {
        let mut said = words::outcome(row).unwrap_or_default();
        let outcome_ends = said.len();
        if row.outcome != Outcome::Exception {
            let separator = if said.is_empty() { "" } else { " · " };
            said.push_str(separator);
            let from = said.len();
            // Fails only when a value's `Display` does; then the row ends there.
            let _ = words::write_meaning(&mut said, row, meaning);
            if said.len() == from {
                said.truncate(outcome_ends);
            }
        }
        if said.is_empty() {
            said.push_str(if row.outcome == Outcome::Broadcast { "broadcast" } else { "done" });
        }
        let ids = [row.request, row.response].map(|side| Some(side?.id));
        let mut names = |text: &str| self.names.get(text);
        Exchange {
            id: row.id,
            bus,
            time: columns::began(row),
            end: columns::ended(row),
            address: row.address,
            function: row.function,
            register: row.start_register,
            quantity: row.quantity,
            outcome: row.outcome,
            exception: row.exception_code.map(|code| code.0),
            latency: row.latency,
            device: meaning.device().map(&mut names),
            candidates: meaning.candidates().map(&mut names).collect(),
            label: names(&self.labels.of(meaning)),
            serial: meaning.serial_number().map(&mut names),
            command: meaning.command().map(&mut names),
            title: names(&words::command(row, meaning)),
            said: said.into(),
            fields: fields(meaning, &mut names),
            codes: Box::default(),
            ids,
            sides: ids.map(|id| frame_number(&self.store.frames, id?)),
        }
    }

    /// Learns about the device from a transaction.
    fn observe(&mut self, exchange: &Exchange, row: &Transaction<'_>, meaning: &Meaning<'_>) {
        let is_new_label = exchange.device.is_some() || &*exchange.label != "-";
        let (label, serial) = (Arc::clone(&exchange.label), exchange.serial.clone());
        let readings: Vec<Quantity> =
            meaning.readings().map(|reading| self.quantity(&reading, exchange.end)).collect();
        let guesses: Vec<Quantity> = guesses(exchange);
        let device = self.device(exchange.bus, exchange.address);
        device.outcomes[row.outcome as usize] += 1; // in the order of `Outcome::ALL`
        device.seen = exchange.end.or(device.seen);
        if row.request.is_some() {
            device.poll(exchange.time);
        }
        if device.id.is_none() && is_new_label {
            device.label = label;
        }
        device.id = exchange.device.clone().or_else(|| device.id.take());
        device.serial = serial.or_else(|| device.serial.take());
        device.latency = row.latency.or(device.latency);
        let is_answered = matches!(row.outcome, Outcome::Answered | Outcome::Late);
        let is_write = words::is_write(row.function);
        match is_write {
            true if is_answered => device.written = exchange.end,
            false if is_answered => device.read = exchange.end,
            _ => {}
        }
        readings.into_iter().chain(guesses).for_each(|quantity| device.measure(quantity));
        if let Some(register) = register(exchange, row) {
            device.register(register);
        }
        if is_answered {
            settings(device, exchange, is_write);
        }
    }

    fn quantity(&mut self, reading: &Reading<'_>, time: Option<Timestamp>) -> Quantity {
        Quantity {
            name: self.names.get(reading.quantity),
            unit: reading.unit.filter(|unit| *unit != "1").map(|unit| self.names.get(unit)),
            text: reading.to_string().into(),
            value: reading.value.as_f64(),
            time,
            is_implausible: reading.is_implausible(),
            is_derived: reading.derived,
            is_guess: false,
            history: super::Pages::default(),
        }
    }
}
