//! Rows for people and programs: one file per output format, the columns defined once.

pub mod audit;
mod clock;
pub mod columns;
mod csv;
mod gate;
pub mod held;
pub mod hex;
pub mod info;
mod json;
pub mod mcap;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod pcapng;
pub mod redact;
mod rows;
mod subject;
mod text;
pub mod wide;

pub use clock::{Clock, TimeStyle};
pub use csv::Csv;
pub use json::Json;
pub use rows::{Judge, Passing, Rows, Show};
pub use subject::passes;
pub use text::{Guess, Text};

use crate::line::LineSettings;
use crate::pipeline::Event;

/// Turns events into rows of one output format.
pub trait Format {
    /// Appends one row for `event`, with its line end.
    fn row(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>);

    /// Appends what stands before the first row.
    fn heading(&mut self, _out: &mut Vec<u8>) {}

    /// Appends what stands before the first row of a bus with these line settings.
    fn begin(&mut self, _bus: &str, _line: LineSettings, _out: &mut Vec<u8>) {}

    /// Takes note of the time of an event that is not shown, for relative times.
    fn note_time(&mut self, _event: &Event<'_>) {}

    /// Returns a reading that was shown though it is only the likeliest, if there was one.
    fn guess(&self) -> Option<Guess> {
        None
    }
}
