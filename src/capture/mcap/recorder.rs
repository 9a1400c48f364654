//! Writes a recording: bytes of buses as they were read, and whatever else belongs beside them.
//!
//! Knows no Modbus and no clock: times are arguments. A recording is one file or several parts of a session.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use prost::Message;

use super::line::{BusSettings, LINE_METADATA};
use super::options::{Options, RecordError, part_path};
use super::part::Part;
use super::pending::Pending;
use super::schema::{Clock, Dating, ErrorKind, LineError, RawChunk, Schema};
use super::time::{Anchor, LogTime, YEAR_2000};
use super::totals::Totals;
use super::{ENCODING, END_METADATA, FORMAT_VERSION, SESSION_METADATA, UNFINISHED};
use crate::decode::chunk::{Chunk, Lost, LostKind, ReadTime};
use crate::time::{SECOND, Timestamp};

/// How long messages wait in memory at most, in nanoseconds.
const FLUSH_AFTER: i64 = SECOND;
/// How long bytes wait on their way to the disk at most, in nanoseconds.
const SYNC_AFTER: i64 = 5 * SECOND;

/// Names a bus of a recorder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusId(usize);

/// Names a channel of a recorder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChannelId(usize);

/// Is a channel, with its place in the part that is open.
struct ChannelState {
    topic: String,
    schema: Schema,
    metadata: BTreeMap<String, String>,
    id: Option<u16>,
    sequence: u32,
}

/// Is a bus, with the reads that wait to be merged.
struct BusState {
    settings: BusSettings,
    raw: ChannelId,
    line: ChannelId,
    offset: u64,
    /// When its last bytes were read, made up where the input does not say.
    time: Option<Timestamp>,
    pending: Option<Pending>,
}

/// Writes a recording.
pub struct Recorder {
    options: Options,
    path: PathBuf,
    part: Option<Part>,
    part_index: u64,
    channels: Vec<ChannelState>,
    clock: ChannelId,
    buses: Vec<BusState>,
    /// Both known from the first time on.
    begun: Option<(Anchor, LogTime)>,
    part_begun: Timestamp,
    flushed: Timestamp,
    synced: Timestamp,
    totals: Totals,
    finished: Vec<PathBuf>,
    /// Bytes that the disk did not take, in all parts.
    disk_lost: u64,
    /// Whether the last part was closed and the next begins when there is something to write.
    is_resting: bool,
    /// Whether the part holds more than its beginning.
    has_items: bool,
}

impl Recorder {
    /// Begins a recording at `path`; further parts are called NAME-0002.mcap and so on.
    ///
    /// # Errors
    /// When the file cannot be created; with [`Options::is_durable`] also when what is left of another recording
    /// is in the way.
    pub fn create(path: &Path, options: Options) -> Result<Self, RecordError> {
        let mut recorder = Recorder {
            options,
            path: path.into(),
            part: None,
            part_index: 0,
            channels: Vec::new(),
            clock: ChannelId(0),
            buses: Vec::new(),
            begun: None,
            part_begun: Timestamp::MIN,
            flushed: Timestamp::MIN,
            synced: Timestamp::MIN,
            totals: Totals::default(),
            finished: Vec::new(),
            disk_lost: 0,
            is_resting: false,
            has_items: false,
        };
        recorder.clock = recorder.channel("/clock", Schema::CLOCK, BTreeMap::new());
        recorder.open_part()?;
        Ok(recorder)
    }

