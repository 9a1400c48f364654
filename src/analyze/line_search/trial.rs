//! Line settings that are listened with for a while, and what shows whether they are right.

use std::sync::Arc;

use super::pace::QUIET_NS;
use super::{ErrorReports, Options};
use crate::analyze::connection::marked;
use crate::decode::candidate::Basis;
use crate::decode::chunk::{Chunk, LineError, LineErrorKind};
use crate::decode::frame::Boundary;
use crate::decode::framer::{Framer, Piece, Readings};
use crate::decode::shape::Shapes;
use crate::line::LineSettings;
use crate::time::{MILLISECOND, SECOND, Timestamp};

/// What is read this long after a change, in nanoseconds, belongs to the change (study of framing, section 5).
const DEAF_NS: i64 = 20 * MILLISECOND;
/// How long after a byte it is counted at the latest that it was damaged, in nanoseconds: adapters are asked once a
/// second.
const COUNT_NS: i64 = 1200 * MILLISECOND;
/// Bytes that prove a parity, at least: a few can have parity bits that look like stop bits.
const PARITY_BYTES: u64 = 40;
/// Bytes after which settings are wrong whose bytes have line errors, and after which they are wrong anyway: no
/// frame among more than the longest request and response (study of framing, section 5).
const DAMAGED_BYTES: u64 = 64;
const FRAMELESS_BYTES: u64 = 300;
/// Frames of one unit that prove settings, and frames of whomever: false ones are 5 in a megabyte.
const OF_ONE_UNIT: u8 = 2;
const OF_ANY: u32 = 4;

/// Per cent of bytes with line errors up to which settings are right; a wrong parity gives 30 and more.
pub(super) const FEW_ERRORS: u64 = 5;

/// Counts what settings have given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Evidence {
    /// Bytes received.
    pub bytes: u64,
    /// Line errors among those that were counted with them.
    pub line_errors: u64,
    /// Bytes of which it is known whether they have line errors.
    pub judged_bytes: u64,
    /// Frames with a length and a function of the specification.
    pub frames: u32,
    /// The unit that most of them are of.
    pub unit: Option<u8>,
}

impl Evidence {
    /// Tells whether more than `percent` of the bytes have line errors.
    pub(super) fn has_errors_above(&self, percent: u64) -> bool {
        self.line_errors.saturating_mul(100) > self.judged_bytes.saturating_mul(percent)
    }

    /// Returns how many of a million bytes have line errors.
    pub(super) fn errors_per_million(&self) -> u64 {
        self.line_errors.saturating_mul(1_000_000).checked_div(self.judged_bytes).unwrap_or(0)
    }

    /// Says which share of the bytes has line errors, if any has.
    pub(super) fn marked(&self) -> Option<String> {
        marked(self.judged_bytes, self.line_errors)
    }
}

/// Tells what has become of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    Open,
    Proven,
    Failed,
}

pub(super) struct Trial {
    line: LineSettings,
    framer: Framer,
    deaf_until: Timestamp,
    /// From when on line errors are those of these settings.
    judges_from: Timestamp,
    reports: ErrorReports,
    /// When there were bytes enough to judge by.
    judged_enough: Option<Timestamp>,
    evidence: Evidence,
    /// What the adapter had counted before.
    counted: Option<u64>,
    frames_of: [u8; 256],
    has_exchange: bool,
    /// Bytes in frames, those of them with line errors, and where the first began and the last ended.
    framed: u64,
    framed_errors: u64,
    line_errors: Vec<LineError>,
    first_frame: Option<u64>,
    last_frame_end: u64,
    /// Time that counts, in nanoseconds, up to `last`, and when the first frame came.
    counted_ns: i64,
    first_frame_ns: i64,
    /// When the last byte came, or the trial began.
    last: Timestamp,
    /// Whether the current burst was heard from its beginning.
    is_burst_whole: bool,
    whole_bursts: u32,
}

