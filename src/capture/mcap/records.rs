//! Splits an MCAP file into its records, and finds the next one after damage.
//!
//! The crate's readers end where a length is wrong; here a record must measure by its inner lengths what its
//! header says, and after one that does not, the search goes on for the next that does.

use std::io::{self, Read, Seek, SeekFrom};

use mcap::MAGIC;
use mcap::records::op;

/// The longest record taken for one, in bytes; chunks are a few megabytes at most.
pub(super) const LONGEST: u64 = 64 << 20;
/// Bytes of opcode and length before a record's body.
pub(super) const HEAD: usize = 9;
/// How much is read at once, in bytes.
const BLOCK: usize = 256 * 1024;
/// How far into a record its inner lengths are looked for while searching, in bytes.
const SEARCH_DEPTH: usize = 1024;

/// Is what comes next in a file.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Found<'a> {
    /// A whole record.
    Record {
        /// Where its head begins.
        offset: u64,
        /// What it is.
        opcode: u8,
        /// What follows its head.
        body: &'a [u8],
    },
    /// The magic bytes that stand at the beginning and at the end.
    Magic,
    /// Bytes that are no record.
    Damage {
        /// Where they begin.
        offset: u64,
        /// How many there are.
        length: u64,
    },
    /// Nothing more is there; a file that grows may have more later.
    End {
        /// Where the file has got to, or where its unfinished record begins.
        offset: u64,
        /// The bytes of the unfinished record.
        rest: &'a [u8],
    },
}

/// Splits a stream into records.
pub(super) struct Records<R> {
    window: Window<R>,
    /// Bytes of the record handed out last.
    held: usize,
}

impl<R: Read> Records<R> {
    /// Begins at `offset` of a file whose bytes from there on `source` gives.
    pub(super) fn new(source: R, offset: u64) -> Self {
        Records { window: Window { source, data: Vec::new(), start: 0, offset }, held: 0 }
    }

    /// Goes on at another offset.
    pub(super) fn seek(&mut self, offset: u64) -> io::Result<()>
    where
        R: Seek,
    {
        self.held = 0;
        self.window.data.clear();
        self.window.start = 0;
        self.window.offset = self.window.source.seek(SeekFrom::Start(offset))?;
        Ok(())
    }

    /// Returns where the bytes come from.
    pub(super) fn source(&self) -> &R {
        &self.window.source
    }

    /// Returns where the record handed out last ends.
    pub(super) fn position(&self) -> u64 {
        self.window.offset + self.held as u64
    }

    /// Tells whether the next record must be waited for.
    pub(super) fn is_drained(&self) -> bool {
        let rest = &self.window.bytes()[self.held..];
        let Some(length) = declared_length(rest) else { return true };
        (rest.len() as u64) < length.saturating_add(HEAD as u64)
    }

    /// Returns what comes next.
    pub(super) fn next(&mut self) -> io::Result<Found<'_>> {
        let held = std::mem::take(&mut self.held);
        self.window.skip(held);
        let offset = self.window.offset;
        if !self.window.fill(HEAD)? {
            if self.window.bytes() == MAGIC {
                self.held = MAGIC.len();
                return Ok(Found::Magic);
            }
            return Ok(Found::End { offset, rest: self.window.bytes() });
        }
        if self.window.bytes().starts_with(MAGIC) {
            self.held = MAGIC.len();
            return Ok(Found::Magic);
        }
        let Some(length) = self.window.measured()? else {
            let length = self.window.skip_to_record()?;
            return Ok(Found::Damage { offset, length });
        };
        if !self.window.fill(length)? {
            return Ok(Found::End { offset, rest: self.window.bytes() });
        }
        self.held = length;
        let bytes = self.window.bytes();
        Ok(Found::Record { offset, opcode: bytes[0], body: &bytes[HEAD..length] }) // filled up to there
    }
}

/// Holds the part of a file that is looked at.
struct Window<R> {
    source: R,
    data: Vec<u8>,
    start: usize,
    /// Where in the file the window begins.
    offset: u64,
}

impl<R: Read> Window<R> {
    fn bytes(&self) -> &[u8] {
        &self.data[self.start..]
    }

    fn skip(&mut self, length: usize) {
        self.start += length;
        self.offset += length as u64;
        if self.start > self.data.len() / 2 {
            self.data.drain(..self.start);
            self.start = 0;
        }
    }

