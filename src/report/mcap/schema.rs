//! The messages of `decoded.proto` and `foxglove_log.proto`, and their descriptors for readers of recordings.

use prost::{Enumeration, Message};

/// `decoded.proto` compiled, as a `FileDescriptorSet`.
pub(super) const DECODED: &[u8] = include_bytes!("decoded.binpb");
/// `foxglove_log.proto` compiled, with `google/protobuf/timestamp.proto`.
pub(super) const FOXGLOVE_LOG: &[u8] = include_bytes!("foxglove_log.binpb");

#[derive(Clone, PartialEq, Message)]
pub(super) struct Transaction {
    #[prost(uint32, tag = "1")]
    pub(super) address: u32,
    #[prost(uint32, tag = "2")]
    pub(super) function: u32,
    #[prost(uint32, optional, tag = "3")]
    pub(super) start_register: Option<u32>,
    #[prost(uint32, optional, tag = "4")]
    pub(super) quantity: Option<u32>,
    #[prost(bytes = "vec", tag = "5")]
    pub(super) request: Vec<u8>,
    #[prost(bytes = "vec", tag = "6")]
    pub(super) response: Vec<u8>,
    #[prost(enumeration = "Outcome", tag = "7")]
    pub(super) outcome: i32,
    #[prost(uint32, optional, tag = "8")]
    pub(super) exception_code: Option<u32>,
    #[prost(double, optional, tag = "9")]
    pub(super) latency_ms: Option<f64>,
    #[prost(double, optional, tag = "10")]
    pub(super) latency_error_ms: Option<f64>,
    #[prost(uint64, tag = "11")]
    pub(super) stream_offset: u64,
    #[prost(string, tag = "12")]
    pub(super) device: String,
    #[prost(string, tag = "13")]
    pub(super) command: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Enumeration)]
#[repr(i32)]
pub(super) enum Outcome {
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
pub(super) struct Reading {
    #[prost(double, tag = "1")]
    pub(super) value: f64,
    #[prost(bytes = "vec", tag = "2")]
    pub(super) raw: Vec<u8>,
    #[prost(bool, tag = "3")]
    pub(super) derived: bool,
}

/// `google.protobuf.Timestamp`.
#[derive(Clone, Copy, PartialEq, Message)]
pub(super) struct Seconds {
    #[prost(int64, tag = "1")]
    pub(super) seconds: i64,
    #[prost(int32, tag = "2")]
    pub(super) nanos: i32,
}

/// `foxglove.Log`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Log {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Seconds>,
    #[prost(enumeration = "Level", tag = "2")]
    pub(super) level: i32,
    #[prost(string, tag = "3")]
    pub(super) message: String,
    #[prost(string, tag = "4")]
    pub(super) name: String,
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
