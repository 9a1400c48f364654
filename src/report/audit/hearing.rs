//! How much of what was heard of a bus makes sense.

use crate::analyze::verify::{Finding, rule};
use crate::decode::frame::{Damaged, Frame, Place};
use crate::line::LineSettings;
use crate::time::Timestamp;

/// How many damaged bytes there are to a byte of frames where those fit by chance.
const CHANCE: u64 = 50;

/// Is a bus as it was heard.
#[derive(Debug)]
pub(super) struct Hearing {
    pub(super) bus: String,
    pub(super) line: LineSettings,
    frame_bytes: u64,
    damaged_bytes: u64,
    /// Damaged runs: the first and the last, and when that one ended.
    damaged: Option<(u64, u64, Option<Timestamp>)>,
}

impl Hearing {
    pub(super) fn new(bus: &str, line: LineSettings) -> Self {
        Hearing { bus: bus.to_owned(), line, frame_bytes: 0, damaged_bytes: 0, damaged: None }
    }

    pub(super) fn frame(&mut self, frame: &Frame<'_>) {
        self.frame_bytes += frame.place.bytes.len() as u64;
    }

    pub(super) fn damaged(&mut self, damaged: &Damaged<'_>) {
        let Place { id, bytes, time, .. } = &damaged.place;
        self.damaged_bytes += bytes.len() as u64;
        let first = self.damaged.map_or(*id, |(first, ..)| first);
        self.damaged = Some((first, *id, time.map(|time| time.end.midpoint())));
    }

    /// Tells whether not a byte was heard.
    pub(super) fn is_silent(&self) -> bool {
        self.frame_bytes + self.damaged_bytes == 0
    }

    /// Finds that nothing makes sense: nobody talks like this, so the line settings are others.
    pub(super) fn nonsense(&self) -> Option<Finding> {
        let (first, last, time) = self.damaged?;
        if self.damaged_bytes <= self.frame_bytes.saturating_mul(CHANCE) {
            return None;
        }
        let (bytes, line) = (self.damaged_bytes, self.line);
        let good = if self.frame_bytes == 0 { "no frame" } else { "hardly a frame" };
        let message = format!(
            "{good} with a good CRC, and {bytes} bytes that belong to none: speed or character format is probably \
             not {line}"
        );
        let frames = std::iter::once(first).chain((first != last).then_some(last));
        Some(Finding::new(rule("L04")?, time, message).shown_by(frames))
    }
}
