//! The messages of a chunk: its checksum verified, decompressed within bounds.

use std::io::Read;

use super::records::{HEAD, LONGEST};

/// Says why a chunk cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trouble {
    /// Its bytes are not those its checksum was made from.
    Checksum,
    /// It cannot be decompressed.
    Compression,
    /// It is compressed in a way that is not known.
    UnknownCompression,
    /// It claims more than 64 MiB.
    TooLarge,
}

/// Is the head of a chunk.
struct Header<'a> {
    uncompressed_size: u64,
    crc: u32,
    compression: &'a [u8],
    data: &'a [u8],
}

/// Reads a little-endian number of up to 8 bytes.
fn number(bytes: &[u8], at: usize, width: usize) -> Option<u64> {
    let field = bytes.get(at..at.checked_add(width)?)?;
    Some(field.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte)))
}

fn header(body: &[u8]) -> Option<Header<'_>> {
    let compression_end = 32 + usize::try_from(number(body, 28, 4)?).ok()?;
    let data_size = usize::try_from(number(body, compression_end, 8)?).ok()?;
    let data_start = compression_end.checked_add(8)?;
    Some(Header {
        uncompressed_size: number(body, 16, 8)?,
        crc: u32::try_from(number(body, 24, 4)?).ok()?,
        compression: body.get(32..compression_end)?,
        data: body.get(data_start..data_start.checked_add(data_size)?)?,
    })
}

/// Puts the records of a chunk into `out`, which is emptied first; on trouble they must not be used.
pub(super) fn unpack(body: &[u8], out: &mut Vec<u8>) -> Result<(), Trouble> {
    out.clear();
    let header = header(body).ok_or(Trouble::Compression)?;
    if header.uncompressed_size > LONGEST {
        return Err(Trouble::TooLarge);
    }
    let size = header.uncompressed_size as usize; // at most 64 MiB
    match header.compression {
        b"" => out.extend_from_slice(header.data),
        b"zstd" => {
            let decoder = zstd::stream::read::Decoder::with_buffer(header.data);
            let mut decoder = decoder.map_err(|_| Trouble::Compression)?;
            // What a damaged head may ask for is bounded: 64 MiB, the longest chunk.
            decoder.window_log_max(26).map_err(|_| Trouble::Compression)?;
            read_bounded(&mut decoder, size, out)?;
        }
        b"lz4" => {
            let decoder = lz4::Decoder::new(header.data);
            read_bounded(&mut decoder.map_err(|_| Trouble::Compression)?, size, out)?;
        }
        _ => return Err(Trouble::UnknownCompression),
    }
    if out.len() != size {
        return Err(Trouble::Compression);
    }
    // A checksum of 0 says that there is none.
    if header.crc != 0 && crc32fast::hash(out) != header.crc {
        return Err(Trouble::Checksum);
    }
    Ok(())
}

/// Reads `size` bytes at most, growing with what comes, not with what was promised.
fn read_bounded(decoder: &mut impl Read, size: usize, out: &mut Vec<u8>) -> Result<(), Trouble> {
    let read = decoder.take(size as u64).read_to_end(out);
    read.map(drop).map_err(|_| Trouble::Compression)
}

/// Is a message within a chunk or beside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MessageHead {
    pub(super) channel: u16,
    pub(super) sequence: u32,
    pub(super) log_time: u64,
    pub(super) publish_time: u64,
}

/// Bytes of a message's head before its payload.
pub(super) const MESSAGE_HEAD: usize = 22;

/// Reads a message record's body: its head, and its payload behind.
pub(super) fn message(body: &[u8]) -> Option<(MessageHead, &[u8])> {
    let (head, payload) = body.split_at_checked(MESSAGE_HEAD)?;
    let head = MessageHead {
        channel: number(head, 0, 2)? as u16,  // two bytes
        sequence: number(head, 2, 4)? as u32, // four bytes
        log_time: number(head, 6, 8)?,
        publish_time: number(head, 14, 8)?,
    };
    Some((head, payload))
}

/// Returns the record of a chunk at `at`: opcode, and where its body begins and ends.
pub(super) fn record_at(records: &[u8], at: usize) -> Option<(u8, usize, usize)> {
    let opcode = *records.get(at)?;
    let length = usize::try_from(number(records, at + 1, 8)?).ok()?;
    let start = at + HEAD;
    let end = start.checked_add(length).filter(|end| *end <= records.len())?;
    Some((opcode, start, end))
}
