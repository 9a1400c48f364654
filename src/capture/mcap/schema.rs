//! The messages of `rtutap.proto` and `foxglove_log.proto`, and their descriptors for readers of recordings.

use prost::{Enumeration, Message};

/// `rtutap.proto` compiled, as a `FileDescriptorSet`.
const RTUTAP: &[u8] = include_bytes!("rtutap.binpb");
/// `foxglove_log.proto` compiled, with `google/protobuf/timestamp.proto`.
const FOXGLOVE_LOG: &[u8] = include_bytes!("foxglove_log.binpb");

/// Names the type of a channel's messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Schema {
    /// Bytes as received.
    RawChunk,
    /// Line settings.
    Line,
    /// A decoded transaction.
    Transaction,
    /// A measured or derived value.
    Reading,
    /// Monotonic against wall clock.
    Clock,
    /// A line of a log, for findings.
    Log,
}

impl Schema {
    /// Returns the full name of the protobuf message.
    pub fn name(self) -> &'static str {
        match self {
            Schema::RawChunk => "rtutap.RawChunk",
            Schema::Line => "rtutap.Line",
            Schema::Transaction => "rtutap.Transaction",
            Schema::Reading => "rtutap.Reading",
            Schema::Clock => "rtutap.Clock",
            Schema::Log => "foxglove.Log",
        }
    }

    /// Returns the `FileDescriptorSet` that defines the message, with all it imports.
    pub fn descriptors(self) -> &'static [u8] {
        if self == Schema::Log { FOXGLOVE_LOG } else { RTUTAP }
    }
}

/// Bytes of one read, or of several within 20 ms.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct RawChunk {
    #[prost(uint64, tag = "1")]
    pub(crate) stream_offset: u64,
    #[prost(bytes = "vec", tag = "2")]
    pub(crate) data: Vec<u8>,
    #[prost(uint64, tag = "3")]
    pub(crate) monotonic_ns: u64,
    #[prost(message, repeated, tag = "4")]
    pub(crate) errors: Vec<LineError>,
    #[prost(uint64, tag = "5")]
    pub(crate) ready_ns: u64,
    #[prost(message, repeated, tag = "6")]
    pub(crate) earlier: Vec<Read>,
    #[prost(enumeration = "Dating", tag = "7")]
    pub(crate) dating: i32,
}

/// Where the times of a chunk are from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Enumeration)]
#[repr(i32)]
pub(crate) enum Dating {
    Read = 0,
    LineSpeed = 1,
    AfterSilence = 2,
}

/// A read merged into a later one's message.
#[derive(Clone, Copy, PartialEq, Message)]
pub(crate) struct Read {
    #[prost(uint32, tag = "1")]
    pub(crate) end: u32,
    #[prost(uint64, tag = "2")]
    pub(crate) monotonic_ns: u64,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub(crate) struct LineError {
    #[prost(uint32, tag = "1")]
    pub(crate) offset: u32,
    #[prost(enumeration = "ErrorKind", tag = "2")]
    pub(crate) kind: i32,
    #[prost(uint32, tag = "3")]
    pub(crate) count: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Enumeration)]
#[repr(i32)]
pub(crate) enum ErrorKind {
    Unknown = 0,
    ParityOrFraming = 1,
    Break = 2,
    Overrun = 3,
    Lost = 4,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct Line {
    #[prost(uint32, tag = "1")]
    pub(crate) baud: u32,
    #[prost(uint32, tag = "2")]
    pub(crate) data_bits: u32,
    #[prost(string, tag = "3")]
    pub(crate) parity: String,
    #[prost(string, tag = "4")]
    pub(crate) stop_bits: String,
    #[prost(double, optional, tag = "5")]
    pub(crate) adapter_hold_ms: Option<f64>,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct Transaction {
    #[prost(uint32, tag = "1")]
    pub(crate) address: u32,
    #[prost(uint32, tag = "2")]
    pub(crate) function: u32,
    #[prost(uint32, optional, tag = "3")]
    pub(crate) start_register: Option<u32>,
    #[prost(uint32, optional, tag = "4")]
    pub(crate) quantity: Option<u32>,
    #[prost(bytes = "vec", tag = "5")]
    pub(crate) request: Vec<u8>,
    #[prost(bytes = "vec", tag = "6")]
    pub(crate) response: Vec<u8>,
    #[prost(enumeration = "Outcome", tag = "7")]
    pub(crate) outcome: i32,
    #[prost(uint32, optional, tag = "8")]
    pub(crate) exception_code: Option<u32>,
    #[prost(double, optional, tag = "9")]
    pub(crate) latency_ms: Option<f64>,
    #[prost(double, optional, tag = "10")]
    pub(crate) latency_error_ms: Option<f64>,
    #[prost(uint64, tag = "11")]
    pub(crate) stream_offset: u64,
    #[prost(string, tag = "12")]
    pub(crate) device: String,
    #[prost(string, tag = "13")]
    pub(crate) command: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Enumeration)]
#[repr(i32)]
pub(crate) enum Outcome {
    Undecided = 0,
    Answered = 1,
    Exception = 2,
    NoResponse = 3,
    Late = 4,
    Unsolicited = 5,
    Broadcast = 6,
    Damaged = 7,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct Reading {
    #[prost(double, tag = "1")]
    pub(crate) value: f64,
    #[prost(bytes = "vec", tag = "2")]
    pub(crate) raw: Vec<u8>,
    #[prost(bool, tag = "3")]
    pub(crate) derived: bool,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub(crate) struct Clock {
    #[prost(uint64, tag = "1")]
    pub(crate) monotonic_ns: u64,
    #[prost(uint64, tag = "2")]
    pub(crate) realtime_ns: u64,
}

/// `google.protobuf.Timestamp`.
#[derive(Clone, Copy, PartialEq, Message)]
pub(crate) struct Seconds {
    #[prost(int64, tag = "1")]
    pub(crate) seconds: i64,
    #[prost(int32, tag = "2")]
    pub(crate) nanos: i32,
}

/// `foxglove.Log`.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Log {
    #[prost(message, optional, tag = "1")]
    pub(crate) timestamp: Option<Seconds>,
    #[prost(enumeration = "Level", tag = "2")]
    pub(crate) level: i32,
    #[prost(string, tag = "3")]
    pub(crate) message: String,
    #[prost(string, tag = "4")]
    pub(crate) name: String,
}

/// How grave a line of a log is, as viewers colour it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Enumeration)]
#[repr(i32)]
pub enum Level {
    /// Not said.
    Unknown = 0,
    /// For developers.
    Debug = 1,
    /// A note.
    Info = 2,
    /// A warning.
    Warning = 3,
    /// An error.
    Error = 4,
    /// The end.
    Fatal = 5,
}

#[cfg(test)]
#[path = "schema_tests.rs"]
mod tests;
