//! The index at the end of a file: channels before the first chunk is read, and one stretch of time without the rest.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use mcap::Summary;
use mcap::records::{Channel, Record};
use mcap::sans_io::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};

use super::messages::SchemaRecord;
use super::records::LONGEST;
use super::schema::Schema;
use crate::time::Timestamp;

/// Holds the index of a file.
pub(super) struct Index {
    summary: Summary,
}

/// Says which chunks to read.
pub(super) struct Plan {
    offsets: VecDeque<u64>,
}

impl Plan {
    /// Returns where the next chunk is.
    pub(super) fn next(&mut self) -> Option<u64> {
        self.offsets.pop_front()
    }
}

impl Index {
    /// Reads the index, and goes back to the beginning; `None` when there is none that can be read.
    ///
    /// # Errors
    /// When the system cannot read the file.
    pub(super) fn read(file: &mut File) -> io::Result<Option<Index>> {
        let size = file.seek(SeekFrom::End(0))?;
        if !is_sound(file, size)? {
            file.seek(SeekFrom::Start(0))?;
            return Ok(None);
        }
        let options =
            SummaryReaderOptions::default().with_file_size(size).with_record_length_limit(LONGEST as usize); // 64 MiB
        let mut reader = SummaryReader::new_with_options(options);
        let is_read = loop {
            match reader.next_event() {
                None => break true,
                // No index: the file is unfinished, cut or damaged, and read without it.
                Some(Err(_)) => break false,
                Some(Ok(SummaryReadEvent::ReadRequest(length))) => {
                    let read = file.read(reader.insert(length))?;
                    reader.notify_read(read);
                }
                Some(Ok(SummaryReadEvent::SeekRequest(to))) => reader.notify_seeked(file.seek(to)?),
            }
        };
        file.seek(SeekFrom::Start(0))?;
        let summary = if is_read { reader.finish() } else { None };
        Ok(summary.map(|summary| Index { summary }))
    }

    /// Returns the channels with their schemas.
    pub(super) fn channels(&self) -> impl Iterator<Item = (Option<(u16, SchemaRecord)>, Channel)> + '_ {
        self.summary.channels.values().map(|channel| {
            let schema = channel.schema.as_ref().map(|schema| {
                let data = schema.data.to_vec();
                let record =
                    SchemaRecord { name: schema.name.clone(), encoding: schema.encoding.clone(), data };
                (schema.id, record)
            });
            let record = Channel {
                id: channel.id,
                schema_id: channel.schema.as_ref().map_or(0, |schema| schema.id),
                topic: channel.topic.clone(),
                message_encoding: channel.message_encoding.clone(),
                metadata: channel.metadata.clone(),
            };
            (schema, record)
        })
    }

    /// Returns the first and the last log time.
    pub(super) fn times(&self) -> Option<(Timestamp, Timestamp)> {
        let chunks = || self.summary.chunk_indexes.iter().filter(|chunk| chunk.message_start_time > 0);
        let time = |log: u64| Timestamp::from_ns(i64::try_from(log).unwrap_or(i64::MAX));
        let first = chunks().map(|chunk| chunk.message_start_time).min()?;
        let last = chunks().map(|chunk| chunk.message_end_time).max()?;
        Some((time(first), time(last)))
    }

    /// Returns when the chunk begins from which at least `bytes` of messages lead up to a time, or the first one.
    pub(super) fn before(&self, time: Timestamp, bytes: u64) -> Option<Timestamp> {
        let log = u64::try_from(time.as_ns()).unwrap_or(0);
        let chunks = self.summary.chunk_indexes.iter();
        let mut chunks: Vec<_> =
            chunks.filter(|chunk| (1..=log).contains(&chunk.message_start_time)).collect();
        chunks.sort_by_key(|chunk| chunk.message_start_time);
        let mut rest = bytes;
        // Nobody knows how much of the last one lies before the time.
        let whole = chunks.iter().rev().skip(1).find(|chunk| {
            rest = rest.saturating_sub(chunk.uncompressed_size);
            rest == 0
        });
        let begin = whole.or(chunks.first())?.message_start_time;
        Some(Timestamp::from_ns(i64::try_from(begin).unwrap_or(i64::MAX)))
    }

    /// Plans to read what was logged within these times: its chunks, and before it those with line settings.
    ///
    /// The first chunk has the session's anchor, and is always read.
    pub(super) fn plan(&self, from: Timestamp, to: Timestamp) -> Plan {
        let log = |time: Timestamp| u64::try_from(time.as_ns()).unwrap_or(0);
        let (from, to) = (log(from), log(to));
        let is_line = |id: &u16| {
            let channel = self.summary.channels.get(id);
            let schema = channel.and_then(|channel| channel.schema.as_ref());
            schema.is_some_and(|schema| schema.name == Schema::LINE.name)
        };
        let mut chunks: Vec<_> = self.summary.chunk_indexes.iter().collect();
        chunks.sort_by_key(|chunk| chunk.chunk_start_offset);
        let first = chunks.first().map(|chunk| chunk.chunk_start_offset);
        let wanted = chunks.into_iter().filter(|chunk| {
            let overlaps = chunk.message_start_time <= to && chunk.message_end_time >= from;
            let sets = chunk.message_start_time <= to && chunk.message_index_offsets.keys().any(is_line);
            overlaps || sets || Some(chunk.chunk_start_offset) == first
        });
        Plan { offsets: wanted.map(|chunk| chunk.chunk_start_offset).collect() }
    }
}

/// Bytes of the footer record and the magic after it, the end of every finished file.
const FOOTER: u64 = 37;

/// Tells whether a file ends with an index whose checksum matches: the crate's reader does not look at it.
fn is_sound(file: &mut File, size: u64) -> io::Result<bool> {
    let Some(footer_start) = size.checked_sub(FOOTER) else { return Ok(false) };
    let mut footer = [0; FOOTER as usize];
    file.seek(SeekFrom::Start(footer_start))?;
    file.read_exact(&mut footer)?;
    let Ok(Record::Footer(fields)) = mcap::parse_record(footer[0], &footer[9..29]) else { return Ok(false) };
    let (start, end) = (fields.summary_start, size - 8 - 4); // the checksum covers the footer up to itself
    if !footer.ends_with(mcap::MAGIC) || !(8..=footer_start).contains(&start) {
        return Ok(false);
    }
    file.seek(SeekFrom::Start(start))?;
    let mut hasher = crc32fast::Hasher::new();
    let mut rest = file.take(end - start);
    let mut block = vec![0; 64 * 1024];
    loop {
        match rest.read(&mut block)? {
            0 => break,
            read => hasher.update(&block[..read]),
        }
    }
    Ok(fields.summary_crc == 0 || hasher.finalize() == fields.summary_crc)
}
