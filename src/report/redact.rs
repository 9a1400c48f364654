//! Blanks serial numbers in the reads themselves, so that whatever is decoded from them has none.
//!
//! A serial number keeps what tells the maker and the kind of device, for the decode rests on it; the rest
//! becomes `X`. Where one lies is known from the profiles; a maker's prefix gives away those that no profile
//! explains, such as an answer without its request; and what is known from anywhere in a recording is found
//! everywhere in it, also a piece of it. In a damaged run letters and digits in a row are taken for such a piece.
//! The CRC is changed by what the change does to it: a good
//! frame stays good, a damaged one stays damaged in the same way.

mod secrets;

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::sync::Arc;

use super::held::{Held, Released};
use crate::decode::chunk::{Chunk, Lost};
use crate::decode::crc;
use crate::decode::frame::{Damaged, Frame, Place, Role};
use crate::decode::transaction::Transaction;
use crate::device::Profiles;
use crate::pipeline::{Event, Pipeline};
use crate::time::Timestamp;
pub use secrets::Secrets;
use secrets::{PIECE, alphanumeric_from, blank_number, merged, prefixed};

/// Says in a file what was done to it.
pub const REMARK: &str = "redacted: serial numbers are blanked with X, and CRCs mended";
/// What columns and facts are called that say what was done to a file.
pub const REMARK_KEY: &str = "remark";
/// Takes the place of each blanked character.
const BLANK: u8 = b'X';
/// Letters and digits in a row that may be a piece of a serial number where one is to be expected.
const LEAST_PIECE: usize = 3;
/// What the fact is called that is the serial number of a USB adapter.
const USB_SERIAL: &str = "usb_serial";
/// Bytes of a CRC.
const CRC: usize = 2;

/// Blanks the serial numbers in the reads of one bus; a read comes out once all its frames are known.
#[derive(Clone)]
pub struct Redactor {
    pipeline: Pipeline,
    profiles: Arc<Profiles>,
    secrets: Arc<Secrets>,
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
    /// A read without its serial numbers, and when its bytes were first there, where that is known.
    Chunk(Chunk<'a>, Option<Timestamp>),
    /// Bytes were lost here.
    Lost(Lost),
    /// Nothing was received until then.
    Silence(Timestamp),
    /// The monotonic clock, in nanoseconds, and the wall clock showed this.
    Clock(u64, Timestamp),
}

impl Redactor {
    /// Makes a redactor that finds serial numbers by a pipeline of its own, beside those known beforehand.
    pub fn new(pipeline: Pipeline, profiles: Arc<Profiles>, secrets: Arc<Secrets>) -> Self {
        let marks = VecDeque::new();
        Redactor { pipeline, profiles, secrets, held: Held::default(), marks, taken: 0, given: 0 }
    }

    /// Takes a read; `ready` is when its bytes were first there, where that is known.
    pub fn push(&mut self, chunk: &Chunk<'_>, ready: Option<Timestamp>) {
        self.held.push(chunk, ready);
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
        let Released { chunk, ready, .. } = self.held.pop()?;
        self.given += chunk.bytes.len() as u64;
        Some(Redacted::Chunk(chunk, ready))
    }

    fn blank(&mut self) {
        let Redactor { pipeline, profiles, secrets, held, .. } = self;
        while let Some(event) = pipeline.poll_event() {
            match &event {
                Event::Frame(Frame { place, .. }) => {
                    let body = place.bytes.len().saturating_sub(CRC);
                    blank_run(place, body, Vec::new(), (profiles, secrets), held);
                }
                // What stands where a CRC should may be a piece as well.
                Event::Damaged(Damaged { place, .. }) => {
                    let pieces = stray_pieces(place.bytes);
                    blank_run(place, place.bytes.len(), pieces, (profiles, secrets), held);
                }
                Event::Transaction { transaction, .. } => blank_transaction(transaction, profiles, held),
                _ => {}
            }
        }
    }
}

/// Learns the serial numbers of a recording before any of it is written: those that good frames say.
pub struct Survey {
    profiles: Arc<Profiles>,
    secrets: Secrets,
}

impl Survey {
    /// Begins a survey; the profiles say where serial numbers lie.
    pub fn new(profiles: Arc<Profiles>) -> Self {
        Survey { profiles, secrets: Secrets::default() }
    }

    /// Takes what is known of a bus and its adapter.
    pub fn facts(&mut self, facts: &BTreeMap<String, String>) {
        facts.get(USB_SERIAL).into_iter().for_each(|number| self.secrets.note(number.as_bytes()));
    }

