//! The messages of `recording.proto`, and their descriptors for readers of recordings.

use prost::{Enumeration, Message};

use crate::time::{SECOND, Timestamp};

/// Is the type of a channel's messages: a protobuf message and what defines it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Schema {
    /// The full name of the message.
    pub name: &'static str,
    /// A `FileDescriptorSet` that defines the message, with all it imports.
    pub descriptors: &'static [u8],
}

/// `recording.proto` compiled.
const RECORDING: &[u8] = include_bytes!("recording.binpb");

impl Schema {
    pub(super) const RAW_CHUNK: Schema = Schema { name: "rtutap.RawChunk", descriptors: RECORDING };
    pub(super) const LINE: Schema = Schema { name: "rtutap.Line", descriptors: RECORDING };
    pub(super) const CLOCK: Schema = Schema { name: "rtutap.Clock", descriptors: RECORDING };
}

/// Bytes of one read, or of several within 20 ms.
#[derive(Clone, PartialEq, Message)]
pub(super) struct RawChunk {
    #[prost(uint64, tag = "1")]
    pub(super) stream_offset: u64,
    #[prost(bytes = "vec", tag = "2")]
    pub(super) data: Vec<u8>,
    #[prost(uint64, tag = "3")]
    pub(super) monotonic_ns: u64,
    #[prost(message, repeated, tag = "4")]
    pub(super) errors: Vec<LineError>,
    #[prost(uint64, tag = "5")]
    pub(super) ready_ns: u64,
    #[prost(message, repeated, tag = "6")]
    pub(super) earlier: Vec<Read>,
    #[prost(enumeration = "Dating", tag = "7")]
    pub(super) dating: i32,
}

/// Where the times of a chunk are from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Enumeration)]
#[repr(i32)]
pub(super) enum Dating {
    Read = 0,
    LineSpeed = 1,
    AfterSilence = 2,
}

/// A read merged into a later one's message.
#[derive(Clone, Copy, PartialEq, Message)]
pub(super) struct Read {
    #[prost(uint32, tag = "1")]
    pub(super) end: u32,
    #[prost(uint64, tag = "2")]
    pub(super) monotonic_ns: u64,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub(super) struct LineError {
    #[prost(uint32, tag = "1")]
    pub(super) offset: u32,
    #[prost(enumeration = "ErrorKind", tag = "2")]
    pub(super) kind: i32,
    #[prost(uint32, tag = "3")]
    pub(super) count: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Enumeration)]
#[repr(i32)]
pub(super) enum ErrorKind {
    Unknown = 0,
    ParityOrFraming = 1,
    Break = 2,
    Overrun = 3,
    Lost = 4,
}

#[derive(Clone, PartialEq, Message)]
pub(super) struct Line {
    #[prost(uint32, tag = "1")]
    pub(super) baud: u32,
    #[prost(uint32, tag = "2")]
    pub(super) data_bits: u32,
    #[prost(string, tag = "3")]
    pub(super) parity: String,
    #[prost(string, tag = "4")]
    pub(super) stop_bits: String,
    #[prost(double, optional, tag = "5")]
    pub(super) adapter_hold_ms: Option<f64>,
}

#[derive(Clone, Copy, PartialEq, Message)]
pub(super) struct Clock {
    #[prost(uint64, tag = "1")]
    pub(super) monotonic_ns: u64,
    #[prost(uint64, tag = "2")]
    pub(super) realtime_ns: u64,
}

/// The topic of what people noted.
pub(super) const NOTES: &str = "/notes";

/// What is read of a `foxglove.Log` on [`NOTES`].
#[derive(Clone, PartialEq, Message)]
pub(super) struct Note {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Seconds>,
    #[prost(string, tag = "3")]
    pub(super) message: String,
}

/// `google.protobuf.Timestamp`.
#[derive(Clone, Copy, PartialEq, Message)]
struct Seconds {
    #[prost(int64, tag = "1")]
    seconds: i64,
    #[prost(int32, tag = "2")]
    nanos: i32,
}

impl Note {
    /// The type of messages it is read from.
    pub(super) const SCHEMA: &str = "foxglove.Log";

    /// Returns the time it is about.
    pub(super) fn time(&self) -> Option<Timestamp> {
        let Seconds { seconds, nanos } = self.timestamp?;
        Some(Timestamp::from_ns(seconds.saturating_mul(SECOND).saturating_add(i64::from(nanos))))
    }
}

#[cfg(test)]
#[path = "schema_tests.rs"]
mod tests;
