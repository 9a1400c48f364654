//! What several test programs share: pipelines, rows as text, frames of real buses, and ways to spoil them.

#![allow(dead_code, reason = "each test program uses a part of it")]

pub mod traffic;

use std::sync::{Arc, OnceLock};

use rtutap::decode::chunk::{Chunk, ReadTime};
use rtutap::device::{Devices, Environment, Profiles};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Options, Pipeline};
use rtutap::report::{Format, Json};

/// Is what one read brings, kept so that it can be fed again.
#[derive(Clone, Debug, PartialEq)]
pub struct Read {
    pub time: ReadTime,
    pub bytes: Vec<u8>,
}

/// Returns the built-in profiles, parsed once.
pub fn profiles() -> Arc<Profiles> {
    static PROFILES: OnceLock<Arc<Profiles>> = OnceLock::new();
    Arc::clone(PROFILES.get_or_init(|| Arc::new(Profiles::built_in())))
}

/// Makes a pipeline that knows the built-in profiles and has seen nothing.
pub fn pipeline(line: LineSettings, adapter_hold_ns: Option<i64>) -> Pipeline {
    let options = Options { readings: true, ..Options::new(line, adapter_hold_ns) };
    let profiles = profiles();
    let shapes = profiles.shapes();
    Pipeline::new(options, Devices::new(profiles, Environment::default()), shapes)
}

/// Makes a pipeline that judges what it decodes, and gives no readings.
pub fn judging_pipeline(line: LineSettings) -> Pipeline {
    let options = Options { findings: true, ..Options::new(line, None) };
    let profiles = profiles();
    let shapes = profiles.shapes();
    Pipeline::new(options, Devices::new(profiles, Environment::default()), shapes)
}

/// Writes all there is to know about an event: what Rust shows of it, and its JSON line.
pub fn row(event: &Event<'_>) -> String {
    let mut json = Vec::new();
    Json::default().row("bus0", event, &mut json);
    let json = String::from_utf8(json).expect("JSON is UTF-8");
    match event {
        Event::Frame(frame) => format!("{frame:?}"),
        Event::Damaged(damaged) => format!("{damaged:?}"),
        Event::Transaction { transaction, .. } => format!("{transaction:?} {json}"),
        _ => json,
    }
}

/// Takes all events that are there, as rows.
pub fn drain(pipeline: &mut Pipeline, rows: &mut Vec<String>) {
    while let Some(event) = pipeline.poll_event() {
        rows.push(row(&event));
    }
}

/// Feeds a read.
pub fn feed(pipeline: &mut Pipeline, read: &Read) {
    pipeline.handle_bytes(&Chunk { time: read.time, bytes: &read.bytes, line_errors: &[] });
}

/// Decodes reads to the end of the input.
pub fn decode(mut pipeline: Pipeline, reads: &[Read]) -> Vec<String> {
    let mut rows = Vec::new();
    for read in reads {
        feed(&mut pipeline, read);
        drain(&mut pipeline, &mut rows);
    }
    pipeline.finish();
    drain(&mut pipeline, &mut rows);
    rows
}

/// Fails with the first row that differs, and where.
#[track_caller]
pub fn assert_same_rows(left: &[String], right: &[String], what: &str) {
    if let Some(at) = (0..left.len().max(right.len())).find(|at| left.get(*at) != right.get(*at)) {
        let before = at.checked_sub(1).and_then(|at| left.get(at));
        panic!(
            "{what}: row {at} differs\nbefore {before:?}\n left  {:?}\n right {:?}",
            left.get(at),
            right.get(at)
        );
    }
}
