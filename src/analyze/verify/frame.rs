//! F: frames that are damaged, or that nobody should send.

use std::collections::BTreeMap;

use super::bus::Bus;
use super::catalogue::{F01, F02, F03, F04, F05, F06, L05, T08};
use super::finding::{Finding, Party};
use super::line::{end, sender};
use super::verifier::Found;
use super::{modbus, request};
use crate::decode::candidate::{candidates, has_known_length};
use crate::decode::crc::{self, Register};
use crate::decode::frame::{Boundary, Damaged, Frame, Reason, Role};
use crate::decode::shape::Shapes;
use crate::time::Timestamp;

/// Bytes up to which a byte is looked for that was lost or replaced: in longer runs chance would find one.
const MOST_SEARCHED: usize = 40;
/// How often that is done: it takes a while, and where so much is damaged, the next does not matter.
const MOST_SEARCHES: u32 = 1000;
/// How many bytes a frame has at least that has lost one.
const LEAST: usize = 4;
/// How many bytes more than an answer has are no talker of their own.
const MOST_STRAY: usize = 3;

/// What explains a damaged run, so that each kind folds by itself.
const FLIPPED: u32 = 1;
const ADDRESSED: u32 = 2;
const DOUBLED: u32 = 3;
const EXCHANGED: u32 = 4;
const REPLACED: u32 = 5;
const LOST: u32 = 6;
const SEVERAL: u32 = 7;
const NOISE: u32 = 8;

/// Pairs of addresses counted.
const MOST_PAIRS: usize = 1024;
/// How often a CRC has to fit the same other address to be built like that.
const HABIT: u64 = 3;
/// Frames and runs after which chance has had its chances.
const EARLY: u64 = 50;

/// Judges frames and damaged runs.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameRules {
    /// How often a CRC fitted another address: by the address on the wire, and the other.
    misfits: BTreeMap<(u8, u8), u64>,
    /// The last frame, when it is a request that waits for its answer.
    outstanding: Option<Due>,
    /// The last damaged run.
    before: Option<Before>,
    /// How many damaged runs there were apart from those in `misfits`.
    others: u64,
    /// How often a byte was looked for that may have been lost or replaced.
    searches: u32,
}

/// Is an answer that is due.
#[derive(Clone, Copy, Debug)]
struct Due {
    /// Where it begins in the stream, and how many bytes it has.
    offset: u64,
    length: usize,
}

/// Is a damaged run: what is right behind it may belong to it.
#[derive(Clone, Copy, Debug)]
struct Before {
    id: u64,
    /// Where it ends in the stream.
    end: u64,
    /// How many bytes the answer still has that was due there; `None` when none was.
    rest: Option<usize>,
    /// Whether one of its bytes came twice, so that the last of the frame is behind it.
    is_doubled: bool,
}

impl FrameRules {
    pub(super) fn frame(&mut self, frame: &Frame<'_>, bus: &Bus, found: &mut Found) {
        let place = &frame.place;
        if frame.role == Role::Request {
            let length = request::expected_answer(place.bytes);
            let offset = place.stream_offset + place.bytes.len() as u64;
            self.outstanding = length.map(|length| Due { offset, length });
        } else {
            self.outstanding = None;
        }
        let function = frame.function().without_exception().0;
        if frame.boundary == Boundary::Crc && !has_known_length(function) && frame.role != Role::Response {
            let message = format!("function {function} is neither the specification's nor a profile's");
            let finding = Finding::new(&F05, end(place), message).at(frame.address()).about(function);
            found.push_back(finding.shown_by([place.id]).within(1..2));
        }
        let address = frame.address();
        if address >= 248 && !bus.shapes.is_service_address(address) && frame.role == Role::Request {
            let message = format!("a request to {address}, which is reserved");
            let finding = Finding::new(&F06, end(place), message).at(address);
            found.push_back(finding.shown_by([place.id]).within(0..1));
        }
    }