    /// Reads on until `length` bytes are there; tells whether they are.
    fn fill(&mut self, length: usize) -> io::Result<bool> {
        while self.bytes().len() < length {
            let end = self.data.len();
            // Grown by what is there, not by what a length promises.
            self.data.resize(end + BLOCK, 0);
            let read = loop {
                match self.source.read(&mut self.data[end..]) {
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    other => break other,
                }
            };
            self.data.truncate(end + *read.as_ref().unwrap_or(&0));
            if read? == 0 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Returns the length with head of the record that begins here; `None` when none does.
    ///
    /// A record of which the file does not hold enough to tell is taken at its word.
    fn measured(&mut self) -> io::Result<Option<usize>> {
        let opcode = self.bytes()[0];
        let Some(length) = declared_length(self.bytes()).filter(|length| *length <= LONGEST) else {
            return Ok(None);
        };
        let whole = HEAD + length as usize; // at most 64 MiB
        let mut depth = whole.min(SEARCH_DEPTH);
        loop {
            let at_end = !self.fill(depth)?;
            let known = &self.bytes()[HEAD..self.bytes().len().min(whole)];
            match measure(opcode, known, length) {
                Measure::Fits => return Ok(Some(whole)),
                Measure::Differs => return Ok(None),
                Measure::Unknown if at_end || depth >= whole => return Ok(Some(whole)),
                Measure::Unknown => depth = whole,
            }
        }
    }

    /// Skips to where a record certainly begins, or to the end; returns how many bytes that were.
    fn skip_to_record(&mut self) -> io::Result<u64> {
        let begun = self.offset;
        self.skip(1);
        loop {
            let at_end = !self.fill(BLOCK)?;
            let bytes = self.bytes();
            // Without the depth behind it a place cannot be judged, unless nothing follows.
            let last = if at_end { bytes.len() } else { bytes.len() - SEARCH_DEPTH };
            if let Some(found) = (0..last).find(|at| certainly_begins(&bytes[*at..])) {
                self.skip(found);
                return Ok(self.offset - begun);
            }
            self.skip(last);
            if at_end {
                return Ok(self.offset - begun);
            }
        }
    }
}

/// Returns the length that a record's head gives to its body.
pub(super) fn declared_length(bytes: &[u8]) -> Option<u64> {
    bytes.get(1..HEAD).and_then(|field| field.try_into().ok()).map(u64::from_le_bytes)
}

/// Tells whether a record begins here, with so many inner lengths that chance is ruled out.
fn certainly_begins(bytes: &[u8]) -> bool {
    let Some(&opcode) = bytes.first() else { return false };
    let strong = matches!(
        opcode,
        op::CHUNK | op::MESSAGE_INDEX | op::METADATA | op::ATTACHMENT | op::DATA_END | op::FOOTER
    );
    let Some(length) = declared_length(bytes).filter(|length| strong && *length <= LONGEST) else {
        return false;
    };
    let body = &bytes[HEAD..];
    let body = &body[..body.len().min(length as usize).min(SEARCH_DEPTH)];
    measure(opcode, body, length) == Measure::Fits
}

#[derive(Debug, PartialEq, Eq)]
enum Measure {
    Fits,
    Differs,
    /// More of the record is needed to tell.
    Unknown,
}

/// Is a part of a record's body.
enum Field {
    Fixed(u64),
    /// Bytes after a 32-bit length: text, a list or a map.
    Counted,
    /// Bytes after a 64-bit length.
    LongCounted,
}

/// Returns the parts of a record's body (MCAP specification, "Records"); `None` where any length goes.
fn layout(opcode: u8) -> Option<&'static [Field]> {
    use Field::{Counted, Fixed, LongCounted};
    Some(match opcode {
        op::HEADER | op::METADATA => &[Counted, Counted],
        op::FOOTER => &[Fixed(20)],
        op::SCHEMA => &[Fixed(2), Counted, Counted, Counted],
        op::CHANNEL => &[Fixed(4), Counted, Counted, Counted],
        op::CHUNK => &[Fixed(28), Counted, LongCounted],
        op::MESSAGE_INDEX => &[Fixed(2), Counted],
        op::CHUNK_INDEX => &[Fixed(32), Counted, Fixed(8), Counted, Fixed(16)],
        op::ATTACHMENT => &[Fixed(16), Counted, Counted, LongCounted, Fixed(4)],
        op::ATTACHMENT_INDEX => &[Fixed(40), Counted, Counted],
        op::STATISTICS => &[Fixed(42), Counted],
        op::METADATA_INDEX => &[Fixed(16), Counted],
        op::SUMMARY_OFFSET => &[Fixed(17)],
        op::DATA_END => &[Fixed(4)],
        _ => return None,
    })
}

/// Holds a record's inner lengths against the length of its body, of which `known` is the beginning.
fn measure(opcode: u8, known: &[u8], length: u64) -> Measure {
    let Some(fields) = layout(opcode) else {
        let may_be = (opcode == op::MESSAGE && length >= 22) || opcode >= 0x80;
        return if may_be { Measure::Fits } else { Measure::Differs };
    };
    let mut at = 0_u64;
    for field in fields {
        let (width, fixed) = match field {
            Field::Fixed(bytes) => (0, *bytes),
            Field::Counted => (4, 0),
            Field::LongCounted => (8, 0),
        };
        let counted = if width == 0 {
            0
        } else {
            let start = usize::try_from(at).unwrap_or(usize::MAX);
            let Some(count) = known.get(start..).and_then(|rest| rest.get(..width)) else {
                let beyond = at.saturating_add(width as u64) > length;
                return if beyond { Measure::Differs } else { Measure::Unknown };
            };
            count.iter().rev().fold(0_u64, |value, byte| value << 8 | u64::from(*byte))
        };
        at = at.saturating_add(fixed).saturating_add(width as u64).saturating_add(counted);
        if at > length {
            return Measure::Differs;
        }
    }
    if at == length { Measure::Fits } else { Measure::Differs }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
        let mut record = vec![opcode];
        record.extend_from_slice(&(body.len() as u64).to_le_bytes());
        record.extend_from_slice(body);
        record
    }

