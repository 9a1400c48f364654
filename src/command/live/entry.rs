//! What goes to the writer: what was received and what it decodes to, in one order, owned.

use std::sync::Arc;

use crate::capture::Item;
use crate::capture::mcap::BusSettings;
use crate::decode::chunk::{Chunk, LineError, Lost, ReadTime};
use crate::report::mcap::Message;
use crate::time::Timestamp;

/// Is one thing to be written.
#[derive(Clone, Debug)]
pub(super) enum Entry {
    /// A bus begins, or goes on with other settings.
    Begin(BusSettings),
    /// The bytes of one read.
    Chunk {
        bus: Arc<str>,
        time: ReadTime,
        ready: Option<Timestamp>,
        bytes: Box<[u8]>,
        line_errors: Box<[LineError]>,
    },
    /// Bytes are missing.
    Lost { bus: Arc<str>, lost: Lost },
    /// Silence decided something.
    Silence { bus: Arc<str>, until: Timestamp },
    /// What the bytes decode to.
    Message(Box<Message>),
    /// What both clocks show.
    Clock { monotonic_ns: u64, realtime: Timestamp },
    /// Time has passed: what is due can be done.
    Tick(Timestamp),
    /// Nothing is written for a while: the file can be finished.
    Rest,
}

impl Entry {
    /// Makes the entry of an item; settings have their own.
    pub(super) fn of(item: &Item<'_>, bus: Arc<str>) -> Option<Self> {
        Some(match item {
            // Live buses have no notes but those that the screen takes.
            Item::Line(_) | Item::Note { .. } => return None,
            Item::Chunk { chunk, ready, .. } => Entry::Chunk {
                bus,
                time: chunk.time,
                ready: *ready,
                bytes: chunk.bytes.into(),
                line_errors: chunk.line_errors.into(),
            },
            Item::Lost { lost, .. } => Entry::Lost { bus, lost: *lost },
            Item::Silence { until, .. } => Entry::Silence { bus, until: *until },
            Item::Clock { monotonic_ns, realtime } => {
                Entry::Clock { monotonic_ns: *monotonic_ns, realtime: *realtime }
            }
        })
    }

    /// Returns the item again.
    pub(super) fn item(&self) -> Option<Item<'_>> {
        Some(match self {
            Entry::Chunk { bus, time, ready, bytes, line_errors } => {
                Item::Chunk { bus, chunk: Chunk { time: *time, bytes, line_errors }, ready: *ready }
            }
            Entry::Lost { bus, lost } => Item::Lost { bus, lost: *lost },
            Entry::Silence { bus, until } => Item::Silence { bus, until: *until },
            _ => return None,
        })
    }

    /// Estimates the memory it takes, in bytes.
    pub(super) fn size(&self) -> usize {
        let beside = match self {
            Entry::Chunk { bytes, line_errors, .. } => bytes.len() + line_errors.len() * 8,
            Entry::Message(message) => size_of::<Message>() + message.topic.len() + message.payload.len(),
            _ => 0,
        };
        // The allocator's own share of each allocation is about 16 bytes.
        size_of::<Entry>() + 32 + beside
    }
}
