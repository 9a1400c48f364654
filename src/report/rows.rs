//! Which events become rows, and in what order they leave.

use super::gate::{Gate, Verdict};
use super::{Format, Guess};
use crate::line::LineSettings;
use crate::pipeline::Event;

/// Names the kinds of rows that can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    /// Frames, damaged runs, losses and identifications.
    Frames,
    /// Transactions.
    Transactions,
    /// Readings.
    Readings,
    /// What is wrong with the traffic.
    Findings,
    /// Identifications alone.
    Devices,
}

impl Show {
    /// Tells whether an event is of this kind.
    fn includes(self, event: &Event<'_>) -> bool {
        match event {
            Event::Transaction { .. } => self == Show::Transactions,
            Event::Reading { .. } => self == Show::Readings,
            Event::Frame(_) | Event::Damaged(_) | Event::Lost(_) => self == Show::Frames,
            Event::Identified { .. } => matches!(self, Show::Frames | Show::Devices),
            Event::Finding(_) => self == Show::Findings,
        }
    }
}

/// Decides whether an event passes the filter.
pub type Judge = Box<dyn Fn(&str, &Event<'_>) -> bool + Send>;

/// Tells which transactions and readings pass the filter, one after the other.
pub struct Passing {
    judge: Option<Judge>,
    transaction_passes: bool,
    transactions: u64,
    any_passed: bool,
}

impl Passing {
    /// Starts before the first event; without a judge all pass.
    pub fn new(judge: Option<Judge>) -> Self {
        Passing { judge, transaction_passes: true, transactions: 0, any_passed: false }
    }

    /// Tells whether an event passes; a reading does when its transaction does.
    pub fn passes(&mut self, bus: &str, event: &Event<'_>) -> bool {
        let passes = match (&self.judge, event) {
            (None, _) => true,
            (Some(_), Event::Reading { .. }) => self.transaction_passes,
            (Some(judge), Event::Transaction { .. }) => {
                self.transactions += 1;
                self.transaction_passes = judge(bus, event);
                self.transaction_passes
            }
            (Some(judge), _) => judge(bus, event),
        };
        self.any_passed |= passes;
        passes
    }

    /// Returns of how many transactions none passed the filter, nor anything else; `None` when something did.
    pub fn none_of(&self) -> Option<u64> {
        (self.judge.is_some() && !self.any_passed).then_some(self.transactions)
    }
}

/// Turns events into rows of the kinds asked for, as far as they pass the filter.
pub struct Rows {
    show: Vec<Show>,
    format: Box<dyn Format>,
    is_filtered: bool,
    /// Whether the filter asks for findings: then what one names passes with it.
    asks_for_findings: bool,
    passing: Passing,
    gate: Gate,
    row: Vec<u8>,
    says_environment: bool,
}

impl Rows {
    /// Makes rows of the kinds `show` in `format`; without a judge all pass.
    pub fn new(show: Vec<Show>, format: Box<dyn Format>, judge: Option<Judge>) -> Self {
        let is_filtered = judge.is_some();
        Rows {
            show,
            format,
            is_filtered,
            asks_for_findings: false,
            passing: Passing::new(judge),
            gate: Gate::default(),
            row: Vec::new(),
            says_environment: false,
        }
    }

    /// Says that the filter asks for findings: frames and damaged runs pass with a finding that names them.
    pub fn asking_for_findings(self) -> Self {
        Rows { asks_for_findings: true, ..self }
    }

    /// Appends what stands before the first row.
    pub fn heading(&mut self, out: &mut Vec<u8>) {
        self.format.heading(out);
    }

    /// Appends what stands before the first row of a bus with these line settings.
    pub fn begin(&mut self, bus: &str, line: LineSettings, out: &mut Vec<u8>) {
        self.format.begin(bus, line, out);
    }

    /// Takes an event; appends to `out` what can be shown now.
    pub fn event(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        self.format.note_time(event);
        let is_shown = self.show.iter().any(|show| show.includes(event));
        if !self.is_filtered {
            if is_shown {
                self.note_environment(event);
                self.format.row(bus, event, out);
            }
            return;
        }
        let names_others = self.asks_for_findings && matches!(event, Event::Finding(_));
        if !is_shown && !names_others && !matches!(event, Event::Transaction { .. }) {
            return;
        }
        let passes = self.passing.passes(bus, event);
        if let Event::Finding(finding) = event
            && names_others
            && passes
        {
            self.gate.admit(&finding.frames);
        }
        let verdict = match event {
            Event::Frame(frame) => Verdict::Awaits { frame: frame.place.id, alone: passes },
            Event::Damaged(damaged) => Verdict::Awaits { frame: damaged.place.id, alone: passes },
            Event::Transaction { transaction, .. } => {
                let ids = [transaction.request, transaction.response].map(|side| Some(side?.id));
                self.gate.decide(ids, passes);
                Verdict::Settled(passes)
            }
            _ => Verdict::Settled(passes),
        };
        // What does not pass is not written either: its guesses would be hinted at.
        if is_shown && verdict != Verdict::Settled(false) {
            self.note_environment(event);
            self.row.clear();
            self.format.row(bus, event, &mut self.row);
            self.gate.push(&self.row, verdict);
        }
    }

    /// Appends what can be shown once every frame before `settled_frame` has its transaction or none.
    pub fn settle(&mut self, settled_frame: u64, out: &mut Vec<u8>) {
        self.gate.release(settled_frame, out);
    }

    fn note_environment(&mut self, event: &Event<'_>) {
        if let Event::Reading { reading, .. } = event {
            self.says_environment |= reading.needs_environment();
        }
    }

    /// Returns of how many transactions none passed the filter, nor anything else; `None` when something did.
    pub fn none_of(&self) -> Option<u64> {
        self.passing.none_of()
    }

    /// Tells whether a reading was shown that depends on salinity and air pressure.
    pub fn needs_environment(&self) -> bool {
        self.says_environment
    }

    /// Returns a reading that was shown though it is only the likeliest, if there was one.
    pub fn guess(&self) -> Option<Guess> {
        self.format.guess()
    }
}
