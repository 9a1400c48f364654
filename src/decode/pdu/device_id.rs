//! Encapsulated interface transport and device identification (V1.1b3, sections 6.19 to 6.21).

use super::draft::{Draft, Parsed, anything};
use super::field::{PduValue, Remark};

/// The MEI type of device identification (6.21).
const DEVICE_IDENTIFICATION: u8 = 14;

/// Reads the request of function 43 (6.21): which objects are wanted, and the first.
pub(super) fn request<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, mei_type) = mei_type(draft, input)?;
    if mei_type != DEVICE_IDENTIFICATION {
        return anything(draft, input);
    }
    let (input, ()) = read_code(draft, input)?;
    let (input, _) = draft.u8_as("object ID", object, input)?;
    Ok((input, ()))
}

/// Reads the response of function 43 (6.21): a list of objects, each with its length.
pub(super) fn response<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, mei_type) = mei_type(draft, input)?;
    if mei_type != DEVICE_IDENTIFICATION {
        return anything(draft, input);
    }
    let (input, ()) = read_code(draft, input)?;
    let (input, level) = draft.u8_as("conformity level", conformity, input)?;
    if !matches!(level, 0x01..=0x03 | 0x81..=0x83) {
        draft.remark(Remark::Note("not in the specification"));
    }
    let (input, more) = draft.u8_as("more follows", yes_or_no, input)?;
    if !matches!(more, 0x00 | 0xFF) {
        draft.remark(Remark::Note("neither 0x00 nor 0xff"));
    }
    let (input, _) = draft.u8("next object ID", input)?;
    let (mut input, objects) = draft.u8("number of objects", input)?;
    for number in 1..=u16::from(objects) {
        draft.item = Some(number);
        (input, _) = draft.u8_as("object ID", object, input)?;
        let len;
        (input, len) = draft.u8("object length", input)?;
        (input, _) = draft.data("object value", len.into(), PduValue::Text, input)?;
    }
    draft.item = None;
    Ok((input, ()))
}

/// Reads the MEI type (6.19).
fn mei_type<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a, u8> {
    let show = |mei_type| match mei_type {
        13 => PduValue::Named(13, "CANopen general reference"),
        DEVICE_IDENTIFICATION => PduValue::Named(14, "read device identification"),
        other => PduValue::Number(other.into()),
    };
    draft.u8_as("MEI type", show, input)
}

/// Reads which kind of access is meant (6.21), 1 to 4.
fn read_code<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let show = |code| match code {
        1 => PduValue::Named(1, "basic"),
        2 => PduValue::Named(2, "regular"),
        3 => PduValue::Named(3, "extended"),
        4 => PduValue::Named(4, "one object"),
        other => PduValue::Number(other.into()),
    };
    let (input, code) = draft.u8_as("read device ID code", show, input)?;
    draft.check(code.into(), 1, 4);
    Ok((input, ()))
}

/// Shows a conformity level (6.21).
fn conformity(level: u8) -> PduValue<'static> {
    let name = match level {
        0x01 => "basic, stream only",
        0x02 => "regular, stream only",
        0x03 => "extended, stream only",
        0x81 => "basic, stream and individual",
        0x82 => "regular, stream and individual",
        0x83 => "extended, stream and individual",
        _ => return PduValue::Number(level.into()),
    };
    PduValue::Named(level.into(), name)
}

/// Shows whether another request is needed for the rest.
fn yes_or_no(more: u8) -> PduValue<'static> {
    match more {
        0x00 => PduValue::Named(0x00, "no"),
        0xFF => PduValue::Named(0xFF, "yes"),
        other => PduValue::Number(other.into()),
    }
}

/// Shows an object by its name (6.21).
fn object(id: u8) -> PduValue<'static> {
    let name = match id {
        0 => "vendor name",
        1 => "product code",
        2 => "major minor revision",
        3 => "vendor URL",
        4 => "product name",
        5 => "model name",
        6 => "user application name",
        _ => return PduValue::Number(id.into()),
    };
    PduValue::Named(id.into(), name)
}
