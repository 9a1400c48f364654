//! Rewrites a damaged or unfinished file: every message that can be read, in a file that is whole.
//!
//! Messages are copied as they are, whatever they mean, so that channels that others added stay.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::Path;

use mcap::records::{Channel, MessageHeader};
use prost::Message;
use thiserror::Error;

use super::definitions::{self, Definitions, Salvaged};
use super::index::Index;
use super::messages::{Content, Messages, SchemaRecord};
use super::part::Part;
use super::recording::Facts;
use super::schema::{Clock, RawChunk, Schema};
use super::state::State;
use super::unpack::MessageHead;
use super::{ENCODING, END_METADATA, RECOVERED};

/// What the file is called until it is finished; not '.part', for that may be what is mended.
pub const RECOVERING: &str = ".recovered";

/// Says what was saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recovered {
    /// What is known of the file that was read.
    pub facts: Facts,
    /// Messages copied.
    pub messages: u64,
    /// Bytes of buses copied.
    pub bytes: u64,
}

/// Says why nothing was saved.
#[derive(Debug, Error)]
pub enum RecoverError {
    /// The system could not read the damaged file.
    #[error("{0}")]
    Read(io::Error),
    /// The system could not write the new one.
    #[error("{0}")]
    Write(io::Error),
    /// There is no message in it that can be read.
    #[error("there is not one message in it that can be read")]
    Nothing,
    /// Its messages are those of another program.
    #[error("it is an MCAP file, but no recording of a bus")]
    Foreign,
    /// It is a recording, but has no byte of a bus.
    #[error("it is a recording, but there is not a byte of a bus in it")]
    Silent,
}

/// Copies what can be read of a file to a new one; the file itself is only read.
///
/// # Errors
/// When the system cannot read or write, or there is nothing to save; then no file is left behind.
pub fn recover(mut file: File, output: &Path) -> Result<Recovered, RecoverError> {
    let index = Index::read(&mut file).map_err(RecoverError::Read)?;
    let salvaged = Salvaged::of(&file, index.is_some()).map_err(RecoverError::Read)?;
    let mut messages = Messages::new(file);
    let mut state = State::default();
    for (schema, channel) in index.iter().flat_map(Index::channels) {
        messages.learn(schema, channel.clone());
        state.channel(&channel, &messages.schemas);
    }
    let part = Part::create(output, RECOVERING, false).map_err(RecoverError::Write)?;
    let temporary = part.temporary().to_owned();
    let copy = Copy {
        part,
        salvaged,
        state,
        channels: BTreeMap::new(),
        sequences: BTreeMap::new(),
        messages: 0,
        has_clock: false,
    };
    let result = copy.run(messages);
    if result.is_err() {
        // What is left of it is of no use; that it cannot be removed changes nothing.
        let _ = fs::remove_file(temporary);
    }
    result
}

/// Is a file being copied.
struct Copy {
    part: Part,
    /// What the rest of an index still says that is not whole.
    salvaged: Salvaged,
    /// Follows what is copied, to tell what is lost.
    state: State,
    /// For each channel its id in the new file.
    channels: BTreeMap<u16, u16>,
    /// For each channel of the new file the number of its messages.
    sequences: BTreeMap<u16, u32>,
    messages: u64,
    has_clock: bool,
}

impl Copy {
    fn run(mut self, mut messages: Messages<File>) -> Result<Recovered, RecoverError> {
        loop {
            match messages.next().map_err(RecoverError::Read)? {
                Content::Message { head, payload } => {
                    // A copy, for the channels are asked for at the same time.
                    let payload = payload.to_vec();
                    self.message(head, &payload, &mut messages).map_err(RecoverError::Write)?;
                }
                Content::Channel(_) => self.state.channels(&messages.channels, &messages.schemas),
                Content::Metadata(metadata) => {
                    self.state.metadata(&metadata);
                    if metadata.name != END_METADATA {
                        let written = self.part.metadata(&metadata.name, metadata.metadata);
                        written.map_err(RecoverError::Write)?;
                    }
                }
                // The new file says it of its own channels.
                Content::Attachment { name, data, .. } if name == definitions::NAME => {
                    Definitions::from_file(&data).teach(&mut messages, &mut self.state);
                }
                Content::Attachment { name, media_type, times, data } => {
                    let written = self.part.attachment(&name, &media_type, times, &data);
                    written.map_err(RecoverError::Write)?;
                }
                Content::Damage(damage) => self.state.damage(damage),
                Content::Index => {
                    self.state.facts.is_indexed = true;
                    break;
                }
                Content::End(cut) => {
                    cut.into_iter().for_each(|cut| self.state.damage(cut));
                    break;
                }
            }
        }
        self.finish()
    }

