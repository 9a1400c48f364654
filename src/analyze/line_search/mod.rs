//! Finds speed, parity and stop bits of a line from its traffic alone.
//!
//! Speeds are tried in the order of their frequency, without parity first: a receiver that expects none gets whole
//! frames from a sender with one, and a line error where the parity bit looks like no stop bit. So once there are
//! frames, the line errors tell whether another parity is to be tried. Some chips lose bytes after a line error;
//! for them the speeds are tried with parity, too, when they have given nothing without. Silence decides nothing.
//!
//! On lines modelled bit by bit, in all eight speeds and 8N1, 8E1, 8O1, 8N2, the medians are 0.1 to 4 s on a busy bus,
//! and 0.2 to 11 s on an installation that is polled every one to three seconds; at worst it took 21 and 27 s
//! (`cargo test --test line_search -- --ignored --nocapture`).

mod action;
mod pace;
mod trial;

use std::collections::VecDeque;

pub use action::{Action, Lock, Reason};
pub use trial::Evidence;

use crate::analyze::connection::Diagnosis;
use crate::decode::chunk::{Chunk, ReadTime};
use crate::line::{LineSettings, Parity};
use crate::time::{SECOND, Timestamp};
use pace::Pace;
use trial::{FEW_ERRORS, Trial, Verdict};

/// Speeds in the order in which they are tried (study of framing, section 5).
pub const SPEEDS: [u32; 8] = [9600, 19200, 115_200, 38400, 57600, 4800, 2400, 1200];
/// What is tried in round after round of all speeds, with how much patience: the first may have come at a bad time.
const ROUNDS: [(Parity, u8); 8] = [
    (Parity::None, 1),
    (Parity::Even, 1),
    (Parity::None, 2),
    (Parity::Odd, 2),
    (Parity::None, 4),
    (Parity::Even, 4),
    (Parity::None, 4),
    (Parity::Odd, 4),
];
/// How much patience there is with a parity at a speed that has given frames.
const SETTLING_PATIENCE: u8 = 2;
/// When silence is told first, in nanoseconds; then each time it has doubled, up to the longest distance.
const SILENCE_NS: i64 = 10 * SECOND;
const SILENCE_APART_NS: i64 = 600 * SECOND;

/// Says how an adapter tells of wrong parity and stop bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ErrorReports {
    /// Bytes, or packets of them, are marked.
    #[default]
    Marks,
    /// They are only counted: see [`LineSearch::handle_counters`].
    Counts,
    /// Not at all.
    None,
    /// Nobody knows: marks count when there are any.
    Unknown,
}

/// Says what is known of the adapter.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// The longest time it keeps a byte back, in nanoseconds.
    pub adapter_hold_ns: Option<i64>,
    /// How it tells of line errors.
    pub error_reports: ErrorReports,
}

/// Is where a search has got to.
#[derive(Clone, Debug)]
enum Stage {
    /// It looks for frames.
    Scan,
    /// It has frames, and looks for a parity without line errors among those left.
    Settle(Vec<Parity>),
    /// It goes back to the best of those that gave frames.
    Return,
    Over,
}

/// Searches for line settings; pure, with time as an argument.
///
/// The source starts with [`LineSearch::settings`]. After each call that takes something in, the actions are to be
/// taken; between [`Action::Try`] and [`LineSearch::handle_line`] nothing that comes counts.
pub struct LineSearch {
    options: Options,
    stage: Stage,
    trial: Trial,
    /// Whether other settings were asked for and are not set yet.
    waits_for: Option<LineSettings>,
    pace: Pace,
    /// Counts the trials of the scan.
    step: usize,
    /// What gave frames, with too many line errors.
    damaged: Vec<(LineSettings, Evidence)>,
    /// What was heard since all settings began to be tried.
    heard: Evidence,
    /// Whether any byte was marked as damaged.
    has_marks: bool,
    refused: Vec<u32>,
    /// What the adapter has counted.
    counted: Option<u64>,
    silent_since: Timestamp,
    /// After how many nanoseconds silence is told next.
    tells_silence_ns: i64,
    actions: VecDeque<Action>,
}

