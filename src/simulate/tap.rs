//! What the tap's receiver makes of the wire: bytes with their times, after collisions, noise and loss.
//!
//! Faults strike at the tap only, so that masters and units behave alike with and without them;
//! collisions are real: the talkers hear them too (see `bus`).

use std::collections::VecDeque;

use crate::line::{LineSettings, Parity};
use crate::simulate::bus::{Bus, Transmission};
use crate::simulate::random::Random;
use crate::simulate::scenario::Scenario;
use crate::simulate::truth::TruthFrame;
use crate::time::Timestamp;

/// Is a byte as the receiver got it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WireByte {
    /// When its last stop bit ended.
    pub(super) end: Timestamp,
    pub(super) value: u8,
    /// Whether its parity or stop bit was wrong.
    pub(super) error: bool,
}

/// Is the receiver of the tap; yields bytes in the order of their times.
pub(super) struct Tap {
    bus: Bus,
    scenario: Scenario,
    line: LineSettings,
    random: Random,
    ahead: Option<Transmission>,
    bytes: VecDeque<WireByte>,
    /// Frames that have passed, in the order of their starts.
    pub(super) truth: VecDeque<TruthFrame>,
    /// Counts the bytes received.
    received: u64,
}

impl Tap {
    pub(super) fn new(mut bus: Bus, scenario: Scenario, line: LineSettings, random: Random) -> Self {
        let ahead = bus.next();
        let (bytes, truth) = (VecDeque::new(), VecDeque::new());
        Tap { bus, scenario, line, random, ahead, bytes, truth, received: 0 }
    }

    /// Returns the next byte.
    pub(super) fn next(&mut self) -> Option<WireByte> {
        while self.bytes.is_empty() {
            let burst = self.next_burst()?;
            let quiet = self.receive_burst(&burst);
            self.add_noise(quiet);
        }
        self.bytes.pop_front()
    }

    /// Takes the next transmission with all that overlap it.
    fn next_burst(&mut self) -> Option<Vec<Transmission>> {
        let character = self.line.character_ns();
        let first = self.ahead.take()?;
        let mut end = first.end(character);
        let mut burst = vec![first];
        self.ahead = self.bus.next();
        while let Some(next) = self.ahead.take_if(|next| next.start < end) {
            end = end.max(next.end(character));
            burst.push(next);
            self.ahead = self.bus.next();
        }
        Some(burst)
    }

    /// Receives transmissions that overlap, or a single one, and returns when the line falls silent.
    ///
    /// Who came first sets the characters, garbled where others talk; of the others remains what is sent
    /// after the first has ended.
    fn receive_burst(&mut self, burst: &[Transmission]) -> Timestamp {
        let character = self.line.character_ns();
        let spans: Vec<_> = burst.iter().map(|sent| (sent.start, sent.end(character))).collect();
        let mut free = Timestamp::MIN;
        for (index, sent) in burst.iter().enumerate() {
            let others: Vec<_> = spans
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != index)
                .map(|(_, span)| *span)
                .collect();
            self.receive(sent, free, &others);
            free = free.max(sent.end(character));
        }
        free
    }

    /// Receives the bytes of a transmission that begin at `free` or later, garbled during the spans of `others`.
    fn receive(&mut self, sent: &Transmission, free: Timestamp, others: &[(Timestamp, Timestamp)]) {
        let character = self.line.character_ns();
        let start = self.received;
        let mut clean = true;
        for (index, &value) in sent.bytes.iter().enumerate() {
            let end = sent.byte_end(index, character);
            let begin = end - character;
            if begin < free || self.random.chance(self.scenario.drop) {
                clean = false;
                continue;
            }
            let mut byte = WireByte { end, value, error: false };
            if others.iter().any(|(from, to)| begin < *to && end > *from) {
                byte.value &= self.random.byte(); // whoever pulls the line down wins, more or less
                byte.error = self.random.chance(0.3);
            } else if self.random.chance(self.scenario.corrupt) {
                byte = self.flipped(byte);
            }
            clean &= byte.value == value;
            self.push(byte);
        }
        self.truth.push_back(TruthFrame {
            start,
            end: self.received,
            start_time: sent.start,
            end_time: sent.end(character),
            role: sent.role,
            clean,
            echo: sent.echo,
            address: sent.bytes[0], // an ADU has an address and a function
            function: sent.bytes[1],
            request: sent.request,
            bytes: sent.bytes.clone(),
        });
    }

    /// Flips a bit, which a parity bit shows.
    fn flipped(&mut self, byte: WireByte) -> WireByte {
        let value = byte.value ^ 1 << self.random.range(0, 7);
        let error = matches!(self.line.parity, Parity::Even | Parity::Odd);
        WireByte { value, error, ..byte }
    }

    /// Fills the silence after a frame with what scenarios ask for, as far as there is room.
    fn add_noise(&mut self, end: Timestamp) {
        let character = self.line.character_ns();
        let limit = self.ahead.as_ref().map_or(Timestamp::MAX, |next| next.start);
        let mut end = end;
        if self.random.chance(self.scenario.glitch) && end + character <= limit {
            end = end + character;
            let value = self.random.pick([0x00, 0xFF]);
            self.push(WireByte { end, value, error: false });
        }
        if !self.random.chance(self.scenario.stray) {
            return;
        }
        for _ in 0..self.random.pick([1, 1, 1, 2, 3]) {
            // Not beyond the usual turn-around, and not across the next start bit.
            let latest = (limit - character).min(end + character.saturating_mul(10));
            if latest < end {
                return;
            }
            end = end + self.random.range(0, latest - end) + character;
            let value = match self.random.range(0, 2) {
                0 => 0x00,
                1 => 0xFF,
                _ => self.random.byte(),
            };
            self.push(WireByte { end, value, error: false });
        }
    }

    fn push(&mut self, byte: WireByte) {
        self.bytes.push_back(byte);
        self.received += 1;
    }
}
