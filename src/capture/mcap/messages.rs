//! The messages of an MCAP file in file order, chunk by chunk: one bad chunk costs no other.
//!
//! Knows channels and schemas, not what messages mean.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Read, Seek};

use mcap::records::{Channel, Metadata, Record, op};

use super::records::{Found, Records};
use super::unpack::{self, MessageHead, Trouble, Unpacker};

/// Says why a part of a file cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Bytes that are no record.
    NoRecord,
    /// A chunk whose bytes are not those its checksum was made from.
    Checksum,
    /// A chunk that cannot be decompressed.
    Compression,
    /// A chunk compressed in a way that is not known.
    UnknownCompression,
    /// A chunk of more than 64 MiB.
    TooLarge,
    /// A record or message that does not hold what it should.
    Content,
    /// The file ends within a record.
    Cut,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Cause::NoRecord => "no record begins there",
            Cause::Checksum => "a chunk's checksum does not match",
            Cause::Compression => "a chunk cannot be decompressed",
            Cause::UnknownCompression => "a chunk is compressed in a way that is not known",
            Cause::TooLarge => "a chunk claims more than 64 MiB",
            Cause::Content => "a record does not hold what it should",
            Cause::Cut => "the file ends within a record",
        })
    }
}

/// Is a part of a file that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins in the file.
    pub offset: u64,
    /// How many bytes it has.
    pub length: u64,
    /// Why.
    pub cause: Cause,
    /// Whether messages were in it, as far as can be told.
    pub had_messages: bool,
}

/// Is what comes next in a file.
pub(super) enum Content<'a> {
    /// A channel, when it is first seen.
    Channel(&'a Channel),
    /// A message of a channel seen before.
    Message { head: MessageHead, payload: &'a [u8] },
    /// Facts about the recording.
    Metadata(Metadata),
    /// A file within the file.
    Attachment { name: String, media_type: String, times: (u64, u64), data: Vec<u8> },
    /// A part that cannot be read.
    Damage(Damage),
    /// The index at the end, whole.
    Index,
    /// Nothing more is there (yet); an unfinished record may be.
    End(Option<Damage>),
}

/// Is what a schema says about messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SchemaRecord {
    pub(super) name: String,
    pub(super) encoding: String,
    pub(super) data: Vec<u8>,
}

/// Reads messages one after the other.
pub(super) struct Messages<R> {
    records: Records<R>,
    /// The records of the chunk being read, and how far it was read.
    chunk: Vec<u8>,
    at: usize,
    chunk_offset: u64,
    unpacker: Unpacker,
    pub(super) schemas: BTreeMap<u16, SchemaRecord>,
    pub(super) channels: BTreeMap<u16, Channel>,
    footer: bool,
}

/// Is what was found, before it is lent out.
enum Step {
    /// The message between these places of the chunk.
    InChunk(usize, usize),
    Outside,
    Channel(u16),
    Content(Content<'static>),
}

impl<R: Read> Messages<R> {
    pub(super) fn new(source: R) -> Self {
        Messages {
            records: Records::new(source, 0),
            chunk: Vec::new(),
            at: 0,
            chunk_offset: 0,
            unpacker: Unpacker::default(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            footer: false,
        }
    }

    /// Forgets the rest of the chunk and goes on elsewhere in the file.
    pub(super) fn seek(&mut self, offset: u64) -> io::Result<()>
    where
        R: Seek,
    {
        self.at = self.chunk.len();
        self.records.seek(offset)
    }

    /// Returns a place in the file to go on from; `None` within a chunk.
    pub(super) fn place(&self) -> Option<(u64, bool)> {
        (!self.is_in_chunk()).then(|| (self.position(), self.footer))
    }

    /// Goes on from a place in the file.
    pub(super) fn go(&mut self, (offset, footer): (u64, bool)) -> io::Result<()>
    where
        R: Seek,
    {
        self.seek(offset)?;
        self.footer = footer;
        Ok(())
    }

    /// Tells whether the rest of a chunk is still to come.
    pub(super) fn is_in_chunk(&self) -> bool {
        self.at < self.chunk.len()
    }

    /// Returns where the bytes come from.
    pub(super) fn source(&self) -> &R {
        self.records.source()
    }

    /// Returns how many bytes of the file were read.
    pub(super) fn position(&self) -> u64 {
        self.records.position()
    }

    /// Tells whether what comes next must be waited for.
    pub(super) fn is_drained(&self) -> bool {
        !self.is_in_chunk() && self.records.is_drained()
    }

    /// Knows a schema and a channel from elsewhere, such as the index at the end of a file.
    pub(super) fn learn(&mut self, schema: Option<(u16, SchemaRecord)>, channel: Channel) {
        if let Some((id, schema)) = schema {
            self.schemas.entry(id).or_insert(schema);
        }
        self.channels.entry(channel.id).or_insert(channel);
    }

    /// Returns what comes next.
    pub(super) fn next(&mut self) -> io::Result<Content<'_>> {
        let step = loop {
            let step = if self.is_in_chunk() { self.step_in_chunk() } else { self.step()? };
            if let Some(step) = step {
                break step;
            }
        };
        Ok(match step {
            Step::Content(content) => content,
            Step::Channel(id) => match self.channels.get(&id) {
                Some(channel) => Content::Channel(channel),
                None => Content::End(None), // does not occur: it was put there just now
            },
            Step::InChunk(start, end) => message(&self.chunk[start..end], self.chunk_offset),
            // A message beside chunks was copied.
            Step::Outside => message(&self.chunk, self.chunk_offset),
        })
    }

