//! The levels of a pair of wires over time, bit by bit: what somebody sends, or what nobody meant.

use std::collections::VecDeque;

use crate::line::{LineSettings, Parity, StopBits};
use crate::simulate::random::Random;
use crate::simulate::simulation::{Config, EPOCH, tap};
use crate::simulate::tap::{Tap, WireByte};
use crate::time::{MILLISECOND, Timestamp};

/// How long a level of noise lasts, in nanoseconds: from a hundredth of a bit at 9600 baud to twenty bits.
const NOISE: (i64, i64) = (1_000, 2 * MILLISECOND);
/// How often noise pauses, and how long at most, in nanoseconds.
const PAUSE: (f64, i64) = (0.002, 200 * MILLISECOND);

/// Is a change of level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) time: Timestamp,
    /// Whether the line is at mark, where it rests, from here on.
    pub(super) mark: bool,
}

enum Sender {
    Traffic(Box<Tap>, LineSettings),
    Noise(Random),
}

/// Is the line as a receiver sees it, from its start on.
pub struct Wire {
    sender: Sender,
    /// Changes that are not forgotten, in the order of their times.
    edges: VecDeque<Edge>,
    /// The level before the first of them, and after the last.
    before: bool,
    after: bool,
    /// Up to when all changes are there.
    end: Timestamp,
    is_over: bool,
    is_swapped: bool,
}

impl Wire {
    /// Carries a simulated bus, sent with the line settings of `config`; its adapter does not matter.
    pub fn traffic(config: Config) -> Self {
        Wire::new(Sender::Traffic(Box::new(tap(config)), config.line))
    }

    /// Carries nothing but noise, without end.
    pub fn noise(seed: u64) -> Self {
        Wire::new(Sender::Noise(Random::new(seed, 6)))
    }

    /// Swaps A and B: every level is the opposite, and rest is a break.
    pub fn swapped(self) -> Self {
        Wire { is_swapped: true, before: false, after: false, ..self }
    }

    fn new(sender: Sender) -> Self {
        Wire {
            sender,
            edges: VecDeque::new(),
            before: true,
            after: true,
            end: EPOCH,
            is_over: false,
            is_swapped: false,
        }
    }

    /// Forgets what was before a time.
    pub(super) fn forget_before(&mut self, time: Timestamp) {
        while let Some(edge) = self.edges.front().filter(|edge| edge.time <= time) {
            self.before = edge.mark;
            self.edges.pop_front();
        }
    }

    /// Finds the first change after a time, up to `until`, that begins a space.
    pub(super) fn falls(&mut self, after: Timestamp, until: Timestamp) -> Option<Timestamp> {
        self.forget_before(after);
        loop {
            let falling = self.edges.iter().find(|edge| !edge.mark);
            match falling {
                Some(edge) => return Some(edge.time).filter(|time| *time <= until),
                None if self.end > until || self.is_over => return None,
                None => self.extend(),
            }
        }
    }

    /// Tells whether the line is at mark at a time that is not forgotten.
    pub(super) fn is_mark(&mut self, time: Timestamp) -> bool {
        while self.end <= time && !self.is_over {
            self.extend();
        }
        let edges = self.edges.iter().take_while(|edge| edge.time <= time);
        edges.last().map_or(self.before, |edge| edge.mark)
    }

    /// Adds what comes next.
    fn extend(&mut self) {
        match &mut self.sender {
            Sender::Traffic(tap, line) => {
                let line = *line;
                // Nobody asks a wire for the truth.
                tap.truth.clear();
                match tap.next() {
                    Some(byte) => self.send(byte, line),
                    None => self.is_over = true,
                }
            }
            Sender::Noise(random) => {
                let pause = if random.chance(PAUSE.0) { random.range(0, PAUSE.1) } else { 0 };
                let time = self.end + random.range(NOISE.0, NOISE.1) + pause;
                let mark = self.after == self.is_swapped;
                self.change(time, mark);
                self.end = time;
            }
        }
    }

    /// Adds the bits of a character.
    fn send(&mut self, byte: WireByte, line: LineSettings) {
        let start = byte.end - line.character_ns();
        let bits = bits(byte, line);
        for (index, mark) in bits.enumerate() {
            self.change(start + bits_ns(2 * index as i64, line), mark);
        }
        self.end = self.end.max(byte.end);
        self.change(self.end, true);
    }

    fn change(&mut self, time: Timestamp, mark: bool) {
        let mark = mark != self.is_swapped;
        if mark != self.after {
            // Times of characters are rounded.
            let time = self.edges.back().map_or(time, |last| last.time.max(time));
            self.edges.push_back(Edge { time, mark });
            self.after = mark;
        }
    }
}

/// Returns the time of half bits in nanoseconds.
pub(super) fn bits_ns(half_bits: i64, line: LineSettings) -> i64 {
    half_bits * 1_000_000_000 / (2 * i64::from(line.baud.max(1)))
}

/// Returns the parity bit of a byte, if characters have one.
pub(super) fn parity_bit(value: u8, line: LineSettings) -> Option<bool> {
    let is_odd = value.count_ones() % 2 == 1;
    match line.parity {
        Parity::None => None,
        Parity::Even => Some(is_odd),
        Parity::Odd => Some(!is_odd),
        Parity::Mark => Some(true),
        Parity::Space => Some(false),
    }
}

/// Returns the levels of a character: start, data from the lowest bit, parity, stop; wrong where it is to be wrong.
fn bits(byte: WireByte, line: LineSettings) -> impl Iterator<Item = bool> {
    // The highest bits of a byte have no room in a shorter character.
    let value = byte.value & 0xFF_u8.checked_shr(8 - u32::from(line.data_bits.min(8))).unwrap_or(0);
    let data = (0..line.data_bits.min(8)).map(move |bit| value >> bit & 1 == 1);
    let parity = parity_bit(value, line);
    let stop = parity.is_some() || !byte.error;
    // A stop bit and a half ends with the character, as does the second of two.
    let second = (line.stop_bits != StopBits::One).then_some(true);
    let parity = parity.map(|bit| bit != byte.error);
    std::iter::once(false).chain(data).chain(parity).chain([stop]).chain(second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_character_is_start_data_parity_and_stop() {
        let bits = |text: &str, error| {
            let byte = WireByte { end: Timestamp::default(), value: 0x13, error };
            let line = text.parse().expect("a line setting of this test");
            bits(byte, line).map(|bit| if bit { '1' } else { '0' }).collect::<String>()
        };
        assert_eq!(bits("9600-8N1", false), "0110010001");
        assert_eq!(bits("9600-8N2", false), "01100100011");
        assert_eq!(bits("9600-8E1", false), "01100100011");
        assert_eq!(bits("9600-8O1", false), "01100100001");
        assert_eq!(bits("9600-8E1", true), "01100100001", "a wrong parity bit");
        assert_eq!(bits("9600-8N1", true), "0110010000", "a wrong stop bit");
    }
}
