//! What `verify` is asked for.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::live::length;
use super::{Equipment, InputKind, Line, Nanoseconds, TimeKind, milliseconds};
use crate::analyze::verify::{Party, Severity, rule};

pub(super) const VERIFY_NOTES: &str = "\
INPUT is what 'rtutap decode' reads. A serial device, tcp://host:port or COM3 is a live SOURCE,
which is listened to until Ctrl-C or for --duration. Rules on order keep silent after damage; rules
on time speak only when they are sure.

Exit status: 0 nothing at or above --fail-on was found, 1 something was, 2 could not do it.

Examples:
  rtutap verify night.mcap
  rtutap verify /dev/ttyUSB0 --line 9600-8N1 --duration 10m --party master
  rtutap verify night.mcap --fail-on warning --ignore L03 --ignore Q01 --format junit > report.xml
  rtutap info --plan good.mcap > plan.toml && rtutap verify new.mcap --expect plan.toml
  rtutap verify --explain D06";

/// Holds what `verify` is asked for.
#[derive(Debug, Args)]
pub struct Verify {
    /// Recordings, one after the other ('-' is standard input), or live sources
    #[arg(value_name = "INPUT|SOURCE", required_unless_present = "explain")]
    pub inputs: Vec<PathBuf>,

    /// Speed and character format, or 'auto' for a serial port; without it the recording's, without that 9600-8N1
    #[arg(long, value_name = "BAUD-DPS", env = "RTUTAP_LINE", hide_env_values = true)]
    pub line: Option<Line>,

    /// Read the input as this, whatever it looks like
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub input_format: Option<InputKind>,

    /// The longest time the adapter keeps a byte back; without it the recording's, or estimated from the reads
    #[arg(long, value_name = "MS", value_parser = milliseconds, env = "RTUTAP_ADAPTER_HOLD", hide_env_values = true, allow_negative_numbers = true)]
    pub adapter_hold: Option<Nanoseconds>,

    /// What is known of devices and water.
    #[command(flatten)]
    pub equipment: Equipment,

    /// Listen to live sources for this time, such as 90s or 10m
    #[arg(long, value_name = "TIME", value_parser = length, allow_hyphen_values = true)]
    pub duration: Option<Nanoseconds>,

    /// How to print the report
    #[arg(long, value_enum, default_value = "text")]
    pub format: VerifyFormat,

    /// From which severity on findings make the exit status 1 [default: error]
    #[arg(long, value_enum, value_name = "SEVERITY")]
    pub fail_on: Option<FailOn>,

    /// Leave out findings of this code, such as L03; may be repeated
    #[arg(long, value_name = "CODE", value_parser = code)]
    pub ignore: Vec<String>,

    /// Show and judge the findings of this party alone; may be repeated
    #[arg(long, value_enum)]
    pub party: Vec<PartyKind>,

    /// Hold the master against this plan; 'rtutap info --plan' writes one from a recording
    #[arg(long, value_name = "FILE")]
    pub expect: Option<PathBuf>,

    /// Say what a rule means, such as D06
    #[arg(long, value_name = "CODE", value_parser = code, exclusive = true)]
    pub explain: Option<String>,

    /// How to show times in text [default: local]
    #[arg(long, value_enum, env = "RTUTAP_TIME", hide_env_values = true)]
    pub time: Option<TimeKind>,

    /// Severities that the configuration gives to codes.
    #[arg(skip)]
    pub severities: Vec<(String, Severity)>,
}

/// Names the formats of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum VerifyFormat {
    /// For people
    Text,
    /// A JSON object a finding, folded
    Json,
    /// JUnit XML, for CI: a test case a finding, and one for each rule that found nothing
    Junit,
}

/// Says from which severity on findings fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FailOn {
    /// Errors
    Error,
    /// Warnings and errors
    Warning,
    /// Whatever is found
    Note,
    /// Nothing
    Never,
}

impl FailOn {
    /// Returns the least severity that fails; `None` when nothing does.
    pub fn severity(self) -> Option<Severity> {
        match self {
            FailOn::Error => Some(Severity::Error),
            FailOn::Warning => Some(Severity::Warning),
            FailOn::Note => Some(Severity::Note),
            FailOn::Never => None,
        }
    }
}

/// Names the parties.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PartyKind {
    /// Who asks
    Master,
    /// Who answers
    Device,
    /// The wire
    Line,
    /// What the listener is connected with
    Adapter,
}

impl From<PartyKind> for Party {
    fn from(kind: PartyKind) -> Party {
        match kind {
            PartyKind::Master => Party::Master,
            PartyKind::Device => Party::Device,
            PartyKind::Line => Party::Line,
            PartyKind::Adapter => Party::Adapter,
        }
    }
}

/// Reads the code of a rule.
pub(crate) fn code(text: &str) -> Result<String, String> {
    let unknown = || format!("no rule has the code '{text}'; codes are such as D06");
    rule(text).map(|rule| rule.code.to_owned()).ok_or_else(unknown)
}

/// Reads a severity.
pub(crate) fn severity(text: &str) -> Result<Severity, String> {
    let known = Severity::ALL.into_iter().find(|severity| severity.name() == text);
    known.ok_or_else(|| format!("'{text}' is no severity; use one of error, warning, note"))
}
