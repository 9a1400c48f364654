//! From stamped bytes to frames and runs of junk, by length, CRC, the outstanding request and hold time.
//!
//! Gaps are not trusted: a USB adapter destroys them. `lattice` weighs all readings of the undecided bytes, each
//! frame by `weigh` with the figures of `score`; `fast` answers for it where nothing is in doubt, `polled` where
//! the same request came before; `experience` is what the bus has taught so far. The best reading of all bytes is
//! taken when the hold time passes in silence.

mod experience;
mod fast;
mod lattice;
mod node;
mod outstanding;
mod polled;
mod reading;
pub(in crate::decode) mod score;
mod weigh;

use std::collections::VecDeque;
use std::sync::Arc;

use crate::decode::candidate::{MIN_FRAME, candidates};
use crate::decode::chunk::Chunk;
use crate::decode::frame::{Boundary, Role};
use crate::decode::shape::Shapes;
use crate::decode::stamp::{Stamper, WAKE_NS};
use crate::decode::store::Store;
use crate::line::LineSettings;
use crate::time::{MILLISECOND, Timestamp};

pub use experience::Experience;
use fast::Glance;
use lattice::{Handed, Lattice};
use node::{FrameEdge, Kind};
use outstanding::PlainAnswer;
pub use outstanding::{Fit, Outstanding};
use polled::Polled;
pub use reading::{Asked, Readings};
use weigh::Context;

/// Nanoseconds that an unfinished frame is held at least.
pub const HOLD_NS: i64 = 120 * MILLISECOND;
/// Undecided bytes at which the best reading of all but the last `FORCED_REST` is taken.
const MOST_UNDECIDED: u64 = 700;
const FORCED_REST: u64 = 300;
/// Missing bytes that lengthen the hold, at most.
const MOST_MISSING: i64 = 64;

/// Is a stretch of the stream that is decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece {
    /// A frame with a good CRC and a possible shape.
    Frame {
        /// Stream offset of its address.
        offset: u64,
        /// Bytes, address to CRC.
        length: u16,
        /// How it can be read; pairing decides with hindsight.
        readings: Readings,
        /// What showed its end.
        boundary: Boundary,
        /// From 0 to 0.99.
        confidence: f32,
    },
    /// A request that waits for its answer, or the full answer to the request just before, beyond doubt: pairing need
    /// not weigh it while nothing is open.
    Half {
        /// Stream offset of its address.
        offset: u64,
        /// Bytes, address to CRC; they show its end.
        length: u16,
        /// Which of both it is.
        role: Role,
        /// From 0 to 0.99.
        confidence: f32,
        /// The estimate of a request's end; [`Framer::readings`] wants it.
        end: Option<Timestamp>,
    },
    /// A request and its answer, both beyond doubt at once: by far the commonest.
    Exchange {
        /// Stream offset of the request's address.
        offset: u64,
        /// Bytes of the request and of the answer right behind it.
        lengths: [u16; 2],
        /// Likewise, from 0 to 0.99.
        confidence: [f32; 2],
    },
    /// Bytes that belong to no frame.
    Junk {
        /// Stream offset of the first.
        offset: u64,
        /// Stream offset after the last.
        end: u64,
        /// The request that was outstanding before.
        outstanding: Option<Outstanding>,
    },
}

/// Splits a bus's bytes; pure, with time as an argument.
#[derive(Clone, Debug)]
pub struct Framer {
    store: Store,
    stamper: Stamper,
    shapes: Arc<Shapes>,
    experience: Experience,
    lattice: Lattice,
    /// Nanoseconds of t3.5.
    gap_ns: i64,
    last_read: Option<Timestamp>,
    junk: Option<(u64, u64, Option<Outstanding>)>,
    pieces: VecDeque<Piece>,
    short_cut: bool,
    /// Whether the bytes so far have given all pieces they can without more of them, or silence.
    is_dry: bool,
    /// Stream offset that the bytes must reach before another glance at the root can tell more.
    needed: u64,
    /// The answer that most likely begins at the root, while the lattice has seen nothing behind it.
    awaited: Option<PlainAnswer>,
    polled: Polled,
    /// The last score of requests and of responses turned into a confidence, and that: most frames score alike.
    confidence: [(f32, f32); 2],
}

