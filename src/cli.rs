//! The command line: types only.

mod export;
mod live;
mod verify;

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::capture::InputFormat;
use crate::line::LineSettings;
use crate::report::{Show, TimeStyle};
use crate::simulate::{Adapter, Scenario};
use crate::time::{MILLISECOND, SECOND};
pub use export::{Export, ExportKind, LinkKind};
use live::length;
pub use live::{Line, Listen, Live, Record};
pub use verify::{FailOn, PartyKind, Verify, VerifyFormat};
pub(crate) use verify::{code, severity};

/// Listens on a Modbus RTU bus without ever speaking, and says what the sensors said.
#[derive(Debug, Parser)]
#[command(name = "rtutap", version, arg_required_else_help = true, after_help = AFTER)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,

    /// Say more: under each row its bytes and fields with their places, what a device could be, and
    /// what to do about a finding; details in --log
    #[arg(short, long, global = true, display_order = 100)]
    pub verbose: bool,

    /// Take options from this file; without it from rtutap/config.toml in your configuration directory
    #[arg(
        long,
        value_name = "FILE",
        global = true,
        env = "RTUTAP_CONFIG",
        hide_env_values = true,
        display_order = 101
    )]
    pub config: Option<PathBuf>,

    /// Append what is done and said, with times, to this file; with --verbose in detail
    #[arg(long, value_name = "FILE", global = true, display_order = 102)]
    pub log: Option<PathBuf>,
}

const AFTER: &str = "\
Exit status: 0 done, 1 'verify' found something, 2 could not do it.

Examples:
  rtutap demo
  rtutap listen /dev/ttyUSB0 --line 9600-8N1
  rtutap record /dev/ttyUSB0 -o recordings/
  rtutap replay night.mcap
  rtutap decode capture.hex
  rtutap decode capture.hex --show readings --format csv > readings.csv
  rtutap verify capture.mcap
  rtutap info capture.hex
  rtutap export capture.hex -o capture.pcapng";

/// Names the commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Watch a live bus
    #[command(after_help = live::LISTEN_EXAMPLES)]
    Listen(Listen),
    /// Record a live bus, unattended
    #[command(after_help = live::RECORD_NOTES)]
    Record(Record),
    /// Show a recording as if it happened now, with a timeline to go about in
    #[command(after_help = REPLAY_NOTES)]
    Replay(Replay),
    /// Print a recording: frames, transactions or readings
    #[command(after_help = DECODE_EXAMPLES)]
    Decode(Decode),
    /// Say what is wrong with a master, its devices or the line, with the evidence
    #[command(after_help = verify::VERIFY_NOTES)]
    Verify(Verify),
    /// Say what a recording holds: times, line, devices, counts
    Info(Info),
    /// Write a recording in another format
    #[command(after_help = export::NOTES)]
    Export(Export),
    /// Rewrite a damaged or unfinished recording, whole but for what is gone
    #[command(after_help = RECOVER_EXAMPLES)]
    Recover(Recover),
    /// Write a recording of a simulated bus, in MCAP or as hex text
    #[command(after_help = SIMULATE_EXAMPLES)]
    Simulate(Simulate),
    /// Show a simulated installation with faults in it, as it happens
    Demo(Demo),
    /// List the serial ports, with adapter, driver, latency timer, and who may open them
    #[command(after_help = PORTS_EXAMPLES)]
    Ports(Ports),
    /// List, show, check and draft the profiles of devices
    Profiles(Profiles),
    /// Print what makes a shell complete rtutap's options
    #[command(after_help = COMPLETIONS_EXAMPLES)]
    Completions(Completions),
    /// Print the manual page
    #[command(after_help = MAN_EXAMPLES)]
    Man,
}

const DECODE_EXAMPLES: &str = "\
A recording is MCAP, hex text, raw bytes, pcapng or pcap (link type 147 or 250), or a table of bytes
as Saleae Logic and DSView export it, told apart by content. Parts of one session are read as one.
In hex text a line is one read, such as

  2026-01-01T00:00:00.123456Z > 01 03 26 00 00 04 4f 41   # a comment
  1767225600.141 0x01,0x03,0x08

with a time (RFC 3339, or seconds with a decimal point) or without, which says when the last byte of
the line had been received. A comment '# line 19200-8E1' before the first byte gives the line
settings. Raw bytes and lines without times have no times, and so no latencies.

