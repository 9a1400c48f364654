//! What an exchange tells: its fields, and what they say of the device.

use std::sync::Arc;

use chrono::NaiveDateTime;

use super::Rows;
use super::device::{Change, Device, Quantity, Register, SensorClock};
use super::row::{Exchange, Field, Row};
use crate::decode::frame::Role;
use crate::decode::pdu::{self, PduValue};
use crate::decode::transaction::Transaction;
use crate::device::{Meaning, Value};
use crate::report::words;
use crate::time::Timestamp;

/// How far back the frames of a transaction are looked for.
pub(super) const LOOK_BACK: u64 = 4096;

/// Finds the number of a frame that came a moment ago.
pub(super) fn frame_number(frames: &Rows, id: u64) -> Option<u64> {
    let latest = frames.pages.total().saturating_sub(LOOK_BACK)..frames.pages.total();
    latest.rev().find(|number| matches!(frames.pages.get(*number), Some(Row::Run(run)) if run.id == id))
}

/// Returns the fields of an exchange, then what is derived from them.
pub(super) fn fields(meaning: &Meaning<'_>, names: &mut impl FnMut(&str) -> Arc<str>) -> Box<[Field]> {
    let mut fields = Vec::new();
    for (field, mark) in words::marked_fields(meaning) {
        let end = |at: usize| u16::try_from(at).unwrap_or(u16::MAX);
        fields.push(Field {
            name: names(field.name),
            value: owned(&field.value),
            text: field.to_string().into(),
            unit: field.unit.map(&mut *names),
            span: (end(field.span.start), end(field.span.end)),
            side: field.side,
            is_guess: !mark.is_empty(),
            is_implausible: field.is_implausible(),
        });
    }
    for reading in meaning.readings().filter(|reading| reading.derived) {
        fields.push(Field {
            name: names(reading.quantity),
            value: owned(&reading.value),
            text: reading.to_string().into(),
            unit: reading.unit.map(&mut *names),
            span: (0, 0),
            side: Role::Unknown,
            is_guess: false,
            is_implausible: reading.is_implausible(),
        });
    }
    fields.into()
}

/// Makes a value its own.
fn owned(value: &Value<'_>) -> Value<'static> {
    match value {
        Value::Text(text) => Value::Text(text.to_string().into()),
        Value::Float32(number) => Value::Float32(*number),
        Value::Float64(number) => Value::Float64(*number),
        Value::Integer(number) => Value::Integer(*number),
        Value::Boolean(truth) => Value::Boolean(*truth),
        Value::Null => Value::Null,
    }
}

/// Returns the values of measurements of which the likeliest reading is all there is.
pub(super) fn guesses(exchange: &Exchange) -> Vec<Quantity> {
    let is_measurement = exchange.title.starts_with("get-measurement");
    let fields = exchange.fields.iter().filter(|field| is_measurement && field.is_guess);
    let quantity = |field: &Field| Quantity {
        name: Arc::clone(&field.name),
        unit: None,
        text: field.text.clone(),
        value: field.value.as_f64(),
        time: exchange.end,
        is_implausible: field.is_implausible,
        is_derived: false,
        is_guess: true,
        history: super::Pages::default(),
    };
    fields.map(quantity).collect()
}

/// Returns the registers that an exchange read or wrote, with their raw words.
pub(super) fn register(exchange: &Exchange, row: &Transaction<'_>) -> Option<Register> {
    let (side, role) = match words::is_write(row.function) {
        true => (row.request, Role::Request),
        false => (row.response, Role::Response),
    };
    let dissection = side.filter(|side| !side.damaged).map(|side| pdu::dissect(side.bytes, role));
    let words = dissection.and_then(|dissection| {
        dissection.fields.iter().find_map(|field| match field.value {
            PduValue::Registers(words) => Some(words),
            _ => None,
        })
    });
    Some(Register {
        function: row.function.0,
        start: exchange.register?,
        quantity: exchange.quantity,
        title: Arc::clone(&exchange.title),
        words: words.unwrap_or_default().into(),
        count: 1,
        time: exchange.end,
        outcome: exchange.outcome,
    })
}

/// Takes what an exchange tells of the device beside its measurements.
pub(super) fn settings(device: &mut Device, exchange: &Exchange, is_write: bool) {
    for field in exchange.fields.iter().filter(|field| !field.is_guess && field.span.1 > 0) {
        match (&*field.name, &field.value) {
            ("serial_number" | "type_byte", _) => {}
            ("software_version", _) => device.firmware = Some(field.text.clone()),
            ("hardware_version", _) => device.hardware = Some(field.text.clone()),
            ("error_flag", _) => device.error_flag = Some(field.text.clone()),
            ("time", Value::Text(text)) if !is_write => {
                let shown = NaiveDateTime::parse_from_str(text, "%Y-%m-%dT%H:%M:%S").ok();
                let shown = shown.and_then(|time| time.and_utc().timestamp_nanos_opt());
                device.clock = shown
                    .zip(exchange.end)
                    .map(|(shown, at)| SensorClock { shown: Timestamp::from_ns(shown), at });
            }
            ("time", _) => {}
            (name, _) if device.quantities.iter().any(|quantity| *quantity.name == *name) => {}
            _ => {
                let text = field.text.clone();
                device.set(&field.name, Change { time: exchange.end, text, is_written: is_write });
            }
        }
    }
}
