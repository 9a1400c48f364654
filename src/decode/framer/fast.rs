//! The short cut for traffic whose next frame is beyond doubt: the lattice's answer without the lattice.
//!
//! The lattice hands over a frame as soon as every other reading is more than the margin worse. When the root has
//! one reading and no other frame, whole or one byte short, can hide in the bytes, the rivals are few: unfinished
//! frames at the same start, whose scores are computed; and unfinished ones after junk, which are bounded.

use crate::decode::candidate::{Basis, Candidate, Candidates, MIN_FRAME, candidates, has_known_length};
use crate::decode::crc;
use crate::decode::frame::{Boundary, MAX_FRAME, Role};
use crate::decode::framer::lattice::{Context, FrameEdge, Kind, readings, zero_extension};
use crate::decode::framer::outstanding::Outstanding;
use crate::decode::framer::reading::Readings;
use crate::decode::framer::score;

/// Says what the bytes after the root are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Glance {
    /// A frame, beyond doubt.
    Frame(FrameEdge, Readings),
    /// The beginning of a frame, and nothing else that could be decided yet.
    Wait,
    /// A case for the lattice.
    Unsure,
}

/// Looks at the bytes from `offset` on, all of them undecided.
pub fn glance(offset: u64, outstanding: Option<&Outstanding>, context: &Context<'_>) -> Glance {
    let bytes = context.store.slice(offset, u64::MAX);
    if bytes.len() < MIN_FRAME {
        return Glance::Wait;
    }
    let within = &bytes[..bytes.len().min(MAX_FRAME)];
    let mut found = candidates(within, context.shapes);
    let list = found.as_slice();
    if list.is_empty() || list.iter().any(|candidate| candidate.basis == Basis::AnyLength) {
        return Glance::Unsure;
    }
    let Some(length) = shortest_good(list, bytes) else {
        let waits = found.undecided || list.iter().any(|c| usize::from(c.length) > bytes.len());
        return if waits && !hides_frame(within, context) { Glance::Wait } else { Glance::Unsure };
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

/// Tells whether the frame is long enough to show all its candidates' lengths.
fn header_ends_within(frame: &[u8]) -> bool {
    matches!(frame[1], 1..=6 | 15 | 16) && frame.len() >= 7
}

/// Returns the shortest candidate length whose CRC is good.
fn shortest_good(list: &[Candidate], bytes: &[u8]) -> Option<usize> {
    let mut last = 0;
    let mut next = || {
        let longer = list.iter().map(|c| usize::from(c.length)).filter(|length| *length > last);
        last = longer.min().filter(|length| *length <= bytes.len())?;
        Some(last)
    };
    while let Some(length) = next() {
        if crc::is_good(&bytes[..length]) {
            return Some(length);
        }
    }
    None
}

/// Tells whether a frame may begin inside the bytes and be whole, or whole but for a last 00.
fn hides_frame(bytes: &[u8], context: &Context<'_>) -> bool {
    (1..bytes.len().saturating_sub(MIN_FRAME - 2)).any(|at| {
        let inner = &bytes[at..];
        may_begin(inner) && may_end(inner, context)
    })
}

/// Rules out most places at a glance: by function code, and by the length that the third byte tells.
fn may_begin(bytes: &[u8]) -> bool {
    let third = bytes.get(2).copied();
    let ends = |length: usize| length <= bytes.len() + 1;
    match bytes[1] {
        0 | 0x80 | 0xFF => false,
        1..=4 => ends(8) || third.is_some_and(|count| ends(5 + usize::from(count))),
        0x81.. => ends(5) && third.is_some_and(|code| matches!(code, 1..=0x7F)),
        _ => true,
    }
}

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
