//! From what the captures hand on to the items of a session: times, offsets, losses. No thread, no waiting.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use super::super::failure::Failure;
use super::super::session::{Origin, Session, Setup, Sink};
use super::capture::{Captured, Order, Read};
use super::link::Link;
use super::notice::Notice;
use super::stage::Stage;
use super::watch::Watch;
use crate::capture::Item;
use crate::capture::mcap::{Anchor, BusSettings};
use crate::decode::chunk::{Chunk, Lost, LostKind, ReadTime};
use crate::line::LineSettings;
use crate::source::{Clock, SourceError};
use crate::time::{SECOND, Timestamp};

/// Is a source with its bus.
pub(in crate::command) struct Tapped {
    /// What the user calls the source.
    pub(in crate::command) name: String,
    /// The bus, its line settings and its adapter.
    pub(in crate::command) settings: BusSettings,
    /// How to tell the capture what to do; dropped, it ends.
    pub(in crate::command) orders: Option<Sender<Order>>,
    /// Whether its line settings are to be found from its traffic.
    pub(in crate::command) searches: bool,
}

impl Tapped {
    pub(in crate::command) fn new(name: String, settings: BusSettings, orders: Sender<Order>) -> Self {
        Tapped { name, settings, orders: Some(orders), searches: false }
    }
}

/// Decodes what live sources hand on.
pub(in crate::command) struct Engine<'a> {
    session: Session<'a>,
    pub(in crate::command) stage: Stage,
    sources: Vec<Tapped>,
    anchor: Anchor,
    clock: Arc<dyn Clock>,
    watch: Watch,
    notices: Vec<Notice>,
    /// The first source that failed for good.
    failed: Option<String>,
}

impl<'a> Engine<'a> {
    /// Begins a session of these sources on one clock.
    ///
    /// # Errors
    /// When nobody reads the rows any more.
    pub(in crate::command) fn new(
        setup: &'a Setup,
        mut stage: Stage,
        sources: Vec<Tapped>,
        anchor: Anchor,
        clock: Arc<dyn Clock>,
    ) -> Result<Self, Failure> {
        let now = anchor.time(clock.monotonic_ns());
        stage.now = stage.now.max(now);
        let link = |tapped: &Tapped| {
            let adapter_hold_ns = setup.adapter_hold_ns.or(tapped.settings.adapter_hold_ns);
            let settings = BusSettings { adapter_hold_ns, ..tapped.settings.clone() };
            Link::new(&settings, tapped.searches, setup.decodes, now)
        };
        stage.links = sources.iter().map(link).collect();
        if sources.len() > 1 {
            stage.links.iter_mut().for_each(Link::name_bus);
        }
        let mut engine = Engine {
            session: Session::new(setup),
            stage,
            sources,
            anchor,
            clock,
            watch: Watch::default(),
            notices: Vec::new(),
            failed: None,
        };
        (0..engine.sources.len()).try_for_each(|at| engine.begin(at))?;
        Ok(engine)
    }

    fn begin(&mut self, at: usize) -> Result<(), Failure> {
        self.session.begin(Origin::from(self.sources[at].settings.clone()), &mut self.stage)
    }

    /// Takes in what a source's capture hands on; rows are handed on by [`Engine::pause`].
    ///
    /// # Errors
    /// When nobody reads the rows any more.
    pub(in crate::command) fn take(&mut self, source: usize, what: Captured) -> Result<(), Failure> {
        if source >= self.sources.len() {
            return Ok(());
        }
        match what {
            Captured::Read(read) => self.take_read(source, &read),
            Captured::Silence(monotonic_ns) => {
                let until = self.time(monotonic_ns);
                self.stage.links[source].silence(until);
                self.session.poll(&self.sources[source].settings.name, until, &mut self.stage)?;
                self.settle()
            }
            Captured::Lost { monotonic_ns, kind, count } => self.lose(source, monotonic_ns, kind, count),
            Captured::Gone(monotonic_ns) => {
                let name = &self.sources[source].name;
                let text = format!("'{name}' is gone; it is tried again until it is back");
                self.notices.push(Notice::Warning(text));
                self.stage.links[source].set_away(true);
                self.lose(source, monotonic_ns, LostKind::SourceGone, 0)
            }
            Captured::Back { adapter_hold_ns, facts } => {
                self.stage.links[source].set_away(false);
                let tapped = &mut self.sources[source];
                self.notices.push(Notice::Note(format!("'{}' is back", tapped.name)));
                // What the user says of the adapter holds whatever the adapter says.
                tapped.settings.adapter_hold_ns = adapter_hold_ns;
                tapped.settings.facts = facts;
                self.begin(source)
            }
            Captured::Line { monotonic_ns, set } => self.take_line(source, monotonic_ns, set),
            Captured::Counters(counters) => {
                self.stage.links[source].counters(counters);
                self.stage.tally.counters(&self.sources[source].settings.name, counters);
                Ok(())
            }
            Captured::Ended(error) => {
                self.sources[source].orders = None;
                if let Some(error) = error {
                    self.failed.get_or_insert_with(|| self.sources[source].name.clone());
                    self.notices.push(Notice::Warning(error.to_string()));
                    self.notices.extend(error.hint.map(Notice::Hint));
                }
                Ok(())
            }
        }
    }

