//! Decode, device and analyze joined: the bytes of a bus go in, events come out.
//!
//! Time is chunk time: [`Pipeline::handle_bytes`] first fires every deadline up to when the first of its bytes was
//! there at the latest, so that a live bus and its recording decide alike.
//!
//! `intake` takes the framer's pieces to pairing, `handout` turns what is decided into events; `replayed` is a shorter
//! way for reads that are there at once.

mod handout;
mod intake;
mod replayed;

use std::sync::Arc;

use crate::analyze::verify::{Finding, Verifier};
use crate::decode::chunk::{Chunk, LineError, ReadTime};
pub use crate::decode::chunk::{Lost, LostKind};
use crate::decode::frame::{Damaged, Frame};
use crate::decode::framer::{Framer, HOLD_NS};
use crate::decode::pairing::Pairing;
use crate::decode::shape::Shapes;
use crate::decode::transaction::Transaction;
use crate::device::{Devices, Identified, Meaning, Profiles, Reading};
use crate::line::LineSettings;
use crate::time::{Span, Timestamp};
use handout::Current;
use intake::Asked;

/// Holds what a pipeline is made with.
#[derive(Clone, Debug)]
pub struct Options {
    /// Speed and character format of the bus.
    pub line: LineSettings,
    /// The longest time the adapter keeps a byte back, in nanoseconds; estimated from the reads when `None`.
    pub adapter_hold_ns: Option<i64>,
    /// Whether readings are wanted as events.
    pub readings: bool,
    /// Whether findings are wanted as events.
    pub findings: bool,
}

impl Options {
    /// Asks for frames and transactions alone.
    pub fn new(line: LineSettings, adapter_hold_ns: Option<i64>) -> Self {
        Options { line, adapter_hold_ns, readings: false, findings: false }
    }
}