macro_rules! context {
    ($framer:expr) => {
        Context {
            store: &$framer.store,
            stamper: &$framer.stamper,
            shapes: &$framer.shapes,
            experience: &$framer.experience,
            gap_ns: $framer.gap_ns,
        }
    };
}

impl Framer {
    /// Gives back memory that only saves time.
    pub fn compact(&mut self) {
        self.polled.forget();
    }

    /// Makes a framer for a line; `adapter_hold_ns` is the longest time the adapter keeps a byte back,
    /// in nanoseconds, estimated from the reads when `None`.
    pub fn new(line: LineSettings, adapter_hold_ns: Option<i64>, shapes: Arc<Shapes>) -> Self {
        Framer {
            store: Store::default(),
            stamper: Stamper::new(line, adapter_hold_ns),
            experience: Experience::new(&shapes),
            shapes,
            lattice: Lattice::new(),
            gap_ns: line.t3_5_ns(),
            last_read: None,
            junk: None,
            pieces: VecDeque::new(),
            short_cut: true,
            is_dry: false,
            needed: 0,
            awaited: None,
            polled: Polled::new(),
            confidence: [(0.0, score::confidence(0.0)); 2],
        }
    }

    /// Sends every byte through the lattice, for tests that hold the short cut against it.
    pub fn without_short_cut(mut self) -> Self {
        self.short_cut = false;
        self
    }

    /// Returns the bytes kept.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// Returns the times of the bytes kept.
    pub fn stamper(&self) -> &Stamper {
        &self.stamper
    }

    /// Returns what the bus has taught.
    pub fn experience(&self) -> &Experience {
        &self.experience
    }

    /// Returns how many bytes are undecided.
    pub fn undecided(&self) -> u64 {
        self.store.end() - self.lattice.root()
    }

    /// Returns the offset before which every byte is decided.
    pub fn decided_end(&self) -> u64 {
        self.lattice.root()
    }

    /// Lets go of bytes before `offset`; those undecided stay.
    pub fn forget_before(&mut self, offset: u64) {
        let junk = self.junk.map_or(u64::MAX, |(from, ..)| from);
        let offset = offset.min(self.lattice.root()).min(junk);
        self.store.forget_before(offset);
        // The byte before tells the gap.
        self.stamper.forget_before(offset.saturating_sub(1));
    }

    /// Decides what the bytes so far allow, and returns the next piece, in stream order.
    ///
    /// Without `pairs` a request and its answer are pieces of their own.
    #[inline]
    pub fn next_piece(&mut self, pairs: bool) -> Option<Piece> {
        // Asked after every read, and most reads end no frame.
        if self.is_dry() { None } else { self.decide(pairs) }
    }

    /// Tells whether the next piece needs more bytes, or silence.
    #[inline]
    pub fn is_dry(&self) -> bool {
        debug_assert!(!self.is_dry || self.pieces.is_empty());
        self.is_dry
    }

    #[inline(never)]
    fn decide(&mut self, pairs: bool) -> Option<Piece> {
        loop {
            if let Some(piece) = self.pieces.pop_front() {
                return Some(piece);
            }
            if self.is_dry {
                return None;
            }
            if self.short_cut
                && let Some(outstanding) = self.lattice.settled()
            {
                let asks = outstanding.is_none();
                if asks && let Some((edge, readings)) = self.recall() {
                    return Some(self.take_request(edge, readings, pairs));
                }
                match fast::glance(self.lattice.root(), outstanding, &context!(self)) {
                    Glance::Answer(edge, since) => return Some(self.take_answer(edge, since)),
                    Glance::Frame(edge, readings) => {
                        if asks {
                            self.remember(edge, readings);
                        }
                        return Some(self.take_short_cut(edge, readings));
                    }
                    Glance::Wait(needed) => {
                        self.needed = needed;
                        self.is_dry = true;
                        return None;
                    }
                    Glance::Unsure => {}
                }
            }
            if self.lattice.end() == self.store.end() {
                self.needed = 0; // the lattice sees every byte
                self.is_dry = true;
                return None;
            }
            self.step();
        }
    }

