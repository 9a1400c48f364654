//! Decodes the buses of a session: from items to events, in one order and with one count over all buses.

use std::sync::Arc;

use super::failure::Failure;
use crate::capture::Item;
use crate::capture::mcap::BusSettings;
use crate::decode::chunk::Chunk;
use crate::device::{Devices, Environment, Profiles};
use crate::line::LineSettings;
use crate::pipeline::{Event, Options, Pipeline};
use crate::report::redact::{self, Redacted, Redactor, Secrets};
use crate::time::Timestamp;

/// Receives what comes out of the inputs.
pub(super) trait Sink {
    /// Tells whether [`Sink::received`] takes reads: then they are decoded one by one.
    const RECEIVES: bool;

    /// Begins a bus, or goes on with other settings.
    fn begin(&mut self, origin: &Origin) -> Result<(), Failure>;

    /// Takes what was received, before what it decodes to; reads only with [`Sink::RECEIVES`].
    fn received(&mut self, _item: &Item<'_>) -> Result<(), Failure> {
        Ok(())
    }

    /// Takes an event.
    fn event(&mut self, bus: &str, event: &Event<'_>);

    /// Comes between chunks, now and then: frames before `settled_frame` have their transaction, or none;
    /// `waits` when the next chunk is not there yet.
    fn pause(&mut self, settled_frame: u64, waits: bool) -> Result<(), Failure>;
}

/// Says how the bytes of a bus were received.
#[derive(Clone, Debug)]
pub(super) struct Origin {
    /// Name, line settings and adapter, as decoded with.
    pub(super) settings: BusSettings,
    /// Whether nobody said what the line settings are.
    pub(super) line_is_assumed: bool,
    /// Whether nothing is known of when bytes were read.
    pub(super) is_raw: bool,
}

impl From<BusSettings> for Origin {
    /// Takes settings that somebody said, of reads that have their times.
    fn from(settings: BusSettings) -> Origin {
        Origin { settings, line_is_assumed: false, is_raw: false }
    }
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
    /// Whether findings are wanted.
    pub(super) findings: bool,
    /// Whether anything but the bytes is wanted.
    pub(super) decodes: bool,
    /// The serial numbers to blank in the bytes themselves, beside those found on the way; `None` to blank none.
    pub(super) secrets: Option<Arc<Secrets>>,
}

impl Setup {
    /// Decodes as the input says, with readings, and with nothing known but the profiles.
    pub(super) fn new(profiles: Arc<Profiles>) -> Self {
        Setup {
            line: None,
            adapter_hold_ns: None,
            devices: Devices::new(Arc::clone(&profiles), Environment::default()),
            profiles,
            readings: true,
            findings: false,
            decodes: true,
            secrets: None,
        }
    }
}

/// Is a bus being decoded.
#[derive(Clone)]
struct Bus {
    /// What the input calls it.
    name: String,
    settings: BusSettings,
    pipeline: Pipeline,
    redactor: Option<Redactor>,
}

/// Decodes all buses of a session; a copy goes on from the same state.
#[derive(Clone)]
pub(super) struct Session<'a> {
    setup: &'a Setup,
    ids: (u64, u64),
    buses: Vec<Bus>,
    /// How many frames came out.
    frames: u64,
}

impl<'a> Session<'a> {
    pub(super) fn new(setup: &'a Setup) -> Self {
        Session { setup, ids: (0, 0), buses: Vec::new(), frames: 0 }
    }

    /// Returns the line settings that override those of inputs.
    pub(super) fn line(&self) -> Option<LineSettings> {
        self.setup.line
    }

    /// Gives back memory that only saves time.
    pub(super) fn compact(&mut self) {
        self.buses.iter_mut().for_each(|bus| bus.pipeline.compact());
    }

    /// Tells whether a bus has begun.
    pub(super) fn has(&self, bus: &str) -> bool {
        self.buses.iter().any(|known| known.name == bus)
    }

    /// Tells whether no bus has begun.
    pub(super) fn is_empty(&self) -> bool {
        self.buses.is_empty()
    }

