//! Damaged runs: where one ends and the next begins, and what each may have been.
//!
//! Bounds come from the length that the outstanding request, or the run's own header, asks for, and from
//! silences that are certain. What neither explains stays whole.

use crate::decode::candidate::candidates;
use crate::decode::crc;
use crate::decode::frame::{Reason, Role};
use crate::decode::framer::{Experience, Outstanding};
use crate::decode::function::FunctionCode;
use crate::decode::shape::Shapes;
use crate::decode::stamp::Stamper;

/// Bytes up to which a run beside a frame counts as stray.
const MOST_STRAY: usize = 3;

/// Is a damaged run with a guess at what it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Stream offset of the first byte.
    pub offset: u64,
    /// Bytes.
    pub length: u32,
    /// What is wrong with it.
    pub reason: Reason,
    /// A guess at who sent it.
    pub role: Role,
    /// A guess at the unit address.
    pub address: Option<u8>,
    /// A guess at the function code as on the wire.
    pub function: Option<FunctionCode>,
}

/// Holds what the guesses rest on.
pub struct Surroundings<'a> {
    /// Forms that profiles declare.
    pub shapes: &'a Shapes,
    /// Which units talk.
    pub experience: &'a Experience,
    /// When the bytes were on the wire.
    pub stamper: &'a Stamper,
    /// Nanoseconds of t3.5.
    pub gap_ns: i64,
    /// Whether a frame ends where the bytes begin.
    pub frame_before: bool,
    /// Whether a frame begins where the bytes end.
    pub frame_after: bool,
}

/// What a stretch looks like by its first bytes.
#[derive(Clone, Copy)]
struct Guess {
    role: Role,
    length: usize,
}

/// Splits bytes that belong to no frame, from stream offset `offset` on.
pub fn split(
    bytes: &[u8],
    offset: u64,
    outstanding: Option<Outstanding>,
    around: &Surroundings<'_>,
    mut take: impl FnMut(Run),
) {
    let mut outstanding = outstanding.filter(|o| !o.is_broadcast());
    let mut at = 0;
    while at < bytes.len() {
        let rest = &bytes[at..];
        let guess = guess(rest, outstanding.as_ref(), around);
        let wanted = guess.map_or(rest.len(), |guess| guess.length.min(rest.len()));
        let length = until_gap(offset + at as u64, wanted, around);
        let beside = (at == 0 && around.frame_before) || (at + length == bytes.len() && around.frame_after);
        take(name(&rest[..length], offset + at as u64, guess, outstanding.as_ref(), beside));
        outstanding = match guess {
            Some(Guess { role: Role::Request, .. }) if length >= 8 => {
                Some(Outstanding::new(offset + at as u64, &rest[..length], None, around.shapes))
            }
            Some(_) => None,
            None => outstanding,
        };
        at += length;
    }
}

/// Guesses from the header what begins here.
fn guess(bytes: &[u8], outstanding: Option<&Outstanding>, around: &Surroundings<'_>) -> Option<Guess> {
    let (&address, &function) = (bytes.first()?, bytes.get(1)?);
    let list = candidates(bytes, around.shapes);
    let request = list
        .as_slice()
        .iter()
        .find(|c| c.role == Role::Request && c.length > 0 && around.experience.knows_unit(address))
        .map(|c| Guess { role: Role::Request, length: usize::from(c.length) });
    let Some(outstanding) = outstanding else { return request };
    if outstanding.repeats(bytes) {
        return request; // a damaged retry
    }
    let response = |length: usize| Some(Guess { role: Role::Response, length });
    let same_function = function & 0x7F == outstanding.function;
    match (address == outstanding.address, same_function) {
        (true, true) if function & 0x80 != 0 => response(5),
        (true, true) => response(outstanding.response_length().or(declared_length(&list))?),
        (true, false) | (false, true) if request.is_none() => response(outstanding.response_length()?),
        _ => request,
    }
}

fn declared_length(list: &crate::decode::candidate::Candidates) -> Option<usize> {
    let response = list.as_slice().iter().find(|c| c.role == Role::Response && c.length > 0);
    response.map(|c| usize::from(c.length))
}

/// Shortens a stretch to where a certain silence of t3.5 lies in it.
fn until_gap(offset: u64, length: usize, around: &Surroundings<'_>) -> usize {
    let silent = |at: &usize| {
        let gap = around.stamper.gap_before(offset + *at as u64);
        gap.is_some_and(|gap| gap.least > around.gap_ns)
    };
    (1..length).find(silent).unwrap_or(length)
}

/// Names what is wrong with a stretch.
fn name(
    bytes: &[u8],
    offset: u64,
    guess: Option<Guess>,
    outstanding: Option<&Outstanding>,
    beside: bool,
) -> Run {
    let run = Run {
        offset,
        length: bytes.len() as u32, // at most what the framer holds
        reason: Reason::Noise,
        role: Role::Unknown,
        address: None,
        function: None,
    };
    if bytes.len() <= MOST_STRAY && beside {
        return Run { reason: Reason::Stray, ..run };
    }
    if let Some(function) = headless(bytes, outstanding) {
        let address = outstanding.map(|o| o.address);
        return Run {
            reason: Reason::Truncated,
            role: Role::Response,
            address,
            function: Some(function),
            ..run
        };
    }
    match guess {
        Some(guess) => Run {
            reason: if bytes.len() >= guess.length { Reason::Crc } else { Reason::Truncated },
            role: guess.role,
            address: bytes.first().copied(),
            function: bytes.get(1).map(|&function| FunctionCode(function)),
            ..run
        },
        None => run,
    }
}

/// Recognises a response that lost its first byte or two: with them the CRC is good.
fn headless(bytes: &[u8], outstanding: Option<&Outstanding>) -> Option<FunctionCode> {
    let outstanding = outstanding?;
    let register = crc::Register::NEW.after(&[outstanding.address]);
    if bytes.len() >= 3 && register.after(bytes).is_zero() {
        return Some(FunctionCode(bytes[0]));
    }
    let register = register.after(&[outstanding.function]);
    (bytes.len() >= 3 && register.after(bytes).is_zero()).then_some(FunctionCode(outstanding.function))
}
