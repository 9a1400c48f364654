//! What a stretch of a recording comes to: the session and the store, which are values, and where they are.

use std::sync::Arc;

use super::super::super::failure::Failure;
use super::super::super::live::facts;
use super::super::super::session::{Origin, Session, Setup, Sink};
use crate::capture::Item;
use crate::capture::mcap::BusSettings;
use crate::decode::chunk::ReadTime;
use crate::line::LineSettings;
use crate::pipeline::Event;
use crate::report::words::Labels;
use crate::time::Timestamp;
use crate::tui::sieve::Sieve;
use crate::tui::store::{Feed, List, Store, Tone};
use crate::tui::timeline::Bucket;

/// About how many bytes of memory a session takes, with the place in the file: measured with three devices.
const STATE_BYTES: usize = 16 << 10;

/// Says how far a recording was decoded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Reached {
    /// Items taken.
    pub(super) items: u64,
    /// Bytes of buses taken.
    pub(super) bytes: u64,
    /// Nanoseconds from the beginning; never goes back.
    pub(super) elapsed_ns: i64,
    /// When the recording begins.
    pub(super) origin: Option<Timestamp>,
}

/// Decodes items into a store; a copy goes on from the same state.
#[derive(Clone)]
pub(super) struct Decoder<'a> {
    session: Session<'a>,
    feed: Feed,
    reached: Reached,
    /// What the last item came to.
    last: Bucket,
    /// What is looked for.
    pub(super) watched: Watched,
}

/// Holds what rows are counted by.
#[derive(Clone, Debug, Default)]
pub(super) struct Watched {
    /// The filter that is looked for.
    pub(super) filter: Option<Arc<Sieve>>,
    /// The words that are searched for.
    pub(super) words: Option<Arc<Sieve>>,
    /// At what playing pauses.
    pub(super) breaks: Option<Arc<Sieve>>,
}

/// Hands events to a feed.
struct Into<'b>(&'b mut Feed);

impl Sink for Into<'_> {
    const RECEIVES: bool = false;

    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        self.0.begin(facts(origin));
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        self.0.event(bus, event);
    }

    fn pause(&mut self, settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        self.0.settle(settled_frame);
        Ok(())
    }
}

impl<'a> Decoder<'a> {
    /// Begins before the first item.
    pub(super) fn new(setup: &'a Setup, labels: Labels) -> Self {
        Decoder {
            session: Session::new(setup),
            feed: Feed::new(labels),
            reached: Reached::default(),
            last: Bucket::default(),
            watched: Watched::default(),
        }
    }

    /// Returns a decoder that begins in the middle of a recording that begins at `origin`; this one has taken nothing.
    pub(super) fn provisional(&self, origin: Timestamp) -> Self {
        let reached = Reached { origin: Some(origin), ..Reached::default() };
        Decoder { feed: self.feed.provisional(origin), reached, ..self.clone() }
    }

    /// Forgets what was decoded so far, but for what it takes to go on.
    pub(super) fn begin_here(&mut self) {
        self.feed = self.feed.begun_here(self.session.settled_frame_id());
    }

    /// Returns how far it has got.
    pub(super) fn reached(&self) -> Reached {
        self.reached
    }

    /// Returns what the last item came to.
    pub(super) fn last(&self) -> Bucket {
        self.last
    }

    /// Returns what is known here.
    pub(super) fn store(&self) -> &Store {
        self.feed.store()
    }

    /// Returns about how many bytes of memory a copy takes, where it is a checkpoint.
    pub(super) fn size(&self) -> usize {
        self.store().size().saturating_add(STATE_BYTES)
    }

    /// Returns what is known here, as it looks at a later time at which nothing has come yet.
    pub(super) fn store_at(&self, elapsed_ns: i64) -> Store {
        match self.reached.origin {
            None => self.feed.store().clone(),
            Some(origin) => {
                let mut feed = self.feed.clone();
                feed.pass(origin + elapsed_ns);
                feed.store().clone()
            }
        }
    }

    /// Returns how many rows a list has had up to here.
    pub(super) fn rows(&self, list: List) -> u64 {
        self.store().list(list).total()
    }

    /// Returns where an item is that comes next.
    pub(super) fn elapsed_after(&self, item: &Item<'_>) -> i64 {
        let reached = self.reached.elapsed_ns;
        if is_untimed(item) {
            return reached.saturating_add(self.busy_ns(item));
        }
        let time = time_of(item);
        let since = time.map(|time| self.reached.origin.map_or(0, |origin| time - origin));
        since.unwrap_or(reached).max(reached)
    }