impl LineSearch {
    /// Begins to search.
    pub fn new(options: Options, now: Timestamp) -> Self {
        let line = planned(0);
        LineSearch {
            options,
            stage: Stage::Scan,
            trial: Trial::new(line, options, None, now).unchanged(),
            waits_for: None,
            pace: Pace::default(),
            step: 0,
            damaged: Vec::new(),
            heard: Evidence::default(),
            has_marks: false,
            refused: Vec::new(),
            counted: None,
            silent_since: now,
            tells_silence_ns: SILENCE_NS,
            actions: VecDeque::new(),
        }
    }

    /// Returns the settings that a search begins with: 9600 8N1.
    pub fn first() -> LineSettings {
        planned(0)
    }

    /// Returns the settings that bytes come with, as far as it knows.
    pub fn settings(&self) -> LineSettings {
        self.trial.line()
    }

    /// Tells whether the settings were found, or cannot be.
    pub fn is_over(&self) -> bool {
        matches!(self.stage, Stage::Over)
    }

    /// Takes in a read.
    pub fn handle_bytes(&mut self, chunk: &Chunk<'_>) {
        let ReadTime::At(now) = chunk.time else { return };
        if chunk.bytes.is_empty() || self.is_over() {
            return;
        }
        self.silent_since = now;
        self.tells_silence_ns = SILENCE_NS;
        self.pace.handle_bytes(now);
        self.has_marks |= !chunk.line_errors.is_empty();
        if self.waits_for.is_none() {
            self.trial.handle_bytes(chunk, now, self.pace.period_ns());
            self.judge(now);
        }
    }

    /// Takes in how many parity and framing errors and breaks the adapter has counted since it was opened.
    pub fn handle_counters(&mut self, line_errors: u64, now: Timestamp) {
        self.counted = Some(line_errors);
        if self.waits_for.is_none() {
            self.trial.handle_counted(line_errors, now);
        }
    }

    /// Takes in that settings were set, or refused, at a time.
    pub fn handle_line(&mut self, is_set: bool, now: Timestamp) {
        let Some(line) = self.waits_for.take() else { return };
        if is_set {
            self.trial = Trial::new(line, self.options, self.counted, now);
            if matches!(self.stage, Stage::Return) {
                self.lock_best();
            }
            return;
        }
        match &self.stage {
            Stage::Settle(_) => self.settle(Reason::Refused(line)),
            Stage::Scan | Stage::Return | Stage::Over => {
                self.refused.push(line.baud);
                self.stage = Stage::Scan;
                self.scan(Reason::Refused(line));
            }
        }
    }

    /// Takes in that it is `now`; to be called a few times a second.
    pub fn handle_timeout(&mut self, now: Timestamp) {
        if self.is_over() {
            return;
        }
        let silent = now - self.silent_since;
        if silent >= self.tells_silence_ns {
            self.actions.push_back(Action::NoTraffic(silent));
            let next = silent.saturating_mul(2).min(silent.saturating_add(SILENCE_APART_NS));
            self.tells_silence_ns = next;
        }
        if self.waits_for.is_none() {
            self.trial.handle_timeout(now);
            self.judge(now);
        }
    }

    /// Returns what is to be done or said next.
    pub fn poll_action(&mut self) -> Option<Action> {
        self.actions.pop_front()
    }

    fn patience(&self) -> u8 {
        match self.stage {
            Stage::Scan => ROUNDS[self.step / SPEEDS.len() % ROUNDS.len()].1,
            Stage::Settle(_) | Stage::Return | Stage::Over => SETTLING_PATIENCE,
        }
    }