    /// Returns how many frames came out so far.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// Begins a bus; where it has begun and the settings are others, it is decoded afresh from here on.
    pub(super) fn begin(&mut self, origin: impl Into<Origin>, sink: &mut impl Sink) -> Result<(), Failure> {
        let mut origin = origin.into();
        let settings = &mut origin.settings;
        settings.line = self.setup.line.unwrap_or(settings.line);
        settings.adapter_hold_ns = self.setup.adapter_hold_ns.or(settings.adapter_hold_ns);
        let name = settings.name.clone();
        let known = self.buses.iter().position(|bus| bus.name == name);
        if let Some(secrets) = &self.setup.secrets {
            let profiles = &self.setup.profiles;
            redact::blank_settings(&mut settings.name, &mut settings.facts, profiles, secrets);
            settings.name = self.free_name(&name, &settings.name);
        }
        if let Some(at) = known {
            let before = &self.buses[at].settings;
            if before.line == settings.line && before.adapter_hold_ns == settings.adapter_hold_ns {
                return Ok(());
            }
            self.finish_bus(at, sink)?;
            self.buses.remove(at);
        }
        sink.begin(&origin)?;
        let settings = origin.settings;
        let redactor = self.setup.secrets.as_ref().map(|secrets| {
            let profiles = Arc::clone(&self.setup.profiles);
            Redactor::new(self.pipeline(&settings), profiles, Arc::clone(secrets))
        });
        let pipeline = self.pipeline(&settings);
        let at = known.unwrap_or(self.buses.len());
        self.buses.insert(at, Bus { name, settings, pipeline, redactor });
        Ok(())
    }

    /// Returns a name that no other bus has: two may differ in what was blanked only.
    fn free_name(&self, name: &str, blanked: &str) -> String {
        let others = || self.buses.iter().filter(|bus| bus.name != name);
        let names = (1_u32..).map(|try_| match try_ {
            1 => blanked.to_owned(),
            _ => format!("{blanked}-{try_}"),
        });
        let mut free = names.filter(|name| others().all(|bus| bus.settings.name != *name));
        free.next().unwrap_or_default() // there are more names than buses
    }

    fn pipeline(&self, settings: &BusSettings) -> Pipeline {
        let options = Options {
            readings: self.setup.readings,
            findings: self.setup.findings,
            ..Options::new(settings.line, settings.adapter_hold_ns)
        };
        Pipeline::new(options, self.setup.devices.clone(), self.setup.profiles.shapes())
    }

    /// Takes in an item of a bus that has begun; of others only settings. Tells whether it was taken in.
    #[inline]
    pub(super) fn take(&mut self, item: &Item<'_>, sink: &mut impl Sink) -> Result<bool, Failure> {
        if let Item::Chunk { bus, chunk, ready } = *item
            && self.take_reads(bus, std::iter::once((chunk, ready)), sink)?
        {
            return Ok(true);
        }
        self.take_seldom(item, sink)
    }

    /// Takes in reads, each with when its bytes were first there: nearly all there is, so the rest is kept out of their
    /// way. Takes nothing of a bus that has not begun, or of which something is to be blanked; tells whether it did.
    #[inline]
    pub(super) fn take_reads<'r, S: Sink>(
        &mut self,
        bus: &str,
        reads: impl Iterator<Item = (Chunk<'r>, Option<Timestamp>)>,
        sink: &mut S,
    ) -> Result<bool, Failure> {
        let known = self.buses.iter_mut().find(|known| known.settings.name == bus);
        let Some(Bus { settings, pipeline, .. }) = known.filter(|bus| bus.redactor.is_none()) else {
            return Ok(false);
        };
        let mut result = Ok(true);
        pipeline.set_next_ids(self.ids);
        if S::RECEIVES || !self.setup.decodes {
            for (chunk, ready) in reads {
                if let Err(failure) = sink.received(&Item::Chunk { bus, chunk, ready }) {
                    result = Err(failure);
                    break;
                }
                if self.setup.decodes {
                    pipeline.handle_bytes(&chunk);
                    self.frames += say(pipeline, &settings.name, sink);
                }
            }
        } else {
            let mut chunks = reads.map(|(chunk, _)| chunk);
            while pipeline.handle_reads(&mut chunks) {
                self.frames += say(pipeline, &settings.name, sink);
            }
            self.frames += say(pipeline, &settings.name, sink);
        }
        self.ids = pipeline.next_ids();
        result
    }

