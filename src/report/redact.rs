//! Blanks serial numbers in the reads themselves, so that whatever is decoded from them has none.
//!
//! A serial number keeps what tells the maker and the kind of device, for the decode rests on it; the rest
//! becomes `X`. Where one lies is known from the profiles; a maker's prefix gives away those that no profile
//! explains, such as an answer without its request. The CRC is changed by what the change does to it: a good
//! frame stays good, a damaged one stays damaged in the same way.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::sync::Arc;

use super::held::Held;
use crate::decode::chunk::{Chunk, Lost};
use crate::decode::crc;
use crate::decode::frame::{Damaged, Frame, Place, Reason, Role};
use crate::decode::transaction::{Side, Transaction};
use crate::device::Profiles;
use crate::pipeline::{Event, Pipeline};
use crate::time::Timestamp;

/// Says in a file what was done to it.
pub const REMARK: &str = "redacted: serial numbers are blanked with X, and CRCs mended";
/// What columns and facts are called that say what was done to a file.
pub const REMARK_KEY: &str = "remark";
/// Takes the place of each blanked character.
const BLANK: u8 = b'X';
/// Letters and digits after a maker's prefix that make a serial number.
const LEAST_AFTER_PREFIX: usize = 4;
/// Letters and digits in a row that may be a piece of a serial number in a damaged answer.
const LEAST_PIECE: usize = 3;
/// Bytes of a CRC.
const CRC: usize = 2;

/// Blanks the serial numbers in the reads of one bus; a read comes out once all its frames are known.
#[derive(Clone)]
pub struct Redactor {
    pipeline: Pipeline,
    profiles: Arc<Profiles>,
    held: Held,
    /// What was lost or silent, and after how many bytes.
    marks: VecDeque<(u64, Mark)>,
    taken: u64,
    given: u64,
}

/// Is what stands between reads.
#[derive(Clone, Copy)]
enum Mark {
    Lost(Lost),
    Silence(Timestamp),
    Clock(u64, Timestamp),
}

/// Is what comes out of a redactor.
pub enum Redacted<'a> {
    /// A read without its serial numbers.
    Chunk(Chunk<'a>),
    /// Bytes were lost here.
    Lost(Lost),
    /// Nothing was received until then.
    Silence(Timestamp),
    /// The monotonic clock, in nanoseconds, and the wall clock showed this.
    Clock(u64, Timestamp),
}

impl Redactor {
    /// Makes a redactor that finds serial numbers by a pipeline of its own.
    pub fn new(pipeline: Pipeline, profiles: Arc<Profiles>) -> Self {
        let marks = VecDeque::new();
        Redactor { pipeline, profiles, held: Held::default(), marks, taken: 0, given: 0 }
    }

    /// Takes a read.
    pub fn push(&mut self, chunk: &Chunk<'_>) {
        self.held.push(chunk);
        self.taken += chunk.bytes.len() as u64;
        self.pipeline.handle_bytes(chunk);
        self.blank();
        self.held.settle(self.pipeline.settled_frame_id());
    }

    /// Takes note that bytes were lost after those taken so far.
    pub fn push_lost(&mut self, lost: Lost) {
        self.marks.push_back((self.taken, Mark::Lost(lost)));
    }

    /// Takes note that nothing was received until then.
    pub fn push_silence(&mut self, until: Timestamp) {
        self.marks.push_back((self.taken, Mark::Silence(until)));
        self.pipeline.handle_timeout(until);
        self.blank();
        self.held.settle(self.pipeline.settled_frame_id());
    }

    /// Takes note of what both clocks showed.
    pub fn push_clock(&mut self, monotonic_ns: u64, realtime: Timestamp) {
        self.marks.push_back((self.taken, Mark::Clock(monotonic_ns, realtime)));
    }

    /// Takes note that the input has ended.
    pub fn finish(&mut self) {
        self.pipeline.finish();
        self.blank();
        self.held.settle_all();
    }

    /// Returns what comes next, if it is ready.
    pub fn pop(&mut self) -> Option<Redacted<'_>> {
        if self.marks.front().is_some_and(|(after, _)| *after <= self.given) {
            return self.marks.pop_front().map(|(_, mark)| match mark {
                Mark::Lost(lost) => Redacted::Lost(lost),
                Mark::Silence(until) => Redacted::Silence(until),
                Mark::Clock(monotonic_ns, realtime) => Redacted::Clock(monotonic_ns, realtime),
            });
        }
        let (chunk, _) = self.held.pop()?;
        self.given += chunk.bytes.len() as u64;
        Some(Redacted::Chunk(chunk))
    }

    fn blank(&mut self) {
        let Redactor { pipeline, profiles, held, .. } = self;
        while let Some(event) = pipeline.poll_event() {
            match &event {
                Event::Frame(Frame { place, .. })
                | Event::Damaged(Damaged { place, reason: Reason::Crc, .. }) => {
                    blank_run(place, place.bytes.len().saturating_sub(CRC), profiles, held);
                }
                Event::Damaged(Damaged { place, .. }) => blank_run(place, place.bytes.len(), profiles, held),
                Event::Transaction { transaction, .. } => blank_transaction(transaction, profiles, held),
                _ => {}
            }
        }
    }
}

/// Blanks the serial number of a bus's adapter in what is known of it: names of devices may have it in them.
pub fn blank_facts(facts: &mut BTreeMap<String, String>) {
    let Some(serial_number) = facts.get("usb_serial").cloned().filter(|text| !text.is_empty()) else {
        return;
    };
    let blank = "X".repeat(serial_number.chars().count());
    // Of the others, those that may be paths under /dev/serial/by-id.
    for key in ["usb_serial", "source", "device"] {
        if let Some(fact) = facts.get_mut(key) {
            *fact = fact.replace(&serial_number, &blank);
        }
    }
}

