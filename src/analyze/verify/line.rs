//! L: silences, and what UART and host reported.

use std::collections::BTreeMap;

use super::bus::{Bus, Crossed};
use super::catalogue::{L01, L02, L03, L04, L05, L06, L07, T02};
use super::finding::{Finding, Party, Severity};
use super::verifier::Found;
use crate::decode::chunk::{LineErrorKind, Lost};
use crate::decode::frame::{Damaged, Frame, Place, Reason, Role};
use crate::decode::stamp::Stamper;
use crate::line::{LineSettings, Parity, StopBits};
use crate::time::{MILLISECOND, SECOND, Timestamp};

/// Nanoseconds by which a host or listener may be late without anybody knowing.
const MOST_STALL_NS: i64 = 50 * MILLISECOND;
/// After so many frames the estimate of an adapter's granularity is worth saying.
const SETTLED: u32 = 64;
/// Places in frames at which pauses are counted.
const MOST_PLACES: usize = 1024;
/// How often a pause has to come at the same place, and in which part of the frames, to be no stall of the host.
const REPEATED: (u32, u32) = (4, 4);

/// Judges silences and line errors.
#[derive(Clone, Debug)]
pub(super) struct LineRules {
    line: LineSettings,
    /// t1.5 of 11-bit characters and t3.5 of 10-bit ones, in nanoseconds.
    longest_inside: i64,
    shortest_between: i64,
    has_said_granularity: bool,
    frames: u32,
    /// Frames and damaged runs without line errors, and with them.
    reported: [u64; 2],
    /// Requests, and echoes of requests.
    requests: [u64; 2],
    /// Stream offset after the last frame.
    frame_end: Option<u64>,
    /// Pauses by address, role, length and place: how many, of how many frames.
    pauses: BTreeMap<(u8, u8, usize, usize), u32>,
    kinds: BTreeMap<(u8, u8, usize), u32>,
}

impl LineRules {
    pub(super) fn new(line: LineSettings) -> Self {
        let bits = |half_bits: i64| half_bits * SECOND / (2 * i64::from(line.baud.max(1)));
        LineRules {
            line,
            longest_inside: if line.baud <= 19_200 { bits(33) } else { line.t1_5_ns() },
            shortest_between: bits(70),
            has_said_granularity: false,
            frames: 0,
            reported: [0; 2],
            requests: [0; 2],
            frame_end: None,
            pauses: BTreeMap::new(),
            kinds: BTreeMap::new(),
        }
    }

    pub(super) fn frame(&mut self, frame: &Frame<'_>, stamper: &Stamper, bus: &mut Bus, found: &mut Found) {
        let place = &frame.place;
        self.errors(place, Some(frame.address()), found);
        self.echo(frame, found);
        if stamper.has_times() {
            self.granularity(place, stamper, found);
            self.inside(frame, stamper, found);
            if self.frame_end == Some(place.stream_offset) && !frame.echo {
                self.between(frame, stamper, bus, found);
            }
        }
        self.frame_end = Some(place.stream_offset + place.bytes.len() as u64);
    }

    pub(super) fn damaged(&mut self, damaged: &Damaged<'_>, found: &mut Found) {
        let place = &damaged.place;
        self.errors(place, None, found);
        if damaged.reason == Reason::Stray {
            let finding = Finding::new(&L05, end(place), stray(place.bytes));
            found.push_back(finding.shown_by([place.id]));
        }
    }

    pub(super) fn lost(&mut self, lost: &Lost, found: &mut Found) {
        let count = match lost.count {
            0 => "bytes".to_owned(),
            1 => "1 byte".to_owned(),
            count => format!("{count} bytes"),
        };
        let message =
            format!("{count} lost before byte {} of the stream: {}", lost.stream_offset, lost.kind.name());
        found.push_back(Finding::new(&L07, lost.time, message).about(lost.kind as u8));
    }

    /// Passes on echoes, once most requests have one.
    fn echo(&mut self, frame: &Frame<'_>, found: &mut Found) {
        if frame.role != Role::Request {
            return;
        }
        let [requests, echoes] = &mut self.requests;
        *requests += u64::from(!frame.echo);
        *echoes += u64::from(frame.echo);
        if frame.echo && *echoes >= 3 && echoes.saturating_mul(2) >= *requests {
            let place = &frame.place;
            let message =
                format!("the request of frame {} came again as an echo", place.id.saturating_sub(1));
            let finding = Finding::new(&L06, end(place), message).at(frame.address()).about(0_u8);
            found.push_back(finding.shown_by([place.id]));
        }
    }

