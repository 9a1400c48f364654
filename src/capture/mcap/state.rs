//! What the messages of a recording come to: items, in the order of the file.

use std::collections::{BTreeMap, VecDeque};

use mcap::records::{Channel, Metadata};
use prost::Message;

use super::line::{BusSettings, LINE_METADATA};
use super::messages::{Cause, Damage, SchemaRecord};
use super::raw_chunk;
use super::reads::Reads;
use super::recording::{Facts, Session, missing};
use super::schema::{Clock, ErrorKind, Line, NOTES, Note, RawChunk, Schema};
use super::time::Anchor;
use super::unpack::MessageHead;
use super::{END_METADATA, SESSION_METADATA};
use crate::capture::{BUS, Item};
use crate::decode::chunk::{Chunk, Lost, LostKind};
use crate::time::Timestamp;

/// Is what a channel is to a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Topic {
    /// Not defined, as far as the file was read.
    #[default]
    Unknown,
    Other,
    Raw(usize),
    Line(usize),
    Clock,
    Notes,
}

/// Is a bus of the recording, as far as it was read.
#[derive(Clone, Debug)]
pub(super) struct Bus {
    pub(super) name: String,
    /// The settings in force, once they were said.
    settings: Option<BusSettings>,
    /// Stream offset after the last byte; `None` before the first where the file does not begin with the stream.
    expected: Option<u64>,
    /// The same, 0 when not known.
    pub(super) end: u64,
    pub(super) last_time: Option<Timestamp>,
    /// Bytes found in this file.
    bytes: u64,
}

/// Is an item to be handed out.
#[derive(Clone)]
enum Ready {
    Line(usize),
    Lost(usize, Lost),
    Chunk(usize),
    Silence(usize, Timestamp),
    Clock(u64, Timestamp),
    Note(Option<Timestamp>, String),
}

/// Stands where there is no item.
const NOTHING: Item<'static> =
    Item::Lost { bus: "", lost: Lost { time: None, stream_offset: 0, kind: LostKind::Disk, count: 0 } };

/// Turns messages into items.
#[derive(Clone, Default)]
pub(super) struct State {
    pub(super) facts: Facts,
    topics: Vec<Topic>,
    buses: Vec<Bus>,
    /// Settings from metadata, for buses whose first message of settings is damaged.
    described: BTreeMap<String, BusSettings>,
    pub(super) anchor: Option<Anchor>,
    bytes_total: Option<u64>,
    bytes_lost_before: u64,
    /// Bytes that damage to the file has taken.
    missing: u64,
    raw: RawChunk,
    reads: Reads,
    queue: VecDeque<Ready>,
    current: Option<Ready>,
    /// Log times asked for.
    selection: Option<(u64, u64)>,
    /// Whether messages were lost since the last chunk of bytes.
    is_damaged_since: bool,
    /// A message whose channel is not known.
    orphan: Option<(MessageHead, Vec<u8>)>,
}

impl State {
    /// Learns what the channels of a file are.
    pub(super) fn channels(
        &mut self,
        channels: &BTreeMap<u16, Channel>,
        schemas: &BTreeMap<u16, SchemaRecord>,
    ) {
        channels.values().for_each(|channel| self.channel(channel, schemas));
    }

    /// Learns what a channel is.
    pub(super) fn channel(&mut self, channel: &Channel, schemas: &BTreeMap<u16, SchemaRecord>) {
        let id = usize::from(channel.id);
        if self.topics.len() <= id {
            self.topics.resize(id + 1, Topic::Unknown);
        }
        if channel.message_encoding != super::ENCODING {
            self.topics[id] = Topic::Other;
            return;
        }
        let schema = schemas.get(&channel.schema_id).map_or("", |schema| &schema.name);
        let bus_of = |suffix| channel.topic.strip_prefix('/')?.strip_suffix(suffix);
        self.topics[id] = if schema == Schema::CLOCK.name {
            Topic::Clock
        } else if let Some(name) = bus_of("/raw").filter(|_| schema == Schema::RAW_CHUNK.name) {
            Topic::Raw(self.bus(name))
        } else if let Some(name) = bus_of("/line").filter(|_| schema == Schema::LINE.name) {
            Topic::Line(self.bus(name))
        } else if channel.topic == NOTES && schema == Note::SCHEMA {
            Topic::Notes
        } else {
            Topic::Other
        };
    }

