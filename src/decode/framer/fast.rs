//! The short cut for traffic whose next frame is beyond doubt: the lattice's answer without the lattice.
//!
//! The lattice hands over a frame as soon as every other reading is more than the margin worse. When the root has
//! one reading and no other frame, whole or one byte short, can hide in the bytes, the rivals are few: unfinished
//! frames at the same start, whose scores are computed; and unfinished ones after junk, which are bounded.

use crate::decode::candidate::{Basis, Candidate, MIN_FRAME, candidates};
use crate::decode::crc;
use crate::decode::frame::{Boundary, Role};
use crate::decode::framer::lattice::{Context, FrameEdge, Kind, readings, zero_extension};
use crate::decode::framer::outstanding::Outstanding;
use crate::decode::framer::score;

/// Says what the bytes after the root are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Glance {
    /// A frame, beyond doubt.
    Frame(FrameEdge),
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
    let found = candidates(&bytes[..bytes.len().min(crate::decode::frame::MAX_FRAME)], context.shapes);
    let list = found.as_slice();
    if list.is_empty() || list.iter().any(|candidate| candidate.basis == Basis::AnyLength) {
        return Glance::Unsure;
    }
    let Some(length) = shortest_good(list, bytes) else {
        let waits = found.undecided || list.iter().any(|c| usize::from(c.length) > bytes.len());
        let within = &bytes[..bytes.len().min(crate::decode::frame::MAX_FRAME)];
        return if waits && !hides_frame(within, context) { Glance::Wait } else { Glance::Unsure };
    };
    let frame = &bytes[..length];
    if hides_frame(frame, context) {
        return Glance::Unsure;
    }
    // What the lattice sees when the last byte of the frame comes in: nothing that follows.
    let then = candidates(frame, context.shapes);
    match beyond_doubt(offset, outstanding, then.as_slice(), frame, context) {
        Some(edge) => Glance::Frame(edge),
        None => Glance::Unsure,
    }
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
        MAY_BEGIN[usize::from(inner[1])] && may_end(inner, context)
    })
}

/// Function codes that a frame may have after junk, without those of any length.
static MAY_BEGIN: [bool; 256] = {
    let mut table = [false; 256];
    let mut function = 1;
    while function < 255 {
        table[function] = function != 0x80;
        function += 1;
    }
    table
};

fn may_end(bytes: &[u8], context: &Context<'_>) -> bool {
    if bytes[1] < 0x80 && !crate::decode::candidate::has_known_length(bytes[1]) {
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
    list: &[Candidate],
    frame: &[u8],
    context: &Context<'_>,
) -> Option<FrameEdge> {
    let begin = context.begin(offset);
    let mut best: Option<(Kind, f32)> = None;
    let mut rival = score::JUNK_OPEN + score::JUNK_BYTE + score::BEST_TAIL;
    for candidate in list {
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