    fn index(entries: usize) -> Vec<u8> {
        let mut body = vec![1, 0];
        body.extend_from_slice(&(16 * entries as u32).to_le_bytes());
        body.resize(body.len() + 16 * entries, 7);
        record(op::MESSAGE_INDEX, &body)
    }

    /// Names what is found: the length of a record, of damage, or what is left.
    fn found(bytes: &[u8]) -> Vec<(&'static str, u64)> {
        let mut records = Records::new(bytes, 0);
        let mut list = Vec::new();
        loop {
            list.push(match records.next().expect("memory can be read") {
                Found::Record { body, .. } => ("record", (HEAD + body.len()) as u64),
                Found::Magic => ("magic", 8),
                Found::Damage { length, .. } => ("damage", length),
                Found::End { rest, .. } => {
                    list.push(("end", rest.len() as u64));
                    return list;
                }
            });
        }
    }

    #[test]
    fn what_is_found_covers_every_byte_of_the_file() {
        let whole = [MAGIC, &index(2), &index(0), MAGIC].concat();
        assert_eq!(found(&whole), [("magic", 8), ("record", 47), ("record", 15), ("magic", 8), ("end", 0)]);
        for length in 0..whole.len() {
            let sum: u64 = found(&whole[..length]).iter().map(|(_, length)| length).sum();
            assert_eq!(sum, length as u64);
        }
    }

    #[test]
    fn one_wrong_byte_in_a_head_costs_one_record() {
        let whole = [MAGIC, &index(2), &index(40), &index(1), MAGIC].concat();
        for at in 8..8 + HEAD {
            for bit in 0..8 {
                let mut bytes = whole.clone();
                bytes[at] ^= 1 << bit;
                let list = found(&bytes);
                assert_eq!(
                    list[list.len() - 4..].iter().map(|(_, length)| length).sum::<u64>(),
                    655 + 31 + 8
                );
                let sum: u64 = list.iter().map(|(_, length)| length).sum();
                assert_eq!(sum, whole.len() as u64, "byte {at}, bit {bit}");
            }
        }
    }

    #[test]
    fn a_length_in_the_gigabytes_is_damage_and_asks_for_no_memory() {
        let mut bytes = [MAGIC, &index(2), &index(3)].concat();
        bytes[8 + 5] = 0xFF;
        let mut records = Records::new(&bytes[..], 0);
        records.next().expect("the magic");
        assert_eq!(records.next().expect("memory"), Found::Damage { offset: 8, length: 47 });
        assert!(records.window.data.capacity() < 4 * BLOCK);
    }
}