    /// Says once how coarsely the adapter hands over.
    fn granularity(&mut self, place: &Place<'_>, stamper: &Stamper, found: &mut Found) {
        self.frames = self.frames.saturating_add(1);
        if self.has_said_granularity || (!stamper.is_hold_known() && self.frames < SETTLED) {
            return;
        }
        let hold = stamper.hold_ns();
        let hidden = match (hold > self.longest_inside, hold > self.shortest_between) {
            (_, true) => "t1.5 and t3.5",
            (true, false) => "t1.5",
            (false, false) if stamper.is_hold_known() => {
                self.has_said_granularity = true;
                return;
            }
            (false, false) => return,
        };
        self.has_said_granularity = true;
        let known = if stamper.is_hold_known() {
            "keeps bytes back for up to"
        } else {
            "seems to keep bytes back for"
        };
        let message = format!("the adapter {known} {}: {hidden} cannot be measured", milliseconds(hold));
        found.push_back(Finding::new(&L03, end(place), message).shown_by([place.id]));
    }

    /// Looks for a silence inside a frame that is certainly too long.
    fn inside(&mut self, frame: &Frame<'_>, stamper: &Stamper, found: &mut Found) {
        let Some(time) = frame.place.time.filter(|_| stamper.is_hold_known()) else { return };
        let length = frame.place.bytes.len();
        // A silence that is certain makes the frame certainly longer.
        let character = stamper.character_ns();
        let duration = time.end.earliest - time.start.latest;
        let is_long = duration > character.saturating_mul(length as i64).saturating_add(self.longest_inside);
        let kind = (frame.address(), frame.role as u8, length);
        if self.kinds.len() < MOST_PLACES || self.kinds.contains_key(&kind) {
            *self.kinds.entry(kind).or_default() += 1;
        }
        if !is_long {
            return;
        }
        let pause = (1..length).find_map(|at| {
            let gap = stamper.gap_before(frame.place.stream_offset + at as u64)?;
            (gap.least > self.longest_inside).then_some((at, gap))
        });
        let Some((at, gap)) = pause else { return };
        let is_proven = gap.least > self.longest_inside + MOST_STALL_NS || self.is_proven(frame, stamper);
        if !is_proven && !self.is_repeated(kind, at) {
            return;
        }
        let message = format!(
            "{} ±{} of silence before byte {at} of a {} of {length} bytes; at most {} is allowed",
            milliseconds(gap.midpoint()),
            milliseconds(gap.half_width()),
            frame.role.name(),
            milliseconds(self.longest_inside),
        );
        let finding =
            Finding::new(&L01, end(&frame.place), message).at(frame.address()).by(sender(frame.role));
        found.push_back(finding.shown_by([frame.place.id]).within(at - 1..at + 1));
    }

    /// Tells whether bytes of a frame are farther apart than allowed silences make them, even if the host stalled.
    fn is_proven(&self, frame: &Frame<'_>, stamper: &Stamper) -> bool {
        let step = stamper.character_ns().saturating_add(self.longest_inside);
        let bytes: Vec<_> = (0..frame.place.bytes.len() as u64)
            .filter_map(|at| stamper.byte(frame.place.stream_offset + at))
            .collect();
        // Each byte against the one before it that has the least time to spare.
        let mut tightest: Option<Timestamp> = None;
        bytes.iter().enumerate().any(|(at, byte)| {
            let allowed = step.saturating_mul(at as i64);
            let is_late = tightest.is_some_and(|from| byte.certain - allowed > from);
            let own = byte.latest - allowed;
            tightest = Some(tightest.map_or(own, |from| from.min(own)));
            is_late
        })
    }

    /// Counts a pause; tells whether it comes at the same place so often that no host stalls like that.
    fn is_repeated(&mut self, kind: (u8, u8, usize), at: usize) -> bool {
        let key = (kind.0, kind.1, kind.2, at);
        if self.pauses.len() >= MOST_PLACES && !self.pauses.contains_key(&key) {
            return false;
        }
        let count = self.pauses.entry(key).or_default();
        *count += 1;
        let frames = self.kinds.get(&kind).copied().unwrap_or(u32::MAX);
        *count >= REPEATED.0 && count.saturating_mul(REPEATED.1) >= frames
    }