    /// Adds a bus; its settings are written before its first bytes.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn add_bus(&mut self, settings: BusSettings) -> Result<BusId, RecordError> {
        let raw = self.channel(&format!("/{}/raw", settings.name), Schema::RAW_CHUNK, BTreeMap::new());
        let line = self.channel(&format!("/{}/line", settings.name), Schema::LINE, BTreeMap::new());
        self.buses.push(BusState { settings, raw, line, offset: 0, time: None, pending: None });
        let bus = BusId(self.buses.len() - 1);
        self.write_bus_metadata(bus)?;
        self.write_settings(bus)?;
        Ok(bus)
    }

    /// Changes the settings of a bus from here on.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn set_line(&mut self, bus: BusId, settings: BusSettings) -> Result<(), RecordError> {
        self.flush_reads()?;
        self.buses[bus.0].settings = settings;
        self.write_settings(bus)
    }

    /// Returns the channel of a topic, which is added when it is first written to.
    pub fn channel(&mut self, topic: &str, schema: Schema, metadata: BTreeMap<String, String>) -> ChannelId {
        let known = self.channels.iter().position(|channel| channel.topic == topic);
        ChannelId(known.unwrap_or_else(|| {
            let topic = topic.to_owned();
            self.channels.push(ChannelState { topic, schema, metadata, id: None, sequence: 0 });
            self.channels.len() - 1
        }))
    }

    /// Writes the bytes of one read; `ready` is when they were first there, where that is known.
    ///
    /// # Errors
    /// When the recording cannot be written; bytes that are lost for it are counted.
    pub fn write_chunk(
        &mut self,
        bus: BusId,
        chunk: &Chunk<'_>,
        ready: Option<Timestamp>,
    ) -> Result<(), RecordError> {
        if chunk.bytes.is_empty() && chunk.line_errors.is_empty() {
            return Ok(());
        }
        let time = self.time_of(bus, chunk);
        self.wake(time)?;
        let anchor = self.begin(time)?;
        // Reads are not merged across those of another bus: they are decoded in the order of the file.
        self.flush_reads_but(bus)?;
        let state = &mut self.buses[bus.0];
        if state.pending.as_mut().is_some_and(|pending| pending.merge(chunk, time, anchor, ready)) {
            state.time = Some(time);
            return Ok(());
        }
        self.flush_reads()?;
        self.rotate_if_due(time)?;
        let state = &mut self.buses[bus.0];
        state.pending = Some(Pending::new(chunk, time, anchor, ready));
        state.time = Some(time);
        if chunk.time == ReadTime::Unknown || chunk.time == ReadTime::UnknownAfterSilence {
            self.flush_reads()?;
        }
        Ok(())
    }

    /// Returns when a chunk was read; without times it follows the one before at line speed.
    fn time_of(&self, bus: BusId, chunk: &Chunk<'_>) -> Timestamp {
        let state = &self.buses[bus.0];
        match chunk.time {
            ReadTime::At(time) => time,
            ReadTime::Unknown | ReadTime::UnknownAfterSilence => {
                let length = i64::try_from(chunk.bytes.len()).unwrap_or(i64::MAX);
                let wire = state.settings.line.character_ns().saturating_mul(length);
                state.time.unwrap_or(YEAR_2000) + wire
            }
        }
    }

    /// Writes that bytes of a bus were lost; `lost.stream_offset` is not looked at.
    ///
    /// Bytes that a disk did not take have no message of their own: the next ones lie that much further on.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn write_lost(&mut self, bus: BusId, lost: &Lost) -> Result<(), RecordError> {
        self.flush_reads()?;
        let time = lost.time.or(self.buses[bus.0].time).unwrap_or(YEAR_2000);
        self.wake(time)?;
        let anchor = self.begin(time)?;
        let count = match lost.kind {
            LostKind::SourceGone => 0,
            LostKind::Overrun | LostKind::Queue | LostKind::Disk => lost.count,
        };
        self.totals.lost = self.totals.lost.saturating_add(lost.count);
        if lost.kind != LostKind::Disk {
            let kind = if lost.kind == LostKind::Overrun { ErrorKind::Overrun } else { ErrorKind::Lost };
            let error =
                LineError { offset: 0, kind: kind as i32, count: u32::try_from(count).unwrap_or(u32::MAX) };
            let raw = RawChunk {
                stream_offset: self.buses[bus.0].offset,
                monotonic_ns: anchor.monotonic_ns(time),
                errors: vec![error],
                dating: if lost.time.is_some() { Dating::Read } else { Dating::LineSpeed } as i32,
                ..RawChunk::default()
            };
            self.write_raw(bus, time, &raw)?;
        }
        self.buses[bus.0].offset = self.buses[bus.0].offset.saturating_add(count);
        Ok(())
    }

    /// Writes that nothing was received until then: silence decided something, and has to decide it again.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn write_silence(&mut self, bus: BusId, until: Timestamp) -> Result<(), RecordError> {
        self.flush_reads()?;
        self.wake(until)?;
        let anchor = self.begin(until)?;
        let raw = RawChunk {
            stream_offset: self.buses[bus.0].offset,
            monotonic_ns: anchor.monotonic_ns(until),
            ..RawChunk::default()
        };
        self.write_raw(bus, until, &raw)
    }

    /// Writes a message beside the bytes; its log time is that of the message before it.
    ///
    /// `time` is that of its cause, shown as the time of publishing; it is never after the log time.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn write_message(
        &mut self,
        channel: ChannelId,
        time: Option<Timestamp>,
        payload: &[u8],
    ) -> Result<(), RecordError> {
        self.flush_reads()?;
        let Some((_, log)) = self.begun else { return Ok(()) }; // nothing was read that it could be about
        let publish = time.map_or(log.last(), |time| log.shown(time));
        self.emit(channel, log.last(), publish, payload)
    }

    /// Writes what the monotonic and the wall clock show: every ten seconds, and when the wall clock was set.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn write_clock(&mut self, monotonic_ns: u64, realtime: Timestamp) -> Result<(), RecordError> {
        self.flush_reads()?;
        let Some((anchor, log)) = &mut self.begun else { return Ok(()) };
        let time = log.next(anchor.time(monotonic_ns));
        self.emit_clock(monotonic_ns, realtime, time)
    }

    fn emit_clock(&mut self, monotonic_ns: u64, realtime: Timestamp, log: u64) -> Result<(), RecordError> {
        let clock = Clock { monotonic_ns, realtime_ns: realtime.as_ns() as u64 }; // signed, by its definition
        self.emit(self.clock, log, log, &clock.encode_to_vec())
    }

    /// Does what is due: flushes what has waited a second, syncs, and begins a new part.
    ///
    /// A part that could not be written is followed by a new one.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn tick(&mut self, now: Timestamp) -> Result<(), RecordError> {
        self.flush_reads()?;
        if self.is_resting {
            return Ok(());
        }
        let is_dirty = self.part.as_ref().is_some_and(Part::is_dirty);
        let is_flush_due = now - self.flushed >= FLUSH_AFTER;
        if self.part.is_none() && is_flush_due {
            self.flushed = now;
            return self.try_part(now);
        }
        if is_dirty && is_flush_due && self.part.as_ref().is_some_and(Part::is_removed) {
            self.totals.unsafe_bytes = self.totals.written;
            return Err(self.abandon(io::Error::new(io::ErrorKind::NotFound, "the file was removed")));
        }
        if is_dirty && is_flush_due {
            self.flushed = now;
            self.guard(Part::flush)?;
            self.totals.unsafe_bytes = 0;
        }
        if self.options.is_durable && now - self.synced >= SYNC_AFTER {
            self.synced = now;
            self.guard(Part::sync)?;
        }
        self.rotate_if_due(now)
    }

    /// Closes the part if anything is in it; the next one begins when there is something to write.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn rest(&mut self, reason: &str) -> Result<(), RecordError> {
        self.flush_reads()?;
        if self.totals.written == 0 || self.part.is_none() {
            return Ok(());
        }
        self.is_resting = true;
        self.close_part(reason)
    }

    /// Begins a part after a rest.
    fn wake(&mut self, now: Timestamp) -> Result<(), RecordError> {
        if !std::mem::take(&mut self.is_resting) {
            return Ok(());
        }
        self.open_part()?;
        self.begin_part(now)
    }

    /// Begins a part after one that failed; when that fails, too, it leaves nothing behind.
    fn try_part(&mut self, now: Timestamp) -> Result<(), RecordError> {
        let before = self.part_index;
        let result = self.open_part().and_then(|()| self.begin_part(now));
        if let Err(RecordError { path, .. }) = &result
            && self.part_index > before
        {
            // It holds nothing; that it cannot be removed changes nothing.
            let _ = std::fs::remove_file(path);
            self.part_index = before;
        }
        result
    }

    /// Returns how many bytes of buses the disk did not take so far.
    pub fn bytes_lost_to_disk(&self) -> u64 {
        self.disk_lost
    }

    /// Returns the parts that are finished.
    pub fn finished(&self) -> &[PathBuf] {
        &self.finished
    }

    /// Tells whether anything was received yet.
    pub fn has_begun(&self) -> bool {
        self.begun.is_some()
    }

    /// Ends the recording; returns the files it is in.
    ///
    /// # Errors
    /// When the last file cannot be finished.
    pub fn finish(mut self, reason: &str) -> Result<Vec<PathBuf>, RecordError> {
        self.flush_reads()?;
        self.begin(YEAR_2000)?;
        if self.has_items || self.finished.is_empty() {
            self.close_part(reason)?;
        } else if let Some(part) = self.part.take() {
            // A part that has just begun holds nothing; that it cannot be removed changes nothing.
            let _ = std::fs::remove_file(part.temporary());
        }
        Ok(self.finished)
    }

    /// Returns the file that is being written, under the name it has until it is finished.
    pub fn current(&self) -> Option<&Path> {
        self.part.as_ref().map(Part::temporary)
    }

    /// Creates the file of the next part.
    fn open_part(&mut self) -> Result<(), RecordError> {
        let path = part_path(&self.path, self.part_index + 1);
        let is_careful = self.options.is_durable;
        // What is left of a live recording is never written over.
        let suffix = if is_careful { ".part" } else { UNFINISHED };
        let part = Part::create(&path, suffix, is_careful).map_err(|error| RecordError { path, error })?;
        self.part_index += 1;
        self.part = Some(part);
        self.totals.written = 0;
        self.has_items = false;
        let previous = self.finished.last().and_then(|path| path.file_name());
        let session = [
            ("format_version", FORMAT_VERSION.to_owned()),
            ("tool", concat!("rtutap ", env!("CARGO_PKG_VERSION")).to_owned()),
            ("session_id", self.options.session_id.clone()),
            ("part_index", self.part_index.to_string()),
            ("previous_part", previous.map_or_else(String::new, |name| name.to_string_lossy().into_owned())),
        ];
        let session = session.map(|(key, value)| (key.to_owned(), value)).into();
        self.guard(|part| part.metadata(SESSION_METADATA, session))?;
        (0..self.buses.len()).try_for_each(|bus| self.write_bus_metadata(BusId(bus)))
    }

    fn write_bus_metadata(&mut self, bus: BusId) -> Result<(), RecordError> {
        let metadata = self.buses[bus.0].settings.metadata();
        self.guard(|part| part.metadata(LINE_METADATA, metadata))
    }

    /// Ties times to the session at the first one, and begins the first part with it.
    fn begin(&mut self, first: Timestamp) -> Result<Anchor, RecordError> {
        if let Some((anchor, _)) = self.begun {
            return Ok(anchor);
        }
        let anchor = self.options.anchor.unwrap_or_else(|| Anchor::of_wall_clock(first));
        self.begun = Some((anchor, LogTime::new(first)));
        self.begin_part(first)?;
        Ok(anchor)
    }

    /// Writes what every part begins with: the session's anchor, then settings and attachments.
    fn begin_part(&mut self, now: Timestamp) -> Result<(), RecordError> {
        let Some((anchor, log)) = &mut self.begun else { return Ok(()) };
        let (anchor, time) = (*anchor, log.next(now));
        (self.part_begun, self.flushed, self.synced) = (now, now, now);
        for channel in &mut self.channels {
            (channel.id, channel.sequence) = (None, 0);
        }
        self.emit_clock(anchor.monotonic_ns, anchor.realtime, time)?;
        for bus in 0..self.buses.len() {
            self.write_settings(BusId(bus))?;
        }
        self.guard(Part::flush)?;
        for (name, media_type, data) in self.options.attachments.clone() {
            self.guard(|part| part.attachment(&name, &media_type, (time, time), &data))?;
        }
        Ok(())
    }

    fn write_settings(&mut self, bus: BusId) -> Result<(), RecordError> {
        let Some((_, log)) = self.begun else { return Ok(()) }; // written when the part begins
        let state = &self.buses[bus.0];
        let (line, message) = (state.line, state.settings.message());
        self.emit(line, log.last(), log.last(), &message.encode_to_vec())
    }

    /// Writes the reads that wait to be merged with later ones; those of one bus at most do.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn flush_reads(&mut self) -> Result<(), RecordError> {
        (0..self.buses.len()).try_for_each(|bus| self.flush_reads_of(bus))
    }

    /// Writes the reads that wait of other buses than this one.
    fn flush_reads_but(&mut self, bus: BusId) -> Result<(), RecordError> {
        (0..self.buses.len()).filter(|other| *other != bus.0).try_for_each(|other| self.flush_reads_of(other))
    }

    fn flush_reads_of(&mut self, bus: usize) -> Result<(), RecordError> {
        let Some(pending) = self.buses[bus].pending.take() else { return Ok(()) };
        let last = pending.last_time();
        let mut raw = pending.into_message();
        raw.stream_offset = self.buses[bus].offset;
        let length = raw.data.len() as u64;
        self.buses[bus].offset = raw.stream_offset.saturating_add(length);
        self.totals.written = self.totals.written.saturating_add(length);
        self.totals.unsafe_bytes = self.totals.unsafe_bytes.saturating_add(length);
        self.write_raw(BusId(bus), last, &raw)
    }

    fn write_raw(&mut self, bus: BusId, time: Timestamp, raw: &RawChunk) -> Result<(), RecordError> {
        let Some((_, log)) = &mut self.begun else { return Ok(()) };
        self.has_items = true;
        let time = log.next(time);
        let state = &self.buses[bus.0];
        let length = i64::try_from(raw.data.len()).unwrap_or(i64::MAX);
        let wire = state.settings.line.character_ns().saturating_mul(length);
        let publish = time.saturating_sub(u64::try_from(wire).unwrap_or(0));
        self.emit(state.raw, time, publish, &raw.encode_to_vec())
    }

    /// Writes a message to its channel, and begins a new part when it is time.
    fn emit(
        &mut self,
        channel: ChannelId,
        log: u64,
        publish: u64,
        payload: &[u8],
    ) -> Result<(), RecordError> {
        let ChannelState { topic, schema, metadata, id, sequence } = &mut self.channels[channel.0];
        let Some(part) = &mut self.part else {
            // The disk failed; until there is a new part everything is lost, and counted.
            self.disk_lost = self.disk_lost.saturating_add(self.totals.lose());
            return Ok(());
        };
        *sequence += 1;
        let header = |channel_id| MessageHeader {
            channel_id,
            sequence: *sequence,
            log_time: log,
            publish_time: publish.clamp(1, log.max(1)),
        };
        let schema = (schema.name, ENCODING, schema.descriptors);
        let written = match id {
            Some(id) => Ok(*id),
            None => part.channel(topic, schema, ENCODING, metadata),
        };
        *id = written.as_ref().ok().copied();
        match written.and_then(|id| part.message(&header(id), payload)) {
            Ok(false) => Ok(()),
            Ok(true) => {
                self.totals.unsafe_bytes = 0;
                self.rotate_if_due(Timestamp::MIN)
            }
            Err(error) => Err(self.abandon(error)),
        }
    }

    /// Does something with the part, if there is one; after an error there is none.
    fn guard(&mut self, act: impl FnOnce(&mut Part) -> io::Result<()>) -> Result<(), RecordError> {
        let result = self.part.as_mut().map_or(Ok(()), act);
        result.map_err(|error| self.abandon(error))
    }

    /// Gives up a part that cannot be written; what it holds stays a valid prefix.
    fn abandon(&mut self, error: io::Error) -> RecordError {
        self.disk_lost = self.disk_lost.saturating_add(self.totals.lose());
        let path = self.part.take().map_or_else(|| self.path.clone(), |part| part.temporary().to_owned());
        RecordError { path, error }
    }

    fn rotate_if_due(&mut self, now: Timestamp) -> Result<(), RecordError> {
        let Some(part) = &self.part else { return Ok(()) };
        let options = &self.options;
        let due = options.rotate_size.is_some_and(|most| part.size() >= most)
            || options.rotate_chunks.is_some_and(|most| part.chunks() >= most)
            || options.rotate_time_ns.is_some_and(|most| now - self.part_begun >= most);
        // A part that holds nothing but its beginning is not followed by another one.
        if !due || self.totals.written == 0 {
            return Ok(());
        }
        let now = now.max(self.buses.iter().filter_map(|bus| bus.time).max().unwrap_or(self.part_begun));
        self.close_part("rotated")?;
        self.open_part()?;
        self.begin_part(now)
    }

    /// Writes the end of a part and gives it its name.
    fn close_part(&mut self, reason: &str) -> Result<(), RecordError> {
        let totals = std::mem::take(&mut self.totals);
        let end = [
            ("reason", reason.to_owned()),
            ("bytes_total", totals.written.to_string()),
            ("bytes_lost", totals.lost.to_string()),
        ];
        let end = end.map(|(key, value)| (key.to_owned(), value)).into();
        self.guard(|part| part.metadata(END_METADATA, end))?;
        let Some(part) = self.part.take() else { return Ok(()) };
        let path = part.path().to_owned();
        let finished = part.finish(self.options.is_durable).map_err(|error| RecordError { path, error })?;
        self.finished.push(finished);
        Ok(())
    }
}