    pub(super) fn damaged(&mut self, damaged: &Damaged<'_>, bus: &Bus, found: &mut Found) {
        let outstanding = self.outstanding.take();
        let place = &damaged.place;
        let bytes = place.bytes;
        let before = self.before.take().filter(|before| before.end == place.stream_offset);
        if damaged.reason == Reason::Stray {
            self.outstanding = outstanding; // the answer may still come
            return;
        }
        let due = outstanding.filter(|due| due.offset == place.stream_offset).map(|due| due.length);
        if let Some(before) = before.filter(|_| damaged.reason == Reason::Noise) {
            if before.is_doubled && bytes.len() == 1 {
                return; // its end
            }
            if let Some(finding) = before.rest.and_then(|rest| beyond(damaged, &before, rest)) {
                found.push_back(finding);
                return;
            }
        }
        if crc::is_good(bytes) && modbus::damaged(damaged, found) {
            return;
        }
        if outstanding.is_none() && request::missing_byte_count(damaged, bus, found) {
            return;
        }
        let finding = self.explain(damaged, due, bus);
        self.others += u64::from(finding.rule.code != F02.code && fitting_address(bytes).is_none());
        let is_doubled = finding.subject == DOUBLED && finding.rule.code == F01.code;
        self.before = Some(Before {
            id: place.id,
            end: place.stream_offset + bytes.len() as u64,
            rest: due.map(|due| due.saturating_sub(bytes.len())),
            is_doubled,
        });
        let crc_bytes = || bytes.len().checked_sub(2).map(|from| from..bytes.len());
        let span = finding.span.clone().or_else(crc_bytes);
        let is_crc = matches!(finding.rule.code, "F01" | "F02" | "F03");
        let address = finding.address.or(damaged.address);
        let finding = Finding { address, span: span.filter(|_| is_crc), ..finding };
        found.push_back(finding.shown_by([place.id]));
    }

    /// Explains a damaged run; `due` is how many bytes an answer has that is due where it begins.
    fn explain(&mut self, damaged: &Damaged<'_>, due: Option<usize>, bus: &Bus) -> Finding {
        let place = &damaged.place;
        let (bytes, time) = (place.bytes, end(place));
        if is_swapped(bytes) {
            let message = "the CRC is right with its two bytes swapped";
            return Finding::new(&F03, time, message).by(blamed(damaged.role));
        }
        let is_whole = match damaged.reason {
            Reason::Crc => true,
            Reason::Noise => has_shape(bytes, &bus.shapes),
            // A frame with a wrong bit is likelier than one that lost its tail and is as long as another.
            Reason::Truncated => {
                bytes.len() <= MOST_SEARCHED && has_shape(bytes, &bus.shapes) && flipped(bytes).is_some()
            }
            Reason::Stray => false,
        };
        let excess = due.map_or(0, |due| bytes.len().saturating_sub(due));
        let finding = match damaged.reason {
            _ if is_whole => self.bad_crc(damaged, bus),
            Reason::Truncated => self.truncated(damaged),
            // Noise may be a frame of which a byte came twice, or that lost one.
            _ => self
                .nearest(bytes, bus, time)
                .unwrap_or_else(|| Finding::new(&L05, time, noise(bytes)).about(NOISE)),
        };
        let is_explained = matches!(finding.rule.code, "F02") || finding.subject == DOUBLED;
        if excess > MOST_STRAY && !is_explained {
            let (count, due) = (bytes.len(), due.unwrap_or(0));
            return Finding::new(
                &T08,
                time,
                format!("{count} damaged bytes where an answer of {due} is due"),
            );
        }
        finding
    }

    /// Explains a CRC that does not fit.
    fn bad_crc(&mut self, damaged: &Damaged<'_>, bus: &Bus) -> Finding {
        let place = &damaged.place;
        let (bytes, time) = (place.bytes, end(place));
        let found = |subject: u32, message: String| {
            Finding::new(&F01, time, format!("the CRC is wrong; {message}")).about(subject)
        };
        if let Some((at, bit)) = flipped(bytes).filter(|(at, _)| *at > 0) {
            return found(FLIPPED, format!("it fits when bit {bit} of byte {at} is flipped"))
                .within(at..at + 1);
        }
        if let Some(other) = fitting_address(bytes) {
            let address = bytes.first().copied().unwrap_or_default();
            if self.is_habit(address, other, bus) {
                let message = format!("the CRC fits when the address is {other}, not {address}");
                let finding = Finding::new(&F02, time, message).by(blamed(damaged.role));
                return finding.at(address).about(other);
            }
            return found(ADDRESSED, format!("it fits when the address is {other}")).at(other).within(0..1);
        }
        if let Some(at) = doubled(bytes) {
            return found(DOUBLED, format!("it fits when byte {at} came twice")).within(at..at + 1);
        }
        if let Some(at) = exchanged(bytes) {
            let message = format!("it fits when bytes {at} and {} are exchanged", at + 1);
            return found(EXCHANGED, message).within(at..at + 2);
        }
        if let Some(at) = doubled_before_end(bytes) {
            return found(DOUBLED, format!("it fits when byte {at} came twice")).within(at..at + 1);
        }
        if self.may_search(bytes)
            && let Some((at, byte)) = fitting(bytes, 1).find(|(at, byte)| {
                let whole = [&bytes[..*at], &[*byte], &bytes[at + 1..]].concat(); // `at` is within
                has_shape(&whole, &bus.shapes)
            })
        {
            let message = format!("it fits when byte {at} is {byte:02x}");
            return found(REPLACED, message).within(at..at + 1);
        }
        found(SEVERAL, "several bytes are damaged".to_owned())
    }

