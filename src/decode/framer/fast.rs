//! The short cut for traffic whose next frame is beyond doubt: the lattice's answer without the lattice.
//!
//! The lattice hands over a frame as soon as every other reading is more than the margin worse. When the root has
//! one reading and no other frame, whole or one byte short, can hide in the bytes, the rivals are few: unfinished
//! frames at the same start, whose scores are computed; and unfinished ones after junk, which are bounded.

use crate::decode::candidate::{
    Basis, Candidate, Candidates, MIN_FRAME, Oddity, candidates, has_known_length,
};
use crate::decode::crc;
use crate::decode::frame::{Boundary, MAX_FRAME, Role};
use crate::decode::framer::node::{FrameEdge, Kind};
use crate::decode::framer::outstanding::{Fit, Outstanding};
use crate::decode::framer::reading::Readings;
use crate::decode::framer::score;
use crate::decode::framer::weigh::{Context, readings, zero_extension};

/// Says what the bytes after the root are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Glance {
    /// The registers or coils that were asked for, beyond doubt, and how long after, in nanoseconds; [`plain`] reads them.
    Answer(FrameEdge, Option<i64>),
    /// A frame, beyond doubt.
    Frame(FrameEdge, Readings),
    /// The beginning of a frame, and nothing else that could be decided before the bytes reach this stream offset.
    Wait(u64),
    /// A case for the lattice.
    Unsure,
}

/// Looks at the bytes from `offset` on, all of them undecided.
pub fn glance(offset: u64, outstanding: Option<&Outstanding>, context: &Context<'_>) -> Glance {
    let bytes = context.store.slice(offset, context.store.end());
    if bytes.len() < MIN_FRAME {
        return Glance::Wait(offset + MIN_FRAME as u64);
    }
    if let Some(outstanding) = outstanding
        && let Some(length) = outstanding.plain_response_length(bytes)
    {
        match bytes.get(..length) {
            // Only what is expected is waited for blindly: in all else another frame may show itself sooner.
            None => return Glance::Wait(offset + length as u64),
            Some(frame) => {
                if let Some((answer, since)) = plain_answer(offset, outstanding, frame, context) {
                    return Glance::Answer(answer, since);
                }
            }
        }
    }
    look(offset, outstanding, bytes, context)
}

/// Looks at bytes that are no plain answer.
#[inline(never)] // a plain answer needs far less of the stack
fn look(offset: u64, outstanding: Option<&Outstanding>, bytes: &[u8], context: &Context<'_>) -> Glance {
    let within = &bytes[..bytes.len().min(MAX_FRAME)];
    let mut found = candidates(within, context.shapes);
    let list = found.as_slice();
    if list.is_empty() || list.iter().any(|candidate| candidate.basis == Basis::AnyLength) {
        return Glance::Unsure;
    }
    let Some(length) = shortest_good(list, bytes) else {
        let waits = found.undecided || next_length(list, bytes.len()).is_some();
        let waits = waits && !hides_frame(within, context);
        // The next byte may show another frame.
        return if waits { Glance::Wait(context.store.end() + 1) } else { Glance::Unsure };
    };
    let frame = &bytes[..length];
    if hides_frame(frame, context) {
        return Glance::Unsure;
    }
    if !header_ends_within(frame) {
        // What the lattice sees when the last byte of the frame comes in: nothing that follows.
        found = candidates(frame, context.shapes);
    }
    match beyond_doubt(offset, outstanding, &found, frame, context) {
        Some(edge) => {
            let end = context.end(edge.end() - 1);
            let readings = Readings::new(found.as_slice(), frame, offset, edge.boundary, end, context.shapes);
            Glance::Frame(edge, readings)
        }
        None => Glance::Unsure,
    }
}

/// Recognises a frame of the length asked for as the answer, by far the commonest; all else is left to the rest.
fn plain_answer(
    offset: u64,
    outstanding: &Outstanding,
    frame: &[u8],
    context: &Context<'_>,
) -> Option<(FrameEdge, Option<i64>)> {
    // As a request it would have to name a quantity that it does not (V1.1b3, 6.1 to 6.4).
    let most = if frame[1] <= 2 { 2000 } else { 125 };
    let no_request = u16::from_be_bytes([frame[4], frame[5]]) > most;
    if !no_request || !crc::is_good(frame) || hides_frame(frame, context) {
        return None;
    }
    let length = frame.len() as u16;
    let candidate = plain(length);
    let begin = context.begin(offset);
    let since = begin.zip(outstanding.end).map(|(begin, end)| begin - end);
    let reading = score::answer(Fit::Full, outstanding, false, frame, since, context.experience);
    let score = score::frame(candidate, frame, context.experience) + reading;
    let kind = Kind::Response(Fit::Full); // by its function and length
    let rival = score::JUNK_OPEN + score::JUNK_BYTE + score::BEST_TAIL;
    let edge = FrameEdge { offset, length, kind, boundary: Boundary::Length, score };
    (rival < score - score::MARGIN).then_some((edge, since))
}

/// Returns how a plain answer of so many bytes is read.
pub fn plain(length: u16) -> Candidate {
    Candidate { role: Role::Response, length, basis: Basis::Standard, oddity: Oddity::None }
}

/// Tells whether the frame is long enough to show all its candidates' lengths.
fn header_ends_within(frame: &[u8]) -> bool {
    matches!(frame[1], 1..=6 | 15 | 16) && frame.len() >= 7
}

