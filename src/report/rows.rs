//! Which events become rows, and in what order they leave.

use super::gate::{Gate, Verdict};
use super::{Format, Guess};
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
    /// Findings; there is no rule yet that makes one.
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
        }
    }
}

/// Decides whether an event passes the filter.
pub type Judge = Box<dyn Fn(&str, &Event<'_>) -> bool>;

/// Turns events into rows of the kinds asked for, as far as they pass the filter.
pub struct Rows {
    show: Vec<Show>,
    format: Box<dyn Format>,
    judge: Option<Judge>,
    gate: Gate,
    row: Vec<u8>,
    transaction_passes: bool,
    says_environment: bool,
}

impl Rows {
    /// Makes rows of the kinds `show` in `format`; without a judge all pass.
    pub fn new(show: Vec<Show>, format: Box<dyn Format>, judge: Option<Judge>) -> Self {
        Rows {
            show,
            format,
            judge,
            gate: Gate::default(),
            row: Vec::new(),
            transaction_passes: true,
            says_environment: false,
        }
    }

    /// Appends what stands before the first row.
    pub fn heading(&mut self, out: &mut Vec<u8>) {
        self.format.heading(out);
    }

    /// Takes an event; appends to `out` what can be shown now.
    pub fn event(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        self.format.note_time(event);
        let is_shown = self.show.iter().any(|show| show.includes(event));
        let Some(judge) = &self.judge else {
            if is_shown {
                self.note_environment(event);
                self.format.row(bus, event, out);
            }
            return;
        };
        let verdict = match event {
            Event::Reading { .. } => Verdict::Settled(self.transaction_passes),
            Event::Frame(frame) if is_shown => {
                Verdict::Awaits { frame: frame.place.id, alone: judge(bus, event) }
            }
            Event::Damaged(damaged) if is_shown => {
                Verdict::Awaits { frame: damaged.place.id, alone: judge(bus, event) }
            }
            Event::Frame(_) | Event::Damaged(_) => return,
            Event::Transaction { transaction, .. } => {
                self.transaction_passes = judge(bus, event);
                let ids = [transaction.request, transaction.response].map(|side| Some(side?.id));
                self.gate.decide(ids, self.transaction_passes);
                Verdict::Settled(self.transaction_passes)
            }
            Event::Lost(_) | Event::Identified { .. } => Verdict::Settled(is_shown && judge(bus, event)),
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

    /// Tells whether a reading was shown that depends on salinity and air pressure.
    pub fn needs_environment(&self) -> bool {
        self.says_environment
    }

    /// Returns a reading that was shown though it is only the likeliest, if there was one.
    pub fn guess(&self) -> Option<Guess> {
        self.format.guess()
    }
}