    /// Explains noise that becomes a frame of a known unit without a byte that came twice, or with one that was lost
    /// or is another.
    fn nearest(&mut self, bytes: &[u8], bus: &Bus, time: Option<Timestamp>) -> Option<Finding> {
        let address = *bytes.first()?;
        let is_known = bus.frames_at.get(usize::from(address)).is_some_and(|frames| *frames > 0);
        if !is_known || bytes.len() < LEAST {
            return None;
        }
        let found = |subject: u32, message: String| {
            Finding::new(&F01, time, format!("the CRC is wrong; {message}")).about(subject).at(address)
        };
        let whole = |from: usize, bytes_between: &[u8], to: usize| {
            has_shape(&[&bytes[..from], bytes_between, &bytes[to..]].concat(), &bus.shapes) // both are within
        };
        if let Some(at) = doubled(bytes).filter(|&at| whole(at, &[], at + 1)) {
            return Some(found(DOUBLED, format!("it fits when byte {at} came twice")).within(at..at + 1));
        }
        if !self.may_search(bytes) {
            return None;
        }
        if let Some((at, _)) = fitting(bytes, 0).find(|(at, byte)| whole(*at, &[*byte], *at)) {
            let message = format!("it fits when a byte before byte {at} was lost");
            return Some(found(LOST, message).within(at - 1..at + 1));
        }
        let (at, byte) = fitting(bytes, 1).find(|(at, byte)| whole(*at, &[*byte], at + 1))?;
        Some(found(REPLACED, format!("it fits when byte {at} is {byte:02x}")).within(at..at + 1))
    }

    /// Tells whether it is worth to try all values of all bytes.
    fn may_search(&mut self, bytes: &[u8]) -> bool {
        self.searches = self.searches.saturating_add(1);
        bytes.len() <= MOST_SEARCHED && self.searches <= MOST_SEARCHES
    }

    /// Explains a frame that is too short: cut, or short of a byte inside.
    fn truncated(&mut self, damaged: &Damaged<'_>) -> Finding {
        let place = &damaged.place;
        let (bytes, time) = (place.bytes, end(place));
        let is_headless = bytes.first() != damaged.address.as_ref() || !begins_as(damaged);
        let who = if damaged.role == Role::Unknown { "frame" } else { damaged.role.name() };
        if is_headless {
            let message =
                format!("a {who} lost its head: with it the CRC fits; the driver may be enabled too late");
            return Finding::new(&F04, time, message).about(1_u8);
        }
        if !lacks_last(bytes)
            && self.may_search(bytes)
            && let Some((at, _)) = fitting(bytes, 0).next()
        {
            let message =
                format!("the CRC of a {who} is wrong; it fits when a byte before byte {at} was lost");
            return Finding::new(&F01, time, message).about(LOST).within(at - 1..at + 1);
        }
        let message = format!(
            "a {who} lost its tail after {} bytes; the driver may be disabled too early",
            bytes.len()
        );
        Finding::new(&F04, time, message)
    }

    /// Counts a CRC that fits another address; tells whether the sender builds it like that.
    fn is_habit(&mut self, address: u8, other: u8, bus: &Bus) -> bool {
        let pair = (address, other);
        if self.misfits.len() < MOST_PAIRS || self.misfits.contains_key(&pair) {
            *self.misfits.entry(pair).or_default() += 1;
        }
        let count = self.misfits.get(&pair).copied().unwrap_or(1);
        // Where nothing else is damaged chance is no explanation; a single bit may be.
        if self.others == 0
            && self.misfits.len() == 1
            && count > u64::from((address ^ other).is_power_of_two())
        {
            return true;
        }
        let at = |address: u8| bus.frames_at.get(usize::from(address)).copied().unwrap_or(0);
        match (at(address), at(other)) {
            // Early on, or again: many damaged bytes fit some address by chance.
            (0, 0) => count > 1 || bus.next_id < EARLY && (address ^ other).count_ones() > 1,
            // A damaged address byte hits the same value once in many frames.
            (0, others) => count >= HABIT && count.saturating_mul(100) >= others,
            _ => false,
        }
    }
}

