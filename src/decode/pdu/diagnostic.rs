//! Exceptions and diagnostics (V1.1b3, sections 6.7 to 6.10, 6.13 and 7).

use super::draft::{Draft, Parsed};
use super::field::{PduValue, Remark, StopReason};
use crate::decode::function::ExceptionCode;

/// Reads an exception response (7): its code.
pub(super) fn exception<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let show = |code| PduValue::Exception(ExceptionCode(code));
    let (input, _) = draft.u8_as("exception code", show, input)?;
    Ok((input, ()))
}

/// Reads the response of function 7 (6.7): eight outputs of the device.
pub(super) fn exception_status<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, _) = draft.data("exception status", 1, |bytes| PduValue::Bits { bytes, count: 8 }, input)?;
    Ok((input, ()))
}

/// Reads the request of function 8 (6.8): a sub-function and its data.
pub(super) fn diagnostics_request<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let at = input;
    let (input, sub_function) = diagnostics(draft, input)?;
    let asked_zero = matches!(sub_function, 2 | 4 | 10..=18 | 20);
    if asked_zero && at.get(2..4).is_some_and(|data| data != [0, 0]) {
        draft.remark(Remark::Expected(0));
    }
    Ok((input, ()))
}

/// Reads the response of function 8 (6.8): the sub-function and its result.
pub(super) fn diagnostics_response<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    diagnostics(draft, input).map(|(input, _)| (input, ()))
}

/// Reads sub-function and data: two bytes, and any number of them to be returned as they are.
fn diagnostics<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a, u16> {
    let show = |number| sub_function(number).map_or(PduValue::Number(number), |n| PduValue::Named(number, n));
    let (input, number) = draft.u16_as("sub-function", show, input)?;
    let len = if number == 0 { draft.before_crc(input).max(2) } else { 2 };
    let (input, _) = draft.data("data", len, PduValue::Registers, input)?;
    Ok((input, number))
}

/// Names the sub-functions of function 8 (6.8.1).
fn sub_function(number: u16) -> Option<&'static str> {
    Some(match number {
        0 => "return query data",
        1 => "restart communications option",
        2 => "return diagnostic register",
        3 => "change ASCII input delimiter",
        4 => "force listen only mode",
        10 => "clear counters and diagnostic register",
        11 => "return bus message count",
        12 => "return bus communication error count",
        13 => "return bus exception error count",
        14 => "return server message count",
        15 => "return server no response count",
        16 => "return server NAK count",
        17 => "return server busy count",
        18 => "return bus character overrun count",
        20 => "clear overrun counter and flag",
        _ => return None,
    })
}

/// Reads the response of function 11 (6.9): the counter of completed messages.
pub(super) fn event_counter<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, _) = draft.u16_as("status", busy, input)?;
    let (input, _) = draft.u16("event count", input)?;
    Ok((input, ()))
}

/// Reads the response of function 12 (6.10): counters, and up to 64 events, the latest first.
pub(super) fn event_log<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let at = input;
    let (input, count) = draft.byte_count(input)?;
    if count < 6 {
        return Err(draft.broken("byte count", at, StopReason::CountTooSmall { given: count, least: 6 }));
    }
    draft.check(u16::try_from(count).unwrap_or(u16::MAX), 6, 70);
    let (input, ()) = event_counter(draft, input)?;
    let (input, _) = draft.u16("message count", input)?;
    let (input, _) = draft.data("events", count - 6, PduValue::Raw, input)?;
    Ok((input, ()))
}

/// Shows the status word of functions 11 and 12.
fn busy(status: u16) -> PduValue<'static> {
    match status {
        0x0000 => PduValue::Named(status, "ready"),
        0xFFFF => PduValue::Named(status, "busy"),
        _ => PduValue::Word(status),
    }
}

/// Reads the response of function 17 (6.13): who the device is, and whether it runs.
///
/// The length of the ID is the device's own affair; one byte is what most send.
pub(super) fn server_id<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, count) = draft.byte_count(input)?;
    let (input, _) = draft.data("server ID", count.min(1), PduValue::Raw, input)?;
    if count < 2 {
        return Ok((input, ()));
    }
    draft.remark(Remark::Note("taken to be one byte"));
    let show = |status| match status {
        0x00 => PduValue::Named(0x00, "off"),
        0xFF => PduValue::Named(0xFF, "on"),
        other => PduValue::Number(other.into()),
    };
    let (input, status) = draft.u8_as("run indicator", show, input)?;
    if !matches!(status, 0x00 | 0xFF) {
        draft.remark(Remark::Note("neither 0x00 nor 0xff"));
    }
    let (input, _) = draft.data("additional data", count - 2, PduValue::Raw, input)?;
    Ok((input, ()))
}
