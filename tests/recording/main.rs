//! Recordings in MCAP: what is written comes back, whatever happens to the file.

mod damage;
mod parts;
mod round_trip;
mod traps;

use std::fs::File;
use std::path::{Path, PathBuf};

use rtutap::capture::Item;
use rtutap::capture::mcap::{BusId, BusSettings, Facts, Options, Recorder, Recording};
use rtutap::decode::chunk::{Chunk, LineError, Lost, ReadTime};
use rtutap::line::LineSettings;
use rtutap::simulate::{Adapter, Config, Read, Scenario, Simulation};
use rtutap::time::Timestamp;

/// An item of a recording, on its own.
#[derive(Clone, Debug, PartialEq)]
enum Found {
    Line(String, LineSettings, Option<i64>),
    Chunk(String, ReadTime, Vec<u8>, Vec<LineError>),
    Lost(String, Lost),
    Silence(String, Timestamp),
    Clock(u64, Timestamp),
    Note(Option<Timestamp>, String),
}

impl Found {
    /// Returns how many bytes of a bus it has.
    fn length(&self) -> usize {
        if let Found::Chunk(_, _, bytes, _) = self { bytes.len() } else { 0 }
    }
}

/// Reads what a simulated adapter hands over.
fn reads(scenario: &str, adapter: Adapter, frames: u64) -> Vec<Read> {
    let scenario = Scenario::named(scenario).expect("a scenario");
    let line = LineSettings::default();
    Simulation::new(Config { seed: 3, frames, line, adapter, scenario }).collect()
}

fn chunk(read: &Read) -> Chunk<'_> {
    Chunk { time: ReadTime::At(read.time), bytes: &read.bytes, line_errors: &read.line_errors }
}

fn bus(name: &str) -> BusSettings {
    BusSettings { name: name.to_owned(), adapter_hold_ns: Some(17_000_000), ..BusSettings::default() }
}

/// Begins a recording of one bus.
fn recorder(path: &Path, options: Options) -> (Recorder, BusId) {
    let mut recorder = Recorder::create(path, options).expect("a file of this test");
    let id = recorder.add_bus(bus("bus0")).expect("a disk that works");
    (recorder, id)
}

/// Writes reads, with a chunk of the file for each second of them.
fn record(path: &Path, options: Options, reads: &[Read]) -> Vec<PathBuf> {
    let (mut recorder, id) = recorder(path, options);
    for read in reads {
        recorder.write_chunk(id, &chunk(read), None).expect("a disk that works");
        recorder.tick(read.time).expect("a disk that works");
    }
    recorder.finish("finished").expect("a disk that works")
}

/// What a recording of these reads is expected to give.
fn expected(reads: &[Read]) -> Vec<Found> {
    let line = Found::Line("bus0".into(), LineSettings::default(), Some(17_000_000));
    let chunks = reads.iter().map(|read| {
        let time = ReadTime::At(read.time);
        Found::Chunk("bus0".into(), time, read.bytes.clone(), read.line_errors.clone())
    });
    std::iter::once(line).chain(chunks).collect()
}

#[expect(clippy::disallowed_methods, reason = "recordings are files")]
fn open(path: &Path) -> Recording {
    Recording::from_file(File::open(path).expect("a file of this test")).expect("a disk that works")
}

/// Reads on until there is nothing more.
fn rest(recording: &mut Recording) -> Vec<Found> {
    let mut found = Vec::new();
    while let Some(item) = recording.next_item().expect("a disk that works") {
        found.push(match item {
            Item::Line(BusSettings { name, line, adapter_hold_ns, .. }) => {
                Found::Line(name.clone(), *line, *adapter_hold_ns)
            }
            Item::Chunk { bus, chunk, .. } => {
                Found::Chunk(bus.into(), chunk.time, chunk.bytes.to_vec(), chunk.line_errors.to_vec())
            }
            Item::Lost { bus, lost } => Found::Lost(bus.into(), lost),
            Item::Silence { bus, until } => Found::Silence(bus.into(), until),
            Item::Clock { monotonic_ns, realtime } => Found::Clock(monotonic_ns, realtime),
            Item::Note { time, text } => Found::Note(time, text.into()),
        });
    }
    found
}

fn read(path: &Path) -> (Vec<Found>, Facts) {
    let mut recording = open(path);
    let found = rest(&mut recording);
    (found, recording.facts().clone())
}

fn at(ns: i64) -> ReadTime {
    ReadTime::At(Timestamp::from_ns(ns))
}
