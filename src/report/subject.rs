//! What the display filter may ask of an event.

use chrono::{DateTime, Local, Timelike};

use super::columns;
use crate::analyze::filter::{Field, FieldValue, Filter, Subject};
use crate::decode::frame::{Reason, Role};
use crate::decode::function::{ExceptionCode, FunctionCode};
use crate::decode::pdu;
use crate::decode::transaction::{Outcome, Side};
use crate::device::Value;
use crate::pipeline::Event;
use crate::time::{SECOND, Timestamp};

/// Tells whether an event of a bus passes a filter.
pub fn passes(filter: &Filter, bus: &str, event: &Event<'_>) -> bool {
    filter.matches(&EventSubject { bus, event })
}

struct EventSubject<'a> {
    bus: &'a str,
    event: &'a Event<'a>,
}

impl EventSubject<'_> {
    /// Returns request and response of a transaction, as far as there are.
    fn sides(&self) -> impl Iterator<Item = Side<'_>> {
        let sides = match self.event {
            Event::Transaction { transaction, .. } => [transaction.request, transaction.response],
            _ => [None, None],
        };
        sides.into_iter().flatten()
    }

    fn start(&self) -> Option<Timestamp> {
        match self.event {
            Event::Frame(frame) => Some(frame.place.time?.start.midpoint()),
            Event::Damaged(damaged) => Some(damaged.place.time?.start.midpoint()),
            Event::Lost(lost) => lost.time,
            Event::Identified { time, .. } | Event::Reading { time, .. } => *time,
            Event::Transaction { transaction, .. } => columns::began(transaction),
            Event::Finding(finding) => finding.time,
        }
    }
}

impl Subject for EventSubject<'_> {
    fn address(&self) -> Option<u8> {
        match self.event {
            Event::Frame(frame) => Some(frame.address()),
            Event::Damaged(damaged) => damaged.address,
            Event::Identified { identified, .. } => Some(identified.address),
            Event::Transaction { transaction, .. } => Some(transaction.address),
            Event::Reading { address, .. } => Some(*address),
            Event::Finding(finding) => finding.address,
            Event::Lost(_) => None,
        }
    }

    fn function(&self) -> Option<FunctionCode> {
        match self.event {
            Event::Frame(frame) => Some(frame.function()),
            Event::Damaged(damaged) => damaged.function,
            Event::Transaction { transaction, .. } => Some(transaction.function),
            _ => None,
        }
    }

    fn start_register(&self) -> Option<u16> {
        match self.event {
            Event::Frame(frame) => pdu::start_register(frame.place.bytes, frame.role),
            Event::Transaction { transaction, .. } => transaction.start_register,
            _ => None,
        }
    }

    fn quantity(&self) -> Option<u16> {
        match self.event {
            Event::Frame(frame) => pdu::quantity(frame.place.bytes, frame.role),
            Event::Transaction { transaction, .. } => transaction.quantity,
            _ => None,
        }
    }

    fn exception_code(&self) -> Option<ExceptionCode> {
        match self.event {
            Event::Frame(frame) => pdu::exception_code(frame.place.bytes),
            Event::Transaction { transaction, .. } => transaction.exception_code,
            _ => None,
        }
    }

    fn outcome(&self) -> Option<Outcome> {
        match self.event {
            Event::Transaction { transaction, .. } => Some(transaction.outcome),
            _ => None,
        }
    }

    fn role(&self) -> Option<Role> {
        match self.event {
            Event::Frame(frame) => Some(frame.role),
            Event::Damaged(damaged) => Some(damaged.role),
            _ => None,
        }
    }

    fn reason(&self) -> Option<Reason> {
        match self.event {
            Event::Damaged(damaged) => Some(damaged.reason),
            _ => None,
        }
    }

    fn is_damaged(&self) -> bool {
        self.reason().is_some() || self.sides().any(|side| side.damaged)
    }

    fn is_echo(&self) -> bool {
        matches!(self.event, Event::Frame(frame) if frame.echo)
    }

    fn crc_is_good(&self) -> Option<bool> {
        match self.event {
            Event::Frame(_) => Some(true),
            Event::Damaged(_) => Some(false),
            Event::Transaction { .. } => Some(!self.is_damaged()),
            _ => None,
        }
    }

    fn device(&self) -> Option<&str> {
        match self.event {
            Event::Identified { identified, .. } => Some(&identified.device),
            Event::Transaction { meaning, .. } => meaning.device(),
            Event::Reading { reading, .. } => reading.device,
            _ => None,
        }
    }

    fn serial_number(&self) -> Option<&str> {
        match self.event {
            Event::Identified { identified, .. } => identified.serial_number.as_deref(),
            Event::Transaction { meaning, .. } => meaning.serial_number(),
            Event::Reading { reading, .. } => reading.serial_number,
            _ => None,
        }
    }

    fn command(&self) -> Option<&str> {
        match self.event {
            Event::Transaction { meaning, .. } => meaning.command(),
            _ => None,
        }
    }

    fn bus(&self) -> Option<&str> {
        Some(self.bus)
    }

    fn latency_ns(&self) -> Option<i64> {
        match self.event {
            Event::Transaction { transaction, .. } => Some(transaction.latency?.midpoint()),
            _ => None,
        }
    }

    fn start_ns(&self) -> Option<i64> {
        self.start().map(Timestamp::as_ns)
    }

    fn time_of_day_ns(&self) -> Option<i64> {
        let time = DateTime::from_timestamp_nanos(self.start_ns()?).with_timezone(&Local);
        let seconds = i64::from(time.num_seconds_from_midnight());
        Some(seconds * SECOND + i64::from(time.nanosecond() % SECOND as u32))
    }

    fn any_finding(&self, test: &mut dyn FnMut(&str) -> bool) -> bool {
        match self.event {
            Event::Transaction { codes, .. } => codes.iter().any(|code| test(code)),
            Event::Finding(finding) => test(finding.rule.code),
            _ => false,
        }
    }

    fn any_bytes(&self, test: &mut dyn FnMut(&[u8]) -> bool) -> bool {
        match self.event {
            Event::Frame(frame) => test(frame.place.bytes),
            Event::Damaged(damaged) => test(damaged.place.bytes),
            _ => self.sides().any(|side| test(side.bytes)),
        }
    }

    fn any_field(&self, name: &str, test: &mut dyn FnMut(Field<'_>) -> bool) -> bool {
        let mut any = |value: &Value<'_>, text: String| {
            let value = match value {
                Value::Float32(number) => FieldValue::Single(*number),
                Value::Float64(number) => FieldValue::Number(*number),
                Value::Integer(number) => FieldValue::Number(*number as f64),
                Value::Text(text) => FieldValue::Text(text),
                Value::Boolean(truth) => FieldValue::Flag(*truth),
                Value::Null => FieldValue::Null,
            };
            test(Field { value, text: Some(&text) })
        };
        match self.event {
            Event::Transaction { meaning, .. } => {
                let mut named = meaning.fields().filter(|field| field.name == name);
                let mut derived =
                    meaning.readings().filter(|reading| reading.derived && reading.quantity == name);
                named.any(|field| any(&field.value, field.to_string()))
                    || derived.any(|reading| any(&reading.value, reading.to_string()))
            }
            Event::Reading { reading, .. } => {
                reading.quantity == name && any(&reading.value, reading.to_string())
            }
            _ => false,
        }
    }
}
