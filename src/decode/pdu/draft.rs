//! A dissection in the making: nom reads a field, the draft keeps it with its place.

use nom::bytes::complete::take;
use nom::error::Error;
use nom::number::complete::{be_u8, be_u16};
use nom::{IResult, Offset};

use super::crc::Crc;
use super::field::{PduField, PduValue, Remark, Stop, StopReason};

/// Is what a parser gives back: the input behind what it read, and its value.
///
/// What it read before it failed stays in the draft: that is what makes reading lax.
pub(super) type Parsed<'a, T = ()> = Result<(&'a [u8], T), Broken>;

/// Reads what follows the function code.
pub(super) type Parser = for<'a> fn(&mut Draft<'a>, &'a [u8]) -> Parsed<'a>;

/// Is a stop, and whether the whole run ended there: then it has no CRC either, unless a good one showed.
#[derive(Debug)]
pub(super) struct Broken {
    stop: Stop,
    at_end: bool,
}

/// Collects the fields of one run of bytes.
pub(super) struct Draft<'a> {
    bytes: &'a [u8],
    /// The last two bytes taken as a CRC.
    pub(super) crc: Option<Crc>,
    /// The fields read so far, end to end.
    pub(super) fields: Vec<PduField<'a>>,
    /// The number of the list item that is being read.
    pub(super) item: Option<u16>,
}