    /// Returns the index of a bus, which is new when it is not known.
    fn bus(&mut self, name: &str) -> usize {
        self.buses.iter().position(|bus| bus.name == name).unwrap_or_else(|| {
            let name = name.to_owned();
            self.buses.push(Bus { name, settings: None, expected: None, end: 0, last_time: None, bytes: 0 });
            self.buses.len() - 1
        })
    }

    /// Returns the settings that metadata give, as messages, for the buses of which no message gave any.
    pub(super) fn described_lines(&self) -> Vec<(String, Line)> {
        let lines = self.described.iter().map(|(bus, settings)| (bus.clone(), settings.message()));
        lines.collect()
    }

    /// Returns the bytes of buses found in the file.
    pub(super) fn bytes(&self) -> u64 {
        self.buses.iter().map(|bus| bus.bytes).sum()
    }

    /// Returns the bytes that were lost when the file was written, as it says itself.
    pub(super) fn bytes_lost_before(&self) -> u64 {
        self.bytes_lost_before
    }

    /// Tells whether any channel is one of a recording of a bus.
    pub(super) fn has_own_channel(&self) -> bool {
        self.topics.iter().any(|topic| !matches!(topic, Topic::Unknown | Topic::Other))
    }

    /// Returns the only bus of which settings are known and bytes are not; the usual name where none is known at all.
    pub(super) fn bus_without_bytes(&self) -> Option<String> {
        let mut names: Vec<&str> = self.described.keys().map(String::as_str).collect();
        names.extend(
            self.buses.iter().map(|bus| &*bus.name).filter(|name| !self.described.contains_key(*name)),
        );
        if names.is_empty() {
            return Some(BUS.to_owned());
        }
        let has_bytes = |name: &str| {
            let is_its = |topic: &Topic| matches!(topic, Topic::Raw(bus) if self.buses[*bus].name == name);
            self.topics.iter().any(is_its)
        };
        let mut without = names.into_iter().filter(|name| !has_bytes(name));
        let first = without.next()?;
        without.next().is_none().then(|| first.to_owned())
    }

    /// Tells whether the file is a recording of buses, as far as it was read.
    pub(super) fn is_own(&self) -> bool {
        self.facts.session.is_some() || !self.described.is_empty() || self.has_own_channel()
    }

    /// Returns the message taken in last, if its channel is not known.
    pub(super) fn take_orphan(&mut self) -> Option<(MessageHead, Vec<u8>)> {
        self.orphan.take()
    }

    /// Hands out only what was logged within these times.
    pub(super) fn select(&mut self, from: Timestamp, to: Timestamp) {
        let log = |time: Timestamp| u64::try_from(time.as_ns()).unwrap_or(0);
        self.selection = Some((log(from), log(to)));
    }

    /// Goes on with the streams of an earlier part.
    pub(super) fn continue_after(&mut self, earlier: &State) {
        for before in &earlier.buses {
            let index = self.bus(&before.name);
            let bus = &mut self.buses[index];
            bus.expected = before.expected;
            bus.end = before.end;
            bus.last_time = before.last_time;
        }
        self.anchor = self.anchor.or(earlier.anchor);
    }

    pub(super) fn metadata(&mut self, metadata: &Metadata) {
        let get = |key: &str| metadata.metadata.get(key);
        let number = |key: &str| get(key).and_then(|text| text.parse::<u64>().ok());
        match &*metadata.name {
            SESSION_METADATA => {
                let text = |key: &str| get(key).cloned().unwrap_or_default();
                let part_index = number("part_index").unwrap_or(1);
                self.facts.session = Some(Session { id: text("session_id"), part_index, tool: text("tool") });
            }
            LINE_METADATA => {
                if let Some(settings) = BusSettings::from_metadata(&metadata.metadata) {
                    self.facts.buses.insert(settings.name.clone(), settings.facts.clone());
                    self.described.insert(settings.name.clone(), settings);
                }
            }
            END_METADATA => {
                self.facts.end = Some(get("reason").cloned().unwrap_or_default());
                self.bytes_total = number("bytes_total");
                self.bytes_lost_before = number("bytes_lost").unwrap_or(0);
            }
            _ => {}
        }
    }

    pub(super) fn damage(&mut self, damage: Damage) {
        self.is_damaged_since |= damage.had_messages;
        self.facts.add_damage(damage);
    }

