//! Decodes the buses of a session: from items to events, in one order and with one count over all buses.

use std::sync::Arc;

use super::failure::Failure;
use crate::capture::Item;
use crate::capture::mcap::BusSettings;
use crate::decode::chunk::Chunk;
use crate::device::{Devices, Profiles};
use crate::line::LineSettings;
use crate::pipeline::{Event, Options, Pipeline};
use crate::time::Timestamp;

/// Receives what comes out of the inputs.
pub(super) trait Sink {
    /// Begins a bus, or goes on with other settings.
    fn begin(&mut self, settings: &BusSettings) -> Result<(), Failure>;

    /// Takes what was received, before what it decodes to.
    fn received(&mut self, _item: &Item<'_>) -> Result<(), Failure> {
        Ok(())
    }

    /// Takes an event.
    fn event(&mut self, bus: &str, event: &Event<'_>);

    /// Comes after each chunk: frames before `settled_frame` have their transaction, or none;
    /// `waits` when the next chunk is not there yet.
    fn pause(&mut self, settled_frame: u64, waits: bool) -> Result<(), Failure>;
}

/// Says how to decode.
pub(super) struct Setup {
    /// Overrides what the input says.
    pub(super) line: Option<LineSettings>,
    /// Overrides what the input says.
    pub(super) adapter_hold_ns: Option<i64>,
    /// What is known of devices before anything is read.
    pub(super) devices: Devices,
    pub(super) profiles: Arc<Profiles>,
    /// Whether readings are wanted.
    pub(super) readings: bool,
    /// Whether anything but the bytes is wanted.
    pub(super) decodes: bool,
}

/// Is a bus being decoded.
struct Bus {
    settings: BusSettings,
    pipeline: Pipeline,
}

/// Decodes all buses of a session.
pub(super) struct Session<'a> {
    setup: &'a Setup,
    ids: (u64, u64),
    buses: Vec<Bus>,
}

impl<'a> Session<'a> {
    pub(super) fn new(setup: &'a Setup) -> Self {
        Session { setup, ids: (0, 0), buses: Vec::new() }
    }

    /// Returns the line settings that override those of inputs.
    pub(super) fn line(&self) -> Option<LineSettings> {
        self.setup.line
    }

    /// Tells whether a bus has begun.
    pub(super) fn knows(&self, bus: &str) -> bool {
        self.buses.iter().any(|known| known.settings.name == bus)
    }

    /// Begins a bus; where it has begun and the settings are others, it is decoded afresh from here on.
    pub(super) fn begin(&mut self, settings: BusSettings, sink: &mut impl Sink) -> Result<(), Failure> {
        let settings = BusSettings {
            line: self.setup.line.unwrap_or(settings.line),
            adapter_hold_ns: self.setup.adapter_hold_ns.or(settings.adapter_hold_ns),
            ..settings
        };
        let known = self.buses.iter().position(|bus| bus.settings.name == settings.name);
        if let Some(at) = known {
            let before = &self.buses[at].settings;
            if before.line == settings.line && before.adapter_hold_ns == settings.adapter_hold_ns {
                return Ok(());
            }
            self.act(at, sink, Pipeline::finish);
            self.buses.remove(at);
        }
        sink.begin(&settings)?;
        let options = Options {
            line: settings.line,
            adapter_hold_ns: settings.adapter_hold_ns,
            first_frame_id: self.ids.0,
            first_transaction_id: self.ids.1,
            readings: self.setup.readings,
        };
        let pipeline = Pipeline::new(options, self.setup.devices.clone(), self.setup.profiles.shapes());
        let at = known.unwrap_or(self.buses.len());
        self.buses.insert(at, Bus { settings, pipeline });
        Ok(())
    }

    /// Takes in an item of a bus that has begun; of others only settings.
    pub(super) fn take(&mut self, item: &Item<'_>, sink: &mut impl Sink) -> Result<(), Failure> {
        let bus = match *item {
            Item::Line { bus, line, adapter_hold_ns } => {
                let name = bus.to_owned();
                return self
                    .begin(BusSettings { name, line, adapter_hold_ns, ..BusSettings::default() }, sink);
            }
            Item::Chunk { bus, .. } | Item::Lost { bus, .. } => bus,
        };
        sink.received(item)?;
        let Some(at) = self.buses.iter().position(|known| known.settings.name == bus) else { return Ok(()) };
        if self.setup.decodes {
            self.act(at, sink, |pipeline| match item {
                Item::Chunk { chunk, .. } => pipeline.handle_bytes(chunk),
                Item::Lost { lost, .. } => pipeline.handle_lost(*lost),
                Item::Line { .. } => {}
            });
        }
        Ok(())
    }

    /// Takes in the bytes of one read of a bus.
    pub(super) fn take_chunk(
        &mut self,
        bus: &str,
        chunk: Chunk<'_>,
        ready: Option<Timestamp>,
        sink: &mut impl Sink,
    ) -> Result<(), Failure> {
        self.take(&Item::Chunk { bus, chunk, ready }, sink)
    }

    /// Lets a pipeline do something, with the ids that all share, and hands over all events that are there.
    fn act(&mut self, at: usize, sink: &mut impl Sink, act: impl FnOnce(&mut Pipeline)) {
        let Bus { settings, pipeline } = &mut self.buses[at];
        pipeline.set_next_ids(self.ids);
        act(pipeline);
        while let Some(event) = pipeline.poll_event() {
            sink.event(&settings.name, &event);
        }
        self.ids = pipeline.next_ids();
    }

    /// Returns an id: every frame or run with a smaller one belongs to a transaction that came out, or to none.
    pub(super) fn settled_frame_id(&mut self) -> u64 {
        for bus in &mut self.buses {
            bus.pipeline.set_next_ids(self.ids);
        }
        self.buses.iter().map(|bus| bus.pipeline.settled_frame_id()).min().unwrap_or(self.ids.0)
    }

    /// Ends all buses: what comes next is another session.
    pub(super) fn finish(&mut self, sink: &mut impl Sink) -> Result<(), Failure> {
        for at in 0..self.buses.len() {
            self.act(at, sink, Pipeline::finish);
        }
        self.buses.clear();
        sink.pause(u64::MAX, true)
    }
}
