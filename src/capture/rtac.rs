//! Serial data as a Real-Time Automation Controller captures it: link type 250.
//!
//! Twelve bytes go before the data: seconds and microseconds (32 bits each, big-endian), an event, control
//! lines, and two that mean nothing (Wireshark, packet-rtacser.c). The packet's own time is used.

use crate::decode::chunk::LineErrorKind;

/// LINKTYPE_RTAC_SERIAL.
pub(super) const LINK_TYPE: i32 = 250;

const HEADER: usize = 12;
/// Offset of the event in the header.
const EVENT: usize = 8;

/// Returns the event and the data of a packet, unless it is too short for a header.
pub(super) fn split(packet: &[u8]) -> Option<(u8, &[u8])> {
    Some((*packet.get(EVENT)?, packet.get(HEADER..)?))
}

/// Returns what an event says about the line: of its packet's first byte, or of the next when it has none.
pub(super) fn line_error(event: u8) -> Option<LineErrorKind> {
    match event {
        0x05 | 0x0A => Some(LineErrorKind::Overrun), // CAPTURE_DATA_LOST, SERIAL_OVERFLOW_EVENT
        0x07 | 0x08 => Some(LineErrorKind::ParityOrFraming), // FRAMING_ERROR, PARITY_ERROR
        0x09 => Some(LineErrorKind::Break),
        _ => None,
    }
}