    #[inline(never)]
    fn take_seldom(&mut self, item: &Item<'_>, sink: &mut impl Sink) -> Result<bool, Failure> {
        if let Item::Line(settings) = item {
            return self.begin((*settings).clone(), sink).map(|()| true);
        }
        let Some(at) = self.buses.iter().position(|known| {
            // The clocks are of no bus; one has to hold them back with its reads, where they are.
            item.bus().is_none_or(|bus| known.name == bus)
        }) else {
            return Ok(item.bus().is_none());
        };
        let Some(redactor) = &mut self.buses[at].redactor else {
            return self.decode(at, item, sink).map(|()| true);
        };
        match item {
            Item::Chunk { chunk, ready, .. } => redactor.push(chunk, *ready),
            Item::Lost { lost, .. } => redactor.push_lost(*lost),
            Item::Silence { until, .. } => redactor.push_silence(*until),
            Item::Clock { monotonic_ns, realtime } => redactor.push_clock(*monotonic_ns, *realtime),
            Item::Note { time, text } => {
                let text = &redactor.blank_text(text);
                return self.decode(at, &Item::Note { time: *time, text }, sink).map(|()| true);
            }
            Item::Line(_) => {}
        }
        self.take_redacted(at, sink).map(|()| true)
    }

    /// Takes in the reads of a bus from which serial numbers have been blanked.
    fn take_redacted(&mut self, at: usize, sink: &mut impl Sink) -> Result<(), Failure> {
        let Some(mut redactor) = self.buses[at].redactor.take() else { return Ok(()) };
        let mut result = Ok(());
        let bus = self.buses[at].settings.name.clone();
        while let Some(redacted) = redactor.pop() {
            let item = match redacted {
                Redacted::Chunk(chunk, ready) => Item::Chunk { bus: &bus, chunk, ready },
                Redacted::Lost(lost) => Item::Lost { bus: &bus, lost },
                Redacted::Silence(until) => Item::Silence { bus: &bus, until },
                Redacted::Clock(monotonic_ns, realtime) => Item::Clock { monotonic_ns, realtime },
            };
            result = result.and(self.decode(at, &item, sink));
        }
        self.buses[at].redactor = Some(redactor);
        result
    }

    fn decode(&mut self, at: usize, item: &Item<'_>, sink: &mut impl Sink) -> Result<(), Failure> {
        sink.received(item)?;
        if self.setup.decodes {
            self.act(at, sink, |pipeline| match item {
                Item::Chunk { chunk, .. } => pipeline.handle_bytes(chunk),
                Item::Lost { lost, .. } => pipeline.handle_lost(*lost),
                Item::Silence { until, .. } => pipeline.handle_timeout(*until),
                Item::Line(_) | Item::Clock { .. } | Item::Note { .. } => {}
            });
        }
        Ok(())
    }

    /// Takes in that a live bus was silent until then, if that decides anything.
    ///
    /// What does is an item: the ids of all buses are counted in the order of decisions, and a recording has to
    /// give the same ones.
    pub(super) fn poll(&mut self, bus: &str, until: Timestamp, sink: &mut impl Sink) -> Result<(), Failure> {
        let known = self.buses.iter().find(|known| known.name == bus);
        let deadline = known.and_then(|bus| bus.pipeline.poll_timeout());
        if deadline.is_none_or(|deadline| deadline > until) {
            return Ok(());
        }
        self.take(&Item::Silence { bus, until }, sink).map(drop)
    }

    /// Tells whether every byte and frame so far is decided.
    pub(super) fn is_settled(&self) -> bool {
        self.buses.iter().all(|bus| bus.pipeline.poll_timeout().is_none())
    }

    fn finish_bus(&mut self, at: usize, sink: &mut impl Sink) -> Result<(), Failure> {
        if let Some(redactor) = &mut self.buses[at].redactor {
            redactor.finish();
            self.take_redacted(at, sink)?;
        }
        self.act(at, sink, Pipeline::finish);
        Ok(())
    }

    /// Lets a pipeline do something, with the ids that all share, and hands over all events that are there.
    fn act(&mut self, at: usize, sink: &mut impl Sink, act: impl FnOnce(&mut Pipeline)) {
        let Bus { settings, pipeline, .. } = &mut self.buses[at];
        pipeline.set_next_ids(self.ids);
        act(pipeline);
        self.frames += say(pipeline, &settings.name, sink);
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
            self.finish_bus(at, sink)?;
        }
        self.buses.clear();
        sink.pause(u64::MAX, true)
    }
}

/// Hands over all events that are there; returns how many of them are frames.
#[inline]
fn say(pipeline: &mut Pipeline, bus: &str, sink: &mut impl Sink) -> u64 {
    let mut frames = 0;
    while let Some(event) = pipeline.poll_event() {
        frames += u64::from(matches!(event, Event::Frame(_)));
        sink.event(bus, &event);
    }
    frames
}