A table is CSV with a header that names a time column (time, start_time or timestamp, with a unit as
in 'Time [ms]', else in seconds) and a byte column (data, value or byte, in hexadecimal). A time is
that of the start bit. This makes one of what sigrok-cli prints, here for 1 MHz:

  sigrok-cli -i bus.sr -P uart:rx=D0:baudrate=9600 -A uart=rx-data --protocol-decoder-samplenum |
    awk -v rate=1000000 -F'[-: ]+' 'BEGIN { print \"time,data\" }
                                    { printf \"%.9f,0x%s\\n\", $1 / rate, $NF }' |
    rtutap decode -

JSON lines have every key in every row; what is not known is null. Times are nanoseconds since the
Unix epoch, bytes lower-case hex, and a value that was a float on the wire is the shortest decimal
that reads back to it.

Examples:
  rtutap decode capture.hex --filter 'addr == 1 && temperature > 20'
  rtutap decode capture.hex --filter 'outcome in (no-response, late)' --time utc
  rtutap decode capture.hex --show frames --format json
  rtutap decode one.hex two.hex --device 3=yosemitech-do -v
  cat capture.hex | rtutap decode -";

const REPLAY_NOTES: &str = "\
The first rows are there at once, whatever the size; the rest is decoded meanwhile. What is shown is
what was known at the playhead: space plays, < and > change the speed, . and , go by a frame, { and
} by a fiftieth of the recording, e goes to the next error, : to a time; the mouse seeks on the
timeline. ? shows all keys.

Examples:
  rtutap replay night.mcap
  rtutap replay night.mcap --filter 'addr == 1 && outcome != answered'
  rtutap replay night.mcap.part --follow";

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  rtutap completions bash > ~/.local/share/bash-completion/completions/rtutap
  rtutap completions zsh > ~/.zfunc/_rtutap
  rtutap completions fish > ~/.config/fish/completions/rtutap.fish";

const MAN_EXAMPLES: &str = "\
Examples:
  rtutap man > ~/.local/share/man/man1/rtutap.1
  rtutap man | man -l -";

const PORTS_EXAMPLES: &str = "\
Nothing is opened: whoever uses a port is not disturbed.

Examples:
  rtutap ports
  rtutap ports --format json";

const RECOVER_EXAMPLES: &str = "\
What can be read of the file is copied; the file itself is only read.

Examples:
  rtutap recover night.mcap.part -o night.mcap
  rtutap info night.mcap";

const SIMULATE_EXAMPLES: &str = "\
The file's name says what is written: MCAP when it ends in .mcap, hex text when in .hex or .txt, or
without any ending.

Examples:
  rtutap simulate -o bus.mcap
  rtutap simulate -o bad.hex --scenario everything-bad --adapter ftdi16 --seed 7 --truth bad.jsonl
  rtutap simulate -o - --frames 100 | rtutap decode -";

/// Holds what `decode` is asked for.
#[derive(Debug, Args)]
pub struct Decode {
    /// Where the bytes come from, and how to read them.
    #[command(flatten)]
    pub bus: Bus,

    /// What to print, and how.
    #[command(flatten)]
    pub printing: Printing,

    /// Wait for a recording that is still being written, and print on
    #[arg(long)]
    pub follow: bool,
}

/// Holds what `replay` is asked for.
#[derive(Debug, Args)]
pub struct Replay {
    /// Where the bytes come from, and how to read them.
    #[command(flatten)]
    pub bus: Bus,

    /// Show only rows that pass, such as 'addr == 1 && temperature > 20'; the language is that of 'decode --filter'
    #[arg(long, value_name = "EXPR")]
    pub filter: Option<String>,

    /// How to show times [default: local]
    #[arg(long, value_enum, env = "RTUTAP_TIME", hide_env_values = true)]
    pub time: Option<TimeKind>,

    /// Begin at the end of a recording that is still being written, and show what comes
    #[arg(long)]
    pub follow: bool,
}

/// Holds which rows are printed, and how.
#[derive(Debug, Args)]
pub struct Printing {
    /// What to print; may be repeated [default: transactions]
    #[arg(long, value_enum, value_name = "WHAT")]
    pub show: Vec<ShowKind>,

    /// How to print it [default: text]
    #[arg(long, value_enum, env = "RTUTAP_FORMAT", hide_env_values = true)]
    pub format: Option<RowFormat>,

    /// Print only what passes, such as 'addr == 1 && temperature > 20'
    ///
    /// Compared can be addr, fn, reg, quantity, outcome, exception, latency, time, device, serial, cmd,
    /// role, reason, bus, and any decoded field or derived value; also: echo, damaged, crc good, crc bad,
    /// 'bytes contains 26 00'. A frame passes when its transaction does. 'finding == D06' lets pass what the finding
    /// is about: transaction, frames and damaged runs, as far as they come right before it.
    #[arg(long, value_name = "EXPR")]
    pub filter: Option<String>,

    /// How to show times in text and CSV [default: local]
    #[arg(long, value_enum, env = "RTUTAP_TIME", hide_env_values = true)]
    pub time: Option<TimeKind>,
}

/// Holds what `recover` is asked for.
#[derive(Debug, Args)]
pub struct Recover {
    /// The damaged or unfinished file
    #[arg(value_name = "INPUT")]
    pub input: PathBuf,

    /// Where to write the whole one
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// Holds what `info` is asked for.
#[derive(Debug, Args)]
pub struct Info {
    /// Where the bytes come from, and how to read them.
    #[command(flatten)]
    pub bus: Bus,

    /// How to print it
    #[arg(long, value_enum, default_value = "text")]
    pub format: InfoFormat,

    /// Write what the master does as a plan in TOML, for 'verify --expect'
    #[arg(long, conflicts_with_all = ["format", "time"])]
    pub plan: bool,

    /// How to show times in text [default: local]
    #[arg(long, value_enum, env = "RTUTAP_TIME", hide_env_values = true)]
    pub time: Option<TimeKind>,
}

/// Holds where bytes come from and how to read them.
#[derive(Clone, Debug, Args)]
pub struct Bus {
    /// Recordings, one after the other; '-' is standard input
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,

    /// Speed and character format; without it, or with 'auto', the recording's, without that 9600-8N1
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
}

/// Holds what is known of devices and water.
#[derive(Clone, Debug, Default, Args)]
pub struct Equipment {
    /// Say what device is at an address, such as 3=yosemitech-do; may be repeated
    #[arg(long = "device", value_name = "ADDRESS=PROFILE", value_parser = assignment)]
    pub devices: Vec<Assignment>,

    /// Add a device profile from a TOML file; may be repeated
    #[arg(long = "profile", value_name = "FILE")]
    pub profiles: Vec<PathBuf>,

    /// Salinity of the water in g/kg, 0 to 100, for dissolved oxygen in mg/L [default: 0]
    #[arg(long, value_name = "G/KG", value_parser = salinity, env = "RTUTAP_SALINITY", hide_env_values = true, allow_negative_numbers = true)]
    pub salinity: Option<f64>,

    /// Air pressure in kPa, 20 to 200, for dissolved oxygen in mg/L [default: 101.325]
    #[arg(long, value_name = "KPA", value_parser = pressure, env = "RTUTAP_PRESSURE_KPA", hide_env_values = true, allow_negative_numbers = true)]
    pub pressure_kpa: Option<f64>,
}

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

/// Holds what `ports` is asked for.
#[derive(Debug, Args)]
pub struct Ports {
    /// How to print them: for people, or a JSON object a port
    #[arg(long, value_enum, default_value = "text")]
    pub format: InfoFormat,
}

/// Holds what `profiles` is asked for.
#[derive(Debug, Args)]
pub struct Profiles {
    /// What to do; without it, list.
    #[command(subcommand)]
    pub action: Option<ProfileAction>,
}

/// Holds what `completions` is asked for.
#[derive(Debug, Args)]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Names what can be done with profiles.
#[derive(Debug, Subcommand)]
pub enum ProfileAction {
    /// List the profiles built in, with manual, source and confidence
    List,
    /// Show the commands and fields of a profile
    Show {
        /// Its id, such as yosemitech-do
        id: String,
    },
    /// Say what is wrong with a profile, with line and column
    Check {
        /// A TOML file
        file: PathBuf,
    },
    /// Draft the profile of an unknown device from a recording
    #[command(after_help = NEW_PROFILE_EXAMPLES)]
    New(NewProfile),
}

const NEW_PROFILE_EXAMPLES: &str = "\
The draft holds what the device accepted: functions, registers, quantities. The types of values are
guessed, each with its evidence as a comment; the longer the recording, the better. Names, units and
meanings are left to you.

Examples:
  rtutap profiles new capture.mcap -o mine.toml
  rtutap profiles new capture.mcap --address 5
  rtutap decode capture.mcap --profile mine.toml --device 5=unknown-5";

/// Holds what `profiles new` is asked for.
#[derive(Debug, Args)]
pub struct NewProfile {
    /// Where the bytes come from, and how to read them.
    #[command(flatten)]
    pub bus: Bus,

    /// Where to write the profile; without it, and with '-', standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// The device's address, 1 to 247; without it, that of the only unknown device
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=247))]
    pub address: Option<u8>,
}