    /// Tells whether the next piece is decided already, and is a frame.
    pub fn frame_follows(&self) -> bool {
        matches!(self.pieces.front(), Some(Piece::Frame { .. }))
    }

    /// Takes in a read, and returns its time; all pieces and deadlines before it must have been taken.
    #[inline(always)] // done for every read
    pub fn push(&mut self, chunk: &Chunk<'_>) -> Timestamp {
        let read = self.stamper.push(chunk.time, chunk.bytes.len());
        if chunk.bytes.is_empty() {
            return read;
        }
        self.last_read = Some(read);
        self.store.push(chunk.bytes, chunk.line_errors);
        self.is_dry = self.is_dry && (self.store.end() < self.needed || self.awaits_more());
        self.experience.set_hold_ns(self.stamper.hold_ns());
        read
    }

    /// Tells whether the plain answer that is awaited has begun and is not whole, as a glance would; then its end is what
    /// is needed.
    #[inline]
    fn awaits_more(&mut self) -> bool {
        let Some(awaited) = self.awaited else { return false };
        let (root, end) = (self.lattice.root(), self.store.end());
        let whole = root + u64::from(awaited.length);
        if whole <= end || self.store.slice(root, root + 3) != awaited.head {
            return false;
        }
        self.needed = whole;
        true
    }

    /// Returns the request at the root if its bytes were beyond doubt before, with nothing outstanding as now.
    fn recall(&self) -> Option<(FrameEdge, Readings)> {
        let offset = self.lattice.root();
        let bytes = self.store.slice(offset, offset + 8).try_into().ok()?;
        let (score, readings) = self.polled.recall(bytes, self.experience.epoch())?;
        let mut readings = *readings;
        if let Some(asked) = &mut readings.request {
            asked.outstanding.offset = offset;
            asked.outstanding.end = context!(self).end(offset + 7);
        }
        let (length, kind, boundary) = (8, Kind::Request, Boundary::Length);
        Some((FrameEdge { offset, length, kind, boundary, score }, readings))
    }

    fn remember(&mut self, edge: FrameEdge, readings: Readings) {
        let bytes = self.store.slice(edge.offset, edge.end());
        if edge.kind == Kind::Request
            && let Ok(bytes) = bytes.try_into()
        {
            self.polled.remember(bytes, self.experience.epoch(), edge.score, readings);
        }
    }

    /// Hands over a request that the lattice need not see, with its answer where that is as plain.
    fn take_request(&mut self, edge: FrameEdge, readings: Readings, pairs: bool) -> Piece {
        let (Some(asked), true) = (&readings.request, pairs) else {
            return self.take_short_cut(edge, readings);
        };
        self.learn(edge, None);
        // Mostly a read ends with it, and the answer is still to come.
        let has_more = self.store.end() >= edge.end() + MIN_FRAME as u64;
        let found = has_more.then(|| fast::glance(edge.end(), Some(&asked.outstanding), &context!(self)));
        let (answer, since) = match found {
            Some(Glance::Answer(answer, since)) => (answer, since),
            Some(Glance::Frame(answer, readings)) if certain(answer, &readings) == Some(Role::Response) => {
                (answer, self.since(answer.offset, asked.outstanding.end))
            }
            _ => {
                self.skip(edge.end(), Some(asked.outstanding));
                return self.piece(edge, readings);
            }
        };
        self.learn(answer, since);
        self.skip(answer.end(), None);
        let confidence = [self.confidence(edge), self.confidence(answer)];
        Piece::Exchange { offset: edge.offset, lengths: [edge.length, answer.length], confidence }
    }

