//! What `listen` and `record` are asked for.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

use super::{Equipment, Nanoseconds, Printing, milliseconds};
use crate::line::{LineSettings, LineSettingsError};
use crate::source::Spec;
use crate::time::{MILLISECOND, SECOND};

pub(super) const LISTEN_EXAMPLES: &str = "\
SOURCE is a serial device, tcp://host:port (a raw serial server), or '-' for bytes on standard
input. Nothing is ever sent to the bus. Ctrl-C ends; a second one at once.

On a terminal there is a UI, in which ? shows the keys; with --format, or where standard output is
none, lines are printed.

Examples:
  rtutap listen /dev/ttyUSB0 --line 9600-8N1
  rtutap listen /dev/ttyUSB0 --line auto
  rtutap listen pump=/dev/ttyUSB0 tank=tcp://192.168.1.20:4001 --show readings
  rtutap listen /dev/ttyUSB0 --record today.mcap --filter 'outcome != answered'";

pub(super) const RECORD_NOTES: &str = "\
SOURCE is a serial device, tcp://host:port (a raw serial server), or '-' for bytes on standard
input. Nothing is ever sent to the bus. A file is called NAME.mcap.part until it is finished;
SIGINT, SIGTERM and SIGHUP finish it. Further parts are NAME-0002.mcap and so on.

Examples:
  rtutap record /dev/ttyUSB0 -o recordings/
  rtutap record pump=/dev/ttyUSB0 tank=/dev/ttyUSB1 -o /srv/tap/ --min-free 500MB --drop-oldest
  rtutap record /dev/ttyUSB0 -o faults/ --ring 10m --trigger 'outcome != answered'";

/// Says with which line settings to receive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// With these.
    Is(LineSettings),
    /// With those that the traffic shows.
    Auto,
}

impl Line {
    /// Returns the settings, if they are said: a recording was made with some, and there is nothing to find.
    pub fn settings(self) -> Option<LineSettings> {
        match self {
            Line::Is(line) => Some(line),
            Line::Auto => None,
        }
    }
}

impl FromStr for Line {
    type Err = LineSettingsError;

    /// Reads `auto`, or what [`LineSettings`] reads.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text.eq_ignore_ascii_case("auto") { Ok(Line::Auto) } else { text.parse().map(Line::Is) }
    }
}

/// Holds where live bytes come from, and how to read them.
#[derive(Debug, Args)]
pub struct Live {
    /// Where bytes come from, such as /dev/ttyUSB0 or pump=/dev/ttyUSB0; several are recorded side by side
    #[arg(required = true, value_name = "[NAME=]SOURCE")]
    pub sources: Vec<Spec>,

    /// Speed and character format, or 'auto' to find them from the traffic of a serial port [default: 9600-8N1]
    #[arg(long, value_name = "BAUD-DPS", env = "RTUTAP_LINE", hide_env_values = true)]
    pub line: Option<Line>,

    /// The longest time the adapter keeps a byte back; without it the adapter's, or estimated from the reads
    #[arg(long, value_name = "MS", value_parser = milliseconds, env = "RTUTAP_ADAPTER_HOLD", hide_env_values = true, allow_negative_numbers = true)]
    pub adapter_hold: Option<Nanoseconds>,

    /// What is known of devices and water.
    #[command(flatten)]
    pub equipment: Equipment,
}

/// Holds what `listen` is asked for.
#[derive(Debug, Args)]
pub struct Listen {
    /// Where bytes come from.
    #[command(flatten)]
    pub live: Live,

    /// What to print, and how.
    #[command(flatten)]
    pub printing: Printing,

    /// Record what is received in this file, too
    #[arg(long, value_name = "FILE", conflicts_with = "no_record")]
    pub record: Option<PathBuf>,

    /// Record nothing; without it, the terminal UI keeps its session in the state directory
    #[arg(long)]
    pub no_record: bool,

    /// Whether --format was given, not only configured: then there is no terminal UI.
    #[arg(skip)]
    pub wants_lines: bool,
}

/// Holds what `record` is asked for.
#[derive(Debug, Args)]
pub struct Record {
    /// Where bytes come from.
    #[command(flatten)]
    pub live: Live,

    /// A file, or a directory for files named by the time
    #[arg(short, long, value_name = "PATH")]
    pub output: PathBuf,

    /// Begin a new file after this time, 1s to 366d, such as 30m or 1h; 0 never does
    #[arg(long, value_name = "TIME", default_value = "1h", value_parser = rotate_time, allow_hyphen_values = true)]
    pub rotate_time: Nanoseconds,

    /// Begin a new file after this size, 4kB to 1TB, such as 256MB; 0 never does
    #[arg(long, value_name = "SIZE", default_value = "256MB", value_parser = rotate_size, allow_hyphen_values = true)]
    pub rotate_size: u64,

    /// Begin a new file after so many chunks, 2 to 100000; each costs about 2 kB of memory
    #[arg(long, value_name = "COUNT", default_value_t = 10_000, value_parser = rotate_chunks, allow_hyphen_values = true)]
    pub rotate_chunks: u64,

    /// Stop, or drop the oldest, when less than this is free on the disk; 0 never does
    #[arg(long, value_name = "SIZE", default_value = "1GB", value_parser = size, allow_hyphen_values = true)]
    pub min_free: u64,

    /// Make room on the disk by removing the oldest finished recordings beside this one
    #[arg(long)]
    pub drop_oldest: bool,

