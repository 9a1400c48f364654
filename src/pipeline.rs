//! Stands in for the pipeline until it is there.
#![expect(missing_docs, reason = "a stand-in")]
use crate::decode::{
    chunk::Chunk,
    frame::{Damaged, Frame},
    shape::Shapes,
    transaction::Transaction,
};
use crate::device::{Devices, Identified, Meaning, Reading};
use crate::{line::LineSettings, time::Timestamp};
pub struct Options {
    pub line: LineSettings,
    pub adapter_hold_ns: Option<i64>,
    pub first_frame_id: u64,
    pub first_transaction_id: u64,
    pub readings: bool,
}
pub struct Pipeline;
impl Pipeline {
    pub fn new(_: Options, _: Devices, _: Shapes) -> Self {
        Self
    }
    pub fn handle_bytes(&mut self, _: &Chunk<'_>) {}
    pub fn handle_timeout(&mut self, _: Timestamp) {}
    pub fn poll_timeout(&self) -> Option<Timestamp> {
        None
    }
    pub fn finish(&mut self) {}
    pub fn poll_event(&mut self) -> Option<Event<'_>> {
        None
    }
    pub fn next_ids(&self) -> (u64, u64) {
        (0, 0)
    }
    pub fn settled_frame_id(&self) -> u64 {
        0
    }
}
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LostKind {
    Overrun,
    Queue,
    Disk,
    SourceGone,
}
impl LostKind {
    pub fn name(self) -> &'static str {
        "overrun"
    }
}
pub struct Lost {
    pub time: Option<Timestamp>,
    pub stream_offset: u64,
    pub kind: LostKind,
    pub count: u64,
}
pub enum Event<'a> {
    Frame(Frame<'a>),
    Damaged(Damaged<'a>),
    Lost(Lost),
    Identified { identified: Identified, time: Option<Timestamp> },
    Transaction { transaction: Transaction<'a>, meaning: Meaning<'a> },
    Reading { reading: Reading<'a>, time: Option<Timestamp>, address: u8, transaction: u64 },
}
