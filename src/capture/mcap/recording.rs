//! Reads a recording: the reads of its buses with their times, settings, and what was lost where.
//!
//! Complete, unfinished, damaged and still growing files are read alike. Memory stays flat: one chunk at a time.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use super::RECOVERED;
use super::definitions::{self, Definitions, Salvaged};
use super::index::{Index, Plan};
use super::messages::{Cause, Content, Damage, Messages};
use super::state::{Bus, State};
use super::time::Anchor;
use crate::capture::Item;
use crate::capture::origin::is_mcap;
use crate::decode::chunk::{Chunk, Lost, LostKind};
use crate::time::Timestamp;

/// Says what a recording holds beside its bytes, as far as it was read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// The session it is a part of.
    pub session: Option<Session>,
    /// What is known of each bus and its adapter, as [`super::BusSettings::facts`] has it.
    pub buses: BTreeMap<String, BTreeMap<String, String>>,
    /// Whether the file ends with its index, which says where everything is.
    pub is_indexed: bool,
    /// Why it was closed; `None` for a recording that was not.
    pub end: Option<String>,
    /// Where it could not be read: the first hundred places.
    pub damage: Vec<Damage>,
    /// In how many places it could not be read.
    pub damage_count: u64,
    /// Bytes of the file that could not be read.
    pub damage_bytes: u64,
    /// Bytes of buses that are lost for it, as far as their number is known.
    pub lost_bytes: u64,
    /// Messages that can be read, but mean nothing: what their channel was is lost.
    pub undefined_messages: u64,
    /// The buses of channels whose definition is lost, but whose messages can only be bytes of a bus.
    pub guessed_buses: Vec<String>,
}

/// Says what session a file is a part of.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Session {
    /// The same in all parts, and in no other session.
    pub id: String,
    /// Counts the parts from 1.
    pub part_index: u64,
    /// What wrote it.
    pub tool: String,
}

/// How many places of damage are kept.
const MOST_DAMAGE: usize = 100;

impl Facts {
    /// Tells whether nothing is missing, as far as the file tells.
    pub fn is_complete(&self) -> bool {
        let is_closed = self.end.as_ref().is_some_and(|reason| reason != RECOVERED);
        self.is_indexed
            && is_closed
            && self.damage_count == 0
            && self.lost_bytes == 0
            && self.undefined_messages == 0
    }

    /// Takes back that it ends within a record: whoever is writing it is about to go on.
    pub fn forget_cut(&mut self) {
        if let Some(cut) = self.damage.pop_if(|damage| damage.cause == Cause::Cut) {
            self.damage_count = self.damage_count.saturating_sub(1);
            self.damage_bytes = self.damage_bytes.saturating_sub(cut.length);
        }
    }

    /// Tells whether nothing is wrong with the file but that it ends where it should go on.
    pub fn ends_early(&self) -> bool {
        let is_cut = |damage: &Damage| damage.cause == Cause::Cut;
        !self.is_indexed && self.end.is_none() && self.damage.iter().all(is_cut)
    }

    /// Tells whether another file continues this one: a later part of the same session.
    pub fn is_continued_by(&self, next: &Facts) -> bool {
        match (&self.session, &next.session) {
            (Some(this), Some(next)) => this.id == next.id && this.part_index < next.part_index,
            _ => false,
        }
    }

    pub(super) fn add_damage(&mut self, damage: Damage) {
        self.damage_count += 1;
        self.damage_bytes = self.damage_bytes.saturating_add(damage.length);
        if self.damage.len() < MOST_DAMAGE {
            self.damage.push(damage);
        }
    }
}

/// Reads a recording item by item.
pub struct Recording {
    messages: Messages<Source>,
    state: State,
    index: Option<Index>,
    /// What the rest of an index still says that is not whole.
    salvaged: Salvaged,
    plan: Option<Plan>,
    follows: bool,
    is_finished: bool,
}

/// Is a place between the chunks of a file, with all that is known there.
#[derive(Clone)]
pub struct Place {
    at: (u64, bool),
    state: State,
    is_finished: bool,
}

/// Is where the bytes of a file come from.
pub(super) enum Source {
    File(File),
    Stream(Box<dyn Read + Send>),
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Source::File(file) => file.read(buffer),
            Source::Stream(stream) => stream.read(buffer),
        }
    }
}

impl Seek for Source {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Source::File(file) => file.seek(to),
            Source::Stream(_) => Err(io::ErrorKind::NotSeekable.into()),
        }
    }
}

