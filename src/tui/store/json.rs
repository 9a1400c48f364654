//! A row as a JSON line, with the keys that `decode --format json` prints.

use std::fmt;

use serde_json::{Value as Json, json};

use super::row::{Exchange, Remark, RemarkKind, Row, Run, RunKind};
use super::{List, Store};
use crate::device::Value;
use crate::report::{columns, value_json};
use crate::time::Span;

/// Is a row to be written as JSON.
pub struct RowJson<'a> {
    store: &'a Store,
    row: &'a Row,
}

impl<'a> RowJson<'a> {
    /// Takes a row of a store.
    pub fn new(store: &'a Store, row: &'a Row) -> Self {
        RowJson { store, row }
    }

    fn bus(&self) -> Json {
        self.store.buses().get(self.row.bus()).map_or(Json::Null, |bus| json!(&*bus.name))
    }

    fn bytes(&self, side: Option<u64>) -> Json {
        match side.and_then(|number| self.store.list(List::Frames).get(number)) {
            Some(Row::Run(run)) => json!(hex(&run.bytes)),
            _ => Json::Null,
        }
    }

    fn exchange(&self, row: &Exchange, key: &str) -> Json {
        match key {
            "type" => json!("transaction"),
            "id" | "request" | "response" if self.store.known_from().is_some() => Json::Null,
            "id" => json!(row.id),
            "start_ns" => json!(row.time.map(|time| time.as_ns())),
            "end_ns" => json!(row.end.map(|time| time.as_ns())),
            "address" => json!(row.address),
            "function" => json!(row.function.0),
            "start_register" => json!(row.register),
            "quantity" => json!(row.quantity),
            "outcome" => json!(row.outcome.name()),
            "exception_code" => json!(row.exception),
            "latency_ns" => middle(row.latency),
            "latency_error_ns" => error(row.latency),
            "request" => json!(row.ids[0]),
            "response" => json!(row.ids[1]),
            "request_bytes" => self.bytes(row.sides[0]),
            "response_bytes" => self.bytes(row.sides[1]),
            "device" => json!(row.device.as_deref()),
            "candidates" => row.candidates.iter().map(|id| json!(&**id)).collect(),
            "command" => json!(row.command.as_deref()),
            _ => Json::Null,
        }
    }

    fn run(&self, run: &Run, key: &str) -> Json {
        let (echo, boundary, confidence) = match run.kind {
            RunKind::Frame { echo, boundary, confidence } => (echo, boundary.name(), confidence),
            RunKind::Damaged(_) => (false, "", 0.0),
        };
        match key {
            "type" => json!(if run.reason().is_some() { "damaged" } else { "frame" }),
            "id" | "stream_offset" if self.store.known_from().is_some() => Json::Null,
            "id" => json!(run.id),
            "start_ns" => json!(run.time.map(|time| time.as_ns())),
            "end_ns" => json!(run.end.map(|time| time.as_ns())),
            "uncertainty_ns" => json!(run.time.map(|_| run.uncertainty_ns)),
            "stream_offset" => json!(run.stream_offset),
            "bytes" => json!(hex(&run.bytes)),
            "reason" => json!(run.reason().map(|reason| reason.name())),
            "role" => json!(run.role.name()),
            "echo" => json!(echo),
            "address" => json!(run.address),
            "function" => json!(run.function.map(|code| code.0)),
            "boundary" => json!(boundary),
            "confidence" => {
                serde_json::from_str(&value_json(&Value::Float32(confidence))).unwrap_or(Json::Null)
            }
            "gap_before_ns" => middle(run.gap),
            "gap_error_ns" => error(run.gap),
            "line_errors" => {
                let one = |error: &crate::decode::chunk::LineError| json!({"offset": error.offset, "kind": error.kind.name()});
                run.line_errors.iter().map(one).collect()
            }
            _ => Json::Null,
        }
    }

    fn remark(&self, row: &Remark) -> Json {
        let kind = match row.kind {
            RemarkKind::Lost => "lost",
            RemarkKind::Identified => "identified",
            RemarkKind::Note => "note",
        };
        let time = row.time.map(|time| time.as_ns());
        json!({"type": kind, "bus": self.bus(), "t_ns": time, "address": row.address, "text": &*row.text})
    }
}

impl fmt::Display for RowJson<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let keys = match self.row {
            Row::Exchange(_) => columns::transaction::KEYS,
            Row::Run(run) if run.reason().is_some() => columns::damaged::KEYS,
            Row::Run(_) => columns::frame::KEYS,
            Row::Remark(remark) => return write!(f, "{}", self.remark(remark)),
        };
        // By hand, for the order of the keys counts.
        for (index, key) in keys.iter().enumerate() {
            write!(f, "{}\"{key}\":", if index == 0 { "{" } else { "," })?;
            match self.row {
                _ if *key == "bus" => write!(f, "{}", self.bus())?,
                Row::Exchange(row) if *key == "fields" => fields(f, row)?,
                Row::Exchange(row) => write!(f, "{}", self.exchange(row, key))?,
                Row::Run(run) => write!(f, "{}", self.run(run, key))?,
                Row::Remark(_) => {}
            }
        }
        f.write_str("}")
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn middle(span: Option<Span>) -> Json {
    json!(span.map(|span| span.midpoint()))
}

fn error(span: Option<Span>) -> Json {
    json!(span.map(|span| span.half_width()))
}

/// Writes the fields that are sure and lie in a frame.
fn fields(f: &mut fmt::Formatter<'_>, row: &Exchange) -> fmt::Result {
    let sure = row.fields.iter().filter(|field| !field.is_guess && field.span.1 > 0);
    f.write_str("[")?;
    for (index, field) in sure.enumerate() {
        let value = value_json(&field.value);
        let (name, text) = (json!(&*field.name), json!(&*field.text));
        let (unit, side) = (json!(field.unit.as_deref()), json!(field.side.name()));
        let (start, end) = field.span;
        write!(f, "{}{{\"name\":{name},\"value\":{value}", if index == 0 { "" } else { "," })?;
        write!(f, ",\"text\":{text},\"unit\":{unit},\"in\":{side},\"span\":[{start},{end}]}}")?;
    }
    f.write_str("]")
}
