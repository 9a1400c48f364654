//! What the channels of a file are, where their definitions in a chunk are lost.
//!
//! A chunk defines the channels that it is the first to use, and the index at the end all of them. With one wrong byte
//! in each, later chunks would be whole and mean nothing. So an attachment after each chunk that defines channels says
//! it again, as an MCAP file of its own; what an index that is not whole still says is taken, too; and what by its form and
//! by all its times is bytes of a bus is taken for that.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};

use mcap::records::{Channel, Record, op};
use mcap::{McapResult, WriteOptions};

use super::ENCODING;
use super::messages::{Content, Messages, SchemaRecord};
use super::raw_chunk;
use super::records::{Found, HEAD, LONGEST, Records, declared_length};
use super::schema::{RawChunk, Schema};
use super::state::State;
use super::time::Anchor;
use super::unpack::MessageHead;
use crate::time::{SECOND, Timestamp};

/// What the attachment is called.
pub(super) const NAME: &str = "rtutap/channels.mcap";
/// What it is.
pub(super) const MEDIA_TYPE: &str = "application/x-mcap";

/// Holds channels by their ids, with their schemas.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Definitions {
    pub(super) schemas: BTreeMap<u16, SchemaRecord>,
    pub(super) channels: BTreeMap<u16, Channel>,
}

/// Looks for definitions behind the last chunk when they are first asked for: that reads all of the file.
#[derive(Default)]
pub(super) struct Salvaged {
    /// The file that is being read, until it was looked through.
    file: Option<File>,
    found: Definitions,
}

impl Salvaged {
    /// Says where to look: in a file whose index is not whole.
    ///
    /// # Errors
    /// When the system gives no second hold of the file.
    pub(super) fn of(file: &File, is_indexed: bool) -> io::Result<Self> {
        let file = if is_indexed { None } else { Some(file.try_clone()?) };
        Ok(Salvaged { file, found: Definitions::default() })
    }

    /// Returns what is there, and leaves the file where it was: whoever reads it goes on.
    pub(super) fn definitions(&mut self) -> &Definitions {
        if let Some(mut file) = self.file.take() {
            let found = file.stream_position().and_then(|here| {
                let found = Definitions::salvage(&mut file);
                file.seek(SeekFrom::Start(here)).and(found)
            });
            self.found = found.unwrap_or_default(); // what cannot be read is said by whoever reads on
        }
        &self.found
    }
}

impl Definitions {
    pub(super) fn is_empty(&self) -> bool {
        self.channels.is_empty()
    }