/// Is what comes out of the pipeline, in the order in which nothing can change it any more.
#[derive(Clone, Debug)]
pub enum Event<'a> {
    /// A frame, in stream order with the damaged runs.
    Frame(Frame<'a>),
    /// A damaged run.
    Damaged(Damaged<'a>),
    /// Bytes that were lost.
    Lost(Lost),
    /// A device became known, or another one took its place.
    Identified {
        /// What was found, and by what.
        identified: Identified,
        /// End of the transaction that showed it.
        time: Option<Timestamp>,
    },
    /// A request and what became of it, after its last frame.
    Transaction {
        /// The transaction.
        transaction: Transaction<'a>,
        /// What it means, by what was known then.
        meaning: Meaning<'a>,
        /// The codes of the findings it proved, which come after it and its readings.
        codes: &'a [&'static str],
    },
    /// A measured or derived quantity, right after its transaction.
    Reading {
        /// The quantity.
        reading: Reading<'a>,
        /// End of the response.
        time: Option<Timestamp>,
        /// Unit address.
        address: u8,
        /// Id of the transaction.
        transaction: u64,
    },
    /// Something wrong in the traffic, right after the row that proved it and that row's readings.
    Finding(&'a Finding),
}

/// Judges the rows that come out.
#[derive(Clone)]
struct Verifying {
    verifier: Verifier,
    /// The finding handed out last.
    finding: Option<Finding>,
    /// The codes of what the current transaction proved.
    codes: Vec<&'static str>,
}

impl Verifying {
    fn new(line: LineSettings, profiles: Arc<Profiles>) -> Self {
        Verifying { verifier: Verifier::new(line, profiles), finding: None, codes: Vec::new() }
    }
}

/// From how many bytes on it is worth looking which are still needed.
const FORGET_FROM: usize = 512;

/// Decodes one bus; a copy goes on from the same state.
#[derive(Clone)]
pub struct Pipeline {
    framer: Framer,
    pairing: Pairing,
    devices: Devices,
    shapes: Arc<Shapes>,
    line: LineSettings,
    readings: bool,
    verifying: Option<Box<Verifying>>,
    next_frame: u64,
    next_transaction: u64,
    /// Offset after the last frame handed over by the framer.
    frame_end: Option<u64>,
    current: Option<Current>,
    asked: Option<Asked>,
    lost: Option<Lost>,
    /// How many bytes were taken in.
    received: u64,
    /// Time of the last chunk that had one, or of the last deadline.
    now: Timestamp,
    /// No deadline is before.
    quiet_until: Timestamp,
    line_errors: Vec<LineError>,
}

impl Pipeline {
    /// Gives back memory that only saves time, such as before a copy is put by; what comes out stays the same.
    pub fn compact(&mut self) {
        self.framer.compact();
        self.devices.compact();
    }

    /// Makes a pipeline for a bus with these devices; `shapes` are the forms that profiles declare.
    pub fn new(options: Options, devices: Devices, shapes: Shapes) -> Self {
        let shapes = Arc::new(shapes);
        let verifying = || Box::new(Verifying::new(options.line, Arc::clone(devices.profiles())));
        let verifying = options.findings.then(verifying);
        Pipeline {
            framer: Framer::new(options.line, options.adapter_hold_ns, Arc::clone(&shapes)),
            pairing: Pairing::default(),
            devices,
            shapes,
            line: options.line,
            readings: options.readings,
            verifying,
            next_frame: 0,
            next_transaction: 0,
            frame_end: None,
            current: None,
            asked: None,
            lost: None,
            received: 0,
            now: Timestamp::MIN,
            quiet_until: Timestamp::MIN,
            line_errors: Vec::new(),
        }
    }

    /// Sends every byte through the framer's lattice, for tests that hold the short cut against it.
    pub fn without_short_cut(mut self) -> Self {
        self.framer = self.framer.without_short_cut();
        self
    }

    /// Takes in the bytes of one read, with its times and line errors; fires the deadlines before it first.
    pub fn handle_bytes(&mut self, chunk: &Chunk<'_>) {
        match self.due_before(chunk) {
            Some(until) => self.handle_timeout(until),
            None => self.pump(),
        }
        self.receive(chunk);
    }

    /// Returns up to when there was silence before a read, if a deadline may be before.
    ///
    /// Without times nobody knows of silence: what waits is given up by the bytes that come, wherever they are cut.
    #[inline]
    fn due_before(&self, chunk: &Chunk<'_>) -> Option<Timestamp> {
        let until = self.framer.stamper().silent_until(chunk.time, chunk.bytes.len())?;
        (until >= self.quiet_until && matches!(chunk.time, ReadTime::At(_))).then_some(until)
    }

    #[inline(always)] // done for every read
    fn receive(&mut self, chunk: &Chunk<'_>) {
        if self.framer.store().length() >= FORGET_FROM {
            self.forget();
        }
        let read = self.framer.push(chunk);
        self.received = self.received.saturating_add(chunk.bytes.len() as u64);
        if matches!(chunk.time, ReadTime::At(_)) {
            self.now = self.now.max(read);
        }
    }

    /// Decides what silence up to `now` decides; does nothing when called without need.
    pub fn handle_timeout(&mut self, now: Timestamp) {
        self.pump();
        if self.framer.undecided() == 0 && self.asked.is_none() && self.pairing.is_idle() {
            self.quiet_until = now + HOLD_NS; // nothing waits for anything, as between two polls
            return;
        }
        // One deadline after the other: what the first decides may move the next.
        loop {
            match self.poll_timeout() {
                Some(due) if due <= now => self.expire(due),
                due => {
                    // What is received from now on is held that long at least, but it may decide an item, and
                    // then what waited for that item is due.
                    let first = due.into_iter().chain(self.pairing.quiet_until()).min();
                    self.quiet_until = first.unwrap_or(Timestamp::MAX).min(now + HOLD_NS);
                    return;
                }
            }
        }
    }

    fn expire(&mut self, due: Timestamp) {
        self.now = self.now.max(due);
        self.framer.expire(due);
        self.pump();
        if self.asked.is_some_and(|asked| Pairing::gives_up(asked.at) <= due) {
            self.adopt();
        }
        self.pairing.expire(due);
    }

    /// Returns when silence would decide something; it may come early, never late.
    ///
    /// Ask when all events were taken.
    pub fn poll_timeout(&self) -> Option<Timestamp> {
        let asked = self.asked.map(|asked| Pairing::gives_up(asked.at));
        [self.framer.deadline(), self.pairing.deadline(), asked].into_iter().flatten().min()
    }

    /// Decides everything: the input has ended.
    pub fn finish(&mut self) {
        // What was due by the last read that had a time does not depend on whether another one comes.
        self.handle_timeout(self.now);
        self.framer.finish();
        self.pump();
        self.adopt();
        self.pairing.finish();
    }

    /// Takes in that bytes are missing after those handled so far; fires the deadlines before it first.
    pub fn handle_lost(&mut self, lost: Lost) {
        if let Some(time) = lost.time {
            self.handle_timeout(time);
        }
        // Frames are placed by the bytes received, and so is what is missing between them.
        self.lost = Some(Lost { stream_offset: self.received, ..lost });
    }

    /// Gives the next frame and the next transaction these ids: buses that are decoded at once share them.
    pub fn set_next_ids(&mut self, (frame, transaction): (u64, u64)) {
        self.next_frame = frame;
        self.next_transaction = transaction;
    }

    /// Returns the ids that the next frame and the next transaction would get.
    pub fn next_ids(&self) -> (u64, u64) {
        (self.next_frame, self.next_transaction)
    }

    /// Returns an id: every frame or run with a smaller one belongs to a transaction that came out, or to none.
    pub fn settled_frame_id(&self) -> u64 {
        self.oldest().map_or(self.next_frame, |(id, _)| id)
    }

    /// Returns the id and offset of the oldest frame or run that a later row may still need.
    fn oldest(&self) -> Option<(u64, u64)> {
        self.asked.map(|asked| (asked.part.id, asked.part.offset)).or_else(|| self.pairing.oldest())
    }

    /// Lets go of the bytes that no later event needs.
    fn forget(&mut self) {
        let oldest = self.oldest().map_or(u64::MAX, |(_, offset)| offset);
        let waiting = self.pairing.waiting().unwrap_or(u64::MAX);
        let current =
            self.current.and_then(|current| current.assembled.request.or(current.assembled.response));
        let current = current.map_or(u64::MAX, |part| part.offset);
        self.framer.forget_before(oldest.min(waiting).min(current));
    }
}

/// Bounds a length of time that cannot be negative: bytes of one wire do not overlap.
fn not_negative(span: Span) -> Span {
    Span { least: span.least.max(0), most: span.most.max(0) }
}