impl Trial {
    /// Begins to listen with these settings, which were set just now; `counted` are the line errors that the adapter has counted before.
    pub(super) fn new(line: LineSettings, options: Options, counted: Option<u64>, now: Timestamp) -> Self {
        let Options { adapter_hold_ns, error_reports: reports } = options;
        let is_late = reports == ErrorReports::Counts;
        Trial {
            line,
            // Only forms of the specification are evidence.
            framer: Framer::new(line, adapter_hold_ns, Arc::new(Shapes::default())),
            deaf_until: now + DEAF_NS,
            judges_from: if is_late { now + COUNT_NS } else { now },
            reports,
            judged_enough: None,
            evidence: Evidence::default(),
            counted,
            frames_of: [0; 256],
            has_exchange: false,
            framed: 0,
            framed_errors: 0,
            line_errors: Vec::new(),
            first_frame: None,
            last_frame_end: 0,
            counted_ns: 0,
            first_frame_ns: 0,
            last: now,
            is_burst_whole: false,
            whole_bursts: 0,
        }
    }

    /// Listens to all that comes: nothing was changed.
    pub(super) fn unchanged(self) -> Self {
        Trial { deaf_until: Timestamp::MIN, ..self }
    }

    pub(super) fn line(&self) -> LineSettings {
        self.line
    }

    pub(super) fn evidence(&self) -> Evidence {
        self.evidence
    }

    /// Returns what speaks for settings that give frames: of line errors those within frames, where it is known which
    /// bytes they are of. What was heard from the middle of a byte on has errors at any settings.
    pub(super) fn proof(&self) -> Evidence {
        match self.reports {
            ErrorReports::Marks | ErrorReports::Unknown => {
                Evidence { judged_bytes: self.framed, line_errors: self.framed_errors, ..self.evidence }
            }
            ErrorReports::Counts | ErrorReports::None => self.evidence,
        }
    }

    /// Takes in a read; silences longer than `period_ns` count no more than that.
    pub(super) fn handle_bytes(&mut self, chunk: &Chunk<'_>, now: Timestamp, period_ns: i64) {
        if now < self.deaf_until {
            return;
        }
        self.handle_timeout(now);
        let silence = now - self.last;
        self.counted_ns = self.counted_ns(now, period_ns);
        self.last = now;
        if silence >= QUIET_NS {
            self.whole_bursts = self.whole_bursts.saturating_add(u32::from(self.is_burst_whole));
            self.is_burst_whole = true;
        }
        let bytes = chunk.bytes.len() as u64;
        self.evidence.bytes = self.evidence.bytes.saturating_add(bytes);
        if now >= self.judges_from {
            let errors = damaged(chunk.line_errors);
            self.evidence.judged_bytes = self.evidence.judged_bytes.saturating_add(bytes);
            self.evidence.line_errors = self.evidence.line_errors.saturating_add(errors);
            if self.evidence.judged_bytes >= PARITY_BYTES {
                self.judged_enough.get_or_insert(now);
            }
        }
        self.framer.push(chunk);
        self.pump();
    }

    /// Takes in how many line errors the adapter has counted.
    pub(super) fn handle_counted(&mut self, counted: u64, now: Timestamp) {
        let before = self.counted.replace(counted).unwrap_or(counted);
        if self.reports == ErrorReports::Counts && now >= self.judges_from {
            let errors = counted.saturating_sub(before);
            self.evidence.line_errors = self.evidence.line_errors.saturating_add(errors);
        }
    }

    /// Decides what silence up to `now` decides.
    pub(super) fn handle_timeout(&mut self, now: Timestamp) {
        while let Some(due) = self.framer.deadline().filter(|due| *due <= now) {
            self.framer.expire(due);
            self.pump();
        }
    }

    /// Tells whether these settings are right, as far as anybody can tell by `now`; more patience takes longer.
    pub(super) fn verdict(&self, now: Timestamp, period_ns: i64, patience: u8) -> Verdict {
        let patience = i64::from(patience.max(1));
        let dwell = (period_ns.saturating_mul(3) / 2).max(3 * SECOND / 2).saturating_mul(patience);
        let beyond = |bytes: u64, limit: u64| bytes >= limit.saturating_mul(patience.unsigned_abs());
        let is_over = if self.is_proven() {
            return if self.is_judged(now) { Verdict::Proven } else { Verdict::Open };
        } else if self.evidence.frames > 0 {
            let since = self.framer.store().end().saturating_sub(self.last_frame_end);
            let waited = self.counted_ns(now, period_ns).saturating_sub(self.first_frame_ns);
            beyond(since, FRAMELESS_BYTES) || waited >= dwell.saturating_mul(4)
        } else {
            let bytes = self.evidence.bytes;
            let bursts = self.whole_bursts > 0 || (self.is_burst_whole && now - self.last >= QUIET_NS);
            beyond(bytes, FRAMELESS_BYTES)
                || (beyond(bytes, DAMAGED_BYTES) && self.evidence.has_errors_above(25))
                || (self.counted_ns(now, period_ns) >= dwell && (bursts || bytes >= DAMAGED_BYTES))
        };
        if is_over { Verdict::Failed } else { Verdict::Open }
    }