    fn take_line(
        &mut self,
        source: usize,
        monotonic_ns: u64,
        set: Result<LineSettings, SourceError>,
    ) -> Result<(), Failure> {
        let now = self.time(monotonic_ns);
        self.stage.links[source].line(set.is_ok(), now);
        match set {
            Ok(line) => {
                self.sources[source].settings.line = line;
                self.begin(source)
            }
            Err(error) => {
                self.notices.push(Notice::Warning(error.to_string()));
                Ok(())
            }
        }
    }

    fn time(&mut self, monotonic_ns: u64) -> Timestamp {
        let time = self.anchor.time(monotonic_ns);
        self.stage.now = self.stage.now.max(time);
        time
    }

    fn take_read(&mut self, source: usize, read: &Read) -> Result<(), Failure> {
        let now = self.time(read.monotonic_ns);
        let time = ReadTime::At(now);
        let ready = (read.ready_ns > 0).then(|| self.anchor.time(read.ready_ns));
        let bus = &self.sources[source].settings.name;
        let chunk = Chunk { time, bytes: &read.bytes, line_errors: &read.line_errors };
        self.stage.links[source].read(&chunk, now);
        let item = Item::Chunk { bus, chunk, ready };
        self.session.take(&item, &mut self.stage)?;
        self.settle()
    }

    fn lose(&mut self, source: usize, monotonic_ns: u64, kind: LostKind, count: u64) -> Result<(), Failure> {
        let time = Some(self.time(monotonic_ns));
        let bus = &self.sources[source].settings.name;
        // Its place is where the stream is: pipeline and recorder know that.
        let lost = Lost { time, stream_offset: 0, kind, count };
        self.session.take(&Item::Lost { bus, lost }, &mut self.stage)?;
        self.settle()
    }

    fn settle(&mut self) -> Result<(), Failure> {
        let settled = self.session.settled_frame_id();
        self.stage.pause(settled, false)
    }

    /// Hands on rows and entries, and does what is due; comes whenever there is nothing to take, and then at least
    /// four times a second.
    ///
    /// # Errors
    /// When nobody reads the rows any more.
    pub(in crate::command) fn pause(&mut self) -> Result<(), Failure> {
        let monotonic_ns = self.clock.monotonic_ns();
        let now = self.time(monotonic_ns);
        if let Some(compared) = self.watch.look(monotonic_ns, || self.clock.realtime()) {
            if let Some(ns) = compared.step_ns {
                let seconds = ns as f64 / SECOND as f64;
                let text = format!("the clock was set by {seconds:+.3} s; times go on as if it had not been");
                self.notices.push(Notice::Note(text));
            }
            if let Some(tape) = &mut self.stage.tape {
                tape.clock(monotonic_ns, compared.realtime);
            }
        }
        self.stage.tally.pass(now);
        self.check();
        let is_settled = self.session.is_settled();
        if let Some(tape) = &mut self.stage.tape {
            tape.pass(now, is_settled);
            if tape.take_shortage() {
                let text = "--ring: memory does not suffice for all of that time; what is kept is shorter";
                self.notices.push(Notice::Warning(text.to_owned()));
            }
        }
        let settled = self.session.settled_frame_id();
        self.stage.pause(settled, true)
    }

    /// Looks whether what comes makes sense, and does what is to be done about it.
    fn check(&mut self) {
        for source in 0..self.sources.len() {
            // A source that has ended is silent for ever.
            if self.sources[source].orders.is_some()
                && let Some(line) = self.stage.links[source].pass(&mut self.notices)
            {
                self.set_line(source, line);
            }
        }
    }

    /// Receives from a source with other line settings from now on; decoding starts afresh where it does.
    fn set_line(&mut self, source: usize, line: LineSettings) {
        let orders = self.sources.get(source).and_then(|tapped| tapped.orders.as_ref());
        // A capture that has ended says so itself.
        let _ = orders.map(|orders| orders.send(Order::SetLine(line)));
    }

    /// Returns the first source that failed for good.
    pub(in crate::command) fn failed(&self) -> Option<&str> {
        self.failed.as_deref()
    }

    /// Lets all captures end; what they have received is still to be taken.
    pub(in crate::command) fn stop(&mut self) {
        self.sources.iter_mut().for_each(|tapped| tapped.orders = None);
    }

    /// Returns what people should know, once.
    pub(in crate::command) fn take_notices(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.notices)
    }

    /// Ends the session: decides what is still open. Also tells whether nobody reads the rows any more.
    pub(in crate::command) fn finish(mut self) -> (Stage, Result<(), Failure>) {
        let result = self.session.finish(&mut self.stage);
        (self.stage, result)
    }
}

#[cfg(test)]
#[path = "engine_tests.rs"]
mod tests;
