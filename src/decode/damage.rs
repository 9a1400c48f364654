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
    let mut is_sound = true; // a damaged request tells no length
    let mut at = 0;
    while at < bytes.len() {
        let rest = &bytes[at..];
        let guess = guess(rest, outstanding.as_ref(), is_sound, around);
        let wanted = guess.map_or(rest.len(), |guess| guess.length.min(rest.len()));
        let length = until_gap(offset + at as u64, wanted, around);
        let beside = (at == 0 && around.frame_before) || (at + length == bytes.len() && around.frame_after);
        let stretch = Stretch { bytes: &rest[..length], offset: offset + at as u64, guess, beside };
        take(stretch.name(outstanding.as_ref(), around));
        is_sound &= guess.is_none();
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
fn guess(
    bytes: &[u8],
    outstanding: Option<&Outstanding>,
    is_sound: bool,
    around: &Surroundings<'_>,
) -> Option<Guess> {
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
        (true, true) if !is_sound => response(declared_length(&list).or(outstanding.response_length())?),
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

/// Is a stretch of bytes between two bounds.
struct Stretch<'a> {
    bytes: &'a [u8],
    offset: u64,
    guess: Option<Guess>,
    /// Whether a frame stands right beside it.
    beside: bool,
}

impl Stretch<'_> {
    /// Names what is wrong with it.
    fn name(&self, outstanding: Option<&Outstanding>, around: &Surroundings<'_>) -> Run {
        let run = Run {
            offset: self.offset,
            length: self.bytes.len() as u32, // at most what the framer holds
            reason: Reason::Noise,
            role: Role::Unknown,
            address: None,
            function: None,
        };
        if self.bytes.len() <= MOST_STRAY && self.beside {
            return Run { reason: Reason::Stray, ..run };
        }
        let headless = || outstanding.and_then(|o| headless(self.bytes, o.address, &[o.function]));
        if let Some(Head { address, function }) = headless() {
            let (role, address, function) = (Role::Response, Some(address), Some(function));
            return Run { reason: Reason::Truncated, role, address, function, ..run };
        }
        if let Some(Head { address, function }) = headless_of_known(self.bytes, around.experience) {
            let role = whole_role(self.bytes, address, function, around.shapes);
            let (address, function) = (Some(address), Some(function));
            return Run { reason: Reason::Truncated, role, address, function, ..run };
        }
        match self.guess {
            Some(guess) => Run {
                reason: if self.bytes.len() >= guess.length { Reason::Crc } else { Reason::Truncated },
                role: guess.role,
                address: self.bytes.first().copied(),
                function: self.bytes.get(1).map(|&function| FunctionCode(function)),
                ..run
            },
            None => run,
        }
    }
}

/// Is what a frame lost at its head.
struct Head {
    address: u8,
    function: FunctionCode,
}

/// Functions tried where address and function are lost and nothing is outstanding: those in common use.
const USUAL_FUNCTIONS: [u8; 8] = [1, 2, 3, 4, 5, 6, 15, 16];

/// Recognises a frame that lost its first byte or two: with them the CRC is good.
fn headless(bytes: &[u8], address: u8, functions: &[u8]) -> Option<Head> {
    if bytes.len() < 3 {
        return None;
    }
    let register = crc::Register::NEW.after(&[address]);
    if register.after(bytes).is_zero() {
        return Some(Head { address, function: FunctionCode(bytes[0]) });
    }
    let lost = |function: &&u8| register.after(&[**function]).after(bytes).is_zero();
    let function = functions.iter().find(lost)?;
    Some(Head { address, function: FunctionCode(*function) })
}

/// Recognises a frame of any known unit that lost its first byte or two.
fn headless_of_known(bytes: &[u8], experience: &Experience) -> Option<Head> {
    // A chance hit needs luck: few units are known, and the CRC has 16 bits.
    let known = (1..=247).filter(|&address| experience.knows_unit(address));
    known.take(16).find_map(|address| headless(bytes, address, &USUAL_FUNCTIONS))
}

/// Tells which role the whole frame has, by its form.
fn whole_role(bytes: &[u8], address: u8, function: FunctionCode, shapes: &Shapes) -> Role {
    let lost_function = bytes.first() != Some(&function.0);
    let mut whole = vec![address];
    whole.extend(lost_function.then_some(function.0));
    whole.extend(bytes);
    let list = candidates(&whole, shapes);
    let mut fitting = list.as_slice().iter().filter(|c| usize::from(c.length) == whole.len());
    match (fitting.next(), fitting.next()) {
        (Some(only), None) => only.role,
        _ => Role::Unknown,
    }
}
