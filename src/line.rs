//! How bytes look on the wire: speed and character format, and the silences that follow from them.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

/// Names the parity bit of a character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parity {
    /// No parity bit.
    None,
    /// Even parity, the default of the Modbus serial line specification V1.02, section 2.5.1.
    Even,
    /// Odd parity.
    Odd,
    /// Always 1.
    Mark,
    /// Always 0.
    Space,
}

/// Names the length of the stop bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopBits {
    /// One bit.
    One,
    /// One and a half bits.
    OneAndHalf,
    /// Two bits, what the specification asks for without parity.
    Two,
}

/// Holds speed and character format of a serial line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineSettings {
    /// Bits a second, from 1.
    pub baud: u32,
    /// Data bits of a character, 5 to 8; Modbus RTU needs 8.
    pub data_bits: u8,
    /// Parity bit.
    pub parity: Parity,
    /// Stop bits.
    pub stop_bits: StopBits,
}

impl Default for LineSettings {
    /// Returns 9600 8N1, what the sensors leave the factory with (manuals, 1.2.2).
    fn default() -> Self {
        LineSettings { baud: 9600, data_bits: 8, parity: Parity::None, stop_bits: StopBits::One }
    }
}

impl LineSettings {
    /// Returns the length of a character in half bits: start, data, parity and stop.
    fn half_bits(self) -> i64 {
        let parity = if self.parity == Parity::None { 0 } else { 2 };
        let stop = match self.stop_bits {
            StopBits::One => 2,
            StopBits::OneAndHalf => 3,
            StopBits::Two => 4,
        };
        2 + 2 * i64::from(self.data_bits) + parity + stop
    }

    /// Returns the time of half bits in nanoseconds, rounded to the nearest.
    fn half_bits_ns(self, half_bits: i64) -> i64 {
        let twice_baud = 2 * i64::from(self.baud.max(1));
        (half_bits * 1_000_000_000 + twice_baud / 2) / twice_baud
    }

    /// Returns the time of one character in nanoseconds.
    pub fn character_ns(self) -> i64 {
        self.half_bits_ns(self.half_bits())
    }

    /// Returns t1.5 in nanoseconds: the longest silence allowed inside a frame.
    ///
    /// 1.5 characters up to 19200 baud, 750 µs above (Modbus serial line V1.02, 2.5.1.1).
    pub fn t1_5_ns(self) -> i64 {
        if self.baud <= 19200 { self.half_bits_ns(self.half_bits() * 3) / 2 } else { 750_000 }
    }

    /// Returns t3.5 in nanoseconds: the shortest silence allowed between frames.
    ///
    /// 3.5 characters up to 19200 baud, 1.750 ms above (Modbus serial line V1.02, 2.5.1.1).
    pub fn t3_5_ns(self) -> i64 {
        if self.baud <= 19200 { self.half_bits_ns(self.half_bits() * 7) / 2 } else { 1_750_000 }
    }
}

/// Says why line settings could not be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("'{given}' is not a line setting: {problem}; write it like 9600-8N1 or 19200-8E1")]
pub struct LineSettingsError {
    given: String,
    problem: &'static str,
}

impl FromStr for LineSettings {
    type Err = LineSettingsError;

    /// Reads `BAUD-DPS`: data bits 5 to 8, parity N, E, O, M or S, stop bits 1, 1.5 or 2.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let problem = |problem| LineSettingsError { given: text.to_owned(), problem };
        let (baud, format) =
            text.split_once('-').ok_or_else(|| problem("no '-' between speed and format"))?;
        let baud: u32 = baud.parse().map_err(|_| problem("the speed is not a whole number"))?;
        if !(50..=20_000_000).contains(&baud) {
            return Err(problem("the speed is not between 50 and 20000000 baud"));
        }
        let mut letters = format.chars();
        let data_bits = match letters.next() {
            Some(c @ '5'..='8') => c as u8 - b'0',
            _ => return Err(problem("the data bits are not 5 to 8")),
        };
        let parity = match letters.next().map(|c| c.to_ascii_uppercase()) {
            Some('N') => Parity::None,
            Some('E') => Parity::Even,
            Some('O') => Parity::Odd,
            Some('M') => Parity::Mark,
            Some('S') => Parity::Space,
            _ => return Err(problem("the parity is not N, E, O, M or S")),
        };
        let stop_bits = match letters.as_str() {
            "1" => StopBits::One,
            "1.5" => StopBits::OneAndHalf,
            "2" => StopBits::Two,
            _ => return Err(problem("the stop bits are not 1, 1.5 or 2")),
        };
        Ok(LineSettings { baud, data_bits, parity, stop_bits })
    }
}

impl fmt::Display for LineSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parity = match self.parity {
            Parity::None => 'N',
            Parity::Even => 'E',
            Parity::Odd => 'O',
            Parity::Mark => 'M',
            Parity::Space => 'S',
        };
        let stop = match self.stop_bits {
            StopBits::One => "1",
            StopBits::OneAndHalf => "1.5",
            StopBits::Two => "2",
        };
        write!(f, "{}-{}{parity}{stop}", self.baud, self.data_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> LineSettings {
        text.parse().expect("a line setting of this test")
    }

    #[test]
    fn silences_follow_the_character_up_to_19200_and_are_fixed_above() {
        // Figures of the specification and of the study: 9600 8N1 and 8E1, 19200 8E1, 115200.
        assert_eq!(line("9600-8N1").character_ns(), 1_041_667);
        assert_eq!(line("9600-8N1").t1_5_ns(), 1_562_500);
        assert_eq!(line("9600-8N1").t3_5_ns(), 3_645_833);
        assert_eq!(line("9600-8E1").t3_5_ns(), 4_010_416);
        assert_eq!(line("9600-8N2").t1_5_ns(), 1_718_750);
        assert_eq!(line("19200-8E1").t3_5_ns(), 2_005_208);
        assert_eq!(line("115200-8N1").t1_5_ns(), 750_000);
        assert_eq!(line("115200-8N1").t3_5_ns(), 1_750_000);
    }

    #[test]
    fn every_form_prints_as_it_is_read() {
        for text in ["9600-8N1", "19200-8E1", "1200-7O2", "115200-8N2", "300-5M1.5", "57600-8S1"] {
            assert_eq!(line(text).to_string(), text);
        }
        assert_eq!(line("9600-8n1"), LineSettings::default());
    }

    #[test]
    fn an_error_names_what_is_wrong() {
        for (text, part) in [
            ("9600", "no '-'"),
            ("fast-8N1", "whole number"),
            ("0-8N1", "between 50 and"),
            ("9600-9N1", "data bits"),
            ("9600-8X1", "parity"),
            ("9600-8N3", "stop bits"),
            ("9600-8N", "stop bits"),
        ] {
            let error = text.parse::<LineSettings>().expect_err(text).to_string();
            assert!(error.contains(part) && error.contains(text), "{error}");
        }
    }
}
