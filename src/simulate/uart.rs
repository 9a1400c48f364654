//! A receiver that samples the line, whatever its settings and the sender's are.
//!
//! An ideal one: its clock is exact, a start bit is looked at again in its middle, and each bit is sampled once, in
//! its middle. Of several stop bits the first is looked at, as chips do.

use crate::decode::chunk::LineErrorKind;
use crate::line::LineSettings;
use crate::simulate::wire::{Wire, bits_ns, parity_bit};
use crate::time::Timestamp;

/// Says what a receiver does after a stop bit that is none; chips differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AfterFramingError {
    /// It waits for the line to rest, and for a start bit then.
    WaitForMark,
    /// It takes the stop bit for the next start bit (data sheet of the 16550D, line status register, bit 3).
    TakeAsStart,
}

/// Is what a receiver makes of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Character {
    /// The middle of the stop bit, when a receiver hands it over.
    pub end: Timestamp,
    /// Its data.
    pub value: u8,
    /// What is wrong with it.
    pub error: Option<LineErrorKind>,
}

/// Receives what is on a wire.
pub struct Uart {
    wire: Wire,
    line: LineSettings,
    after_error: AfterFramingError,
    /// How far it has listened.
    now: Timestamp,
    /// A start bit that it has taken a stop bit for.
    start: Option<Timestamp>,
}

impl Uart {
    /// Listens to a wire from its start on.
    pub fn new(wire: Wire, line: LineSettings, after_error: AfterFramingError) -> Self {
        Uart { wire, line, after_error, now: Timestamp::MIN, start: None }
    }

    /// Receives with other settings from `at` on; a character under way is given up.
    pub fn set_line(&mut self, line: LineSettings, at: Timestamp) {
        self.line = line;
        self.now = self.now.max(at);
        self.start = None;
    }

    /// Returns the next character, if it ends by `until`.
    pub fn receive(&mut self, until: Timestamp) -> Option<Character> {
        loop {
            let start = match self.start {
                Some(start) => start,
                None => self.wire.falls(self.now, until)?,
            };
            let samples = i64::from(self.line.data_bits) + i64::from(parity_bit(0, self.line).is_some()) + 1;
            let end = start + bits_ns(2 * samples + 1, self.line);
            if end > until {
                return None;
            }
            if self.wire.is_mark(start + bits_ns(1, self.line)) {
                self.now = start;
                continue;
            }
            return Some(self.sample(start, end));
        }
    }

