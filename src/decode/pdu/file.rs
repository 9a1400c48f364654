//! File records (V1.1b3, sections 6.14 and 6.15).

use super::draft::{Draft, Parsed, Parser};
use super::field::{PduValue, Remark, StopReason};

/// Reads the request of function 20 (6.14): sub-requests of seven bytes.
pub(super) fn read_request<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    list(draft, 0x07, 0xF5, record_place, input)
}

/// Reads the response of function 20 (6.14): sub-responses, each with its length.
pub(super) fn read_response<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    list(draft, 0x07, 0xF5, record_read, input)
}

/// Reads function 21 (6.15), the same both ways: sub-requests with their data.
pub(super) fn write<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    list(draft, 0x09, 0xFB, record_write, input)
}

/// Reads a byte count and the items it covers; what is missing of them is said by the item cut short.
fn list<'a>(draft: &mut Draft<'a>, least: u16, most: u16, item: Parser, input: &'a [u8]) -> Parsed<'a> {
    let (input, count) = draft.byte_count(input)?;
    draft.check(u16::try_from(count).unwrap_or(u16::MAX), least, most);
    let (items, rest) = input.split_at(count.min(input.len()));
    draft.items(items, item)?;
    if items.len() < count {
        let reason = StopReason::Missing { needed: count, present: items.len() };
        return Err(draft.broken("sub-requests", input, reason));
    }
    Ok((rest, ()))
}

/// Reads where a record is and how long: reference type, file, record, registers.
fn record_place<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    record_header(draft, input).map(|(input, _)| (input, ()))
}

/// Reads where a record is, and its data.
fn record_write<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, registers) = record_header(draft, input)?;
    let (input, _) = draft.data("record data", 2 * usize::from(registers), PduValue::Registers, input)?;
    Ok((input, ()))
}

/// Reads the seven bytes that name a record.
fn record_header<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a, u16> {
    let (input, ()) = reference_type(draft, input)?;
    let (input, file) = draft.u16("file number", input)?;
    draft.check(file, 1, 0xFFFF);
    let (input, record) = draft.u16("record number", input)?;
    draft.check(record, 0, 0x270F);
    draft.u16("record length", input)
}

/// Reads the reference type, always 6.
fn reference_type<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, kind) = draft.u8("reference type", input)?;
    draft.expect(kind.into(), 6);
    Ok((input, ()))
}

/// Reads one sub-response: its length counts the reference type and the data.
fn record_read<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let at = input;
    let (input, len) = draft.u8("file response length", input)?;
    if len == 0 {
        return Err(draft.broken(
            "file response length",
            at,
            StopReason::CountTooSmall { given: 0, least: 1 },
        ));
    }
    if len % 2 == 0 {
        draft.remark(Remark::Note("even: half a register is missing"));
    }
    let (input, ()) = reference_type(draft, input)?;
    let (input, _) = draft.data("record data", usize::from(len) - 1, PduValue::Registers, input)?;
    Ok((input, ()))
}