    /// Takes an event.
    pub fn event(&mut self, event: &Event<'_>) {
        match event {
            Event::Frame(Frame { place, .. }) => {
                let body = place.bytes.get(..place.bytes.len().saturating_sub(CRC)).unwrap_or_default();
                prefixed(body, &self.profiles).for_each(|(_, span)| self.secrets.note(&body[span]));
            }
            Event::Transaction { transaction: t, .. } => {
                for (role, span) in self.profiles.serial_numbers(t) {
                    let side = if role == Role::Request { t.request } else { t.response };
                    let number = side.filter(|side| !side.damaged).and_then(|side| side.bytes.get(span));
                    number.into_iter().for_each(|number| self.secrets.note(number));
                }
            }
            _ => {}
        }
    }

    /// Returns what was learnt.
    pub fn finish(self) -> Secrets {
        self.secrets
    }
}

/// Blanks serial numbers in what is known of a bus: that of its adapter, which names of devices may have in them, and
/// those that its master or whoever recorded it gave to other things.
pub fn blank_settings(
    name: &mut String,
    facts: &mut BTreeMap<String, String>,
    profiles: &Profiles,
    secrets: &Secrets,
) {
    blank_facts(facts);
    *name = secrets.blank(name, profiles);
    facts.values_mut().for_each(|fact| *fact = secrets.blank(fact, profiles));
}

/// Blanks the serial number of a bus's adapter in what is known of it: names of devices may have it in them.
fn blank_facts(facts: &mut BTreeMap<String, String>) {
    let Some(serial_number) = facts.get(USB_SERIAL).cloned().filter(|text| !text.is_empty()) else {
        return;
    };
    let blank = "X".repeat(serial_number.chars().count());
    // Of the others, those that may be paths under /dev/serial/by-id.
    for key in [USB_SERIAL, "source", "device"] {
        if let Some(fact) = facts.get_mut(key) {
            *fact = fact.replace(&serial_number, &blank);
        }
    }
}

/// Blanks in the first `length` bytes of a frame or run these spans, what a maker's prefix gives away, and what is
/// known from elsewhere.
fn blank_run(
    place: &Place<'_>,
    length: usize,
    mut spans: Vec<Range<usize>>,
    (profiles, secrets): (&Profiles, &Secrets),
    held: &mut Held,
) {
    held.note(place);
    let body = place.bytes.get(..length).unwrap_or_default();
    spans.extend(prefixed(body, profiles).map(|(_, span)| span));
    spans.extend(secrets.known_in(body));
    change(place.stream_offset, place.bytes.len(), &spans, profiles, held);
}

fn blank_transaction(t: &Transaction<'_>, profiles: &Profiles, held: &mut Held) {
    let spans = profiles.serial_numbers(t);
    for (role, side) in [(Role::Request, t.request), (Role::Response, t.response)] {
        let Some(side) = side else { continue };
        let Some(offset) = held.offset_of(side.id) else { continue };
        let spans: Vec<_> = if side.damaged && profiles.asks_for_serial_number(t) {
            rows(side.bytes, LEAST_PIECE)
        } else {
            spans.iter().filter(|(of, _)| *of == role).map(|(_, span)| span.clone()).collect()
        };
        change(offset, side.bytes.len(), &spans, profiles, held);
    }
}

/// Returns where pieces of a serial number may stand in a damaged run of which nothing is known.
///
/// A row of five letters and digits is hardly ever anything else, nor is one of three that the end of the run cut off;
/// where there is one, the shorter ones beside it are taken for what damage left of the same.
fn stray_pieces(bytes: &[u8]) -> Vec<Range<usize>> {
    let rows = rows(bytes, LEAST_PIECE);
    let is_piece = |row: &Range<usize>| row.len() >= PIECE || row.start == 0 || row.end == bytes.len();
    if rows.iter().any(is_piece) { rows } else { Vec::new() }
}

/// Returns where so many letters and digits stand in a row, or more.
fn rows(bytes: &[u8], least: usize) -> Vec<Range<usize>> {
    let mut rows = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let end = alphanumeric_from(bytes, at);
        if end - at >= least {
            rows.push(at..end);
        }
        at = end + 1;
    }
    rows
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
        blank_number(bytes.get_mut(span).unwrap_or_default(), profiles);
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
        let mut redactor = Redactor::new(pipeline, profiles, Arc::default());
        let lost = Lost { time: None, stream_offset: 8, kind: LostKind::Queue, count: 3 };
        let request = [0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41];
        for at in [0, 1] {
            let time = ReadTime::At(Timestamp::from_ns(at * 1000 * MILLISECOND));
            redactor.push(&Chunk { time, bytes: &request, line_errors: &[] }, None);
            if at == 0 {
                redactor.push_lost(lost);
            }
        }
        redactor.finish();
        let mut order = Vec::new();
        while let Some(redacted) = redactor.pop() {
            order.push(match redacted {
                Redacted::Chunk(chunk, _) => Err(chunk.bytes.to_vec()),
                Redacted::Lost(lost) => Ok(lost),
                Redacted::Silence(_) | Redacted::Clock(..) => unreachable!("there was none"),
            });
        }
        assert_eq!(order, [Err(request.to_vec()), Ok(lost), Err(request.to_vec())]);
    }
}
