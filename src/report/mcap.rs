//! Decoded messages of a recording: what a viewer shows beside the bytes. All of them can be made anew.

use std::collections::{BTreeMap, VecDeque};

use crate::capture::mcap::schema::{self, Log, Seconds};
use crate::capture::mcap::{ChannelId, Level, RecordError, Recorder, Schema};
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::{Meaning, Reading};
use crate::pipeline::Event;
use crate::report::columns;
use crate::time::{MILLISECOND, SECOND, Timestamp};

/// How many frames are remembered to tell where in the stream a transaction began.
const MOST_FRAMES: usize = 4096;

/// Writes the decoded messages of one bus.
pub struct Messages {
    bus: String,
    transactions: ChannelId,
    sensors: BTreeMap<(u8, String), ChannelId>,
    /// Id and stream offset of the latest frames and damaged runs, in order.
    frames: VecDeque<(u64, u64)>,
    /// Start of the latest transaction, and the bytes of each quantity in its response.
    start: Option<Timestamp>,
    quantities: Vec<(String, Vec<u8>)>,
}

impl Messages {
    /// Prepares the channels of a bus.
    pub fn new(bus: &str, recorder: &mut Recorder) -> Self {
        let topic = format!("/{bus}/transactions");
        Messages {
            bus: bus.to_owned(),
            transactions: recorder.channel(&topic, Schema::Transaction, BTreeMap::new()),
            sensors: BTreeMap::new(),
            frames: VecDeque::new(),
            start: None,
            quantities: Vec::new(),
        }
    }

    /// Writes the message of an event, if it has one.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn event(&mut self, event: &Event<'_>, recorder: &mut Recorder) -> Result<(), RecordError> {
        match event {
            Event::Frame(frame) => self.frame(frame.place.id, frame.place.stream_offset),
            Event::Damaged(damaged) => self.frame(damaged.place.id, damaged.place.stream_offset),
            Event::Transaction { transaction, meaning } => {
                self.start = columns::began(transaction);
                self.remember_quantities(transaction, meaning);
                let message = self.transaction(transaction, meaning);
                recorder.write_message(self.transactions, self.start, &message)?;
            }
            Event::Reading { reading, address, .. } => self.reading(*address, reading, recorder)?,
            Event::Lost(_) | Event::Identified { .. } => {}
        }
        Ok(())
    }

    /// Writes a finding: `code` is its rule, `cause` when what it is about was on the wire.
    ///
    /// # Errors
    /// When the recording cannot be written.
    pub fn finding(
        &mut self,
        level: Level,
        code: &str,
        message: &str,
        cause: Option<Timestamp>,
        recorder: &mut Recorder,
    ) -> Result<(), RecordError> {
        let channel = recorder.channel(&format!("/{}/findings", self.bus), Schema::Log, BTreeMap::new());
        let timestamp = cause.map(|time| Seconds {
            seconds: time.as_ns().div_euclid(SECOND),
            nanos: time.as_ns().rem_euclid(SECOND) as i32, // below 10^9
        });
        let log = Log { timestamp, level: level as i32, message: message.to_owned(), name: code.to_owned() };
        recorder.write_message(channel, cause, &log)
    }

    fn frame(&mut self, id: u64, stream_offset: u64) {
        if self.frames.len() == MOST_FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back((id, stream_offset));
    }

    fn stream_offset(&self, id: u64) -> u64 {
        let found = self.frames.binary_search_by_key(&id, |(id, _)| *id);
        found.ok().and_then(|at| self.frames.get(at)).map_or(0, |(_, offset)| *offset)
    }

    /// Keeps the bytes of what was measured, for the readings that follow.
    fn remember_quantities(&mut self, transaction: &Transaction<'_>, meaning: &Meaning<'_>) {
        self.quantities.clear();
        let response = transaction.response.map_or(&[][..], |side| side.bytes);
        for field in meaning.fields().filter(|field| field.is_quantity) {
            let bytes = response.get(field.span.clone()).unwrap_or_default();
            self.quantities.push((field.name.to_owned(), bytes.to_vec()));
        }
    }

    fn transaction(&self, transaction: &Transaction<'_>, meaning: &Meaning<'_>) -> schema::Transaction {
        let milliseconds = |ns: i64| ns as f64 / MILLISECOND as f64;
        let first = transaction.request.or(transaction.response);
        let bytes = |side: Option<crate::decode::transaction::Side<'_>>| {
            side.map_or_else(Vec::new, |side| side.bytes.to_vec())
        };
        schema::Transaction {
            address: transaction.address.into(),
            function: transaction.function.0.into(),
            start_register: transaction.start_register.map(Into::into),
            quantity: transaction.quantity.map(Into::into),
            request: bytes(transaction.request),
            response: bytes(transaction.response),
            outcome: outcome(transaction.outcome) as i32,
            exception_code: transaction.exception_code.map(|code| code.0.into()),
            latency_ms: transaction.latency.map(|latency| milliseconds(latency.midpoint())),
            latency_error_ms: transaction.latency.map(|latency| milliseconds(latency.half_width())),
            stream_offset: first.map_or(0, |side| self.stream_offset(side.id)),
            device: meaning.device().unwrap_or_default().to_owned(),
            command: meaning.command().unwrap_or_default().to_owned(),
        }
    }

    fn reading(
        &mut self,
        address: u8,
        reading: &Reading<'_>,
        recorder: &mut Recorder,
    ) -> Result<(), RecordError> {
        let bus = &self.bus;
        let key = (address, reading.quantity.to_owned());
        let channel = *self.sensors.entry(key).or_insert_with(|| {
            let topic = format!("/{bus}/sensor/{address}/{}", reading.quantity);
            let unit = ("unit".to_owned(), reading.unit.unwrap_or_default().to_owned());
            let metadata = BTreeMap::from([unit, ("address".to_owned(), address.to_string())]);
            recorder.channel(&topic, Schema::Reading, metadata)
        });
        let measured = self.quantities.iter().find(|(name, _)| name == reading.quantity && !reading.derived);
        let message = schema::Reading {
            value: reading.value.as_f64().unwrap_or(f64::NAN),
            raw: measured.map(|(_, bytes)| bytes.clone()).unwrap_or_default(),
            derived: reading.derived,
        };
        recorder.write_message(channel, self.start, &message)
    }
}

fn outcome(outcome: Outcome) -> schema::Outcome {
    match outcome {
        Outcome::Answered => schema::Outcome::Answered,
        Outcome::Exception => schema::Outcome::Exception,
        Outcome::NoResponse => schema::Outcome::NoResponse,
        Outcome::Late => schema::Outcome::Late,
        Outcome::Unsolicited => schema::Outcome::Unsolicited,
        Outcome::Broadcast => schema::Outcome::Broadcast,
        Outcome::Damaged => schema::Outcome::Damaged,
    }
}