    /// Looks whether the silence before a frame is certainly too short.
    fn between(&mut self, frame: &Frame<'_>, stamper: &Stamper, bus: &mut Bus, found: &mut Found) {
        let Some(gap) = stamper.gap_before(frame.place.stream_offset) else { return };
        let fixed = self.line.t3_5_ns();
        let severity = if gap.most < self.shortest_between {
            Severity::Error
        } else if self.line.baud > 19_200 && gap.most < fixed {
            Severity::Note
        } else {
            return;
        };
        if let Some(finding) = crossed(frame, bus).filter(|_| severity == Severity::Error) {
            found.push_back(finding);
            return;
        }
        let least = if severity == Severity::Error { self.shortest_between } else { fixed };
        let message = format!(
            "at most {} of silence before a {}; at least {} is due",
            milliseconds(gap.most),
            frame.role.name(),
            milliseconds(least),
        );
        let finding =
            Finding::new(&L02, end(&frame.place), message).at(frame.address()).by(sender(frame.role));
        let finding =
            Finding { severity, ..finding.shown_by([frame.place.id.saturating_sub(1), frame.place.id]) };
        found.push_back(finding);
    }

    /// Passes on what the UART reported.
    fn errors(&mut self, place: &Place<'_>, address: Option<u8>, found: &mut Found) {
        self.reported[usize::from(!place.line_errors.is_empty())] += 1;
        let (Some(first), Some(last)) = (place.line_errors.first(), place.line_errors.last()) else { return };
        let mut kinds: Vec<&'static str> = place.line_errors.iter().map(|error| error.kind.name()).collect();
        kinds.dedup();
        let (count, length) = (place.line_errors.len(), place.bytes.len());
        let bytes = if count == 1 { "byte" } else { "bytes" };
        let is_overrun = first.kind == LineErrorKind::Overrun;
        // Where most is received well the settings are right, and something else disturbs.
        let [well, badly] = self.reported;
        let advice = if is_overrun || well > badly { String::new() } else { self.other_settings() };
        let message = format!("{} at {count} {bytes} of {length}{advice}", kinds.join(" and "));
        let rule = if is_overrun { &L07 } else { &L04 };
        let (from, to) = (first.offset as usize, last.offset as usize + 1);
        let finding =
            Finding::new(rule, end(place), message).shown_by([place.id]).about(u8::from(is_overrun));
        let finding = finding.within(from.min(length)..to.min(length));
        found.push_back(Finding { address, ..finding });
    }

    /// Names other settings that the talkers may have.
    fn other_settings(&self) -> String {
        let parity = match self.line.parity {
            Parity::None => return "; the talkers may send parity, such as 8E1".to_owned(),
            Parity::Even => Parity::Odd,
            _ => Parity::Even,
        };
        let other = LineSettings { parity, ..self.line };
        let none = LineSettings { parity: Parity::None, stop_bits: StopBits::Two, ..self.line };
        format!("; the talkers may use {other} or {none}")
    }
}

/// Finds an answer that comes right behind a repetition of its request: nobody answers that fast.
fn crossed(frame: &Frame<'_>, bus: &mut Bus) -> Option<Finding> {
    let mut requests = bus.requests.iter().rev();
    let (again, first) = (requests.next()?, requests.next()?);
    let id = frame.place.id;
    if frame.role != Role::Response || [first.id + 2, again.id + 1] != [id; 2] || first.bytes != again.bytes {
        return None;
    }
    let latency = first.time.zip(frame.place.time).map(|(asked, answer)| asked.end.until(answer.start));
    let after =
        latency.map_or_else(String::new, |latency| format!(" {} after it", milliseconds(latency.midpoint())));
    let message = format!("the answer to a request came{after}, when the master had just asked again");
    let finding = Finding::new(&T02, end(&frame.place), message).at(frame.address());
    let finding = finding.shown_by([first.id, again.id, id]);
    bus.crossed = Some(Crossed { request: first.id, response: id });
    Some(finding)
}

fn stray(bytes: &[u8]) -> String {
    let hex: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let count = if bytes.len() == 1 { "a byte belongs" } else { "bytes belong" };
    let kind = if bytes.iter().all(|byte| matches!(byte, 0x00 | 0xFF)) {
        ", as bias or drivers make them"
    } else {
        ""
    };
    format!("{count} to no frame, beside one: {}{kind}", hex.join(" "))
}

pub(super) fn end(place: &Place<'_>) -> Option<Timestamp> {
    Some(place.time?.end.midpoint())
}

/// Returns who sends frames of a role; where it is not known, the line is to blame.
pub(super) fn sender(role: Role) -> Party {
    match role {
        Role::Request => Party::Master,
        Role::Response => Party::Device,
        Role::Unknown => Party::Line,
    }
}

/// Writes a length of time in milliseconds, to a hundredth.
pub(super) fn milliseconds(ns: i64) -> String {
    format!("{:.2} ms", ns as f64 / MILLISECOND as f64)
}

/// Writes a length of time in seconds, to a hundredth.
pub(super) fn seconds(ns: i64) -> String {
    format!("{:.2} s", ns as f64 / SECOND as f64)
}
