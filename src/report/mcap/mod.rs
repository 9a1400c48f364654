//! Decoded messages of a recording: what a viewer shows beside the bytes. All of them can be made anew.

mod schema;

use std::collections::{BTreeMap, VecDeque};

use prost::Message as _;

use self::schema::{Level, Log, Seconds};
use crate::analyze::verify::{Finding, Severity};
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::{Meaning, Reading};
use crate::pipeline::Event;
use crate::report::columns;
use crate::time::{MILLISECOND, SECOND, Timestamp};

/// How many frames are remembered to tell where in the stream a transaction began.
const MOST_FRAMES: usize = 4096;

/// Is a message of a recording, ready to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// The topic of its channel.
    pub topic: String,
    /// The full name of the protobuf message.
    pub schema: &'static str,
    /// The `FileDescriptorSet` that defines it.
    pub descriptors: &'static [u8],
    /// Facts about the channel.
    pub metadata: BTreeMap<String, String>,
    /// When its cause was on the wire; `None` where the input has no times.
    pub time: Option<Timestamp>,
    /// The message, encoded.
    pub payload: Vec<u8>,
}

/// Makes the decoded messages of one bus.
#[derive(Debug)]
pub struct Messages {
    bus: String,
    /// Id and stream offset of the latest frames and damaged runs, in order.
    frames: VecDeque<(u64, u64)>,
    /// Start of the latest transaction, and the bytes of each quantity in its response.
    start: Option<Timestamp>,
    quantities: Vec<(String, Vec<u8>)>,
}

impl Messages {
    /// Begins with a bus.
    pub fn new(bus: &str) -> Self {
        Messages { bus: bus.to_owned(), frames: VecDeque::new(), start: None, quantities: Vec::new() }
    }

    /// Returns the message of an event, if it has one.
    pub fn event(&mut self, event: &Event<'_>) -> Option<Message> {
        match event {
            Event::Frame(frame) => self.frame(frame.place.id, frame.place.stream_offset),
            Event::Damaged(damaged) => self.frame(damaged.place.id, damaged.place.stream_offset),
            Event::Transaction { transaction, meaning, .. } => {
                self.start = columns::began(transaction);
                self.remember_quantities(transaction, meaning);
                let payload = self.transaction(transaction, meaning).encode_to_vec();
                return Some(self.message("transactions", "rtutap.Transaction", payload));
            }
            Event::Reading { reading, address, .. } => return Some(self.reading(*address, reading)),
            Event::Finding(finding) => return Some(self.finding(finding)),
            Event::Lost(_) | Event::Identified { .. } => {}
        }
        None
    }

    fn message(&self, topic: &str, schema: &'static str, payload: Vec<u8>) -> Message {
        let topic = format!("/{}/{topic}", self.bus);
        let (metadata, time) = (BTreeMap::new(), self.start);
        Message { topic, schema, descriptors: schema::DECODED, metadata, time, payload }
    }

    fn finding(&self, finding: &Finding) -> Message {
        let timestamp = finding.time.map(|time| Seconds {
            seconds: time.as_ns().div_euclid(SECOND),
            nanos: time.as_ns().rem_euclid(SECOND) as i32, // below 10^9
        });
        let level = match finding.severity {
            Severity::Note => Level::Info,
            Severity::Warning => Level::Warning,
            Severity::Error => Level::Error,
        };
        let address = finding.address.map_or_else(String::new, |address| format!(" at {address}"));
        let message =
            format!("{} ({}{address}): {}", finding.rule.name, finding.party.name(), finding.message);
        let log = Log { timestamp, level: level as i32, message, name: finding.rule.code.to_owned() };
        Message {
            descriptors: schema::FOXGLOVE_LOG,
            time: finding.time,
            ..self.message("findings", "foxglove.Log", log.encode_to_vec())
        }
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

    fn reading(&self, address: u8, reading: &Reading<'_>) -> Message {
        let measured = self.quantities.iter().find(|(name, _)| name == reading.quantity && !reading.derived);
        let message = schema::Reading {
            value: reading.value.as_f64().unwrap_or(f64::NAN),
            raw: measured.map(|(_, bytes)| bytes.clone()).unwrap_or_default(),
            derived: reading.derived,
        };
        let topic = format!("sensor/{address}/{}", reading.quantity);
        let unit = ("unit".to_owned(), reading.unit.unwrap_or_default().to_owned());
        let metadata = BTreeMap::from([unit, ("address".to_owned(), address.to_string())]);
        Message { metadata, ..self.message(&topic, "rtutap.Reading", message.encode_to_vec()) }
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
