//! Rows: what the traffic view lists, owned and compact.

use std::sync::Arc;

use crate::decode::chunk::LineError;
use crate::decode::frame::{Boundary, Reason, Role};
use crate::decode::function::FunctionCode;
use crate::decode::transaction::Outcome;
use crate::device::Value;
use crate::time::{Span, Timestamp};

/// Is a row of the traffic.
#[derive(Clone, Debug)]
pub enum Row {
    /// A request and what became of it.
    Exchange(Box<Exchange>),
    /// A frame or a damaged run.
    Run(Box<Run>),
    /// Something else that happened.
    Remark(Box<Remark>),
}

/// Is a transaction as it was told.
#[derive(Clone, Debug)]
pub struct Exchange {
    /// Counts transactions of a command, from 0.
    pub id: u64,
    /// Index of the bus.
    pub bus: usize,
    /// Start of the request.
    pub time: Option<Timestamp>,
    /// End of its last frame.
    pub end: Option<Timestamp>,
    /// The unit address.
    pub address: u8,
    /// The request's function code.
    pub function: FunctionCode,
    /// The first register the request names.
    pub register: Option<u16>,
    /// How many registers or coils the request names.
    pub quantity: Option<u16>,
    /// How it ended.
    pub outcome: Outcome,
    /// The code of an exception response.
    pub exception: Option<u8>,
    /// From the request's end to the response's start.
    pub latency: Option<Span>,
    /// The id of the device's profile, when it was known.
    pub device: Option<Arc<str>>,
    /// The profiles that fit while the device is not known.
    pub candidates: Box<[Arc<str>]>,
    /// The device as it is shown: short, or likely with a `?`.
    pub label: Arc<str>,
    /// Its serial number, when it was known.
    pub serial: Option<Arc<str>>,
    /// The command's name, when all agree on it.
    pub command: Option<Arc<str>>,
    /// The command as it is shown: the name, a likely one with a `?`, or function and registers.
    pub title: Arc<str>,
    /// How it ended and what was said, in words.
    pub said: Box<str>,
    /// The decoded fields, request first, then those derived from them.
    pub fields: Box<[Field]>,
    /// The codes of the findings that it proved.
    pub codes: Box<[&'static str]>,
    /// The ids of request and response.
    pub ids: [Option<u64>; 2],
    /// The numbers of their rows in the list of frames.
    pub sides: [Option<u64>; 2],
}

/// Is a decoded field.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// What it is called.
    pub name: Arc<str>,
    /// Its value.
    pub value: Value<'static>,
    /// How it is shown, with its unit.
    pub text: Box<str>,
    /// In what it is measured.
    pub unit: Option<Arc<str>>,
    /// Its bytes, half-open from the address byte; empty for what is derived.
    pub span: (u16, u16),
    /// Which frame it is in.
    pub side: Role,
    /// Whether it is only the likeliest reading.
    pub is_guess: bool,
    /// Whether it is outside of what can be.
    pub is_implausible: bool,
}

/// Is a frame or a damaged run.
#[derive(Clone, Debug)]
pub struct Run {
    /// Counts frames and damaged runs together, from 0.
    pub id: u64,
    /// Index of the bus.
    pub bus: usize,
    /// When its first start bit was on the wire.
    pub time: Option<Timestamp>,
    /// When its last stop bit was.
    pub end: Option<Timestamp>,
    /// The `±` of both in nanoseconds.
    pub uncertainty_ns: i64,
    /// Index of the first byte in the stream.
    pub stream_offset: u64,
    /// The silence before.
    pub gap: Option<Span>,
    /// As received.
    pub bytes: Box<[u8]>,
    /// What the UART said about them.
    pub line_errors: Box<[LineError]>,
    /// Who sent it.
    pub role: Role,
    /// The address, guessed where it is damaged.
    pub address: Option<u8>,
    /// The function code as on the wire, guessed where it is damaged.
    pub function: Option<FunctionCode>,
    /// What it is.
    pub kind: RunKind,
    /// The number of the row of its transaction, once there is one.
    pub exchange: Option<u64>,
}

/// Tells a frame from a damaged run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RunKind {
    /// Its CRC is good.
    Frame {
        /// Whether it is the adapter's echo.
        echo: bool,
        /// What showed its end.
        boundary: Boundary,
        /// From 0 to 1.
        confidence: f32,
    },
    /// It is no frame.
    Damaged(Reason),
}

