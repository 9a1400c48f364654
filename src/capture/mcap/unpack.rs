//! The messages of a chunk: its checksum verified, decompressed within bounds.

use std::io::{self, Read};

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

/// Returns the bytes of a number.
fn field<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    field(bytes, at).map(u64::from_le_bytes)
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    field(bytes, at).map(u32::from_le_bytes)
}

fn header(body: &[u8]) -> Option<Header<'_>> {
    let compression_end = usize::try_from(u32_at(body, 28)?).ok()?.checked_add(32)?;
    let data_size = usize::try_from(u64_at(body, compression_end)?).ok()?;
    let data_start = compression_end.checked_add(8)?;
    Some(Header {
        uncompressed_size: u64_at(body, 16)?,
        crc: u32_at(body, 24)?,
        compression: body.get(32..compression_end)?,
        data: body.get(data_start..data_start.checked_add(data_size)?)?,
    })
}

/// Unpacks chunks, one after the other.
#[derive(Default)]
pub(super) struct Unpacker {
    /// Made once: that takes longer than to decompress a chunk of a second.
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

impl Unpacker {
    /// Puts the records of a chunk into `out`, which is emptied first; on trouble they must not be used.
    pub(super) fn unpack(&mut self, body: &[u8], out: &mut Vec<u8>) -> Result<(), Trouble> {
        out.clear();
        let header = header(body).ok_or(Trouble::Compression)?;
        if header.uncompressed_size > LONGEST {
            return Err(Trouble::TooLarge);
        }
        let size = header.uncompressed_size as usize; // at most 64 MiB
        match header.compression {
            b"" => out.extend_from_slice(header.data),
            b"zstd" => {
                self.unpack_zstd(header.data, size, out).map_err(|_| Trouble::Compression)?;
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

    fn unpack_zstd(&mut self, data: &[u8], size: usize, out: &mut Vec<u8>) -> io::Result<()> {
        let decompressor = match self.zstd.take() {
            Some(decompressor) => decompressor,
            None => zstd::bulk::Decompressor::new()?,
        };
        // Memory that is asked for and not written to costs nothing: a head may promise more than there is.
        out.reserve(size);
        self.zstd.insert(decompressor).decompress_to_buffer(data, out).map(drop)
    }
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
        channel: u16::from_le_bytes(field(head, 0)?),
        sequence: u32_at(head, 2)?,
        log_time: u64_at(head, 6)?,
        publish_time: u64_at(head, 14)?,
    };
    Some((head, payload))
}

/// Returns the record of a chunk at `at`: opcode, and where its body begins and ends.
pub(super) fn record_at(records: &[u8], at: usize) -> Option<(u8, usize, usize)> {
    let opcode = *records.get(at)?;
    let length = usize::try_from(u64_at(records, at + 1)?).ok()?;
    let start = at + HEAD;
    let end = start.checked_add(length).filter(|end| *end <= records.len())?;
    Some((opcode, start, end))
}
