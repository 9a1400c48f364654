//! What the screen shows of a live session, on the engine's side: never waits for the screen.

use super::super::session::Origin;
use super::super::ui::Teller;
use crate::pipeline::Event;
use crate::report::words::Labels;
use crate::source::LineErrorReports;
use crate::time::{MILLISECOND, SECOND, Timestamp};
use crate::tui::store::{BusFacts, Feed};

/// How long a store is shown at least before the next, in nanoseconds.
const SHOWN: i64 = 33 * MILLISECOND;
/// How often the screen learns that time has passed though nothing happened, in nanoseconds.
const HEARTBEAT: i64 = SECOND;

/// Grows the store of the screen.
pub(in crate::command) struct Monitor {
    feed: Feed,
    teller: Teller,
    /// What was shown last, and when.
    revision: u64,
    shown: Timestamp,
}

impl Monitor {
    pub(in crate::command) fn new(labels: Labels, teller: Teller) -> Self {
        Monitor { feed: Feed::new(labels), teller, revision: 0, shown: Timestamp::MIN }
    }

    /// Takes the settings of a bus.
    pub(super) fn begin(&mut self, origin: &Origin) {
        self.feed.begin(facts(origin));
    }

    /// Takes note that the source of a bus is gone since then, or back.
    pub(super) fn set_away(&mut self, bus: &str, since: Option<Timestamp>) {
        self.feed.set_away(bus, since);
    }

    pub(super) fn event(&mut self, bus: &str, event: &Event<'_>) {
        self.feed.event(bus, event);
    }

    /// Takes what somebody noted.
    pub(super) fn note(&mut self, time: Option<Timestamp>, text: &str) {
        self.feed.note(time, text);
    }

    pub(super) fn settle(&mut self, settled_frame: u64) {
        self.feed.settle(settled_frame);
    }

    /// Takes note of the time, and shows what there is, if it is time for that.
    pub(super) fn pass(&mut self, now: Timestamp) {
        self.feed.pass(now);
        let is_new = self.feed.store().revision() != self.revision;
        let wait = if is_new { SHOWN } else { HEARTBEAT };
        if now - self.shown >= wait && self.teller.is_taken() {
            self.show(now);
        }
    }

    fn show(&mut self, now: Timestamp) {
        self.teller.show(self.feed.store().clone());
        (self.revision, self.shown) = (self.feed.store().revision(), now);
    }
}

/// Returns what is known of a bus, as the screen has it.
pub(in crate::command) fn facts(origin: &Origin) -> BusFacts {
    let settings = &origin.settings;
    let fact = |key: &str| settings.facts.get(key).cloned();
    let facts = settings.facts.iter().filter(|(key, _)| *key != "source");
    let driver = fact("driver");
    BusFacts {
        name: settings.name.clone(),
        line: settings.line,
        source: fact("source"),
        hold_ns: settings.adapter_hold_ns,
        facts: facts.map(|(key, value)| (key.clone(), value.clone())).collect(),
        error_reports: driver.map(|driver| LineErrorReports::of(Some(&driver)).meaning()),
    }
}