impl Run {
    /// Returns what is wrong with it; `None` for a frame.
    pub fn reason(&self) -> Option<Reason> {
        match self.kind {
            RunKind::Frame { .. } => None,
            RunKind::Damaged(reason) => Some(reason),
        }
    }

    /// Tells whether it is the adapter's echo of a request.
    pub fn is_echo(&self) -> bool {
        matches!(self.kind, RunKind::Frame { echo: true, .. })
    }
}

/// Is something that happened beside the frames.
#[derive(Clone, Debug)]
pub struct Remark {
    /// Index of the bus.
    pub bus: usize,
    /// When.
    pub time: Option<Timestamp>,
    /// The address it is about.
    pub address: Option<u8>,
    /// What it is.
    pub kind: RemarkKind,
    /// It in words.
    pub text: Box<str>,
}

/// Names what a remark is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RemarkKind {
    /// Bytes are missing here.
    Lost,
    /// A device became known.
    Identified,
    /// Somebody noted something.
    Note,
}

/// Says how well something went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tone {
    /// As it should be.
    Good,
    /// Worth knowing.
    Info,
    /// Doubtful.
    Warn,
    /// Wrong.
    Bad,
}

impl Tone {
    /// Returns the tone of an outcome.
    pub fn of(outcome: Outcome) -> Tone {
        match outcome {
            Outcome::Answered => Tone::Good,
            Outcome::Broadcast => Tone::Info,
            Outcome::Late | Outcome::Unsolicited => Tone::Warn,
            Outcome::Exception | Outcome::NoResponse | Outcome::Damaged => Tone::Bad,
        }
    }
}

impl Row {
    /// Returns when it began.
    pub fn time(&self) -> Option<Timestamp> {
        match self {
            Row::Exchange(row) => row.time,
            Row::Run(row) => row.time,
            Row::Remark(row) => row.time,
        }
    }

    /// Returns when it was over.
    pub fn end(&self) -> Option<Timestamp> {
        match self {
            Row::Exchange(row) => row.end,
            Row::Run(row) => row.end,
            Row::Remark(row) => row.time,
        }
    }

    /// Returns the index of its bus.
    pub fn bus(&self) -> usize {
        match self {
            Row::Exchange(row) => row.bus,
            Row::Run(row) => row.bus,
            Row::Remark(row) => row.bus,
        }
    }

    /// Returns the unit address it is about.
    pub fn address(&self) -> Option<u8> {
        match self {
            Row::Exchange(row) => Some(row.address),
            Row::Run(row) => row.address,
            Row::Remark(row) => row.address,
        }
    }

    /// Returns latency or gap.
    pub fn span(&self) -> Option<Span> {
        match self {
            Row::Exchange(row) => row.latency,
            Row::Run(row) => row.gap,
            Row::Remark(_) => None,
        }
    }

    /// Returns how well it went.
    pub fn tone(&self) -> Tone {
        match self {
            Row::Exchange(row) if row.outcome == Outcome::Answered => {
                if row.fields.iter().any(|field| field.is_implausible && !field.is_guess) {
                    Tone::Warn
                } else {
                    Tone::Good
                }
            }
            Row::Exchange(row) => Tone::of(row.outcome),
            Row::Run(row) => match row.kind {
                RunKind::Damaged(_) => Tone::Bad,
                RunKind::Frame { .. } if !row.line_errors.is_empty() => Tone::Bad,
                RunKind::Frame { echo: true, .. } => Tone::Info,
                RunKind::Frame { .. } => Tone::Good,
            },
            Row::Remark(row) => match row.kind {
                RemarkKind::Lost => Tone::Bad,
                RemarkKind::Identified | RemarkKind::Note => Tone::Info,
            },
        }
    }

    /// Estimates the memory it takes, in bytes; the allocator's share of an allocation is about 16.
    pub fn size(&self) -> usize {
        let inner = match self {
            Row::Exchange(row) => {
                let fields = row.fields.iter().map(|field| size_of::<Field>() + field.text.len() + 16);
                size_of::<Exchange>() + row.said.len() + fields.sum::<usize>() + 32
            }
            Row::Run(row) => {
                size_of::<Run>() + row.bytes.len() + row.line_errors.len() * size_of::<LineError>() + 32
            }
            Row::Remark(row) => size_of::<Remark>() + row.text.len() + 16,
        };
        size_of::<Row>() + 16 + inner
    }
}
