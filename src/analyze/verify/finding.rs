//! What a finding is made of.

use std::ops::Range;

use crate::time::Timestamp;

/// Says how grave a finding is; the graver is the greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Likely to do harm.
    Warning,
    /// Wrong.
    Error,
}

impl Severity {
    /// All severities, the gravest first.
    pub const ALL: [Severity; 3] = [Severity::Error, Severity::Warning, Severity::Note];

    /// Returns the name used in JSON lines.
    pub fn name(self) -> &'static str {
        match self {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// Names who is to blame, or where to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Party {
    /// Who asks.
    Master,
    /// Who answers.
    Device,
    /// The wire, its termination and bias, and its settings.
    Line,
    /// What the listener is connected with, and the listener's machine.
    Adapter,
}

impl Party {
    /// All parties, in the order in which they are listed to people.
    pub const ALL: [Party; 4] = [Party::Master, Party::Device, Party::Line, Party::Adapter];

    /// Returns the name used in JSON lines.
    pub fn name(self) -> &'static str {
        match self {
            Party::Master => "master",
            Party::Device => "device",
            Party::Line => "line",
            Party::Adapter => "adapter",
        }
    }
}

/// Is a rule of the catalogue.
#[derive(Debug, PartialEq, Eq)]
pub struct Rule {
    /// A letter for the family and two digits; stable for ever.
    pub code: &'static str,
    /// What it is called.
    pub name: &'static str,
    /// How grave a finding is, unless it says otherwise.
    pub severity: Severity,
    /// Who is to blame, unless a finding says otherwise.
    pub party: Party,
    /// What is observed, what it may mean, and when the rule keeps silent.
    pub explanation: &'static str,
    /// What to check next.
    pub help: &'static str,
    /// Where it is written.
    pub reference: &'static str,
}

/// Is something wrong in the traffic, with its evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The rule it goes by.
    pub rule: &'static Rule,
    /// How grave it is.
    pub severity: Severity,
    /// Who is to blame.
    pub party: Party,
    /// The unit address it is about, when there is one.
    pub address: Option<u8>,
    /// Tells findings of a rule and address apart that are not about the same, such as by register.
    pub subject: u32,
    /// The ids of the frames and damaged runs that show it, in order.
    pub frames: Vec<u64>,
    /// The bytes that show it, counted from the address byte of the last of `frames`; `None` for the whole.
    pub span: Option<Range<usize>>,
    /// End of the last of `frames`; `None` where the input has no times.
    pub time: Option<Timestamp>,
    /// How many findings are folded into this one.
    pub count: u64,
    /// Time of the first of them.
    pub first: Option<Timestamp>,
    /// Time of the last of them.
    pub last: Option<Timestamp>,
    /// What was observed.
    pub message: String,
}

impl Finding {
    /// Makes a single finding with the rule's severity and party, of no address and nothing to show it yet.
    pub fn new(rule: &'static Rule, time: Option<Timestamp>, message: impl Into<String>) -> Self {
        Finding {
            rule,
            severity: rule.severity,
            party: rule.party,
            address: None,
            subject: 0,
            frames: Vec::new(),
            span: None,
            time,
            count: 1,
            first: time,
            last: time,
            message: message.into(),
        }
    }

    /// Returns what to check next, by who is to blame.
    pub fn help(&self) -> &'static str {
        super::catalogue::help(self.rule, self.party)
    }

    /// Blames another party than the rule does.
    pub fn by(self, party: Party) -> Self {
        Finding { party, ..self }
    }

    /// Says which unit it is about.
    pub fn at(self, address: u8) -> Self {
        Finding { address: Some(address), ..self }
    }

    /// Says about what it is, so that it folds with its like only.
    pub fn about(self, subject: impl Into<u32>) -> Self {
        Finding { subject: subject.into(), ..self }
    }

    /// Names the frames that show it.
    pub fn shown_by(self, frames: impl IntoIterator<Item = u64>) -> Self {
        Finding { frames: frames.into_iter().collect(), ..self }
    }

    /// Names the bytes that show it, in the last of the frames.
    pub fn within(self, span: Range<usize>) -> Self {
        Finding { span: Some(span), ..self }
    }
}
