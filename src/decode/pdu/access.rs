//! The few facts that pairing needs of every frame, without allocation.

use crate::decode::frame::Role;
use crate::decode::function::{ExceptionCode, FunctionCode};

/// Returns two bytes at an offset from the address, high byte first; the last two bytes are the CRC's.
fn word(bytes: &[u8], offset: usize) -> Option<u16> {
    let before_crc = bytes.get(..bytes.len().checked_sub(2)?)?;
    match before_crc.get(offset..)? {
        [high, low, ..] => Some(u16::from_be_bytes([*high, *low])),
        _ => None,
    }
}

/// Returns the first register, coil or input that a frame names, from address to CRC.
///
/// Requests of functions 1 to 6, 15, 16 and 22 to 24 name one (23 the one to read from), and so do the
/// responses of 5, 6, 15, 16 and 22. `None` for the others, when the bytes end before it, and for an
/// unknown role where it matters.
#[inline]
pub fn start_register(bytes: &[u8], role: Role) -> Option<u16> {
    match (bytes.get(1)?, role) {
        (5 | 6 | 15 | 16 | 22, _) | (1..=4 | 23 | 24, Role::Request) => word(bytes, 2),
        _ => None,
    }
}

/// Returns how many registers, coils or inputs a frame names, from address to CRC.
///
/// Requests of functions 1 to 4, 15, 16 and 23 (how many to read) name it, and so do the responses of
/// 15 and 16. `None` for the others, when the bytes end before it, and for an unknown role where it
/// matters.
#[inline]
pub fn quantity(bytes: &[u8], role: Role) -> Option<u16> {
    match (bytes.get(1)?, role) {
        (15 | 16, _) | (1..=4 | 23, Role::Request) => word(bytes, 4),
        _ => None,
    }
}

/// Returns the code of an exception response, from address to CRC; `None` for everything else.
#[inline]
pub fn exception_code(bytes: &[u8]) -> Option<ExceptionCode> {
    match bytes {
        [_, function, code, _, _, ..] if FunctionCode(*function).is_exception() => Some(ExceptionCode(*code)),
        _ => None,
    }
}
