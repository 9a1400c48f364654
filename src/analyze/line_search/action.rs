//! What a search wants done, and said.

use std::fmt;

use super::trial::Evidence;
use crate::analyze::connection::Diagnosis;
use crate::line::{LineSettings, Parity};
use crate::time::SECOND;

/// Is what a search wants done, or said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Receive with these settings from now on, and tell [`super::LineSearch::handle_line`] when it is done.
    Try(LineSettings, Reason),
    /// These settings, which are set, are right; the search is over.
    Lock(Lock),
    /// Nothing has come for this long in nanoseconds; the search waits.
    NoTraffic(i64),
    /// Bytes came, but no settings gave frames; the search goes on with more patience.
    NothingFits(Diagnosis),
    /// The source refuses every speed; the search is over.
    Refused,
}

/// Says why other settings are tried.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reason {
    /// Those before gave no frames, or too few.
    Failed(LineSettings, Evidence),
    /// Those before gave frames, with too many line errors.
    Damaged(LineSettings, Evidence),
    /// They had the fewest line errors.
    Best(Evidence),
    /// The source refused those before.
    Refused(LineSettings),
}

/// Is what was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lock {
    /// The settings.
    pub line: LineSettings,
    /// What shows that they are right.
    pub evidence: Evidence,
    /// Settings that gave frames, too, with what spoke against them.
    pub others: Vec<(LineSettings, Evidence)>,
    /// Whether the adapter tells of line errors, as far as anybody knows.
    pub reports_errors: bool,
}

impl Lock {
    /// Says what the traffic cannot tell.
    pub fn doubt(&self) -> &'static str {
        match (self.reports_errors, self.line.parity) {
            (false, Parity::None) => {
                "no line errors are reported by this adapter: the parity may be another, which reads the same"
            }
            (false, _) => "no line errors are reported by this adapter: the parity may be even or odd",
            (true, Parity::None) => "stop bits cannot be told from the traffic: two read the same",
            (true, _) => "",
        }
    }
}

impl fmt::Display for Action {
    /// Writes what people should know, in one line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Action::Try(line, reason) => write!(f, "trying {line}: {reason}"),
            Action::Lock(lock) => lock.fmt(f),
            Action::NoTraffic(ns) => {
                write!(f, "no traffic: not a byte in {} s; the speed shows once there is some", ns / SECOND)
            }
            Action::NothingFits(diagnosis) => diagnosis.fmt(f),
            Action::Refused => f.write_str("the source refuses every speed that was to be tried"),
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::Failed(line, evidence) => {
                let frames = match evidence.frames {
                    0 => "no frame".to_owned(),
                    1 => "only one frame".to_owned(),
                    frames => format!("only {frames} frames"),
                };
                write!(f, "{line} gave {frames} in {} bytes", evidence.bytes)?;
                evidence.marked().map_or(Ok(()), |share| write!(f, ", {share}"))
            }
            Reason::Damaged(line, evidence) => {
                write!(f, "{line} gave {}", Summary(evidence))
            }
            Reason::Best(_) => f.write_str("it gave frames with the fewest line errors"),
            Reason::Refused(line) => write!(f, "the source refuses {line}"),
        }
    }
}

impl fmt::Display for Lock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the line is {}: {}", self.line, Summary(&self.evidence))?;
        let mut separator = " (";
        for (line, evidence) in &self.others {
            let share = evidence.marked().unwrap_or_else(|| "no line errors".to_owned());
            write!(f, "{separator}{line}: {share}")?;
            separator = ", ";
        }
        f.write_str(if self.others.is_empty() { "" } else { ")" })
    }
}

struct Summary<'a>(&'a Evidence);

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Evidence { bytes, frames, unit, .. } = *self.0;
        let plural = if frames == 1 { "" } else { "s" };
        write!(f, "{frames} frame{plural} in {bytes} bytes")?;
        if let Some(unit) = unit {
            write!(f, ", most of unit {unit}")?;
        }
        self.0.marked().map_or(Ok(()), |share| write!(f, ", {share}"))
    }
}