    /// Samples a character that begins at `start` and whose stop bit has its middle at `end`.
    fn sample(&mut self, start: Timestamp, end: Timestamp) -> Character {
        let line = self.line;
        let mut bit = |index: u8| self.wire.is_mark(start + bits_ns(3 + 2 * i64::from(index), line));
        let value = (0..line.data_bits).fold(0, |value, index| value | u8::from(bit(index)) << index.min(7));
        let parity = parity_bit(value, line).map(|right| (bit(line.data_bits), right));
        let stop = self.wire.is_mark(end);
        let is_break = value == 0 && !stop && parity.is_none_or(|(parity, _)| !parity);
        let error = match (is_break, stop, parity) {
            (true, ..) => Some(LineErrorKind::Break),
            (_, false, _) => Some(LineErrorKind::ParityOrFraming),
            (_, _, Some((parity, right))) if parity != right => Some(LineErrorKind::ParityOrFraming),
            _ => None,
        };
        let is_resumed = !stop && !is_break && self.after_error == AfterFramingError::TakeAsStart;
        self.start = is_resumed.then(|| end - bits_ns(1, line));
        self.now = self.start.unwrap_or(end);
        Character { end, value, error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Adapter, Config, Scenario, Simulation};

    fn line(text: &str) -> LineSettings {
        text.parse().expect("a line setting of this test")
    }

    fn config(sent: &str) -> Config {
        let scenario = Scenario::named("installation").expect("a scenario");
        Config { seed: 3, frames: 80, line: line(sent), adapter: Adapter::Uart, scenario }
    }

    fn received(sent: &str, received: &str, after_error: AfterFramingError) -> Vec<Character> {
        let mut uart = Uart::new(Wire::traffic(config(sent)), line(received), after_error);
        std::iter::from_fn(|| uart.receive(Timestamp::MAX)).collect()
    }

    /// Returns the percentage of characters with line errors.
    fn errors(characters: &[Character]) -> usize {
        100 * characters.iter().filter(|character| character.error.is_some()).count() / characters.len()
    }

    fn sent(text: &str) -> Vec<u8> {
        Simulation::new(config(text)).flat_map(|read| read.bytes).collect()
    }

    #[test]
    fn with_the_senders_settings_every_byte_is_received_when_it_ends() {
        for text in ["9600-8N1", "115200-8E1", "1200-8O1", "57600-8N2", "4800-7E1"] {
            let characters = received(text, text, AfterFramingError::TakeAsStart);
            let mask = if text.contains("-7") { 0x7F } else { 0xFF };
            assert_eq!(errors(&characters), 0, "{text}");
            let values: Vec<u8> = characters.iter().map(|character| character.value).collect();
            assert_eq!(values, sent(text).iter().map(|byte| byte & mask).collect::<Vec<_>>(), "{text}");
        }
        let first = received("9600-8N1", "9600-8N1", AfterFramingError::WaitForMark)[0];
        let read = Simulation::new(config("9600-8N1")).next().expect("a read");
        let early = read.time - first.end;
        assert!((0..1_000_000).contains(&early), "{early}");
    }

    #[test]
    fn a_wrong_parity_setting_shows_in_line_errors_only() {
        // Section 5 of the study has 67 % and 100 %; the traffic is another.
        for (sender, receiver, least, most) in [
            ("9600-8E1", "9600-8N1", 30, 80),
            ("9600-8O1", "9600-8N1", 30, 80),
            ("9600-8E1", "9600-8O1", 100, 100),
            ("9600-8N2", "9600-8E1", 30, 70),
            ("9600-8N2", "9600-8N1", 0, 0),
        ] {
            let characters = received(sender, receiver, AfterFramingError::WaitForMark);
            let values: Vec<u8> = characters.iter().map(|character| character.value).collect();
            assert_eq!(values, sent(sender), "{sender} received as {receiver}");
            let errors = errors(&characters);
            assert!((least..=most).contains(&errors), "{sender} received as {receiver}: {errors} %");
        }
    }

    #[test]
    fn a_receiver_that_takes_stop_for_start_loses_what_others_do_not() {
        let characters = received("9600-8E1", "9600-8N1", AfterFramingError::TakeAsStart);
        let values: Vec<u8> = characters.iter().map(|character| character.value).collect();
        assert_ne!(values, sent("9600-8E1"));
    }

    #[test]
    fn characters_come_in_time_and_other_settings_hold_at_once() {
        let until = |uart: &mut Uart, until| std::iter::from_fn(|| uart.receive(until)).collect::<Vec<_>>();
        let whole = received("9600-8N1", "9600-8N1", AfterFramingError::WaitForMark);
        let mut uart =
            Uart::new(Wire::traffic(config("9600-8N1")), line("9600-8N1"), AfterFramingError::WaitForMark);
        let middle = whole[whole.len() / 2].end;
        let first = until(&mut uart, middle);
        assert_eq!(first, whole[..=whole.len() / 2]);
        assert_eq!(until(&mut uart, middle), []);
        uart.set_line(line("1200-8N1"), middle);
        assert!(until(&mut uart, Timestamp::MAX).len() < whole.len() / 3);
    }

    #[test]
    fn a_swapped_pair_rests_in_a_break() {
        let wire = Wire::traffic(config("9600-8N1")).swapped();
        let mut uart = Uart::new(wire, line("9600-8N1"), AfterFramingError::WaitForMark);
        let characters: Vec<Character> = std::iter::from_fn(|| uart.receive(Timestamp::MAX)).collect();
        assert!(characters.iter().any(|character| character.error == Some(LineErrorKind::Break)));
        assert!(errors(&characters) > 10);
    }
}
