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
pub(super) fn data<'a>(t: &Transaction<'a>, side: Role) -> Option<(usize, &'a [u8])> {
    let whole = |side: Option<Side<'a>>| side.filter(|side| !side.damaged).map(|side| side.bytes);
    let request = whole(t.request)?;
    let bytes = if side == Role::Request { request } else { whole(t.response)? };
    let is_ordinary = bytes.get(1) == Some(&t.function.0) && t.outcome != Outcome::Exception;
    let start = data_start(t.function.0, side).filter(|_| is_ordinary)?;
    Some((start, bytes.get(start..bytes.len().checked_sub(CRC_BYTES)?)?))
}
