//! Decode, device and analyze joined: the bytes of a bus go in, events come out.
//!
//! Time is chunk time: [`Pipeline::handle_bytes`] first fires every deadline up to when the first of its bytes was
//! there at the latest, so that a live bus and its recording decide alike.

use std::sync::Arc;

use crate::analyze::verify::{Finding, Verifier};
use crate::decode::chunk::{Chunk, LineError, ReadTime};
pub use crate::decode::chunk::{Lost, LostKind};
use crate::decode::damage::{self, Surroundings};
use crate::decode::frame::{Boundary, Damaged, Frame, Place, Role, WireTime};
use crate::decode::framer::{Framer, HOLD_NS, Outstanding, Piece, Readings};
use crate::decode::function::FunctionCode;
use crate::decode::pairing::{Assembled, Choice, Item, Pairing, Part, Settled, What};
use crate::decode::pdu;
use crate::decode::shape::Shapes;
use crate::decode::store::Store;
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::device::{Devices, Identified, Meaning, Profiles, Reading};
use crate::line::LineSettings;
use crate::time::{Span, Timestamp};

/// Holds what a pipeline is made with.
#[derive(Clone, Debug)]
pub struct Options {
    /// Speed and character format of the bus.
    pub line: LineSettings,
    /// The longest time the adapter keeps a byte back, in nanoseconds; estimated from the reads when `None`.
    pub adapter_hold_ns: Option<i64>,
    /// The id of the first frame or damaged run.
    pub first_frame_id: u64,
    /// The id of the first transaction.
    pub first_transaction_id: u64,
    /// Whether readings are wanted as events.
    pub readings: bool,
    /// Whether findings are wanted as events.
    pub findings: bool,
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

/// A transaction whose events are still to come.
#[derive(Clone, Copy, Debug)]
struct Current {
    assembled: Assembled,
    id: u64,
    /// Where its events have got to.
    stage: Stage,
}

/// A request beyond doubt that pairing has not been told of, for its answer most likely follows.
#[derive(Clone, Copy, Debug)]
struct Asked {
    part: Part,
    readings: Readings,
    confidence: f32,
    /// Time of the read that decided it.
    at: Timestamp,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// The frame of a request whose answer is still to come, with its confidence.
    Asked(f32),
    /// The frames of an exchange are still to come, with these confidences.
    Request([f32; 2]),
    Response(f32),
    Observe,
    Say,
    Reading {
        next: usize,
        count: usize,
    },
}

/// Judges the rows that come out.
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

/// Decodes one bus.
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
    /// Time of the last chunk or time-out.
    now: Timestamp,
    /// No deadline is before.
    quiet_until: Timestamp,
    line_errors: Vec<LineError>,
}

