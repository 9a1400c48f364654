//! What `export` is asked for.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{Bus, ShowKind, TimeKind};
use crate::time::Timestamp;

/// Shown after the options.
pub(super) const NOTES: &str = "\
Formats, by the extension of FILE:
  .mcap     the whole recording with what it decodes to: for Foxglove, PlotJuggler, Rerun and Python
  .hex      the reads as hex text, a line each with its time: pastes into an issue, decodes the same
  .csv      readings, or with --wide a row a poll and a column a quantity
  .jsonl    the rows of 'decode --format json': frames, transactions and readings
  .pcapng   frames for Wireshark; 'Decode As' MBRTU takes them apart, TX is the master, RX a device
  .parquet  readings or transactions in typed columns, where built with '--features parquet'

With --filter, rows leave as from 'decode': a frame passes when its transaction does. Hex text keeps
the bytes of the frames and damaged runs that pass, each with the time of its read. MCAP keeps every
byte, and beside them what passes.

With --redact, serial numbers keep what tells the kind of device and have X for the rest: in bytes,
values, names, paths and remarks, and pieces of them in damaged runs. CRCs are mended, and the file
says so. A filter then sees them blanked.

Examples:
  rtutap export capture.hex -o readings.csv
  rtutap export capture.hex -o table.csv --wide --time utc
  rtutap export capture.hex -o issue.hex --filter 'outcome == damaged' --redact
  rtutap export capture.hex -o bus.pcapng
  tshark -r bus.pcapng -d rtacser.data,mbrtu";

/// Holds what `export` is asked for.
#[derive(Clone, Debug, Args)]
pub struct Export {
    /// Where the bytes come from, and how to read them.
    #[command(flatten)]
    pub bus: Bus,

    /// Where to write; the extension says what; '-' is standard output, with --format
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// Write this, whatever the extension
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub format: Option<ExportKind>,

    /// Which rows, for CSV, JSON lines and Parquet; may be repeated for JSON lines
    #[arg(long, value_enum, value_name = "WHAT")]
    pub show: Vec<ShowKind>,

    /// CSV with a row a poll and a column a quantity
    #[arg(long)]
    pub wide: bool,

    /// Write only what passes, such as 'addr == 1 && temperature > 20'; see 'decode --help'
    #[arg(long, value_name = "EXPR")]
    pub filter: Option<String>,

    /// Blank serial numbers
    #[arg(long)]
    pub redact: bool,

    /// Write only the bytes to MCAP, not what they decode to
    #[arg(long)]
    pub raw_only: bool,

    /// Link type of a pcapng: RTAC serial, or frames alone as user type 0 [default: 250]
    #[arg(long, value_enum, value_name = "NUMBER")]
    pub link_type: Option<LinkKind>,

    /// How to show times in CSV [default: local]
    #[arg(long, value_enum, env = "RTUTAP_TIME", hide_env_values = true)]
    pub time: Option<TimeKind>,

    /// What was marked and noted on the screen, with the times of the traffic.
    #[arg(skip)]
    pub notes: Vec<(Timestamp, String)>,
}

/// Names the formats that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportKind {
    /// The whole recording
    Mcap,
    /// Hex text
    Hex,
    /// Comma-separated values
    Csv,
    /// JSON lines
    Jsonl,
    /// Packets for Wireshark
    Pcapng,
    /// Typed columns
    Parquet,
}

impl ExportKind {
    /// Returns the format that a file's extension asks for, in any case.
    pub fn of(extension: &str) -> Option<ExportKind> {
        <ExportKind as ValueEnum>::from_str(extension, true).ok()
    }
}

/// Names the link types of a pcapng.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LinkKind {
    /// RTAC serial: direction and line errors come with each frame
    #[value(name = "250")]
    RtacSerial,
    /// User type 0: the frames alone
    #[value(name = "147")]
    User0,
}