/// Names the kinds of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ShowKind {
    /// Frames, damaged runs, losses and identifications
    Frames,
    /// Requests and what became of them
    Transactions,
    /// Measured and derived values
    Readings,
    /// What is wrong with the traffic
    Findings,
}

impl From<ShowKind> for Show {
    fn from(kind: ShowKind) -> Show {
        match kind {
            ShowKind::Frames => Show::Frames,
            ShowKind::Transactions => Show::Transactions,
            ShowKind::Readings => Show::Readings,
            ShowKind::Findings => Show::Findings,
        }
    }
}

/// Names the formats of rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum RowFormat {
    /// For people
    #[default]
    Text,
    /// A JSON object a line
    Json,
    /// Comma-separated values, of one kind of row
    Csv,
}

/// Names the formats of a summary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum InfoFormat {
    /// For people
    Text,
    /// One JSON object
    Json,
}

/// Names the formats of recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum InputKind {
    /// MCAP
    Mcap,
    /// Hex text
    Hex,
    /// Raw bytes
    Raw,
    /// Packets: pcapng or pcap, link type 147 or 250
    Pcap,
    /// A table of bytes with their times: CSV as Saleae Logic and DSView export it
    Table,
}

impl From<InputKind> for InputFormat {
    fn from(kind: InputKind) -> InputFormat {
        match kind {
            InputKind::Hex => InputFormat::Hex,
            InputKind::Raw => InputFormat::Raw,
            InputKind::Mcap => InputFormat::Mcap,
            InputKind::Pcap => InputFormat::Pcap,
            InputKind::Table => InputFormat::Table,
        }
    }
}

