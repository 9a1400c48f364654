//! Reads the message that holds the bytes of a bus, of which a recording has millions.
//!
//! The common fields are taken apart here, without the two allocations a message that prost needs. Whatever is not
//! as common is left to prost, which has the last word on what is a message.

use prost::{DecodeError, Message};

use super::schema::{RawChunk, Read};

/// Keys of the fields: number and wire type.
const STREAM_OFFSET: u8 = 1 << 3;
const DATA: u8 = 2 << 3 | 2;
const MONOTONIC_NS: u8 = 3 << 3;
const READY_NS: u8 = 5 << 3;
const EARLIER: u8 = 6 << 3 | 2;
const EARLIER_END: u8 = 1 << 3;
const EARLIER_MONOTONIC_NS: u8 = 2 << 3;

/// Reads a message into `raw`, which keeps its memory.
///
/// # Errors
/// When it is none.
pub(super) fn read(payload: &[u8], raw: &mut RawChunk) -> Result<(), DecodeError> {
    raw.clear();
    if read_common(payload, raw).is_none() {
        raw.clear();
        raw.merge(payload)?;
    }
    Ok(())
}

fn read_common(mut rest: &[u8], raw: &mut RawChunk) -> Option<()> {
    while let Some(key) = rest.split_off_first() {
        match *key {
            STREAM_OFFSET => raw.stream_offset = varint(&mut rest)?,
            DATA => {
                raw.data.clear();
                raw.data.extend_from_slice(field(&mut rest)?);
            }
            MONOTONIC_NS => raw.monotonic_ns = varint(&mut rest)?,
            READY_NS => raw.ready_ns = varint(&mut rest)?,
            EARLIER => raw.earlier.push(earlier(field(&mut rest)?)?),
            _ => return None,
        }
    }
    Some(())
}

fn earlier(mut rest: &[u8]) -> Option<Read> {
    let mut read = Read::default();
    while let Some(key) = rest.split_off_first() {
        match *key {
            EARLIER_END => read.end = u32::try_from(varint(&mut rest)?).ok()?,
            EARLIER_MONOTONIC_NS => read.monotonic_ns = varint(&mut rest)?,
            _ => return None,
        }
    }
    Some(read)
}

/// Reads a field with its length.
fn field<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let length = usize::try_from(varint(rest)?).ok()?;
    rest.split_off(..length)
}

/// Reads a number of up to nine bytes; those of ten are too rare.
fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..63).step_by(7) {
        let byte = *rest.split_off_first()?;
        value |= u64::from(byte & 0x7F) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::schema::LineError;
    use super::*;

    fn messages() -> impl Strategy<Value = RawChunk> {
        let errors = prop::collection::vec((any::<u32>(), 0..5, any::<u32>()), 0..2);
        let earlier = prop::collection::vec((any::<u32>(), any::<u64>()), 0..4);
        let data = prop::collection::vec(any::<u8>(), 0..300);
        (any::<u64>(), data, any::<u64>(), errors, any::<u64>(), earlier, 0..3).prop_map(
            |(stream_offset, data, monotonic_ns, errors, ready_ns, earlier, dating)| RawChunk {
                stream_offset,
                data,
                monotonic_ns: monotonic_ns >> 4,
                errors: errors
                    .into_iter()
                    .map(|(offset, kind, count)| LineError { offset, kind, count })
                    .collect(),
                ready_ns,
                earlier: earlier.into_iter().map(|(end, monotonic_ns)| Read { end, monotonic_ns }).collect(),
                dating,
            },
        )
    }

    proptest! {
        #[test]
        fn messages_are_read_as_prost_reads_them(message in messages(), at: prop::sample::Index, byte: u8) {
            let mut raw = RawChunk { data: vec![1], ready_ns: 7, ..RawChunk::default() };
            let mut payload = message.encode_to_vec();
            prop_assert!(read(&payload, &mut raw).is_ok());
            prop_assert_eq!(&raw, &message);
            if !payload.is_empty() {
                let at = at.index(payload.len());
                payload[at] = byte;
                match RawChunk::decode(&*payload) {
                    Ok(expected) => {
                        prop_assert!(read(&payload, &mut raw).is_ok());
                        prop_assert_eq!(&raw, &expected);
                    }
                    Err(_) => prop_assert!(read(&payload, &mut raw).is_err()),
                }
            }
        }
    }
}