impl<'a> Draft<'a> {
    /// Starts on the bytes from address to CRC.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Draft { bytes, crc: Crc::of(bytes), fields: Vec::with_capacity(8), item: None }
    }

    /// Returns what to read: all but a good CRC; with a bad one nothing shows where the PDU ends.
    pub(super) fn body(&self) -> &'a [u8] {
        if self.crc_is_good() { &self.bytes[..self.bytes.len() - 2] } else { self.bytes } // good: 4 bytes at least
    }

    fn crc_is_good(&self) -> bool {
        self.crc.is_some_and(Crc::is_good)
    }

    /// Returns how many bytes of the input lie before the CRC, good or bad.
    pub(super) fn before_crc(&self, input: &[u8]) -> usize {
        if self.crc_is_good() { input.len() } else { input.len().saturating_sub(2) }
    }

    /// Marks the field read last.
    pub(super) fn remark(&mut self, remark: Remark) {
        if let Some(field) = self.fields.last_mut() {
            field.remark = Some(remark);
        }
    }

    /// Marks the field read last when its value is outside the specification's range.
    pub(super) fn check(&mut self, value: u16, least: u16, most: u16) {
        if !(least..=most).contains(&value) {
            self.remark(Remark::OutsideRange { least, most });
        }
    }

    /// Marks the field read last when it is not what another field asks for.
    pub(super) fn expect(&mut self, value: usize, wanted: usize) {
        if value != wanted {
            self.remark(Remark::Expected(u16::try_from(wanted).unwrap_or(u16::MAX)));
        }
    }

    fn push(&mut self, name: &'static str, at: &[u8], len: usize, value: PduValue<'a>) {
        let start = self.bytes.offset(at);
        let span = start..start + len;
        self.fields.push(PduField { name, value, span, item: self.item, remark: None });
    }

    /// Says that a field does not fit.
    pub(super) fn broken(&self, field: &'static str, at: &[u8], reason: StopReason) -> Broken {
        let offset = self.bytes.offset(at);
        Broken { stop: Stop { offset, field, reason }, at_end: offset + at.len() == self.bytes.len() }
    }

    fn missing(&self, field: &'static str, at: &[u8], needed: usize) -> Broken {
        self.broken(field, at, StopReason::Missing { needed, present: at.len() })
    }

    /// Reads one byte as a number.
    pub(super) fn u8(&mut self, name: &'static str, input: &'a [u8]) -> Parsed<'a, u8> {
        self.u8_as(name, |byte| PduValue::Number(byte.into()), input)
    }

    /// Reads one byte, shown as told.
    pub(super) fn u8_as(
        &mut self,
        name: &'static str,
        show: impl FnOnce(u8) -> PduValue<'static>,
        input: &'a [u8],
    ) -> Parsed<'a, u8> {
        let read: IResult<_, _, Error<_>> = be_u8(input);
        let (rest, byte) = read.map_err(|_| self.missing(name, input, 1))?;
        self.push(name, input, 1, show(byte));
        Ok((rest, byte))
    }

    /// Reads two bytes as a number.
    pub(super) fn u16(&mut self, name: &'static str, input: &'a [u8]) -> Parsed<'a, u16> {
        self.u16_as(name, PduValue::Number, input)
    }

    /// Reads two bytes as a word.
    pub(super) fn word(&mut self, name: &'static str, input: &'a [u8]) -> Parsed<'a, u16> {
        self.u16_as(name, PduValue::Word, input)
    }

    /// Reads two bytes, shown as told.
    pub(super) fn u16_as(
        &mut self,
        name: &'static str,
        show: impl FnOnce(u16) -> PduValue<'static>,
        input: &'a [u8],
    ) -> Parsed<'a, u16> {
        let read: IResult<_, _, Error<_>> = be_u16(input);
        let (rest, number) = read.map_err(|_| self.missing(name, input, 2))?;
        self.push(name, input, 2, show(number));
        Ok((rest, number))
    }

    /// Reads as many bytes as told, shown as told; keeps those that are there when some are missing.
    ///
    /// No bytes make no field.
    pub(super) fn data(
        &mut self,
        name: &'static str,
        len: usize,
        show: impl FnOnce(&'a [u8]) -> PduValue<'a>,
        input: &'a [u8],
    ) -> Parsed<'a, &'a [u8]> {
        let read: IResult<_, _, Error<_>> = take(len)(input);
        let (rest, data) = match read {
            Ok(read) => read,
            Err(_) => (&input[input.len()..], input),
        };
        if !data.is_empty() {
            self.push(name, input, data.len(), show(data));
        }
        if data.len() < len { Err(self.missing(name, input, len)) } else { Ok((rest, data)) }
    }

    /// Reads a byte count of one byte; says so when more bytes follow than it counts.
    pub(super) fn byte_count(&mut self, input: &'a [u8]) -> Parsed<'a, usize> {
        let (input, count) = self.u8("byte count", input)?;
        let (count, follow) = (usize::from(count), self.before_crc(input));
        if follow > count {
            self.remark(Remark::Follow { bytes: follow });
        }
        Ok((input, count))
    }

    /// Reads one item after another, numbered from 1, until the input is used up.
    pub(super) fn items(&mut self, input: &'a [u8], parser: Parser) -> Result<(), Broken> {
        let mut rest = input;
        let mut number = 0_u16;
        while !rest.is_empty() {
            number = number.saturating_add(1);
            self.item = Some(number);
            (rest, ()) = parser(self, rest)?;
        }
        self.item = None;
        Ok(())
    }

    /// Turns the bytes that no parser took into fields: those left over, and the CRC.
    pub(super) fn finish(&mut self, broken: Option<Broken>) -> Option<Stop> {
        self.item = None;
        let start = self.fields.last().map_or(0, |field| field.span.end);
        let rest = &self.bytes[start..]; // spans lie inside the bytes
        let truncated = broken.as_ref().is_some_and(|broken| broken.at_end) && !self.crc_is_good();
        let (before, crc) = match rest.len().checked_sub(2) {
            Some(split) if !truncated => rest.split_at(split),
            _ => (rest, &rest[rest.len()..]),
        };
        if !before.is_empty() {
            self.push("bytes", before, before.len(), PduValue::Raw(before));
            self.remark(if broken.is_some() || crc.is_empty() { Remark::Unread } else { Remark::LeftOver });
        }
        if let [low, high] = *crc {
            self.push("CRC", crc, 2, PduValue::Word(u16::from_le_bytes([low, high])));
            if let Some(Crc { computed, .. }) = self.crc.filter(|crc| !crc.is_good()) {
                self.remark(Remark::BadCrc { computed });
            }
        } else if broken.is_none() {
            return Some(self.missing("CRC", rest, 2).stop);
        }
        broken.map(|broken| broken.stop)
    }
}

/// Reads nothing: the function has no data.
pub(super) fn nothing<'a>(_: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    Ok((input, ()))
}

/// Reads all up to the CRC raw: the form of the function is not known.
pub(super) fn anything<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, _) = draft.data("data", draft.before_crc(input), PduValue::Raw, input)?;
    Ok((input, ()))
}
