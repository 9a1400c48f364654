//! What can be wrong between the bus and this program, with what to try.

use std::fmt;

/// Names what is wrong with a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Trouble {
    /// Not a byte comes.
    Silence,
    /// Bytes come, but no frame is among them.
    NoFrames,
    /// Masters ask, and nobody is heard to answer.
    OnlyRequests,
    /// Units answer, and nobody is heard to ask.
    OnlyResponses,
    /// What is sent comes twice.
    Echo,
    /// Bytes are marked as damaged without end, though they make up frames.
    LineErrors,
}

impl Trouble {
    /// Returns a short name.
    pub fn name(self) -> &'static str {
        match self {
            Trouble::Silence => "no traffic",
            Trouble::NoFrames => "no frames",
            Trouble::OnlyRequests => "only requests",
            Trouble::OnlyResponses => "only responses",
            Trouble::Echo => "everything twice",
            Trouble::LineErrors => "line errors",
        }
    }

    /// Returns what to try first.
    fn advice(self) -> &'static str {
        match self {
            Trouble::Silence => {
                "is the master polling? Check A, B and ground where the tap is connected, and that this is its port"
            }
            Trouble::NoFrames => {
                "try --line auto; where that finds nothing, swap A and B, connect the grounds, and look for noise"
            }
            Trouble::OnlyRequests => {
                "check the units' power and addresses; on a four-wire bus, tap the units' pair, too"
            }
            Trouble::OnlyResponses => {
                "the master is on other wires, or too weak here: on a four-wire bus, tap its pair, too"
            }
            Trouble::Echo => {
                "an adapter or converter repeats what it hears: switch its echo off, or tap beside it"
            }
            Trouble::LineErrors => {
                "the parity is probably another: try --line auto; else check termination and ground"
            }
        }
    }
}

/// Tells how a connection is, when that has changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnosis {
    /// What is wrong; `None` when all is well again.
    pub trouble: Option<Trouble>,
    /// What shows it, in figures.
    pub evidence: String,
    /// What to try next; empty when all is well.
    pub advice: &'static str,
}

impl Diagnosis {
    pub(super) fn of(trouble: Trouble, evidence: String) -> Self {
        Diagnosis { trouble: Some(trouble), evidence, advice: trouble.advice() }
    }

    /// Says that bytes come, but no frame at any speed or parity.
    pub fn no_frames_at_any_speed(bytes: u64, line_errors: u64) -> Self {
        let evidence = format!(
            "{bytes} bytes{} and no frames at any speed and parity",
            marked(bytes, line_errors).map_or_else(String::new, |share| format!(", {share},"))
        );
        let advice = "swap A and B, connect the grounds, and look for noise: a bus at rest should be silent";
        Diagnosis { trouble: Some(Trouble::NoFrames), evidence, advice }
    }

    pub(super) fn well(evidence: String) -> Self {
        Diagnosis { trouble: None, evidence, advice: "" }
    }
}

impl fmt::Display for Diagnosis {
    /// Writes what is wrong and what shows it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.trouble {
            Some(trouble) => write!(f, "{}: {}", trouble.name(), self.evidence),
            None => write!(f, "the connection is well again: {}", self.evidence),
        }
    }
}

/// Says which share of bytes has line errors, if any has.
pub(in crate::analyze) fn marked(bytes: u64, errors: u64) -> Option<String> {
    let percent = errors.saturating_mul(100).checked_div(bytes)?.min(100);
    (errors > 0)
        .then(|| format!("{}{percent} % of them with line errors", if percent == 0 { "<" } else { "" }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagnosis_says_what_is_wrong_with_figures() {
        let diagnosis = Diagnosis::no_frames_at_any_speed(2000, 900);
        assert_eq!(
            diagnosis.to_string(),
            "no frames: 2000 bytes, 45 % of them with line errors, and no frames at any speed and parity"
        );
        assert_eq!(marked(1000, 0), None);
        assert_eq!(marked(1000, 10).as_deref(), Some("1 % of them with line errors"));
        assert_eq!(marked(u64::MAX, u64::MAX).as_deref(), Some("1 % of them with line errors"));
    }
}