    /// Draws the conclusion from what the trial has given so far.
    fn judge(&mut self, now: Timestamp) {
        let (line, evidence) = (self.trial.line(), self.trial.evidence());
        match self.trial.verdict(now, self.pace.period_ns(), self.patience()) {
            Verdict::Open => {}
            Verdict::Proven => self.take_proof(line, self.trial.proof()),
            Verdict::Failed => {
                let reason = Reason::Failed(line, evidence);
                if matches!(self.stage, Stage::Settle(_)) {
                    return self.settle(reason);
                }
                self.heard.bytes = self.heard.bytes.saturating_add(evidence.bytes);
                self.heard.line_errors = self.heard.line_errors.saturating_add(evidence.line_errors);
                self.scan(reason);
            }
        }
    }

    /// Goes on from settings that give frames.
    fn take_proof(&mut self, line: LineSettings, evidence: Evidence) {
        if !evidence.has_errors_above(FEW_ERRORS) {
            return self.lock(line, evidence);
        }
        self.damaged.push((line, evidence));
        if matches!(self.stage, Stage::Scan) {
            let all = [Parity::None, Parity::Even, Parity::Odd];
            let others = all.into_iter().filter(|parity| *parity != line.parity);
            self.stage = Stage::Settle(others.collect());
        }
        self.settle(Reason::Damaged(line, evidence));
    }

    /// Tries the next parity, or the best again.
    fn settle(&mut self, reason: Reason) {
        let line = self.trial.line();
        if let Stage::Settle(parities) = &mut self.stage
            && !parities.is_empty()
        {
            let parity = parities.remove(0);
            return self.ask(LineSettings { parity, ..line }, reason);
        }
        self.stage = Stage::Return;
        match self.best() {
            Some((best, evidence)) if best != line => self.ask(best, Reason::Best(evidence)),
            _ => self.lock_best(),
        }
    }

    /// Returns the settings with frames and the fewest line errors.
    fn best(&self) -> Option<(LineSettings, Evidence)> {
        self.damaged.iter().min_by_key(|(_, evidence)| evidence.errors_per_million()).copied()
    }

    fn lock_best(&mut self) {
        if let Some((line, evidence)) = self.best() {
            self.lock(line, evidence);
        }
    }

    fn lock(&mut self, line: LineSettings, evidence: Evidence) {
        let others = self.damaged.drain(..).filter(|(other, _)| *other != line).collect();
        self.stage = Stage::Over;
        let reports_errors = match self.options.error_reports {
            ErrorReports::Marks | ErrorReports::Counts => true,
            ErrorReports::None => false,
            ErrorReports::Unknown => self.has_marks,
        };
        self.actions.push_back(Action::Lock(Lock { line, evidence, others, reports_errors }));
    }

    /// Goes on to the next speed that the source does not refuse.
    fn scan(&mut self, reason: Reason) {
        if SPEEDS.iter().all(|speed| self.refused.contains(speed)) {
            self.stage = Stage::Over;
            return self.actions.push_back(Action::Refused);
        }
        loop {
            self.step = (self.step + 1) % (SPEEDS.len() * ROUNDS.len());
            if self.step.is_multiple_of(2 * SPEEDS.len()) {
                let Evidence { bytes, line_errors, .. } = std::mem::take(&mut self.heard);
                let diagnosis = Diagnosis::no_frames_at_any_speed(bytes, line_errors);
                self.actions.push_back(Action::NothingFits(diagnosis));
            }
            let line = planned(self.step);
            if !self.refused.contains(&line.baud) {
                return self.ask(line, reason);
            }
        }
    }

    fn ask(&mut self, line: LineSettings, reason: Reason) {
        self.waits_for = Some(line);
        self.actions.push_back(Action::Try(line, reason));
    }
}

/// Returns the settings of a step of the scan.
fn planned(step: usize) -> LineSettings {
    let (parity, _) = ROUNDS[step / SPEEDS.len() % ROUNDS.len()];
    LineSettings { baud: SPEEDS[step % SPEEDS.len()], parity, ..LineSettings::default() }
}