    /// Returns how long the bytes of an item took at line speed.
    fn busy_ns(&self, item: &Item<'_>) -> i64 {
        let Item::Chunk { bus, chunk, .. } = item else { return 0 };
        let known = self.store().buses().iter().find(|known| *known.name == **bus);
        let line = known.map_or_else(LineSettings::default, |bus| bus.line);
        line.character_ns().saturating_mul(i64::try_from(chunk.bytes.len()).unwrap_or(i64::MAX))
    }

    /// Takes an item; `line` is that of buses which do not say theirs.
    ///
    /// # Errors
    /// None that reading has not had before.
    pub(super) fn take(
        &mut self,
        item: &Item<'_>,
        line: LineSettings,
        hold_ns: Option<i64>,
    ) -> Result<(), Failure> {
        let mut sink = Into(&mut self.feed);
        let time = time_of(item);
        if let Item::Chunk { bus, .. } | Item::Lost { bus, .. } | Item::Silence { bus, .. } = *item
            && !self.session.has(bus)
        {
            let settings = BusSettings {
                name: bus.to_owned(),
                line,
                adapter_hold_ns: hold_ns,
                ..BusSettings::default()
            };
            self.session.begin(settings, &mut sink)?;
        }
        self.reached.origin = self.reached.origin.or(time);
        let elapsed_ns = self.elapsed_after(item);
        let before = self.counted();
        if let Item::Note { time, text } = item {
            self.feed.note(*time, text);
        }
        let mut sink = Into(&mut self.feed);
        self.session.take(item, &mut sink)?;
        sink.pause(self.session.settled_frame_id(), false)?;
        if let Some(time) = time {
            self.feed.pass(time);
        }
        let bytes = if let Item::Chunk { chunk, .. } = item { chunk.bytes.len() } else { 0 };
        self.reached.items += 1;
        self.reached.bytes = self.reached.bytes.saturating_add(bytes as u64);
        self.reached.elapsed_ns = elapsed_ns;
        self.last = self.since(before);
        self.last.busy_ns = self.busy_ns(item);
        self.last.notes = u64::from(matches!(item, Item::Note { .. }));
        Ok(())
    }

    /// Decides everything: the recording has ended.
    ///
    /// # Errors
    /// None that reading has not had before.
    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        let before = self.counted();
        self.session.finish(&mut Into(&mut self.feed))?;
        self.last = self.since(before);
        Ok(())
    }

    /// Returns how many transactions, and how many findings, there were.
    fn counted(&self) -> (u64, u64) {
        (self.rows(List::Exchanges), self.store().findings().total())
    }

    /// Returns what has come since.
    fn since(&self, (rows, findings): (u64, u64)) -> Bucket {
        let store = self.store();
        let new = || store.list(List::Exchanges).range(rows..u64::MAX);
        let count = |sieve: &Option<Arc<Sieve>>| {
            let passing = |sieve: &Arc<Sieve>| new().filter(|row| sieve.passes(store, row)).count() as u64;
            sieve.as_ref().map_or(0, passing)
        };
        Bucket {
            busy_ns: 0,
            rows: self.rows(List::Exchanges).saturating_sub(rows),
            errors: new().filter(|row| row.tone() >= Tone::Warn).count() as u64,
            findings: store.findings().total().saturating_sub(findings),
            matches: count(&self.watched.filter),
            words: count(&self.watched.words),
            breaks: count(&self.watched.breaks),
            notes: 0,
        }
    }

    /// Forgets rows that nobody will look at.
    pub(super) fn forget(&mut self) {
        self.feed = self.feed.checkpoint(self.session.settled_frame_id());
    }

    /// Forgets rows that nobody will look at; returns a copy to go on from later, in little memory.
    pub(super) fn checkpoint(&mut self) -> Self {
        self.forget();
        let mut copy = self.clone();
        copy.session.compact();
        copy
    }
}

/// Returns when an item was received, where that is known.
fn time_of(item: &Item<'_>) -> Option<Timestamp> {
    match item {
        Item::Chunk { chunk, .. } => match chunk.time {
            ReadTime::At(time) => Some(time),
            ReadTime::Unknown | ReadTime::UnknownAfterSilence => None,
        },
        Item::Lost { lost, .. } => lost.time,
        Item::Silence { until, .. } => Some(*until),
        Item::Line(_) | Item::Clock { .. } | Item::Note { .. } => None,
    }
}

/// Tells whether an item has bytes without a time.
fn is_untimed(item: &Item<'_>) -> bool {
    matches!(item, Item::Chunk { chunk, .. } if !matches!(chunk.time, ReadTime::At(_)))
}
