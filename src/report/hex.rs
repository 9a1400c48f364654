//! Hex text: the reads as they were, or what of them passes the filter.

use std::collections::VecDeque;
use std::ops::Range;

use super::held::{Held, Released};
use super::{Format, Judge, Rows, Show};
use crate::capture::{BUS, hex_bus, hex_line, hex_lost, hex_silence};
use crate::decode::chunk::{Chunk, LineError, Lost, ReadTime};
use crate::line::LineSettings;
use crate::pipeline::Event;
use crate::time::Timestamp;

/// Turns reads into lines of hex text.
///
/// With a filter, of each read those bytes remain whose frame or damaged run passes.
pub struct Hex {
    cut: Option<Box<Cut>>,
    /// The bus that the lines are of.
    bus: String,
}

impl Hex {
    /// Makes a writer; without a judge every byte passes.
    pub fn new(judge: Option<Judge>) -> Self {
        Hex { cut: judge.map(|judge| Box::new(Cut::new(judge))), bus: BUS.to_owned() }
    }

    /// Takes a read.
    pub fn chunk(&mut self, chunk: &Chunk<'_>, out: &mut Vec<u8>) {
        match &mut self.cut {
            Some(cut) => cut.held.push(chunk, None),
            None => line(chunk, out),
        }
    }

    /// Goes on with the lines of a bus, with its settings where they begin.
    pub fn bus(&mut self, name: &str, settings: Option<(LineSettings, Option<i64>)>, out: &mut Vec<u8>) {
        if self.bus != name || settings.is_some() {
            name.clone_into(&mut self.bus);
            out.extend_from_slice(hex_bus(name, settings).as_bytes());
            out.push(b'\n');
        }
    }

    /// Takes that nothing was received until then: a comment, unless only a part is written.
    pub fn silence(&mut self, until: Timestamp, out: &mut Vec<u8>) {
        if self.cut.is_none() {
            out.extend_from_slice(hex_silence(until).as_bytes());
            out.push(b'\n');
        }
    }

    /// Takes that bytes were lost: a comment, unless only a part is written.
    pub fn lost(&mut self, lost: &Lost, out: &mut Vec<u8>) {
        if self.cut.is_none() {
            out.extend_from_slice(hex_lost(lost).as_bytes());
            out.push(b'\n');
        }
    }

    /// Takes what came of the reads so far.
    pub fn event(&mut self, bus: &str, event: &Event<'_>) {
        let Some(cut) = &mut self.cut else { return };
        match event {
            Event::Frame(frame) => cut.held.note(&frame.place),
            Event::Damaged(damaged) => cut.held.note(&damaged.place),
            _ => {}
        }
        cut.rows.event(bus, event, &mut cut.spans);
    }

    /// Returns of how many transactions none passed the filter, nor anything else; `None` when something did.
    pub fn none_of(&self) -> Option<u64> {
        self.cut.as_ref()?.rows.none_of()
    }

    /// Appends what is settled once every frame before `settled_frame` has its transaction or none.
    pub fn settle(&mut self, settled_frame: u64, out: &mut Vec<u8>) {
        let Some(cut) = &mut self.cut else { return };
        cut.rows.settle(settled_frame, &mut cut.spans);
        if settled_frame == u64::MAX {
            cut.held.settle_all();
        } else {
            cut.held.settle(settled_frame);
        }
        cut.release(out);
    }
}

/// Bytes of a line that is no read.
const LINE: usize = 32;

fn line(chunk: &Chunk<'_>, out: &mut Vec<u8>) {
    let is_read = chunk.time != ReadTime::Unknown;
    for bytes in chunk.bytes.chunks(if is_read { chunk.bytes.len().max(1) } else { LINE }) {
        out.extend_from_slice(hex_line(&Chunk { bytes, ..*chunk }).as_bytes());
        out.push(b'\n');
    }
}

/// Cuts reads down to what passes.
struct Cut {
    rows: Rows,
    held: Held,
    /// Rows of `Spans` that passed.
    spans: Vec<u8>,
    passing: VecDeque<Range<u64>>,
}

impl Cut {
    fn new(judge: Judge) -> Self {
        let rows = Rows::new(vec![Show::Frames], Box::new(Spans), Some(judge));
        Cut { rows, held: Held::default(), spans: Vec::new(), passing: VecDeque::new() }
    }

    fn release(&mut self, out: &mut Vec<u8>) {
        let (words, _) = self.spans.as_chunks::<8>();
        let ends = words.iter().map(|word| u64::from_le_bytes(*word)).collect::<Vec<_>>();
        self.passing.extend(ends.as_chunks::<2>().0.iter().map(|[from, to]| *from..*to));
        self.spans.clear();
        while let Some(Released { chunk, offsets, .. }) = self.held.pop() {
            let (mut bytes, mut line_errors) = (Vec::new(), Vec::new());
            for span in self.passing.iter().take_while(|span| span.start < offsets.end) {
                let within =
                    |offset: u64| (offset.clamp(offsets.start, offsets.end) - offsets.start) as usize;
                let (from, to) = (within(span.start), within(span.end));
                let kept = |error: &&LineError| (from..to).contains(&(error.offset as usize));
                line_errors.extend(chunk.line_errors.iter().filter(kept).map(|error| LineError {
                    offset: (bytes.len() + error.offset as usize - from) as u32, // at most what it was
                    kind: error.kind,
                }));
                bytes.extend_from_slice(chunk.bytes.get(from..to).unwrap_or_default());
            }
            while self.passing.front().is_some_and(|span| span.end <= offsets.end) {
                self.passing.pop_front();
            }
            if !bytes.is_empty() {
                line(&Chunk { time: chunk.time, bytes: &bytes, line_errors: &line_errors }, out);
            }
        }
    }
}

/// Writes where in the stream each frame and run lies, for the gate to let pass: two numbers of 64 bits.
struct Spans;

impl Format for Spans {
    fn row(&mut self, _bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        let place = match event {
            Event::Frame(frame) => &frame.place,
            Event::Damaged(damaged) => &damaged.place,
            _ => return,
        };
        out.extend_from_slice(&place.stream_offset.to_le_bytes());
        out.extend_from_slice(&(place.stream_offset + place.bytes.len() as u64).to_le_bytes());
    }
}