    /// Write only the bytes, not what they decode to
    #[arg(long)]
    pub raw_only: bool,

    /// Write only what is this much before and after a match of --trigger, 1s to 1d
    #[arg(long, value_name = "TIME", value_parser = ring, requires = "trigger", allow_hyphen_values = true)]
    pub ring: Option<Nanoseconds>,

    /// Write when something passes this filter, such as 'outcome == no-response'
    #[arg(long, value_name = "EXPR", requires = "ring")]
    pub trigger: Option<String>,
}

/// Reads a number with a unit, as a multiple of the unit 1; a bare number is `bare` of it.
fn with_unit(text: &str, units: &[(&str, f64)], example: &str) -> Result<f64, String> {
    let text = text.trim();
    let digits = text.trim_end_matches(|c: char| c.is_alphabetic());
    let unit = text[digits.len()..].to_ascii_lowercase();
    let number: f64 =
        digits.trim().parse().map_err(|_| format!("not a number with a unit, such as {example}"))?;
    let factor = units.iter().find(|(name, _)| *name == unit).map(|(_, factor)| *factor);
    let factor = factor.or((number == 0.0 && unit.is_empty()).then_some(1.0));
    let names = units.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let value = number * factor.ok_or_else(|| format!("give a unit ({names}), such as {example}"))?;
    match value {
        value if value < 0.0 => Err(format!("it is negative; give something like {example}")),
        value if value < 9e18 => Ok(value),
        _ => Err(format!("it is more than can be counted; give something like {example}")),
    }
}

/// Refuses what is neither 0 nor within a range that reads like `text`.
fn within<T: PartialOrd>(value: T, zero: T, (least, most): (T, T), text: &str) -> Result<T, String> {
    if value == zero || (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(format!("not within {text}, nor 0 for never"))
    }
}

fn rotate_time(text: &str) -> Result<Nanoseconds, String> {
    let range = (SECOND, 366 * 86_400 * SECOND);
    within(length(text)?.0, 0, range, "1s to 366d").map(Nanoseconds)
}

fn rotate_size(text: &str) -> Result<u64, String> {
    within(size(text)?, 0, (4_000, 1_000_000_000_000), "4kB to 1TB")
}

fn rotate_chunks(text: &str) -> Result<u64, String> {
    match text.trim().parse() {
        Ok(count @ 2..=100_000) => Ok(count),
        Ok(0_u64) => Err("memory would grow without end; not within 2 to 100000".to_owned()),
        _ => Err("not a whole number from 2 to 100000".to_owned()),
    }
}

fn ring(text: &str) -> Result<Nanoseconds, String> {
    match length(text)? {
        Nanoseconds(0) => Err("nothing would be kept around a match; not within 1s to 1d".to_owned()),
        span if (SECOND..=86_400 * SECOND).contains(&span.0) => Ok(span),
        _ => Err("not within 1s to 1d".to_owned()),
    }
}

/// Reads a size in bytes; kB, MB and GB are powers of 1000.
fn size(text: &str) -> Result<u64, String> {
    let units = [("b", 1.0), ("kb", 1e3), ("mb", 1e6), ("gb", 1e9), ("tb", 1e12)];
    with_unit(text, &units, "256MB").map(|bytes| bytes as u64) // within 0 to 9e18
}

/// Reads a length of time.
pub(super) fn length(text: &str) -> Result<Nanoseconds, String> {
    let second = SECOND as f64;
    let units = [
        ("ms", MILLISECOND as f64),
        ("s", second),
        ("m", 60.0 * second),
        ("min", 60.0 * second),
        ("h", 3600.0 * second),
        ("d", 86_400.0 * second),
    ];
    with_unit(text, &units, "10m").map(|ns| Nanoseconds(ns as i64)) // within 0 to 9e18
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_times_have_units() {
        assert_eq!(size("256MB"), Ok(256_000_000));
        assert_eq!(size("1.5 gb"), Ok(1_500_000_000));
        assert_eq!((size("0"), length("0")), (Ok(0), Ok(Nanoseconds(0))));
        assert_eq!(length("10m"), Ok(Nanoseconds(600 * SECOND)));
        assert_eq!(length("90s"), length("1.5min"));
        for wrong in ["", "10", "10x", "NaN s", "h"] {
            assert!(length(wrong).is_err(), "{wrong}");
        }
        assert!(length("-1s").is_err_and(|said| said.starts_with("it is negative")));
        assert!(length("1e30d").is_err_and(|said| said.starts_with("it is more than can be counted")));
    }

    #[test]
    fn what_would_make_a_file_a_moment_or_none_ever_is_refused_with_the_range() {
        assert_eq!((rotate_time("0"), rotate_time("1s")), (Ok(Nanoseconds(0)), Ok(Nanoseconds(SECOND))));
        for (result, range) in [
            (rotate_time("1ms").err(), "1s to 366d"),
            (rotate_time("400d").err(), "1s to 366d"),
            (rotate_size("1B").err(), "4kB to 1TB"),
            (rotate_chunks("1").err(), "2 to 100000"),
            (rotate_chunks("-5").err(), "2 to 100000"),
            (rotate_chunks("0").err(), "memory would grow"),
            (ring("0").err(), "nothing would be kept"),
            (ring("2d").err(), "1s to 1d"),
        ] {
            assert!(result.as_ref().is_some_and(|said| said.contains(range)), "{result:?}, {range}");
        }
    }
}