    /// Goes on within the chunk.
    fn step_in_chunk(&mut self) -> Option<Step> {
        let Some((opcode, start, end)) = unpack::record_at(&self.chunk, self.at) else {
            let rest = (self.chunk.len() - self.at) as u64;
            self.at = self.chunk.len();
            return Some(damage(self.chunk_offset, rest, Cause::Content, true));
        };
        self.at = end;
        match opcode {
            op::MESSAGE => Some(Step::InChunk(start, end)),
            op::SCHEMA | op::CHANNEL => {
                let record = mcap::parse_record(opcode, &self.chunk[start..end]).map(Record::into_owned);
                self.definition(record, self.chunk_offset, (end - start) as u64)
            }
            _ => None,
        }
    }

    /// Goes on to the next record of the file.
    fn step(&mut self) -> io::Result<Option<Step>> {
        let (offset, opcode, body) = match self.records.next()? {
            Found::Record { offset, opcode, body } => (offset, opcode, body),
            Found::Magic => {
                let is_end = std::mem::take(&mut self.footer);
                return Ok(is_end.then_some(Step::Content(Content::Index)));
            }
            Found::Damage { offset, length } => {
                return Ok(Some(damage(offset, length, Cause::NoRecord, true)));
            }
            Found::End { offset, rest } => {
                let had_messages = rest.first() == Some(&op::CHUNK) || rest.first() == Some(&op::MESSAGE);
                let damage = Damage { offset, length: rest.len() as u64, cause: Cause::Cut, had_messages };
                let cut = (!rest.is_empty()).then_some(damage);
                return Ok(Some(Step::Content(Content::End(cut))));
            }
        };
        let length = (body.len() + super::records::HEAD) as u64;
        match opcode {
            op::CHUNK => {
                self.chunk_offset = offset;
                self.at = 0;
                let Err(trouble) = self.unpacker.unpack(body, &mut self.chunk) else { return Ok(None) };
                self.chunk.clear();
                Ok(Some(damage(offset, length, trouble.into(), true)))
            }
            op::MESSAGE => {
                self.chunk_offset = offset;
                self.chunk.clear();
                self.chunk.extend_from_slice(body);
                self.at = self.chunk.len();
                Ok(Some(Step::Outside))
            }
            op::SCHEMA | op::CHANNEL | op::METADATA | op::ATTACHMENT => {
                let record = mcap::parse_record(opcode, body).map(Record::into_owned);
                Ok(self.definition(record, offset, length))
            }
            op::FOOTER => {
                self.footer = true;
                Ok(None)
            }
            _ => Ok(None),
        }
    }

    /// Takes in a record that stands beside messages.
    fn definition(
        &mut self,
        record: mcap::McapResult<Record<'static>>,
        offset: u64,
        length: u64,
    ) -> Option<Step> {
        match record {
            Ok(Record::Schema { header, data }) => {
                let schema =
                    SchemaRecord { name: header.name, encoding: header.encoding, data: data.into_owned() };
                self.schemas.insert(header.id, schema);
                None
            }
            Ok(Record::Channel(channel)) => {
                let id = channel.id;
                let known = self.channels.insert(id, channel);
                (known.as_ref() != self.channels.get(&id)).then_some(Step::Channel(id))
            }
            Ok(Record::Metadata(metadata)) => Some(Step::Content(Content::Metadata(metadata))),
            Ok(Record::Attachment { header, data, .. }) => Some(Step::Content(Content::Attachment {
                name: header.name,
                media_type: header.media_type,
                times: (header.log_time, header.create_time),
                data: data.into_owned(),
            })),
            _ => Some(damage(offset, length, Cause::Content, false)),
        }
    }
}

fn message(body: &[u8], offset: u64) -> Content<'_> {
    match unpack::message(body) {
        Some((head, payload)) => Content::Message { head, payload },
        None => {
            let length = body.len() as u64;
            Content::Damage(Damage { offset, length, cause: Cause::Content, had_messages: true })
        }
    }
}

fn damage(offset: u64, length: u64, cause: Cause, had_messages: bool) -> Step {
    Step::Content(Content::Damage(Damage { offset, length, cause, had_messages }))
}

impl From<Trouble> for Cause {
    fn from(trouble: Trouble) -> Cause {
        match trouble {
            Trouble::Checksum => Cause::Checksum,
            Trouble::Compression => Cause::Compression,
            Trouble::UnknownCompression => Cause::UnknownCompression,
            Trouble::TooLarge => Cause::TooLarge,
        }
    }
}