impl Recording {
    /// Reads a file, of which the index is read first when there is one.
    ///
    /// # Errors
    /// When the system cannot read it.
    pub fn from_file(mut file: File) -> io::Result<Self> {
        let index = Index::read(&mut file)?;
        let salvaged = Salvaged::of(&file, index.is_some())?;
        let mut recording = Recording { salvaged, ..Recording::new(Source::File(file)) };
        if let Some(index) = &index {
            for (schema, channel) in index.channels() {
                recording.messages.learn(schema, channel.clone());
                recording.state.channel(&channel, &recording.messages.schemas);
            }
        }
        recording.index = index;
        Ok(recording)
    }

    /// Reads a stream from beginning to end.
    pub fn from_stream(stream: Box<dyn Read + Send>) -> Self {
        Recording::new(Source::Stream(stream))
    }

    fn new(source: Source) -> Self {
        Recording {
            messages: Messages::new(source),
            state: State::default(),
            index: None,
            salvaged: Salvaged::default(),
            plan: None,
            follows: false,
            is_finished: false,
        }
    }

    /// Waits at the end for a file to grow: [`Recording::next_item`] then returns `None` whenever nothing is there.
    pub fn follow(&mut self) {
        self.follows = true;
    }

    /// Tells whether all has been read; a file that is followed ends with its index.
    pub fn is_finished(&self) -> bool {
        self.is_finished
    }

    /// Reads only what was logged from `from` to `to`, both included, and the line settings before.
    ///
    /// Returns false and reads everything when the file has no index, or was begun to be read.
    pub fn select(&mut self, from: Timestamp, to: Timestamp) -> bool {
        let Some(index) = self.index.as_ref().filter(|_| self.messages.position() == 0) else { return false };
        self.plan = Some(index.plan(from, to));
        self.state.select(from, to);
        true
    }

    /// Reads only what leads up to a time, from at least `bytes` of messages before, and all that follows.
    ///
    /// Returns false and reads everything when the file has no index, or was begun to be read.
    pub fn start_near(&mut self, time: Timestamp, bytes: u64) -> bool {
        let from = self.index.as_ref().and_then(|index| index.before(time, bytes));
        from.is_some_and(|from| self.select(from, Timestamp::from_ns(i64::MAX)))
    }

    /// Returns where to go on later; `None` while items wait or a chunk is read, and for streams.
    pub fn place(&self) -> Option<Place> {
        let can_go = matches!(self.messages.source(), Source::File(_))
            && self.plan.is_none()
            && !self.state.has_items();
        let at = self.messages.place().filter(|_| can_go)?;
        Some(Place { at, state: self.state.clone(), is_finished: self.is_finished })
    }

    /// Goes on from a place in the same file.
    ///
    /// # Errors
    /// When the system cannot go there.
    pub fn go(&mut self, place: &Place) -> io::Result<()> {
        self.messages.go(place.at)?;
        self.plan = None;
        self.state = place.state.clone();
        // Channels that were seen after the place are not told again.
        self.state.channels(&self.messages.channels, &self.messages.schemas);
        self.is_finished = place.is_finished;
        Ok(())
    }

    /// Returns the first and the last time of the file, where its index says them.
    pub fn times(&self) -> Option<(Timestamp, Timestamp)> {
        self.index.as_ref()?.times()
    }

    /// Goes on with the streams of an earlier recording, if this one is a later part of its session; tells whether.
    ///
    /// To be called before the first item is read.
    pub fn continue_after(&mut self, earlier: &Recording) -> bool {
        let continues = self.read_session().is_ok() && earlier.facts().is_continued_by(self.facts());
        if continues {
            self.state.continue_after(&earlier.state);
        }
        continues
    }

    /// Reads on until the session is known or the first item is there.
    fn read_session(&mut self) -> io::Result<()> {
        while self.facts().session.is_none() && !self.state.has_items() && !self.is_finished {
            if !self.read_on()? {
                break;
            }
        }
        Ok(())
    }

    /// Returns what is known beside the bytes, as far as the file was read.
    pub fn facts(&self) -> &Facts {
        &self.state.facts
    }

    /// Returns the topics of a file that is no recording of a bus, with their schemas; `None` when it may be one.
    pub fn foreign_topics(&self) -> Option<Vec<(String, String)>> {
        let is_own = self.state.has_own_channel() || self.facts().session.is_some();
        if is_own || !(self.is_finished || self.index.is_some()) {
            return None;
        }
        let channels = self.messages.channels.values().map(|channel| {
            let schema = self.messages.schemas.get(&channel.schema_id);
            (channel.topic.clone(), schema.map_or("no schema", |schema| &schema.name).to_owned())
        });
        Some(channels.collect())
    }

    /// Returns how many bytes of the file were read.
    pub fn position(&self) -> u64 {
        self.messages.position()
    }