impl Pipeline {
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
            next_frame: options.first_frame_id,
            next_transaction: options.first_transaction_id,
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
        let is_timed = matches!(chunk.time, ReadTime::At(_));
        match self.framer.stamper().silent_until(chunk.time, chunk.bytes.len()) {
            Some(until) if until >= self.quiet_until || !is_timed => self.handle_timeout(until),
            _ => self.pump(),
        }
        if self.framer.store().length() >= FORGET_FROM {
            self.forget();
        }
        let read = self.framer.push(chunk);
        self.received = self.received.saturating_add(chunk.bytes.len() as u64);
        if is_timed {
            self.now = self.now.max(read);
        }
    }

    /// Decides what silence up to `now` decides; does nothing when called without need.
    pub fn handle_timeout(&mut self, now: Timestamp) {
        self.pump();
        // One deadline after the other: what the first decides may move the next.
        loop {
            match self.poll_timeout() {
                Some(due) if due <= now => self.expire(due),
                due => {
                    // What is received from now on is held that long at least.
                    self.quiet_until = due.unwrap_or(Timestamp::MAX).min(now + HOLD_NS);
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
        self.pump();
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

    /// Takes all pieces from the framer to the pairing.
    fn pump(&mut self) {
        while self.pump_one(false) {}
    }

    /// Takes a piece from the framer; with `pairs` also a whole exchange, while nothing is current.
    fn pump_one(&mut self, pairs: bool) -> bool {
        let pairs = pairs && self.pairing.is_idle();
        match self.framer.next_piece(pairs && self.asked.is_none()) {
            None => return false,
            Some(Piece::Exchange { offset, lengths, confidence }) => {
                self.exchange(offset, lengths, confidence);
            }
            Some(Piece::Frame { offset, length, readings, confidence, certain: Some(role), .. })
                if pairs && (role == Role::Request) == self.asked.is_none() =>
            {
                self.half(offset, length, readings, confidence);
            }
            Some(Piece::Frame { offset, length, readings, boundary, confidence, .. }) => {
                self.adopt();
                let bytes = self.framer.store().slice(offset, offset + 2);
                let function = FunctionCode(bytes[1]); // a frame has at least four bytes
                let what = What::Frame { function, boundary, confidence };
                let item = self.item(offset, u32::from(length), what);
                self.frame_end = Some(item.end());
                self.pair(item, &readings);
            }
            Some(Piece::Junk { offset, end, outstanding }) => {
                self.adopt();
                self.junk(offset, end, outstanding);
            }
        }
        true
    }

    /// Splits bytes that belong to no frame into damaged runs.
    #[cold]
    fn junk(&mut self, offset: u64, end: u64, outstanding: Option<Outstanding>) {
        let mut runs = Vec::new();
        let around = Surroundings {
            shapes: &self.shapes,
            experience: self.framer.experience(),
            stamper: self.framer.stamper(),
            gap_ns: self.line.t3_5_ns(),
            frame_before: self.frame_end == Some(offset),
            frame_after: self.framer.frame_follows(),
        };
        let bytes = self.framer.store().slice(offset, end);
        damage::split(bytes, offset, outstanding, &around, |run| runs.push(run));
        for run in runs {
            let damage::Run { reason, role, address, function, .. } = run;
            let what = What::Run { reason, role, address, function };
            let item = self.item(run.offset, run.length, what);
            self.pair(item, &Readings::default());
        }
    }

    /// Gives a frame of an exchange its id and times.
    fn part(&mut self, offset: u64, length: u16) -> Part {
        let (id, length) = (self.next_frame, u32::from(length));
        self.next_frame += 1;
        let end = offset + u64::from(length);
        self.frame_end = Some(end);
        Part { id, offset, length, damaged: false, time: self.wire_time(offset, end - 1) }
    }

    /// Makes a request and the answer right behind it the current transaction.
    fn exchange(&mut self, offset: u64, [request, response]: [u16; 2], confidence: [f32; 2]) {
        let request = self.part(offset, request);
        let response = self.part(request.end(), response);
        self.exchanged(request, response, Stage::Request(confidence));
    }

    /// Takes a request that no other is open beside, or the answer to it.
    fn half(&mut self, offset: u64, length: u16, readings: Readings, confidence: f32) {
        let part = self.part(offset, length);
        let at = self.decided_at(part.time, part.end() - 1);
        match self.asked {
            Some(asked) if Pairing::gives_up(asked.at) > at => {
                self.asked = None;
                self.exchanged(asked.part, part, Stage::Response(confidence));
            }
            Some(_) => {
                // So late that only pairing can tell.
                self.adopt();
                let gap_before = self.gap_before(offset, part.time);
                let item = Asked { part, readings, confidence, at }.item(self.framer.store());
                self.pair(Item { gap_before, ..item }, &readings);
            }
            None => {
                self.asked = Some(Asked { part, readings, confidence, at });
                let assembled =
                    Assembled { request: Some(part), response: None, outcome: Outcome::NoResponse };
                let stage = Stage::Asked(confidence);
                self.current = Some(Current { assembled, id: self.next_transaction, stage });
            }
        }
    }

    /// Makes a request and its answer the current transaction, at this stage.
    fn exchanged(&mut self, request: Part, response: Part, stage: Stage) {
        let answer = self.framer.store().slice(response.offset, response.end());
        let (address, function) = (answer[0], FunctionCode(answer[1])); // a frame has at least four bytes
        let outcome = if function.is_exception() { Outcome::Exception } else { Outcome::Answered };
        self.pairing.exchanged(request.id, address);
        let assembled = Assembled { request: Some(request), response: Some(response), outcome };
        self.set_current(assembled, stage);
    }

    /// Tells pairing of the request that it was not told of; the frame itself came out before.
    fn adopt(&mut self) {
        let Some(asked) = self.asked.take() else { return };
        let item = asked.item(self.framer.store());
        self.pairing.push(item, &asked.readings, self.framer.store(), self.framer.experience());
        let told = self.pairing.take();
        debug_assert!(matches!(told, Some(Settled::Item(_, Choice::Request))), "{told:?}");
    }

    fn set_current(&mut self, assembled: Assembled, stage: Stage) {
        self.current = Some(Current { assembled, id: self.next_transaction, stage });
        self.next_transaction += 1;
    }

    fn pair(&mut self, item: Item, readings: &Readings) {
        if item.time.is_none() {
            self.pairing.expire(item.at);
        }
        self.pairing.push(item, readings, self.framer.store(), self.framer.experience());
    }

    /// Gives a stretch of the stream its id and times.
    fn item(&mut self, offset: u64, length: u32, what: What) -> Item {
        let id = self.next_frame;
        self.next_frame += 1;
        let last = offset + u64::from(length) - 1;
        let time = self.wire_time(offset, last);
        let gap_before = self.gap_before(offset, time);
        let at = self.decided_at(time, last);
        Item { id, offset, length, time, gap_before, at, what }
    }

    /// Returns the time of the read that decided what ends with the byte at `last`.
    fn decided_at(&self, time: Option<WireTime>, last: u64) -> Timestamp {
        if time.is_some() { self.now } else { self.framer.stamper().arrival(last).unwrap_or(self.now) }
    }

    /// Bounds when the bytes from `first` to `last` were on the wire.
    #[inline]
    fn wire_time(&self, first: u64, last: u64) -> Option<WireTime> {
        let stamper = self.framer.stamper();
        if !stamper.has_times() {
            return None;
        }
        let (first, last) = (stamper.byte(first)?, stamper.byte(last)?);
        let start = first.interval().shifted(-stamper.character_ns());
        // Bytes that come faster than the line's speed allows have no sound times, but keep their order.
        Some(WireTime { start, end: last.interval().not_before(start) })
    }

    /// Bounds the silence before the byte at `offset`.
    fn gap_before(&self, offset: u64, time: Option<WireTime>) -> Option<Span> {
        let before = self.framer.stamper().byte(offset.checked_sub(1)?)?;
        Some(not_negative(before.interval().until(time?.start)))
    }

    /// Returns the next event. Take them all after each call that takes something in.
    pub fn poll_event(&mut self) -> Option<Event<'_>> {
        if self.verifying.is_some()
            && !matches!(self.current, Some(Current { stage: Stage::Reading { .. }, .. }))
            && self.next_finding()
        {
            return self.verifying.as_ref()?.finding.as_ref().map(Event::Finding);
        }
        while self.current.is_none() {
            match self.pairing.take() {
                Some(Settled::Item(item, choice)) => return Some(self.item_event(item, choice)),
                Some(Settled::Transaction(assembled)) => self.set_current(assembled, Stage::Observe),
                None if self.pump_one(true) => {}
                // What was decided before it was lost comes before it.
                None => return self.lost_event(),
            }
        }
        match self.current.as_ref()?.stage {
            Stage::Asked(_) | Stage::Request(_) | Stage::Response(_) => self.exchange_event(),
            Stage::Observe | Stage::Say => self.transaction_event(),
            Stage::Reading { next, count } => self.reading_event(next, count),
        }
    }

    /// Takes the next finding, if there is one.
    fn next_finding(&mut self) -> bool {
        let Some(verifying) = &mut self.verifying else { return false };
        verifying.finding = verifying.verifier.pop();
        verifying.finding.is_some()
    }

    fn lost_event(&mut self) -> Option<Event<'_>> {
        let lost = self.lost.take()?;
        if let Some(verifying) = &mut self.verifying {
            verifying.verifier.lost(&lost);
        }
        Some(Event::Lost(lost))
    }

    /// Hands out the next frame of the current exchange.
    #[inline]
    fn exchange_event(&mut self) -> Option<Event<'_>> {
        let current = self.current.as_mut()?;
        let (part, role, confidence) = match current.stage {
            Stage::Asked(confidence) => {
                let part = current.assembled.request?;
                self.current = None;
                (part, Role::Request, confidence)
            }
            Stage::Request([confidence, next]) => {
                current.stage = Stage::Response(next);
                (current.assembled.request?, Role::Request, confidence)
            }
            Stage::Response(confidence) => {
                current.stage = Stage::Observe;
                (current.assembled.response?, Role::Response, confidence)
            }
            _ => return None, // not called for the others
        };
        self.framer.store().errors(part.offset, part.end(), &mut self.line_errors);
        let place = Place {
            id: part.id,
            stream_offset: part.offset,
            bytes: self.framer.store().slice(part.offset, part.end()),
            time: part.time,
            gap_before: self.gap_before(part.offset, part.time),
            line_errors: &self.line_errors,
        };
        let frame = Frame { place, role, echo: false, boundary: Boundary::Length, confidence };
        if let Some(verifying) = &mut self.verifying {
            verifying.verifier.frame(&frame, self.framer.stamper());
        }
        Some(Event::Frame(frame))
    }

    /// Tells what the current transaction says of its device, then what it means.
    #[inline]
    fn transaction_event(&mut self) -> Option<Event<'_>> {
        let current = self.current.as_mut()?;
        let transaction = transaction(self.framer.store(), current);
        // The devices learn from a transaction before it is told what it means.
        if current.stage == Stage::Observe
            && let Some(identified) = self.devices.observe(&transaction)
        {
            current.stage = Stage::Say;
            return Some(Event::Identified { identified, time: end(&transaction) });
        }
        let meaning = self.devices.meaning(&transaction);
        let mut count = 0;
        if self.readings && matches!(transaction.outcome, Outcome::Answered | Outcome::Late) {
            count = meaning.readings().count();
        }
        match count {
            0 => self.current = None,
            _ => current.stage = Stage::Reading { next: 0, count },
        }
        let mut codes: &[&'static str] = &[];
        if let Some(verifying) = &mut self.verifying {
            verifying.verifier.transaction(&transaction, &meaning);
            verifying.codes.clear();
            verifying.codes.extend(verifying.verifier.found().map(|finding| finding.rule.code));
            codes = &verifying.codes;
        }
        Some(Event::Transaction { transaction, meaning, codes })
    }

    // Kept out of the way of exchanges, which need far less of the stack.
    #[inline(never)]
    fn reading_event(&mut self, index: usize, count: usize) -> Option<Event<'_>> {
        let current = self.current.as_mut()?;
        let transaction = transaction(self.framer.store(), current);
        let reading = self.devices.meaning(&transaction).readings().nth(index)?;
        let (address, id) = (transaction.address, transaction.id);
        match index + 1 {
            next if next < count => current.stage = Stage::Reading { next, count },
            _ => self.current = None,
        }
        Some(Event::Reading { reading, time: end(&transaction), address, transaction: id })
    }

    // Kept out of the way of exchanges, which need far less of the stack.
    #[inline(never)]
    fn item_event(&mut self, item: Item, choice: Choice) -> Event<'_> {
        self.framer.store().errors(item.offset, item.end(), &mut self.line_errors);
        let place = Place {
            id: item.id,
            stream_offset: item.offset,
            bytes: self.framer.store().slice(item.offset, item.end()),
            time: item.time,
            gap_before: item.gap_before,
            line_errors: &self.line_errors,
        };
        match item.what {
            What::Frame { boundary, confidence, .. } => {
                let echo = choice == Choice::Echo;
                let role = if matches!(choice, Choice::Request | Choice::Echo) {
                    Role::Request
                } else {
                    Role::Response
                };
                let frame = Frame { place, role, echo, boundary, confidence };
                if let Some(verifying) = &mut self.verifying {
                    verifying.verifier.frame(&frame, self.framer.stamper());
                }
                Event::Frame(frame)
            }
            What::Run { reason, role, address, function } => {
                let damaged = Damaged { place, reason, role, address, function };
                if let Some(verifying) = &mut self.verifying {
                    verifying.verifier.damaged(&damaged);
                }
                Event::Damaged(damaged)
            }
        }
    }
}