    fn message(
        &mut self,
        head: MessageHead,
        payload: &[u8],
        messages: &mut Messages<File>,
    ) -> io::Result<()> {
        self.state.message(head, payload);
        if self.state.take_orphan().is_some() {
            self.salvaged.definitions().adopt((head, payload), messages, &mut self.state);
        }
        let schemas = &messages.schemas;
        // Without its definition it means nothing, and is counted.
        let Some(channel) = messages.channels.get(&head.channel) else { return Ok(()) };
        self.restore_beginning(head, payload, channel, schemas)?;
        while self.state.advance() {}
        self.copy(head, payload, channel, schemas)
    }

    fn copy(
        &mut self,
        head: MessageHead,
        payload: &[u8],
        channel: &Channel,
        schemas: &BTreeMap<u16, SchemaRecord>,
    ) -> io::Result<()> {
        let id = match self.channels.get(&channel.id) {
            Some(known) => *known,
            None => {
                let schema = schemas.get(&channel.schema_id);
                let schema = schema
                    .map_or(("", "", &[][..]), |schema| (&*schema.name, &*schema.encoding, &*schema.data));
                let encoding = &channel.message_encoding;
                self.part.channel(&channel.topic, schema, encoding, &channel.metadata)?
            }
        };
        self.channels.insert(channel.id, id);
        self.messages += 1;
        self.write(id, head.log_time, head.publish_time, payload)
    }

    /// Writes a message with the next number of its channel in the new file.
    fn write(&mut self, channel_id: u16, log_time: u64, publish_time: u64, payload: &[u8]) -> io::Result<()> {
        let sequence = self.sequences.entry(channel_id).or_default();
        *sequence = sequence.wrapping_add(1);
        let header = MessageHeader { channel_id, sequence: *sequence, log_time, publish_time };
        self.part.message(&header, payload)?;
        Ok(())
    }

    /// Writes what a recording begins with, where its first chunk is gone: the anchor of its times, and settings.
    fn restore_beginning(
        &mut self,
        head: MessageHead,
        payload: &[u8],
        channel: &Channel,
        schemas: &BTreeMap<u16, SchemaRecord>,
    ) -> io::Result<()> {
        let schema = schemas.get(&channel.schema_id).map_or("", |schema| &*schema.name);
        if self.has_clock {
            return Ok(());
        }
        let monotonic_ns = if schema == Schema::RAW_CHUNK.name {
            RawChunk::decode(payload).ok().map(|raw| raw.monotonic_ns)
        } else if schema == Schema::CLOCK.name {
            self.has_clock = head.sequence <= 1;
            Clock::decode(payload).ok().map(|clock| clock.monotonic_ns)
        } else {
            None
        };
        let Some(monotonic_ns) = monotonic_ns.filter(|_| !self.has_clock) else { return Ok(()) };
        self.has_clock = true;
        // Log times are those of the session, so any of them tells the anchor.
        let clock = Clock { monotonic_ns, realtime_ns: head.log_time };
        self.write_own("/clock", Schema::CLOCK, head.log_time, &clock.encode_to_vec())?;
        for (bus, line) in self.state.described_lines() {
            self.write_own(&format!("/{bus}/line"), Schema::LINE, head.log_time, &line.encode_to_vec())?;
        }
        Ok(())
    }

    /// Writes a message that the damaged file lacks.
    fn write_own(&mut self, topic: &str, schema: Schema, log_time: u64, payload: &[u8]) -> io::Result<()> {
        let descriptor = (schema.name, ENCODING, schema.descriptors);
        let id = self.part.channel(topic, descriptor, ENCODING, &BTreeMap::new())?;
        self.write(id, log_time, log_time, payload)
    }

    /// Returns why the file ends: for the same reason as before, where nothing was missing.
    fn reason(&self) -> String {
        let facts = &self.state.facts;
        facts.end.clone().filter(|_| facts.is_complete()).unwrap_or_else(|| RECOVERED.to_owned())
    }

    fn finish(mut self) -> Result<Recovered, RecoverError> {
        if self.messages == 0 {
            return Err(RecoverError::Nothing);
        }
        if !self.state.has_own_channel() && self.state.facts.session.is_none() {
            return Err(RecoverError::Foreign);
        }
        self.state.finish();
        let bytes = self.state.bytes();
        if bytes == 0 {
            return Err(RecoverError::Silent);
        }
        let lost = self.state.facts.lost_bytes.saturating_add(self.state.bytes_lost_before());
        let end =
            [("reason", self.reason()), ("bytes_total", bytes.to_string()), ("bytes_lost", lost.to_string())];
        let end = end.map(|(key, value)| (key.to_owned(), value)).into();
        self.part.metadata(END_METADATA, end).map_err(RecoverError::Write)?;
        self.part.finish(true).map_err(RecoverError::Write)?;
        Ok(Recovered { facts: self.state.facts, messages: self.messages, bytes })
    }
}