    /// Hands over a plain answer, which came so long after its request.
    fn take_answer(&mut self, edge: FrameEdge, since: Option<i64>) -> Piece {
        debug_assert_eq!(
            self.readings(edge.offset, edge.length, None),
            Readings { request: None, response: Some(fast::plain(edge.length)) }
        );
        self.learn(edge, since);
        self.skip(edge.end(), None);
        self.half(edge, Role::Response, None)
    }

    /// Hands over a frame that the lattice need not see.
    fn take_short_cut(&mut self, edge: FrameEdge, readings: Readings) -> Piece {
        let before = self.lattice.root_outstanding().copied();
        let after = match edge.kind {
            Kind::Request => readings.request.map(|asked| asked.outstanding),
            Kind::Echo => before.map(Outstanding::after_echo),
            Kind::Response(Fit::None) => before,
            Kind::Response(_) => None,
        };
        self.learn(edge, self.since(edge.offset, before.and_then(|asked| asked.end)));
        self.skip(edge.end(), after);
        self.piece(edge, readings)
    }

    /// Makes a piece of a frame that the lattice need not see.
    fn piece(&mut self, edge: FrameEdge, readings: Readings) -> Piece {
        match certain(edge, &readings) {
            Some(role) => self.half(edge, role, readings.request.and_then(|asked| asked.outstanding.end)),
            None => self.frame(edge, readings),
        }
    }

    fn half(&mut self, edge: FrameEdge, role: Role, end: Option<Timestamp>) -> Piece {
        let FrameEdge { offset, length, .. } = edge;
        Piece::Half { offset, length, role, confidence: self.confidence(edge), end }
    }

    fn frame(&mut self, edge: FrameEdge, readings: Readings) -> Piece {
        let FrameEdge { offset, length, boundary, .. } = edge;
        Piece::Frame { offset, length, readings, boundary, confidence: self.confidence(edge) }
    }

    /// Returns how the frame of a [`Piece::Half`] can be read, for pairing after all.
    pub fn readings(&self, offset: u64, length: u16, end: Option<Timestamp>) -> Readings {
        let bytes = self.store.slice(offset, offset + u64::from(length));
        let list = candidates(bytes, &self.shapes);
        Readings::new(list.as_slice(), bytes, offset, Boundary::Length, end, &self.shapes)
    }

    /// Goes on behind a frame that the lattice need not see; a read mostly ends with it, and then nothing is to be seen.
    fn skip(&mut self, end: u64, outstanding: Option<Outstanding>) {
        self.awaited = outstanding.as_ref().and_then(Outstanding::plain_answer);
        self.lattice.skip(end, outstanding);
        let needed = end + MIN_FRAME as u64;
        if self.store.end() < needed {
            self.needed = needed;
            self.is_dry = true;
        }
    }

    /// Takes one byte into the lattice and hands over what that decides.
    #[inline(never)]
    fn step(&mut self) {
        self.awaited = None;
        self.lattice.step(&context!(self));
        while let Some(end) = self.lattice.decided(&context!(self)) {
            self.cut(end);
        }
        if self.lattice.end() - self.lattice.root() > MOST_UNDECIDED {
            self.cut(self.lattice.end() - FORCED_REST);
            self.flush_junk();
        }
    }

    fn cut(&mut self, to: u64) {
        let mut handed = Vec::new();
        let mut outstanding = self.lattice.root_outstanding().copied();
        self.lattice.cut(to, &context!(self), |piece| handed.push(piece));
        for piece in handed {
            match piece {
                Handed::Junk(offset) => {
                    let (from, _, before) = self.junk.unwrap_or((offset, offset, outstanding));
                    self.junk = Some((from, offset + 1, before));
                }
                Handed::Frame(edge) => {
                    let readings = self.hand_over_frame(edge, outstanding);
                    if edge.kind == Kind::Request {
                        outstanding = readings.request.map(|asked| asked.outstanding);
                    } else if matches!(edge.kind, Kind::Response(Fit::Full | Fit::Function)) {
                        outstanding = None;
                    }
                }
            }
        }
    }