    /// Takes in a message of a channel.
    pub(super) fn message(&mut self, head: MessageHead, payload: &[u8]) {
        let topic = self.topics.get(usize::from(head.channel)).copied().unwrap_or_default();
        match topic {
            Topic::Unknown => self.orphan = Some((head, payload.to_vec())),
            Topic::Other => {}
            Topic::Clock => self.clock(head, payload),
            Topic::Notes => match Note::decode(payload) {
                Ok(note) if self.selects(head.log_time) => {
                    self.queue.push_back(Ready::Note(note.time(), note.message));
                }
                Ok(_) => {}
                Err(_) => self.bad_message(payload),
            },
            Topic::Line(bus) => match Line::decode(payload) {
                Ok(line) => match BusSettings::from_message(&self.buses[bus].name, &line) {
                    Some(settings) => self.settings(bus, settings),
                    None => self.bad_message(payload),
                },
                Err(_) => self.bad_message(payload),
            },
            Topic::Raw(bus) => {
                if self.selects(head.log_time) {
                    self.raw(bus, head, payload);
                }
            }
        }
    }

    fn selects(&self, log_time: u64) -> bool {
        self.selection.is_none_or(|(from, to)| (from..=to).contains(&log_time))
    }

    /// Takes the session's anchor from the first message of a file; later ones tell how the clocks drift.
    fn clock(&mut self, head: MessageHead, payload: &[u8]) {
        let Ok(Clock { monotonic_ns, realtime_ns }) = Clock::decode(payload) else {
            return self.bad_message(payload);
        };
        let realtime = Timestamp::from_ns(realtime_ns as i64); // signed, by its definition
        let said = Anchor { monotonic_ns, realtime };
        let by_log = || anchor_by_log_time(monotonic_ns, head);
        let anchor = *self.anchor.get_or_insert_with(|| if head.sequence <= 1 { said } else { by_log() });
        // Every part begins with the anchor again.
        if said != anchor && self.selects(head.log_time) {
            self.queue.push_back(Ready::Clock(monotonic_ns, realtime));
        }
    }

    fn bad_message(&mut self, payload: &[u8]) {
        let length = payload.len() as u64;
        self.damage(Damage { offset: 0, length, cause: Cause::Content, had_messages: true });
    }

    /// Takes in settings; the same again change nothing.
    fn settings(&mut self, index: usize, mut settings: BusSettings) {
        if let Some(facts) = self.facts.buses.get(&settings.name) {
            settings.facts.clone_from(facts);
        }
        let bus = &mut self.buses[index];
        let known = bus.settings.as_ref();
        let same = known.is_some_and(|known| {
            known.line == settings.line && known.adapter_hold_ns == settings.adapter_hold_ns
        });
        if !same {
            bus.settings = Some(settings);
            self.queue.push_back(Ready::Line(index));
        }
    }

    /// Takes in bytes of a bus.
    fn raw(&mut self, index: usize, head: MessageHead, payload: &[u8]) {
        if raw_chunk::read(payload, &mut self.raw).is_err() {
            return self.bad_message(payload);
        }
        if self.buses[index].settings.is_none()
            && let Some(settings) = self.described.get(&self.buses[index].name).cloned()
        {
            self.settings(index, settings);
        }
        let anchor = *self.anchor.get_or_insert_with(|| anchor_by_log_time(self.raw.monotonic_ns, head));
        let damaged = std::mem::take(&mut self.is_damaged_since);
        let is_first_part = self.facts.session.as_ref().is_none_or(|session| session.part_index <= 1);
        let bus = &mut self.buses[index];
        let begins_at =
            if damaged && is_first_part && self.selection.is_none() { 0 } else { self.raw.stream_offset };
        let expected = bus.expected.unwrap_or(begins_at);
        self.reads.begin(&self.raw, anchor);
        if let Some(count) = self.raw.stream_offset.checked_sub(expected).filter(|count| *count > 0) {
            bus.end = expected;
            let lost = Lost { time: self.reads.first_time().or(bus.last_time), ..missing(bus, count) };
            self.missing = self.missing.saturating_add(count);
            self.facts.lost_bytes = self.facts.lost_bytes.saturating_add(count);
            self.queue.push_back(Ready::Lost(index, lost));
        }
        bus.bytes = bus.bytes.saturating_add(self.raw.data.len() as u64);
        bus.last_time = self.reads.last_time().or(bus.last_time);
        bus.end = self.raw.stream_offset.saturating_add(self.raw.data.len() as u64);
        if Reads::is_any(&self.raw) {
            self.queue.push_back(Ready::Chunk(index));
        } else if self.raw.errors.is_empty()
            && let Some(until) = self.reads.last_time()
        {
            self.queue.push_back(Ready::Silence(index, until));
        }
        self.losses(index);
        self.buses[index].expected = Some(self.buses[index].end);
    }