    /// Tells whether the next item has to be waited for.
    pub fn is_drained(&self) -> bool {
        !self.state.has_items() && self.messages.is_drained()
    }

    /// Goes on to the next item; tells whether there is one.
    ///
    /// # Errors
    /// When the system cannot read on.
    pub fn advance(&mut self) -> io::Result<bool> {
        while !self.state.advance() {
            if self.is_finished || !self.read_on()? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Returns the bus of the read gone on to, where the item is one.
    #[inline]
    pub fn bus_of_read(&self) -> Option<&str> {
        self.state.bus_of_read()
    }

    /// Hands out the read gone on to and those after it in its message, each with when its bytes were first there.
    ///
    /// `take` tells whether it wants more; the last read it got is then the one gone on to.
    #[inline]
    pub fn each_read(&mut self, take: impl FnMut(Chunk<'_>, Option<Timestamp>) -> bool) {
        self.state.each_read(take);
    }

    /// Returns the item gone on to.
    pub fn item(&self) -> Item<'_> {
        self.state.item()
    }

    /// Goes on to the next item and returns it; `None` at the end.
    ///
    /// # Errors
    /// When the system cannot read on.
    pub fn next_item(&mut self) -> io::Result<Option<Item<'_>>> {
        Ok(if self.advance()? { Some(self.item()) } else { None })
    }

    /// Takes in the next message of the file; tells whether to go on.
    fn read_on(&mut self) -> io::Result<bool> {
        if let Some(plan) = self.plan.as_mut().filter(|_| !self.messages.is_in_chunk()) {
            let Some(offset) = plan.next() else {
                self.is_finished = true;
                return Ok(true);
            };
            self.messages.seek(offset)?;
        }
        match self.messages.next()? {
            Content::Message { head, payload } => self.state.message(head, payload),
            Content::Channel(_) => self.state.channels(&self.messages.channels, &self.messages.schemas),
            Content::Metadata(metadata) => self.state.metadata(&metadata),
            Content::Attachment { name, data, .. } if name == definitions::NAME => {
                Definitions::from_file(&data).teach(&mut self.messages, &mut self.state);
            }
            Content::Attachment { .. } => {}
            Content::Damage(damage) => self.state.damage(damage),
            Content::Index => self.finish(None, true),
            Content::End(_) if self.follows => return Ok(false),
            Content::End(cut) => self.finish(cut, false),
        }
        if let Some((head, payload)) = self.state.take_orphan() {
            let salvaged = self.salvaged.definitions();
            salvaged.adopt((head, &payload), &mut self.messages, &mut self.state);
        }
        Ok(true)
    }

    fn finish(&mut self, cut: Option<Damage>, is_indexed: bool) {
        self.is_finished = true;
        self.state.facts.is_indexed = is_indexed;
        if let Some(cut) = cut {
            self.state.damage(cut);
        }
        self.state.finish();
    }
}

/// Is what a recording says before its first bytes.
#[derive(Clone, Debug, Default)]
pub struct Preface {
    /// The session it is a part of.
    pub session: Option<Session>,
    /// Ties its times to a monotonic clock, where it begins with that.
    pub anchor: Option<Anchor>,
    /// The files kept in it: name and content.
    pub attachments: Vec<(String, Vec<u8>)>,
}

impl Preface {
    /// Reads what stands before the first bytes of a file; a file that is no MCAP says nothing.
    ///
    /// # Errors
    /// When the system cannot read it.
    pub fn read(mut file: File) -> io::Result<Self> {
        // What is something else is not searched for records.
        let mut prefix = Vec::new();
        (&mut file).take(mcap::MAGIC.len() as u64).read_to_end(&mut prefix)?;
        if !is_mcap(&prefix) {
            return Ok(Preface::default());
        }
        file.rewind()?;
        let mut messages = Messages::new(file);
        let mut preface = Preface::default();
        let mut state = State::default();
        loop {
            match messages.next()? {
                Content::Metadata(metadata) => state.metadata(&metadata),
                Content::Attachment { name, data, .. } => preface.attachments.push((name, data)),
                Content::Channel(channel) if channel.topic.ends_with("/raw") => break,
                Content::Channel(_) => state.channels(&messages.channels, &messages.schemas),
                Content::Message { head, payload } => state.message(head, payload),
                // What is damaged at its beginning has none.
                Content::Damage(_) | Content::Index | Content::End(_) => break,
            }
        }
        (preface.session, preface.anchor) = (state.facts.session, state.anchor);
        Ok(preface)
    }
}

/// Says that bytes of a bus are missing in a file.
pub(super) fn missing(bus: &Bus, count: u64) -> Lost {
    Lost { time: bus.last_time, stream_offset: bus.end, kind: LostKind::Disk, count }
}