    fn flush_junk(&mut self) {
        if let Some((offset, end, outstanding)) = self.junk.take() {
            self.pieces.push_back(Piece::Junk { offset, end, outstanding });
        }
    }

    fn hand_over_frame(&mut self, edge: FrameEdge, outstanding: Option<Outstanding>) -> Readings {
        self.flush_junk();
        self.learn(edge, self.since(edge.offset, outstanding.and_then(|asked| asked.end)));
        let bytes = self.store.slice(edge.offset, edge.end());
        let end = context!(self).end(edge.end() - 1);
        let list = candidates(bytes, &self.shapes);
        let readings = Readings::new(list.as_slice(), bytes, edge.offset, edge.boundary, end, &self.shapes);
        let piece = self.frame(edge, readings);
        self.pieces.push_back(piece);
        readings
    }

    /// Estimates how long after the end of a request the byte at `offset` began, in nanoseconds.
    fn since(&self, offset: u64, asked: Option<Timestamp>) -> Option<i64> {
        Some(context!(self).begin(offset)? - asked?)
    }

    /// Learns from a frame that is decided: its unit, how long after its request it began, whether it was an echo.
    fn learn(&mut self, edge: FrameEdge, since: Option<i64>) {
        let bytes = self.store.slice(edge.offset, edge.offset + 2);
        let (address, function) = (bytes[0], bytes[1]); // a frame has at least four bytes
        self.experience.saw_frame(address, function, edge.boundary == Boundary::Crc);
        match edge.kind {
            Kind::Request | Kind::Echo if matches!(function, 1..=4 | 15 | 16) => {
                self.experience.saw_request(edge.kind == Kind::Echo);
            }
            Kind::Response(Fit::Full) if matches!(function, 1..=4) => {
                if let Some(since) = since {
                    self.experience.saw_latency(address, since.max(0));
                }
            }
            _ => {}
        }
    }

    /// Returns when silence decides what is still open, once all pieces were taken; it may come early, never late.
    pub fn deadline(&self) -> Option<Timestamp> {
        if self.undecided() == 0 {
            return None;
        }
        let hold = HOLD_NS.max(self.stamper.hold_ns() + WAKE_NS + self.gap_ns + 10 * MILLISECOND);
        let missing = if self.lattice.end() == self.store.end() {
            i64::from(self.lattice.missing(&context!(self))).min(MOST_MISSING)
        } else {
            0 // the lattice has not been asked yet
        };
        Some(self.last_read? + hold + self.stamper.character_ns().saturating_mul(missing))
    }

    /// Decides everything if the hold time has passed in silence by `now`; does nothing else.
    pub fn expire(&mut self, now: Timestamp) {
        if self.deadline().is_none_or(|deadline| deadline > now) {
            return;
        }
        self.is_dry = false;
        while self.lattice.end() < self.store.end() {
            self.step();
        }
        if self.deadline().is_some_and(|deadline| deadline <= now) {
            self.finish();
        }
    }

    /// Decides everything: the input has ended, or silence says so.
    pub fn finish(&mut self) {
        self.is_dry = false;
        while self.lattice.end() < self.store.end() {
            self.step();
        }
        if self.lattice.end() > self.lattice.root() {
            self.cut(self.lattice.end());
        }
        self.flush_junk();
    }

    fn confidence(&mut self, edge: FrameEdge) -> f32 {
        let last = &mut self.confidence[usize::from(matches!(edge.kind, Kind::Response(_)))];
        if last.0 != edge.score {
            *last = (edge.score, score::confidence(edge.score));
        }
        last.1
    }
}

/// Returns the role of a frame off the lattice that has no other, and answers nothing but the request before.
fn certain(edge: FrameEdge, readings: &Readings) -> Option<Role> {
    match (edge.kind, &readings.request, &readings.response) {
        (Kind::Request, Some(asked), None) if !asked.outstanding.is_broadcast() => Some(Role::Request),
        (Kind::Response(Fit::Full), None, Some(_)) => Some(Role::Response),
        _ => None,
    }
}