    /// Takes the losses that the recording itself speaks of.
    fn losses(&mut self, index: usize) {
        let bus = &mut self.buses[index];
        for error in &self.raw.errors {
            let kind = match (error.kind(), error.count) {
                (ErrorKind::Lost, 0) => LostKind::SourceGone,
                (ErrorKind::Lost, _) => LostKind::Queue,
                (ErrorKind::Overrun, _) if self.raw.data.is_empty() => LostKind::Overrun,
                _ => continue,
            };
            let count = u64::from(error.count);
            let lost = Lost { time: bus.last_time, stream_offset: bus.end, kind, count };
            bus.end = bus.end.saturating_add(count);
            self.queue.push_back(Ready::Lost(index, lost));
        }
    }

    /// Says what is missing at the end of the file.
    pub(super) fn finish(&mut self) {
        if self.selection.is_some() || self.buses.is_empty() {
            return;
        }
        let accounted = self.bytes().saturating_add(self.missing);
        let last = self.buses.len() - 1;
        match self.bytes_total {
            Some(total) if total > accounted => {
                let count = total - accounted;
                self.facts.lost_bytes = self.facts.lost_bytes.saturating_add(count);
                self.queue.push_back(Ready::Lost(last, missing(&self.buses[last], count)));
            }
            None if self.is_damaged_since => {
                let lost = self.buses.iter().enumerate();
                self.queue.extend(lost.map(|(index, bus)| Ready::Lost(index, missing(bus, 0))));
            }
            _ => {}
        }
    }

    /// Tells whether items are there without reading on.
    pub(super) fn has_items(&self) -> bool {
        !self.queue.is_empty()
            || (matches!(self.current, Some(Ready::Chunk(_))) && self.reads.has_more(&self.raw))
    }

    /// Goes on to the next item; tells whether there is one.
    pub(super) fn advance(&mut self) -> bool {
        if matches!(self.current, Some(Ready::Chunk(_))) && self.reads.advance(&self.raw) {
            return true;
        }
        self.current = self.queue.pop_front();
        if matches!(self.current, Some(Ready::Chunk(_))) {
            return self.reads.advance(&self.raw);
        }
        self.current.is_some()
    }

    /// Returns the bus of the read gone on to, where the item is one.
    #[inline]
    pub(super) fn bus_of_read(&self) -> Option<&str> {
        let Some(Ready::Chunk(bus)) = self.current else { return None };
        Some(&self.buses[bus].name)
    }

    /// Hands out the read gone on to and those after it in its message, each with when its bytes were first there.
    ///
    /// `take` tells whether it wants more; the last read it got is then the one gone on to.
    #[inline]
    pub(super) fn each_read(&mut self, mut take: impl FnMut(Chunk<'_>, Option<Timestamp>) -> bool) {
        if !matches!(self.current, Some(Ready::Chunk(_))) {
            return;
        }
        while take(self.reads.chunk(&self.raw), self.reads.ready(&self.raw)) {
            if !self.reads.advance(&self.raw) {
                return;
            }
        }
    }

    /// Returns the item gone on to.
    pub(super) fn item(&self) -> Item<'_> {
        match self.bus_of_read() {
            Some(bus) => {
                Item::Chunk { bus, chunk: self.reads.chunk(&self.raw), ready: self.reads.ready(&self.raw) }
            }
            None => self.seldom_item(),
        }
    }

    fn seldom_item(&self) -> Item<'_> {
        match &self.current {
            Some(Ready::Line(bus)) => self.buses[*bus].settings.as_ref().map_or(NOTHING, Item::Line),
            Some(Ready::Lost(bus, lost)) => Item::Lost { bus: &self.buses[*bus].name, lost: *lost },
            Some(Ready::Silence(bus, until)) => Item::Silence { bus: &self.buses[*bus].name, until: *until },
            Some(Ready::Clock(monotonic_ns, realtime)) => {
                Item::Clock { monotonic_ns: *monotonic_ns, realtime: *realtime }
            }
            Some(Ready::Note(time, text)) => Item::Note { time: *time, text },
            Some(Ready::Chunk(_)) | None => NOTHING,
        }
    }
}

/// Returns the anchor where its own message is gone: log times are those of the session, so any tells it.
fn anchor_by_log_time(monotonic_ns: u64, head: MessageHead) -> Anchor {
    let realtime = Timestamp::from_ns(i64::try_from(head.log_time).unwrap_or(i64::MAX));
    Anchor { monotonic_ns, realtime }
}
