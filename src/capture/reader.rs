//! What every format of a recording can do, and how reading one fails.

use std::fmt;
use std::io;

use super::HexError;
use super::mcap::BusSettings;
use crate::decode::chunk::{Chunk, Lost};
use crate::line::LineSettings;
use crate::time::Timestamp;

/// Reads a recording of one format, a chunk at a time.
pub(super) trait ReadChunks {
    /// Goes on to the next chunk; tells whether there is one.
    fn advance(&mut self) -> Result<bool, Failure>;

    /// Returns the chunk that `advance` went on to.
    fn chunk(&self) -> Chunk<'_>;

    /// Returns the bus that it is of.
    fn bus(&self) -> &str {
        super::BUS
    }

    /// Returns the settings of a bus, where `advance` went on to those instead of a chunk.
    fn settings(&self) -> Option<&BusSettings> {
        None
    }

    /// Returns until when nothing was received, where `advance` went on to that instead of a chunk.
    fn silence(&self) -> Option<Timestamp> {
        None
    }

    /// Returns what was lost, where `advance` went on to that instead of a chunk.
    fn lost(&self) -> Option<Lost> {
        None
    }

    /// Returns how many bytes of the file have been read.
    fn position(&self) -> u64;

    /// Tells whether the next chunk has to be waited for.
    fn is_drained(&self) -> bool {
        true
    }

    /// Returns the line settings that the recording names before its first byte.
    fn line(&self) -> Option<LineSettings> {
        None
    }

    /// Takes in the line settings that are used, for formats that time the start of a byte.
    fn use_line(&mut self, _line: LineSettings) {}

    /// Returns the longest time a byte was kept back before it was timed, in nanoseconds, where it is known.
    fn adapter_hold_ns(&self) -> Option<i64> {
        None
    }

    /// Returns where times go back, as far as the recording has been read.
    fn times_back(&self) -> Option<TimesBack> {
        None
    }

    /// Returns where the recording was cut off, once it was read up to there.
    fn cut(&self) -> Option<&Malformed> {
        None
    }
}

/// Is what a reader can fail with, before the input's name is added.
#[derive(Debug)]
pub(super) enum Failure {
    Io(io::Error),
    Hex(HexError),
    Malformed(Malformed),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Failure {
        Failure::Io(error)
    }
}

/// Says where an import cannot be understood, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Malformed {
    /// Where, such as `line 3, column 'data'` or `byte 128`.
    pub place: String,
    /// What is wrong there.
    pub problem: String,
    /// What could be done about it.
    pub hint: &'static str,
}

impl fmt::Display for Malformed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.problem)
    }
}

/// Says where times go back in an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimesBack {
    /// What is counted: `line` or `packet`.
    pub unit: &'static str,
    /// The first that goes back, from 1.
    pub first: u64,
    /// How many do.
    pub count: u64,
}

impl TimesBack {
    /// Returns where times go back on any of several buses.
    pub(super) fn of<'a>(buses: impl Iterator<Item = &'a Forward>) -> Option<TimesBack> {
        buses.filter_map(Forward::times_back).reduce(|all, one| TimesBack {
            unit: all.unit,
            first: all.first.min(one.first),
            count: all.count.saturating_add(one.count),
        })
    }
}

/// Keeps times from going back.
#[derive(Debug)]
pub(super) struct Forward {
    last: Timestamp,
    back: TimesBack,
}

impl Forward {
    pub(super) fn new(unit: &'static str) -> Self {
        Forward { last: Timestamp::MIN, back: TimesBack { unit, first: 0, count: 0 } }
    }

    /// Returns the time, or the one before where it goes back; `number` is that of the line or packet.
    pub(super) fn forward(&mut self, time: Timestamp, number: u64) -> Timestamp {
        if time < self.last {
            if self.back.count == 0 {
                self.back.first = number;
            }
            self.back.count += 1;
        }
        self.last = self.last.max(time);
        self.last
    }

    pub(super) fn times_back(&self) -> Option<TimesBack> {
        (self.back.count > 0).then_some(self.back)
    }
}
