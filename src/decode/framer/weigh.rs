//! Weighs one frame, whole or unfinished, from one state: the scores put to the bytes.

use crate::decode::candidate::{Basis, Candidate, Candidates, MIN_FRAME};
use crate::decode::crc;
use crate::decode::frame::{MAX_FRAME, Role};
use crate::decode::framer::experience::Experience;
use crate::decode::framer::node::Kind;
use crate::decode::framer::outstanding::Outstanding;
use crate::decode::framer::score;
use crate::decode::shape::Shapes;
use crate::decode::stamp::Stamper;
use crate::decode::store::Store;
use crate::time::Timestamp;

/// What the scores need to see besides the lattice itself.
pub struct Context<'a> {
    pub store: &'a Store,
    pub stamper: &'a Stamper,
    pub shapes: &'a Shapes,
    pub experience: &'a Experience,
    /// Nanoseconds of t3.5.
    pub gap_ns: i64,
}

impl Context<'_> {
    /// Estimates when the byte at `offset` began.
    pub fn begin(&self, offset: u64) -> Option<Timestamp> {
        Some(self.end(offset)? - self.stamper.character_ns())
    }

    /// Estimates when the byte at `offset` ended.
    pub fn end(&self, offset: u64) -> Option<Timestamp> {
        self.stamper.middle(offset)
    }
}

/// Is a place where an unfinished frame may have begun.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    pub offset: u64,
    pub candidates: Candidates,
    /// Bit a candidate: its length is not reached yet.
    pub open: u8,
    /// Register over the bytes so far; kept only for candidates of any length.
    pub register: crc::Register,
}

impl Start {
    /// Returns the candidates whose length is not reached yet.
    pub fn open(&self) -> impl Iterator<Item = &Candidate> {
        let open = self.open;
        self.candidates
            .as_slice()
            .iter()
            .enumerate()
            .filter(move |(i, _)| open & (1 << i) != 0)
            .map(|(_, c)| c)
    }
}

/// Lists how a frame can be read from a state, with the score of each.
pub fn readings(
    outstanding: Option<&Outstanding>,
    junk: u16,
    candidate: Candidate,
    bytes: &[u8],
    begin: Option<Timestamp>,
    context: &Context<'_>,
) -> [Option<(Kind, f32)>; 2] {
    let since = outstanding.and_then(|o| Some(begin? - o.end?));
    if candidate.role == Role::Request {
        let request = (Kind::Request, score::request(outstanding, junk, bytes, since));
        let echo = score::echo(outstanding, junk, bytes, since, context.experience).map(|s| (Kind::Echo, s));
        [Some(request), echo]
    } else {
        let (score, fit) = score::response(outstanding, junk, candidate, bytes, since, context.experience);
        [Some((Kind::Response(fit), score)), None]
    }
}

/// Scores a frame that is still unfinished, with the bytes there are.
pub fn tail(
    outstanding: Option<&Outstanding>,
    junk: u16,
    candidate: &Candidate,
    start: &Start,
    bytes: &[u8],
    begin: Option<Timestamp>,
    context: &Context<'_>,
) -> f32 {
    let one_missing = if candidate.basis == Basis::AnyLength {
        bytes.len() >= MIN_FRAME && start.register.is_zero()
    } else {
        usize::from(candidate.length) == bytes.len() + 1 && crc::checksum(bytes) == 0
    };
    if one_missing {
        return zero_extension(outstanding, junk, *candidate, bytes, begin, context);
    }
    if candidate.role == Role::Request {
        let since = outstanding.and_then(|o| Some(begin? - o.end?));
        score::request_tail(outstanding, since)
    } else {
        score::response_tail(outstanding, *candidate, bytes)
    }
}

/// Scores a frame that is good if the next byte is 00: as the finished one, less what that is worth.
pub fn zero_extension(
    outstanding: Option<&Outstanding>,
    junk: u16,
    candidate: Candidate,
    bytes: &[u8],
    begin: Option<Timestamp>,
    context: &Context<'_>,
) -> f32 {
    let mut extended = [0; MAX_FRAME];
    let length = bytes.len().min(MAX_FRAME - 1);
    extended[..length].copy_from_slice(&bytes[..length]);
    let extended = &extended[..length + 1];
    let base = score::frame(candidate, extended, context.experience);
    let readings = readings(outstanding, junk, candidate, extended, begin, context);
    let best = readings.iter().flatten().map(|(_, score)| *score).fold(f32::MIN, f32::max);
    base + best + score::ZERO_EXTENSION
}
