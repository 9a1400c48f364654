//! Where the data lies in the frames of a transaction.

use crate::decode::frame::Role;
use crate::decode::transaction::{Outcome, Side, Transaction};

const CRC_BYTES: usize = 2;

/// Returns where the data begins in a frame of a function that profiles may use.
///
/// Counted from the address byte (Modbus application protocol V1.1b3, 6.3, 6.4, 6.6, 6.12); `None`
/// where such a frame has no data.
pub(super) fn data_start(function: u8, side: Role) -> Option<usize> {
    match (function, side) {
        (3 | 4, Role::Response) => Some(3),
        (16, Role::Request) => Some(7),
        (6, Role::Request) => Some(4),
        _ => None,
    }
}

/// Returns the data of one side, with its offset from the address byte.
///
/// A damaged side has none; a response has none without its request, as nothing in it says what it
/// answers; an exception has none.
pub(crate) fn data<'a>(t: &Transaction<'a>, side: Role) -> Option<(usize, &'a [u8])> {
    let frames = [whole(&t.request), whole(&t.response)];
    data_of(frames, side, t.function.0, t.outcome == Outcome::Exception)
}

/// Returns the bytes of a side that is there and not damaged.
pub(super) fn whole<'a>(side: &Option<Side<'a>>) -> Option<&'a [u8]> {
    match side {
        Some(Side { bytes, damaged: false, .. }) => Some(*bytes),
        _ => None,
    }
}

/// Does what [`data`] does, for request and response as far as they are whole.
pub(super) fn data_of(
    [request, response]: [Option<&[u8]>; 2],
    side: Role,
    function: u8,
    is_exception: bool,
) -> Option<(usize, &[u8])> {
    let request = request?;
    let bytes = if side == Role::Request { request } else { response? };
    let is_ordinary = bytes.get(1) == Some(&function) && !is_exception;
    let start = data_start(function, side).filter(|_| is_ordinary)?;
    Some((start, bytes.get(start..bytes.len().checked_sub(CRC_BYTES)?)?))
}