/// Returns the shortest candidate length whose CRC is good.
fn shortest_good(list: &[Candidate], bytes: &[u8]) -> Option<usize> {
    let mut last = 0;
    while let Some(length) = next_length(list, last).filter(|length| *length <= bytes.len()) {
        if crc::is_good(&bytes[..length]) {
            return Some(length);
        }
        last = length;
    }
    None
}

/// Returns the shortest candidate length above this one.
fn next_length(list: &[Candidate], length: usize) -> Option<usize> {
    list.iter().map(|candidate| usize::from(candidate.length)).filter(|longer| *longer > length).min()
}

/// Tells whether a frame may begin inside the bytes and be whole, or whole but for a last 00.
fn hides_frame(bytes: &[u8], context: &Context<'_>) -> bool {
    let ruled_out = if context.experience.trusts_any() { Class::None } else { Class::AnyLength };
    // The shortest hidden frame is one byte short of the four that a frame has at least.
    let mut rest = bytes.get(1..).unwrap_or_default();
    while let [_, function, _, ..] = rest {
        let class = CLASS[usize::from(*function)];
        if class > ruled_out && may_be_frame(class, rest, context) {
            return true;
        }
        rest = &rest[1..];
    }
    false
}

/// Tells whether at least three bytes may be a frame whose function code is of this class, or all but its last 00.
fn may_be_frame(class: Class, bytes: &[u8], context: &Context<'_>) -> bool {
    match class {
        Class::None => false,
        Class::Exception => {
            let [address, function, code @ 1..=0x7F, low, ref rest @ ..] = *bytes else { return false };
            let high = rest.first().copied().unwrap_or(0);
            crc::checksum(&[address, function, code]) == u16::from_le_bytes([low, high])
        }
        Class::Read => {
            let shortest = (5 + usize::from(bytes[2])).min(8);
            bytes.len() + 1 >= shortest && may_end(bytes, context)
        }
        Class::Eight => bytes.len() + 1 >= 8 && may_end(bytes, context),
        Class::AnyLength | Class::Other => may_end(bytes, context),
    }
}

/// Sorts function codes by what rules a hidden frame out at a glance.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Class {
    None,
    AnyLength,
    Read,
    Exception,
    /// At least eight bytes: writes, and what repeats their head.
    Eight,
    Other,
}

static CLASS: [Class; 256] = {
    let mut table = [Class::AnyLength; 256];
    let mut function = 0;
    while function < 256 {
        table[function] = match function as u8 {
            0 | 0x80 | 0xFF => Class::None,
            1..=4 => Class::Read,
            5 | 6 | 8 | 15 | 16 | 22 => Class::Eight,
            0x81.. => Class::Exception,
            function if has_known_length(function) => Class::Other,
            _ => Class::AnyLength,
        };
        function += 1;
    }
    table
};

fn may_end(bytes: &[u8], context: &Context<'_>) -> bool {
    if bytes[1] < 0x80 && !has_known_length(bytes[1]) {
        return context.experience.trusts_function(bytes[1]);
    }
    candidates(bytes, context.shapes).as_slice().iter().any(|candidate| match candidate.basis {
        Basis::AnyLength => context.experience.trusts_function(bytes[1]),
        _ => {
            let length = usize::from(candidate.length);
            (MIN_FRAME..=bytes.len() + 1).contains(&length)
                && crc::checksum(&bytes[..length.min(bytes.len())]) == 0
        }
    })
}

/// Returns the frame if its best reading beats all rivals by more than the margin.
fn beyond_doubt(
    offset: u64,
    outstanding: Option<&Outstanding>,
    found: &Candidates,
    frame: &[u8],
    context: &Context<'_>,
) -> Option<FrameEdge> {
    let begin = context.begin(offset);
    let mut best: Option<(Kind, f32)> = None;
    let mut rival = score::JUNK_OPEN + score::JUNK_BYTE + score::BEST_TAIL;
    for candidate in found.as_slice() {
        if usize::from(candidate.length) == frame.len() {
            let base = score::frame(*candidate, frame, context.experience);
            for (kind, score) in
                readings(outstanding, 0, *candidate, frame, begin, context).into_iter().flatten()
            {
                let score = base + score;
                let worse = match best {
                    Some((_, known)) if known >= score => score,
                    Some((_, known)) => {
                        best = Some((kind, score));
                        known
                    }
                    None => {
                        best = Some((kind, score));
                        continue;
                    }
                };
                rival = rival.max(worse);
            }
        } else if (1..frame.len()).contains(&usize::from(candidate.length)) {
            // Its CRC was bad.
        } else if usize::from(candidate.length) == frame.len() + 1 {
            // The register is 0 after the frame: one more 00 would make this candidate good.
            rival = rival.max(zero_extension(outstanding, 0, *candidate, frame, begin, context));
        } else if candidate.role == Role::Request {
            let since = outstanding.and_then(|o| Some(begin? - o.end?));
            rival = rival.max(score::request_tail(outstanding, since));
        } else {
            rival = rival.max(score::response_tail(outstanding, *candidate, frame));
        }
    }
    let (kind, score) = best?;
    (rival < score - score::MARGIN).then_some(FrameEdge {
        offset,
        length: frame.len() as u16,
        kind,
        boundary: Boundary::Length,
        score,
    })
}