/// Blanks what a maker's prefix gives away in the first `length` bytes of a frame or run.
fn blank_run(place: &Place<'_>, length: usize, profiles: &Profiles, held: &mut Held) {
    held.note(place);
    let bytes = place.bytes.get(..length).unwrap_or_default();
    let mut spans = Vec::new();
    for prefix in profiles.serial_number_prefixes().map(str::as_bytes) {
        let windows = bytes.windows(prefix.len()).enumerate();
        for (at, _) in windows.filter(|(_, window)| *window == prefix) {
            let end = alphanumeric_from(bytes, at + prefix.len());
            if end >= at + prefix.len() + LEAST_AFTER_PREFIX {
                spans.push(at..end);
            }
        }
    }
    change(place.stream_offset, place.bytes.len(), &spans, profiles, held);
}

fn blank_transaction(t: &Transaction<'_>, profiles: &Profiles, held: &mut Held) {
    let spans = profiles.serial_numbers(t);
    for (role, side) in [(Role::Request, t.request), (Role::Response, t.response)] {
        let Some(side) = side else { continue };
        let Some(offset) = held.offset_of(side.id) else { continue };
        let spans: Vec<_> = if side.damaged && profiles.asks_for_serial_number(t) {
            pieces(side)
        } else {
            spans.iter().filter(|(of, _)| *of == role).map(|(_, span)| span.clone()).collect()
        };
        change(offset, side.bytes.len(), &spans, profiles, held);
    }
}

/// Returns where letters and digits stand in a row in a damaged run.
fn pieces(side: Side<'_>) -> Vec<Range<usize>> {
    let mut pieces = Vec::new();
    let mut at = 0;
    while at < side.bytes.len() {
        let end = alphanumeric_from(side.bytes, at);
        if end - at >= LEAST_PIECE {
            pieces.push(at..end);
        }
        at = end + 1;
    }
    pieces
}

/// Returns where the letters and digits end that begin at `at`.
fn alphanumeric_from(bytes: &[u8], at: usize) -> usize {
    let rest = bytes.get(at..).unwrap_or_default();
    at + rest.iter().take_while(|byte| byte.is_ascii_alphanumeric()).count()
}

/// Joins spans that overlap: profiles that see the serial number at different places.
fn merged(spans: &[Range<usize>]) -> Vec<Range<usize>> {
    let mut spans = spans.to_vec();
    spans.sort_by_key(|span| span.start);
    let mut merged: Vec<Range<usize>> = Vec::new();
    for span in spans {
        match merged.last_mut() {
            Some(last) if span.start < last.end => last.end = last.end.max(span.end),
            _ => merged.push(span),
        }
    }
    merged
}

/// Blanks spans of a frame or run that is held, and mends its CRC, unless a span lies in it.
fn change(offset: u64, length: usize, spans: &[Range<usize>], profiles: &Profiles, held: &mut Held) {
    if spans.is_empty() {
        return;
    }
    let Some(bytes) = held.bytes_mut(offset, length) else { return };
    let body = length.saturating_sub(CRC);
    let before = crc::checksum(bytes.get(..body).unwrap_or_default());
    for span in merged(spans) {
        let Some(serial_number) = bytes.get_mut(span) else { continue };
        let told = |at: usize| profiles.telling_part(serial_number.get(at..).unwrap_or_default());
        let told = (0..serial_number.len()).map(|at| at..at + told(at)).find(|told| !told.is_empty());
        let told = told.unwrap_or_default();
        let rest =
            serial_number.iter_mut().enumerate().filter(|(at, byte)| !told.contains(at) && **byte != 0);
        rest.for_each(|(_, byte)| *byte = BLANK);
    }
    if spans.iter().all(|span| span.end <= body) {
        let after = crc::checksum(bytes.get(..body).unwrap_or_default());
        let mended = bytes.iter_mut().skip(body).zip((before ^ after).to_le_bytes());
        mended.for_each(|(byte, difference)| *byte ^= difference);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::chunk::{LostKind, ReadTime};
    use crate::device::{Devices, Environment};
    use crate::line::LineSettings;
    use crate::pipeline::Options;
    use crate::time::MILLISECOND;

    #[test]
    fn what_was_lost_stays_between_the_reads_where_it_was_lost() {
        let profiles = Arc::new(Profiles::built_in());
        let devices = Devices::new(Arc::clone(&profiles), Environment::default());
        let options = Options::new(LineSettings::default(), None);
        let pipeline = Pipeline::new(options, devices, profiles.shapes());
        let mut redactor = Redactor::new(pipeline, profiles);
        let lost = Lost { time: None, stream_offset: 8, kind: LostKind::Queue, count: 3 };
        let request = [0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41];
        for at in [0, 1] {
            let time = ReadTime::At(Timestamp::from_ns(at * 1000 * MILLISECOND));
            redactor.push(&Chunk { time, bytes: &request, line_errors: &[] });
            if at == 0 {
                redactor.push_lost(lost);
            }
        }
        redactor.finish();
        let mut order = Vec::new();
        while let Some(redacted) = redactor.pop() {
            order.push(match redacted {
                Redacted::Chunk(chunk) => Err(chunk.bytes.to_vec()),
                Redacted::Lost(lost) => Ok(lost),
                Redacted::Silence(_) | Redacted::Clock(..) => unreachable!("there was none"),
            });
        }
        assert_eq!(order, [Err(request.to_vec()), Ok(lost), Err(request.to_vec())]);
    }
}