/// Judges what stands right behind a damaged answer, beyond what that still has.
fn beyond(damaged: &Damaged<'_>, before: &Before, rest: usize) -> Option<Finding> {
    let place = &damaged.place;
    let count = place.bytes.len().checked_sub(rest).filter(|count| *count > 0)?;
    let more = if count == 1 { "a byte".to_owned() } else { format!("{count} bytes") };
    let (rule, subject, message) = if count <= MOST_STRAY {
        (&L05, NOISE, format!("{more} more than the answer has, right behind it, which is damaged"))
    } else {
        (&T08, 0, format!("{more} more than the answer has, which is damaged: several may talk at once"))
    };
    let finding = Finding::new(rule, end(place), message).about(subject).shown_by([before.id, place.id]);
    Some(Finding { address: damaged.address, ..finding })
}

/// Tells whether bytes have the length that their header asks for.
fn has_shape(bytes: &[u8], shapes: &Shapes) -> bool {
    candidates(bytes, shapes).as_slice().iter().any(|form| usize::from(form.length) == bytes.len())
}

/// Returns who built a frame with a CRC that is wrong on purpose, so to say.
fn blamed(role: Role) -> Party {
    if role == Role::Response { sender(role) } else { Party::Master }
}

fn begins_as(damaged: &Damaged<'_>) -> bool {
    damaged.place.bytes.get(1).copied() == damaged.function.map(|function| function.0)
}

fn noise(bytes: &[u8]) -> String {
    let count = bytes.len();
    if count == 1 {
        "a byte belongs to no frame".to_owned()
    } else {
        format!("{count} bytes belong to no frame")
    }
}

fn is_swapped(bytes: &[u8]) -> bool {
    let [body @ .., low, high] = bytes else { return false };
    body.len() >= 2 && low != high && Register::NEW.after(body).after(&[*high, *low]).is_zero()
}

/// Returns the address with which the CRC fits.
fn fitting_address(bytes: &[u8]) -> Option<u8> {
    let (own, rest) = bytes.split_first()?;
    (0..=255).find(|address| address != own && Register::NEW.after(&[*address]).after(rest).is_zero())
}

/// Returns the byte and bit that, flipped, make the CRC fit.
fn flipped(bytes: &[u8]) -> Option<(usize, u32)> {
    let mut copy = bytes.to_vec();
    for at in 0..copy.len() {
        for bit in 0..8 {
            copy[at] ^= 1 << bit; // `at` is within
            if crc::checksum(&copy) == 0 {
                return Some((at, bit));
            }
            copy[at] ^= 1 << bit;
        }
    }
    None
}

/// Returns the byte that, left out, makes the CRC fit, and is like the one before.
fn doubled(bytes: &[u8]) -> Option<usize> {
    let without = |at: usize| Register::NEW.after(&bytes[..at]).after(&bytes[at + 1..]).is_zero();
    (1..bytes.len()).find(|&at| bytes[at] == bytes[at - 1] && without(at)) // `at` is within
}

/// Returns the byte that, exchanged with the next, makes the CRC fit.
fn exchanged(bytes: &[u8]) -> Option<usize> {
    let swapped = |at: usize| {
        let (before, pair, after) = (&bytes[..at], [bytes[at + 1], bytes[at]], &bytes[at + 2..]);
        Register::NEW.after(before).after(&pair).after(after).is_zero()
    };
    (0..bytes.len().saturating_sub(1)).find(|&at| bytes[at] != bytes[at + 1] && swapped(at)) // both are within
}

/// Returns the byte that came twice in a frame whose last byte is behind: the CRC's first byte fits without it.
fn doubled_before_end(bytes: &[u8]) -> Option<usize> {
    (1..bytes.len()).find(|&at| {
        bytes[at] == bytes[at - 1] && lacks_last(&[&bytes[..at], &bytes[at + 1..]].concat()) // `at` is within
    })
}

/// Tells whether bytes are a frame but for its last byte.
fn lacks_last(bytes: &[u8]) -> bool {
    let Some((low, body)) = bytes.split_last() else { return false };
    body.len() >= 2 && crc::checksum(body).to_le_bytes()[0] == *low
}

/// Returns bytes with which the CRC fits, and where: in place of `replaced` bytes, 0 or 1.
fn fitting(bytes: &[u8], replaced: usize) -> impl Iterator<Item = (usize, u8)> {
    (1..bytes.len()).flat_map(move |at| {
        let before = Register::NEW.after(&bytes[..at]); // `at` is within
        let fits = move |byte: &u8| before.after(&[*byte]).after(&bytes[at + replaced..]).is_zero();
        (0..=255).filter(fits).map(move |byte| (at, byte))
    })
}