    /// Returns a file that has nothing but these.
    pub(super) fn to_file(&self) -> McapResult<Vec<u8>> {
        let options = WriteOptions::new()
            .use_chunks(false)
            .compression(None)
            .emit_summary_records(false)
            .library(concat!("rtutap ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(Cursor::new(Vec::new()))?;
        for (id, SchemaRecord { name, encoding, data }) in &self.schemas {
            writer.add_schema_with_id(*id, name, encoding, data)?;
        }
        for Channel { id, schema_id, topic, message_encoding, metadata } in self.channels.values() {
            writer.add_channel_with_id(*id, *schema_id, topic, message_encoding, metadata)?;
        }
        writer.finish()?;
        Ok(writer.into_inner().into_inner())
    }

    /// Reads them from such a file.
    pub(super) fn from_file(file: &[u8]) -> Self {
        let mut messages = Messages::new(file);
        // Memory can always be read.
        while !matches!(messages.next(), Ok(Content::Index | Content::End(_)) | Err(_)) {}
        Definitions { schemas: messages.schemas, channels: messages.channels }
    }

    /// Reads what stands behind the last chunk of a file whose index is not whole: every definition that parses.
    ///
    /// # Errors
    /// When the system cannot read the file.
    fn salvage(file: &mut File) -> io::Result<Self> {
        let start = end_of_data(file)?;
        file.seek(SeekFrom::Start(start))?;
        let mut tail = Vec::new();
        Read::by_ref(file).take(LONGEST).read_to_end(&mut tail)?;
        let mut definitions = Definitions::default();
        let mut at = 0;
        while at < tail.len() {
            at += definitions.take(&tail[at..]).unwrap_or(1);
        }
        Ok(definitions)
    }

    /// Takes the definition that begins here; returns the length of its record.
    fn take(&mut self, bytes: &[u8]) -> Option<usize> {
        let opcode = *bytes.first().filter(|opcode| matches!(**opcode, op::SCHEMA | op::CHANNEL))?;
        let length = usize::try_from(declared_length(bytes)?).ok()?;
        let body = bytes.get(HEAD..HEAD.checked_add(length)?)?;
        match mcap::parse_record(opcode, body).ok()?.into_owned() {
            Record::Schema { header, data } if !header.name.is_empty() => {
                let (name, encoding, data) = (header.name, header.encoding, data.into_owned());
                self.schemas.entry(header.id).or_insert(SchemaRecord { name, encoding, data });
            }
            Record::Channel(channel) if channel.topic.starts_with('/') => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            _ => return None,
        }
        Some(HEAD + length)
    }

    /// Makes them known where they are not.
    pub(super) fn teach<R: Read>(self, messages: &mut Messages<R>, state: &mut State) {
        let Definitions { mut schemas, channels } = self;
        for channel in channels.into_values() {
            let schema = schemas.remove(&channel.schema_id).map(|schema| (channel.schema_id, schema));
            messages.learn(schema, channel);
        }
        state.channels(&messages.channels, &messages.schemas);
    }

    /// Takes in a message of a channel that nothing has defined, if it can be told what that is; tells whether it can.
    pub(super) fn adopt<R: Read>(
        &self,
        (head, payload): (MessageHead, &[u8]),
        messages: &mut Messages<R>,
        state: &mut State,
    ) -> bool {
        if self.find(head, payload, messages, state) {
            state.message(head, payload);
            return true;
        }
        state.facts.undefined_messages = state.facts.undefined_messages.saturating_add(1);
        false
    }

    /// Finds out what the channel of a message is; tells whether that is known now.
    fn find<R: Read>(
        &self,
        head: MessageHead,
        payload: &[u8],
        messages: &mut Messages<R>,
        state: &mut State,
    ) -> bool {
        let found = match self.channels.get(&head.channel) {
            Some(channel) => {
                let schema = self.schemas.get(&channel.schema_id).cloned();
                Definitions {
                    schemas: schema.map(|schema| (channel.schema_id, schema)).into_iter().collect(),
                    channels: [(channel.id, channel.clone())].into(),
                }
            }
            None if state.is_own() && is_raw(head, payload, state.anchor) => {
                let bus = state.bus_without_bytes().unwrap_or_else(|| format!("channel{}", head.channel));
                state.facts.guessed_buses.push(bus.clone());
                raw_channel(head.channel, format!("/{bus}/raw"), messages)
            }
            None => return false,
        };
        found.teach(messages, state);
        true
    }
}

/// Defines a channel of bytes, with a schema that no other has.
fn raw_channel<R: Read>(id: u16, topic: String, messages: &Messages<R>) -> Definitions {
    let Schema { name, descriptors } = Schema::RAW_CHUNK;
    let schema =
        SchemaRecord { name: name.to_owned(), encoding: ENCODING.to_owned(), data: descriptors.to_vec() };
    let taken: BTreeSet<u16> =
        messages.schemas.iter().filter(|(_, known)| known.name != name).map(|(id, _)| *id).collect();
    let free = (1..=u16::MAX).rev().find(|id| !taken.contains(id));
    let schema_id = free.unwrap_or(u16::MAX); // no file has as many
    let channel =
        Channel { id, schema_id, topic, message_encoding: ENCODING.to_owned(), metadata: BTreeMap::new() };
    Definitions { schemas: [(schema_id, schema)].into(), channels: [(id, channel)].into() }
}

/// Tells whether a message can only be bytes of a bus.
///
/// Others have bytes where it has them, such as a reading of 0; so its times have to agree as well: what it says of the
/// monotonic clock with its log time, and its publish time with so many characters before.
fn is_raw(head: MessageHead, payload: &[u8], anchor: Option<Anchor>) -> bool {
    let mut raw = RawChunk::default();
    if raw_chunk::read(payload, &mut raw).is_err() || raw.data.is_empty() || raw.monotonic_ns < 2 {
        return false;
    }
    let log = i64::try_from(head.log_time).map(Timestamp::from_ns);
    let agrees =
        |(anchor, log): (Anchor, Timestamp)| (anchor.time(raw.monotonic_ns) - log).saturating_abs() < SECOND;
    let on_wire = head.log_time.checked_sub(head.publish_time);
    let is_whole = |ns: u64| ns > 0 && ns.is_multiple_of(raw.data.len() as u64);
    raw.earlier.iter().all(|read| read.end as usize <= raw.data.len())
        && anchor.zip(log.ok()).is_none_or(agrees)
        && on_wire.is_some_and(is_whole)
}

/// Returns where the records end that stand before the index.
fn end_of_data(file: &mut File) -> io::Result<u64> {
    file.rewind()?;
    let mut records = Records::new(file, 0);
    let mut end = 0;
    loop {
        let is_data = match records.next()? {
            Found::Record { opcode, .. } => matches!(
                opcode,
                op::CHUNK | op::MESSAGE | op::MESSAGE_INDEX | op::ATTACHMENT | op::METADATA | op::DATA_END
            ),
            Found::End { .. } => return Ok(end),
            Found::Magic | Found::Damage { .. } => false,
        };
        if is_data {
            end = records.position();
        }
    }
}

#[cfg(test)]
mod tests {
    use prost::Message;

    use super::*;

    fn anchor() -> Anchor {
        Anchor { monotonic_ns: 5 * SECOND as u64, realtime: Timestamp::from_ns(1000 * SECOND) }
    }

    fn head() -> MessageHead {
        let log_time = 1001 * SECOND as u64;
        MessageHead { channel: 7, sequence: 1, log_time, publish_time: log_time - 4 * 1_041_667 }
    }

    #[test]
    fn bytes_of_a_bus_are_known_by_their_times() {
        let raw = RawChunk { data: vec![1, 3, 0, 0], monotonic_ns: 6 * SECOND as u64, ..RawChunk::default() };
        let payload = raw.encode_to_vec();
        assert!(is_raw(head(), &payload, Some(anchor())));
        assert!(is_raw(head(), &payload, None));
        let later = RawChunk { monotonic_ns: 60 * SECOND as u64, ..raw }.encode_to_vec();
        assert!(!is_raw(head(), &later, Some(anchor())));
        assert!(!is_raw(MessageHead { publish_time: head().log_time, ..head() }, &payload, None));
    }

    #[test]
    fn a_reading_of_0_is_no_bytes_of_a_bus() {
        // Its value is left out, and its bytes stand where a bus has them.
        let reading = RawChunk { data: vec![0; 4], ..RawChunk::default() }.encode_to_vec();
        assert!(!is_raw(head(), &reading, Some(anchor())));
        assert!(!is_raw(head(), &reading, None));
    }
}