    /// Tells whether line errors would have shown by `now`.
    fn is_judged(&self, now: Timestamp) -> bool {
        match self.reports {
            ErrorReports::None => true,
            ErrorReports::Marks | ErrorReports::Unknown => self.framed >= PARITY_BYTES,
            // Of the latest bytes nothing is counted yet: they must not be the half of all.
            ErrorReports::Counts => self.judged_enough.is_some_and(|then| now - then >= 2 * COUNT_NS),
        }
    }

    /// Returns the time that counts by `now`, in nanoseconds.
    fn counted_ns(&self, now: Timestamp, period_ns: i64) -> i64 {
        self.counted_ns.saturating_add((now - self.last).clamp(0, period_ns))
    }

    /// Tells whether there are frames enough, and not by chance: a poll that comes again and again at a wrong speed
    /// gives the same garbage each time, and what chance makes a frame of in it.
    fn is_proven(&self) -> bool {
        let Some(first) = self.first_frame else { return false };
        let is_enough = self.has_exchange
            || self.evidence.frames >= OF_ANY
            || self.frames_of.iter().any(|frames| *frames >= OF_ONE_UNIT);
        let decided = self.framer.decided_end().saturating_sub(first);
        is_enough && self.framed.saturating_mul(2) >= decided
    }

    fn pump(&mut self) {
        while let Some(piece) = self.framer.next_piece(true) {
            match piece {
                Piece::Half { offset, length, end, .. } => {
                    if is_standard(&self.framer.readings(offset, length, end)) {
                        self.count(offset, length);
                    }
                }
                Piece::Frame { offset, length, readings, boundary: Boundary::Length, .. }
                    if is_standard(&readings) =>
                {
                    self.count(offset, length);
                }
                Piece::Exchange { offset, lengths: [request, response], .. } => {
                    self.has_exchange = true;
                    self.count(offset, request);
                    self.count(offset.saturating_add(request.into()), response);
                }
                Piece::Frame { .. } | Piece::Junk { .. } => {}
            }
        }
        self.framer.forget_before(self.framer.decided_end());
    }

    fn count(&mut self, offset: u64, length: u16) {
        let end = offset.saturating_add(length.into());
        self.framer.store().errors(offset, end, &mut self.line_errors);
        self.framed_errors = self.framed_errors.saturating_add(damaged(&self.line_errors));
        let address = self.framer.store().slice(offset, end).first().copied().unwrap_or_default();
        let frames = &mut self.frames_of[usize::from(address)];
        *frames = frames.saturating_add(1);
        let most = self.evidence.unit.map_or(0, |unit| self.frames_of[usize::from(unit)]);
        if self.frames_of[usize::from(address)] > most {
            self.evidence.unit = Some(address);
        }
        if self.first_frame.is_none() {
            self.first_frame = Some(offset);
            self.first_frame_ns = self.counted_ns;
        }
        self.evidence.frames = self.evidence.frames.saturating_add(1);
        self.framed = self.framed.saturating_add(length.into());
        self.last_frame_end = end;
    }
}

/// Counts the bytes with a wrong parity or stop bit.
fn damaged(line_errors: &[LineError]) -> u64 {
    line_errors.iter().filter(|error| error.kind != LineErrorKind::Overrun).count() as u64
}

/// Tells whether a frame can be read as one of the specification.
fn is_standard(readings: &Readings) -> bool {
    readings.request.is_some_and(|asked| asked.candidate.basis == Basis::Standard)
        || readings.response.is_some_and(|candidate| candidate.basis == Basis::Standard)
}