impl Asked {
    /// Makes what pairing takes; the silence before it is of no concern to it.
    fn item(&self, store: &Store) -> Item {
        let Asked { part: Part { id, offset, length, time, .. }, confidence, at, .. } = *self;
        let bytes = store.slice(offset, offset + 2);
        let function = FunctionCode(bytes[1]); // a frame has at least four bytes
        let what = What::Frame { function, boundary: Boundary::Length, confidence };
        Item { id, offset, length, time, gap_before: None, at, what }
    }
}

/// Estimates when the last frame of a transaction ended.
fn end(transaction: &Transaction<'_>) -> Option<Timestamp> {
    let last = transaction.response.or(transaction.request)?;
    Some(last.time?.end.midpoint())
}

/// Gives an assembled transaction its bytes.
fn transaction<'a>(store: &'a Store, current: &Current) -> Transaction<'a> {
    let Assembled { request, response, outcome } = &current.assembled;
    let side = |part: &Part| Side {
        id: part.id,
        bytes: store.slice(part.offset, part.end()),
        damaged: part.damaged,
        time: part.time,
    };
    let (request, response) = (request.as_ref().map(side), response.as_ref().map(side));
    // A good frame leads: the request's, or else the response's.
    let answer = response.as_ref().filter(|side| !side.damaged).map(|side| side.bytes);
    let (lead, role) = match (&request, answer) {
        (Some(Side { bytes, damaged: false, .. }), _) => (*bytes, Role::Request),
        (_, Some(response)) => (response, Role::Response),
        (_, None) => (&[][..], Role::Unknown), // does not occur: a transaction has a good frame
    };
    let time = |side: &Option<Side<'_>>| side.as_ref()?.time;
    let latency = time(&request).zip(time(&response));
    Transaction {
        id: current.id,
        address: lead.first().copied().unwrap_or_default(),
        function: FunctionCode(lead.get(1).copied().unwrap_or_default()).without_exception(),
        start_register: pdu::start_register(lead, role),
        quantity: pdu::quantity(lead, role),
        outcome: *outcome,
        exception_code: answer.and_then(pdu::exception_code),
        latency: latency.map(|(request, response)| not_negative(request.end.until(response.start))),
        request,
        response,
    }
}

/// Bounds a length of time that cannot be negative: bytes of one wire do not overlap.
fn not_negative(span: Span) -> Span {
    Span { least: span.least.max(0), most: span.most.max(0) }
}