/// Names the ways to show times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum TimeKind {
    /// In the time zone of this machine
    #[default]
    Local,
    /// In universal time
    Utc,
    /// In seconds since the first byte
    Relative,
}

impl From<TimeKind> for TimeStyle {
    fn from(kind: TimeKind) -> TimeStyle {
        match kind {
            TimeKind::Local => TimeStyle::Local,
            TimeKind::Utc => TimeStyle::Utc,
            TimeKind::Relative => TimeStyle::Relative,
        }
    }
}

/// Holds a length of time in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nanoseconds(pub i64);

/// Says what device is at an address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    /// The unit address, 1 to 247.
    pub address: u8,
    /// The id of its profile.
    pub device: String,
}

/// Offers the scenarios by name, with what they are.
fn scenarios() -> PossibleValuesParser {
    let value = |scenario: &Scenario| PossibleValue::new(scenario.name).help(scenario.summary);
    PossibleValuesParser::new(Scenario::all().iter().map(value))
}

fn number(text: &str, least: f64, most: f64, unit: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        Ok(_) => Err(format!("not within {least} to {most} {unit}")),
        Err(_) => Err(format!("not a number from {least} to {most} {unit}")),
    }
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

pub(crate) fn salinity(text: &str) -> Result<f64, String> {
    number(text, 0.0, 100.0, "g/kg")
}

pub(crate) fn pressure(text: &str) -> Result<f64, String> {
    number(text, 20.0, 200.0, "kPa (10 hPa or 7.5 mmHg are 1 kPa)")
}

/// Reads milliseconds, decimals too.
pub(crate) fn milliseconds(text: &str) -> Result<Nanoseconds, String> {
    let ms = number(text, 0.0, 10_000.0, "ms")?;
    Ok(Nanoseconds((ms * MILLISECOND as f64).round() as i64))
}

pub(crate) fn assignment(text: &str) -> Result<Assignment, String> {
    let (address, device) = text.split_once('=').ok_or("write ADDRESS=PROFILE, such as 3=yosemitech-do")?;
    match address.parse() {
        Ok(address @ 1..=247) => Ok(Assignment { address, device: device.to_owned() }),
        _ => Err(format!("'{address}' is not a unit address from 1 to 247")),
    }
}
