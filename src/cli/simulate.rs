//! What `simulate` and `demo` are asked for.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::RowFormat;
use super::live::length;
use crate::line::LineSettings;
use crate::simulate::{Adapter, Scenario};
use crate::time::SECOND;

pub(super) const EXAMPLES: &str = "\
The file's name says what is written: MCAP when it ends in .mcap, hex text when in .hex or .txt, or
without any ending.

Examples:
  rtutap simulate -o bus.mcap
  rtutap simulate -o bad.hex --scenario everything-bad --adapter ftdi16 --seed 7 --truth bad.jsonl
  rtutap simulate -o - --frames 100 | rtutap decode -";

/// Holds what `simulate` is asked for.
#[derive(Debug, Args)]
pub struct Simulate {
    /// Where to write; '-' is standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// Chooses among all possible courses of events; the same seed gives the same bytes
    #[arg(long, default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    pub seed: u64,

    /// About how many frames to write, 1 to 100000000
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub frames: u64,

    /// What goes on
    #[arg(long, value_name = "NAME", default_value = "installation", value_parser = scenarios())]
    pub scenario: String,

    /// How the listener is connected: uart, usb1, ftdi16 or idle64; hex text says it only when it is given [default:
    /// ftdi16]
    #[arg(long)]
    pub adapter: Option<Adapter>,

    /// Speed and character format
    #[arg(long, value_name = "BAUD-DPS", default_value = "9600-8N1")]
    pub line: LineSettings,

    /// Write only the bytes to MCAP, not what they decode to
    #[arg(long)]
    pub raw_only: bool,

    /// Write what was really on the wire: a JSON line a frame
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
}

/// Holds what `demo` is asked for.
#[derive(Debug, Args)]
pub struct Demo {
    /// How long, such as 90s or 10m, up to a day; a bare number is in seconds; without it 10s when lines are printed,
    /// else until it is quit
    #[arg(long, value_name = "TIME", value_parser = demo_seconds, allow_hyphen_values = true)]
    pub duration: Option<u32>,

    /// Print lines, not the terminal UI
    #[arg(long, value_enum)]
    pub format: Option<RowFormat>,

    /// Chooses among all possible courses of events
    #[arg(long, default_value_t = 20, value_parser = seed, allow_negative_numbers = true)]
    pub seed: u64,
}

/// Offers the scenarios by name, with what they are.
fn scenarios() -> PossibleValuesParser {
    let value = |scenario: &Scenario| PossibleValue::new(scenario.name).help(scenario.summary);
    PossibleValuesParser::new(Scenario::all().iter().map(value))
}

/// Reads a length of time in whole seconds, up to a day; a bare number is one of seconds.
fn demo_seconds(text: &str) -> Result<u32, String> {
    let seconds = match text.trim().parse::<u32>() {
        Ok(seconds) => i64::from(seconds),
        Err(_) => length(text)?.0 / SECOND,
    };
    let seconds = u32::try_from(seconds).ok().filter(|seconds| (1..=86_400).contains(seconds));
    seconds.ok_or_else(|| "not within 1s to 1d".to_owned())
}

fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("not a whole number from 0 to {}", u64::MAX))
}
