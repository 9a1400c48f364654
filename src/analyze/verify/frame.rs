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

/// Bytes up to which a lost byte is looked for: in longer runs chance would find one.
const MOST_SEARCHED: usize = 40;

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
    outstanding: Option<(u64, usize)>,
    /// Id and end, in the stream, of a damaged run where an answer was due, and how many bytes that still has.
    damaged_answer: Option<(u64, u64, usize)>,
}

impl FrameRules {
    pub(super) fn frame(&mut self, frame: &Frame<'_>, bus: &Bus, found: &mut Found) {
        let place = &frame.place;
        if frame.role == Role::Request {
            let length = request::expected_answer(place.bytes);
            self.outstanding = length.map(|length| (place.stream_offset + place.bytes.len() as u64, length));
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
        let damaged_answer = self.damaged_answer.take();
        let place = &damaged.place;
        let bytes = place.bytes;
        if damaged.reason == Reason::Stray {
            self.outstanding = outstanding; // the answer may still come
            return;
        }
        let end_offset = place.stream_offset + bytes.len() as u64;
        let is_answer = outstanding.is_some_and(|(offset, _)| offset == place.stream_offset);
        let expected = outstanding.filter(|_| is_answer).map(|(_, length)| length);
        self.damaged_answer =
            expected.map(|expected| (place.id, end_offset, expected.saturating_sub(bytes.len())));
        let before =
            damaged_answer.filter(|(_, end, rest)| *end == place.stream_offset && bytes.len() > *rest);
        if let Some((answer, ..)) = before.filter(|_| damaged.reason == Reason::Noise) {
            let message = format!("{} more damaged bytes right behind a damaged answer", bytes.len());
            let finding = Finding::new(&T08, end(place), message).shown_by([answer, place.id]);
            found.push_back(Finding { address: damaged.address, ..finding });
            return;
        }
        if crc::is_good(bytes) && modbus::damaged(damaged, found) {
            return;
        }
        if outstanding.is_none() && request::missing_byte_count(damaged, bus, found) {
            return;
        }
        let finding = match damaged.reason {
            _ if is_swapped(bytes) => {
                Finding::new(&F03, end(place), "the CRC is right with its two bytes swapped")
                    .by(blamed(damaged.role))
            }
            Reason::Crc => self.bad_crc(damaged, bus),
            Reason::Noise if has_shape(bytes, &bus.shapes) => self.bad_crc(damaged, bus),
            Reason::Truncated => truncated(damaged),
            Reason::Stray | Reason::Noise => Finding::new(&L05, end(place), noise(bytes)).about(1_u8),
        };
        let is_explained = std::ptr::eq(finding.rule, &F03) || std::ptr::eq(finding.rule, &F02);
        let finding = match expected {
            Some(expected) if bytes.len() > expected && !is_explained && doubled(bytes).is_none() => {
                let message = format!("{} damaged bytes where an answer of {expected} is due", bytes.len());
                Finding::new(&T08, end(place), message)
            }
            _ => finding,
        };
        let crc_bytes = || bytes.len().checked_sub(2).map(|from| from..bytes.len());
        let span = finding.span.clone().or_else(crc_bytes);
        let is_crc = matches!(finding.rule.code, "F01" | "F02" | "F03");
        let finding = Finding { address: damaged.address, span: span.filter(|_| is_crc), ..finding };
        found.push_back(finding.shown_by([place.id]));
    }

    /// Explains a CRC that does not fit.
    fn bad_crc(&mut self, damaged: &Damaged<'_>, bus: &Bus) -> Finding {
        let place = &damaged.place;
        let (bytes, time) = (place.bytes, end(place));
        let flipped = flipped(bytes);
        if let Some((at, bit)) = flipped.filter(|(at, _)| *at > 0) {
            let message = format!("the CRC is wrong; it fits when bit {bit} of byte {at} is flipped");
            return Finding::new(&F01, time, message).within(at..at + 1);
        }
        if let Some(other) = fitting_address(bytes) {
            let address = bytes.first().copied().unwrap_or_default();
            if self.is_habit(address, other, bus) {
                let message = format!("the CRC fits when the address is {other}, not {address}");
                return Finding::new(&F02, time, message).by(blamed(damaged.role)).about(other);
            }
            let message = format!("the CRC is wrong; it fits when the address is {other}");
            return Finding::new(&F01, time, message).within(0..1);
        }
        if let Some(at) = doubled(bytes) {
            return Finding::new(&F01, time, format!("the CRC is wrong; it fits when byte {at} came twice"))
                .within(at..at + 1);
        }
        if let Some(at) = exchanged(bytes) {
            let message = format!("the CRC is wrong; it fits when bytes {at} and {} are exchanged", at + 1);
            return Finding::new(&F01, time, message).within(at..at + 2);
        }
        let nearest = match lost(bytes) {
            Some(at) => format!("it fits when a byte before byte {at} was lost"),
            None => "several bytes are damaged".to_owned(),
        };
        Finding::new(&F01, time, format!("the CRC is wrong; {nearest}"))
    }

    /// Counts a CRC that fits another address; tells whether the sender builds it like that.
    fn is_habit(&mut self, address: u8, other: u8, bus: &Bus) -> bool {
        let pair = (address, other);
        if self.misfits.len() < MOST_PAIRS || self.misfits.contains_key(&pair) {
            *self.misfits.entry(pair).or_default() += 1;
        }
        let count = self.misfits.get(&pair).copied().unwrap_or(1);
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

/// Tells whether bytes have the length that their header asks for.
fn has_shape(bytes: &[u8], shapes: &Shapes) -> bool {
    candidates(bytes, shapes).as_slice().iter().any(|form| usize::from(form.length) == bytes.len())
}

/// Returns who built a frame with a CRC that is wrong on purpose, so to say.
fn blamed(role: Role) -> Party {
    if role == Role::Response { sender(role) } else { Party::Master }
}

fn truncated(damaged: &Damaged<'_>) -> Finding {
    let place = &damaged.place;
    let is_headless = place.bytes.first() != damaged.address.as_ref() || !begins_as(damaged);
    let role = damaged.role.name();
    let who = if damaged.role == Role::Unknown { "frame" } else { role };
    let message = match is_headless {
        true => format!("a {who} lost its head: with it the CRC fits; the driver may be enabled too late"),
        false => format!(
            "a {who} lost its tail after {} bytes; the driver may be disabled too early",
            place.bytes.len()
        ),
    };
    Finding::new(&F04, end(place), message).about(u8::from(is_headless))
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

/// Returns before which byte one may have been lost.
fn lost(bytes: &[u8]) -> Option<usize> {
    if bytes.len() > MOST_SEARCHED {
        return None;
    }
    (1..bytes.len()).find(|&at| {
        let before = Register::NEW.after(&bytes[..at]); // `at` is within
        (0..=255).any(|byte| before.after(&[byte]).after(&bytes[at..]).is_zero())
    })
}
