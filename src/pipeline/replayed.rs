//! Reads that are there at once, as in a recording: the same as one by one, by a shorter way for polls.
//!
//! Most reads end no frame, and most frames are a request or the answer to it. So reads are taken in until there is an
//! exchange to tell of, not handed in and asked after one by one. Times, deadlines and order are those of one by one.

use super::Pipeline;
use super::handout::Seen;
use crate::decode::chunk::Chunk;
use crate::decode::frame::Role;
use crate::decode::framer::Piece;

impl Pipeline {
    /// Takes in reads as [`Pipeline::handle_bytes`] does one after the other, until there is something to tell.
    ///
    /// Tells whether reads may be left. All events are to be taken each time, as after every call that takes
    /// something in; those of a request may come only now that its answer is there.
    pub fn handle_reads<'r>(&mut self, reads: &mut impl Iterator<Item = Chunk<'r>>) -> bool {
        self.pump();
        // What the frame of the request that is open says, as long as it was not told.
        let mut untold = None;
        for chunk in reads {
            let until = self.due_before(&chunk);
            if let Some(until) = until {
                self.tell(&mut untold);
                self.handle_timeout(until);
            }
            self.receive(&chunk);
            // Where nothing was due, nothing but the framer can have anything to tell.
            let is_quiet = self.framer.is_dry() && (until.is_none() || self.is_quiet());
            if !is_quiet && !self.goes_on(&mut untold) {
                self.tell(&mut untold);
                return true;
            }
        }
        self.tell(&mut untold);
        false
    }

    /// Takes what the last read decided; tells whether to go on with the next.
    #[inline]
    fn goes_on(&mut self, untold: &mut Option<Seen>) -> bool {
        // A request that was not told is all that is open.
        let is_plain = untold.is_some()
            || self.current.is_none()
                && self.verifying.is_none()
                && self.lost.is_none()
                && self.pairing.is_idle()
                && self.asked.is_none();
        is_plain && self.take_halves(untold)
    }

    /// Takes a request, or the answer to the one that is open; tells whether to go on with the next read.
    fn take_halves(&mut self, untold: &mut Option<Seen>) -> bool {
        while let Some(piece) = self.framer.next_piece(untold.is_none()) {
            match (piece, *untold) {
                (Piece::Half { offset, length, role: Role::Request, confidence, end }, None) => {
                    *untold = Some(self.ask(offset, length, confidence, end));
                }
                (Piece::Half { offset, length, role: Role::Response, confidence, end }, Some(_)) => {
                    self.answer(offset, length, confidence, end, untold.take());
                    return false;
                }
                (piece, _) => {
                    self.tell(untold);
                    self.take_piece(piece);
                    return false;
                }
            }
        }
        true
    }

    fn tell(&mut self, untold: &mut Option<Seen>) {
        if let Some(seen) = untold.take() {
            self.tell_request(seen);
        }
    }
}
