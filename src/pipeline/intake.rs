//! From the framer's pieces to pairing, by way of exchanges that need none.

use super::Pipeline;
use super::handout::{Current, Seen, Stage};
use crate::decode::damage::{self, Surroundings};
use crate::decode::frame::{Boundary, Role, WireTime};
use crate::decode::framer::{Outstanding, Piece, Readings};
use crate::decode::function::FunctionCode;
use crate::decode::pairing::{Assembled, Choice, Item, Pairing, Part, Settled, What};
use crate::decode::store::Store;
use crate::decode::transaction::Outcome;
use crate::time::{Span, Timestamp};

/// A request beyond doubt that pairing has not been told of, for its answer most likely follows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    pub(super) part: Part,
    confidence: f32,
    /// The estimate of its end then.
    end: Option<Timestamp>,
    /// Time of the read that decided it.
    pub(super) at: Timestamp,
}

impl Pipeline {
    /// Takes all pieces from the framer to the pairing.
    pub(super) fn pump(&mut self) {
        while self.pump_one(false) {}
    }

    /// Takes a piece from the framer; with `pairs` also a whole exchange, while nothing is current.
    pub(super) fn pump_one(&mut self, pairs: bool) -> bool {
        let pairs = pairs && self.pairing.is_idle();
        match self.framer.next_piece(pairs && self.asked.is_none()) {
            None => return false,
            Some(Piece::Half { offset, length, role, confidence, end })
                if pairs && (role == Role::Request) == self.asked.is_none() =>
            {
                match role {
                    Role::Request => {
                        let seen = self.ask(offset, length, confidence, end);
                        self.tell_request(seen);
                    }
                    _ => self.answer(offset, length, confidence, end, None),
                }
            }
            Some(piece) => self.take_piece(piece),
        }
        true
    }

    /// Takes a piece, half an exchange to pairing.
    pub(super) fn take_piece(&mut self, piece: Piece) {
        match piece {
            Piece::Exchange { offset, lengths, confidence } => {
                self.exchange(offset, lengths, confidence);
            }
            Piece::Half { offset, length, confidence, end, .. } => {
                let readings = self.framer.readings(offset, length, end);
                self.frame(offset, length, Boundary::Length, confidence, &readings);
            }
            Piece::Frame { offset, length, readings, boundary, confidence } => {
                self.frame(offset, length, boundary, confidence, &readings);
            }
            Piece::Junk { offset, end, outstanding } => {
                self.adopt();
                self.junk(offset, end, outstanding);
            }
        }
    }

    /// Takes a frame to pairing.
    fn frame(&mut self, offset: u64, length: u16, boundary: Boundary, confidence: f32, readings: &Readings) {
        self.adopt();
        let bytes = self.framer.store().slice(offset, offset + 2);
        let function = FunctionCode(bytes[1]); // a frame has at least four bytes
        let what = What::Frame { function, boundary, confidence };
        let item = self.item(offset, u32::from(length), what);
        self.frame_end = Some(item.end());
        self.pair(item, readings);
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

    /// Gives a frame of an exchange its id and times, and tells what else its event says.
    fn part(&mut self, offset: u64, length: u16, confidence: f32) -> (Part, Seen) {
        let (id, length) = (self.next_frame, u32::from(length));
        self.next_frame += 1;
        let end = offset + u64::from(length);
        self.frame_end = Some(end);
        let (time, gap_before) = self.times(offset, end - 1);
        (Part { id, offset, length, damaged: false, time }, Seen { confidence, gap_before })
    }

    /// Makes a request and the answer right behind it the current transaction.
    fn exchange(&mut self, offset: u64, lengths: [u16; 2], confidence: [f32; 2]) {
        let (request, asked) = self.part(offset, lengths[0], confidence[0]);
        let (response, answered) = self.part(request.end(), lengths[1], confidence[1]);
        self.exchanged(request, response, Stage::Request([asked, answered]));
    }

    /// Takes a request that no other is open beside; its frame is still to be told.
    pub(super) fn ask(&mut self, offset: u64, length: u16, confidence: f32, end: Option<Timestamp>) -> Seen {
        let (part, seen) = self.part(offset, length, confidence);
        let at = self.decided_at(part.time, part.end() - 1);
        self.asked = Some(Asked { part, confidence, end, at });
        seen
    }

    /// Makes the frame of the request that is open the next to be told.
    pub(super) fn tell_request(&mut self, seen: Seen) {
        let request = self.asked.map(|asked| asked.part);
        let assembled = Assembled { request, response: None, outcome: Outcome::NoResponse };
        self.current = Some(Current { assembled, id: self.next_transaction, stage: Stage::Asked(seen) });
    }

    /// Takes the answer to the request that is open; `untold` where that one's frame is still to be told.
    pub(super) fn answer(
        &mut self,
        offset: u64,
        length: u16,
        confidence: f32,
        end: Option<Timestamp>,
        untold: Option<Seen>,
    ) {
        let (part, seen) = self.part(offset, length, confidence);
        let at = self.decided_at(part.time, part.end() - 1);
        match self.asked {
            Some(asked) if Pairing::gives_up(asked.at) > at => {
                self.asked = None;
                let stage = untold.map_or(Stage::Response(seen), |asked| Stage::Request([asked, seen]));
                self.exchanged(asked.part, part, stage);
            }
            _ => {
                // So late that only pairing can tell.
                if let Some(asked) = untold {
                    self.tell_request(asked);
                }
                self.adopt();
                let readings = self.framer.readings(offset, length, end);
                let item = Asked { part, confidence, end, at }.item(self.framer.store());
                self.pair(Item { gap_before: seen.gap_before, ..item }, &readings);
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
    pub(super) fn adopt(&mut self) {
        let Some(asked) = self.asked.take() else { return };
        let item = asked.item(self.framer.store());
        let readings = self.framer.readings(item.offset, asked.part.length as u16, asked.end); // was one before
        self.pairing.push(item, &readings, self.framer.store(), self.framer.experience());
        let told = self.pairing.take();
        debug_assert!(matches!(told, Some(Settled::Item(_, Choice::Request))), "{told:?}");
    }

    pub(super) fn set_current(&mut self, assembled: Assembled, stage: Stage) {
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
        let (time, gap_before) = self.times(offset, last);
        let at = self.decided_at(time, last);
        Item { id, offset, length, time, gap_before, at, what }
    }

    /// Returns the time of the read that decided what ends with the byte at `last`.
    fn decided_at(&self, time: Option<WireTime>, last: u64) -> Timestamp {
        if time.is_some() { self.now } else { self.framer.stamper().arrival(last).unwrap_or(self.now) }
    }

    /// Bounds when the bytes from `first` to `last` were on the wire, and the silence before them.
    #[inline]
    fn times(&self, first: u64, last: u64) -> (Option<WireTime>, Option<Span>) {
        match self.framer.stamper().frame(first, last) {
            Some((time, gap_before)) => (Some(time), gap_before),
            None => (None, None),
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
