//! How fast a recording in MCAP is read and decoded, against the same bytes raw.
//!
//! `cargo bench --bench recording` takes 20 MB of bus bytes behind a 16 ms adapter; `MEGABYTES=5` as many.
//! `RECORDING=FILE` also opens that file, and reads the minute in its middle; a large one is made by
//! `rtutap simulate --frames 9500000 -o FILE` (1 GB). Times are those on the processor, the best of three; those of
//! whole commands are what a user waits, the median of nine, for they read a recording on a second core.

#![allow(clippy::print_stdout, reason = "the figures are what it is for")]
#![allow(clippy::disallowed_methods, reason = "recordings are files, and a benchmark reads the clock")]

mod measure;

use std::fs::File;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use measure::best;
use rtutap::capture::mcap::{BusSettings, Options, Recorder, Recording};
use rtutap::capture::{Input, InputFormat, Item};
use rtutap::decode::chunk::{Chunk, ReadTime};
use rtutap::device::{Devices, Environment, Profiles};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Options as PipelineOptions, Pipeline};
use rtutap::report::info::Info;
use rtutap::simulate::{Adapter, Config, Read, Scenario, Simulation};
use rtutap::time::{SECOND, Timestamp};

fn main() {
    let megabytes: usize = std::env::var("MEGABYTES").ok().and_then(|text| text.parse().ok()).unwrap_or(20);
    let directory = tempfile::tempdir().expect("a directory");
    let (raw, mcap) = (directory.path().join("bus.bin"), directory.path().join("bus.mcap"));
    let reads = reads(megabytes * 1_000_000);
    write(&reads, &raw, &mcap);
    println!("{megabytes} MB in {} reads, {} MB in MCAP", reads.len(), size(&mcap) / 1_000_000);
    let baseline = best(|| info(&raw, Some(InputFormat::Raw)));
    report("info of raw bytes", megabytes, baseline, baseline);
    report("reads alone from MCAP", megabytes, best(|| skim(&mcap)), baseline);
    report("info of reads in memory", megabytes, best(|| info_of(&reads)), baseline);
    report("info of MCAP", megabytes, best(|| info(&mcap, None)), baseline);
    drop(reads);
    for arguments in [&["info"][..], &["decode", "--format", "json"]] {
        compare(arguments, &raw, &mcap, megabytes);
    }
    if let Some(path) = std::env::var_os("RECORDING").map(PathBuf::from) {
        middle(&path);
    }
}

fn reads(total: usize) -> Vec<Read> {
    let scenario = Scenario::named("installation").expect("a scenario");
    let (line, adapter) = (LineSettings::default(), Adapter::Ftdi16);
    let simulation = Simulation::new(Config { seed: 9, frames: u64::MAX, line, adapter, scenario });
    let mut length = 0;
    let within = |read: &Read| {
        length += read.bytes.len();
        length <= total
    };
    simulation.take_while(within).collect()
}

fn chunk(read: &Read) -> Chunk<'_> {
    Chunk { time: ReadTime::At(read.time), bytes: &read.bytes, line_errors: &read.line_errors }
}

fn write(reads: &[Read], raw: &Path, mcap: &Path) {
    let bytes: Vec<u8> = reads.iter().flat_map(|read| read.bytes.iter().copied()).collect();
    std::fs::write(raw, bytes).expect("a disk that works");
    let mut recorder = Recorder::create(mcap, Options::default()).expect("a disk that works");
    let settings = BusSettings { name: "bus0".into(), ..BusSettings::default() };
    let id = recorder.add_bus(settings).expect("a disk that works");
    for read in reads {
        recorder.write_chunk(id, &chunk(read), None).expect("a disk that works");
    }
    recorder.finish("finished").expect("a disk that works");
}

fn size(path: &Path) -> u64 {
    path.metadata().expect("a file").len()
}

fn skim(path: &Path) {
    let mut input = Input::open(path, None).expect("a recording");
    while let Some(item) = input.next_item().expect("whole") {
        black_box(item);
    }
}

fn info(path: &Path, format: Option<InputFormat>) {
    let mut input = Input::open(path, format).expect("a recording");
    let mut info = Counting::new();
    while let Some(item) = input.next_item().expect("whole") {
        if let Item::Chunk { chunk, .. } = item {
            info.take(&chunk);
        }
    }
    info.finish();
}

fn info_of(reads: &[Read]) {
    let mut info = Counting::new();
    let mut chunks = reads.iter().map(chunk);
    while info.pipeline.handle_reads(&mut chunks) {
        info.drain();
    }
    info.drain();
    info.finish();
}

/// Runs a command on the raw bytes and on the recording by turns, so that both meet the same moods of the machine.
fn compare(arguments: &[&str], raw: &Path, mcap: &Path, megabytes: usize) {
    let run = |path: &Path| {
        let begun = Instant::now();
        let mut command = Command::new(env!("CARGO_BIN_EXE_rtutap"));
        command.args(arguments).arg(path).stdout(Stdio::null()).stderr(Stdio::null());
        assert!(command.status().expect("it runs").success(), "{arguments:?}");
        begun.elapsed()
    };
    let (mut of_raw, mut of_mcap): (Vec<_>, Vec<_>) = (0..9).map(|_| (run(raw), run(mcap))).unzip();
    of_raw.sort();
    of_mcap.sort();
    let (of_raw, of_mcap) = (of_raw[4], of_mcap[4]);
    let name = arguments.join(" ");
    report(&format!("'{name}' raw"), megabytes, of_raw, of_raw);
    report(&format!("'{name}' MCAP"), megabytes, of_mcap, of_raw);
}

/// Returns a pipeline as `info` has it: without readings.
fn pipeline() -> Pipeline {
    let (line, adapter_hold_ns) = (LineSettings::default(), None);
    let options = PipelineOptions::new(line, adapter_hold_ns);
    let profiles = Arc::new(Profiles::built_in());
    let shapes = profiles.shapes();
    Pipeline::new(options, Devices::new(profiles, Environment::default()), shapes)
}

/// Decodes as `info` does.
struct Counting {
    pipeline: Pipeline,
    info: Info,
}

impl Counting {
    fn new() -> Self {
        let mut info = Info::default();
        info.begin("bus0", LineSettings::default());
        Counting { pipeline: pipeline(), info }
    }

    fn take(&mut self, chunk: &Chunk<'_>) {
        self.pipeline.handle_bytes(chunk);
        self.drain();
    }

    fn drain(&mut self) {
        while let Some(event) = self.pipeline.poll_event() {
            self.info.event("bus0", &event);
        }
    }

    fn finish(mut self) {
        self.pipeline.finish();
        self.drain();
        black_box(self.info.to_json());
    }
}

/// Opens a file by its index and reads the minute in its middle.
fn middle(path: &Path) {
    let open = || Recording::from_file(File::open(path).expect("a file")).expect("a disk that works");
    let (mut first, mut last) = (None, None);
    let mut recording = open();
    while let Some(item) = recording.next_item().expect("a disk that works") {
        if let Item::Chunk { chunk: Chunk { time: ReadTime::At(time), .. }, .. } = item {
            first.get_or_insert(time);
            last = Some(time);
        }
    }
    let (first, last): (Timestamp, Timestamp) = first.zip(last).expect("reads with times");
    let from = first + (last - first) / 2;
    let opening = best(|| _ = black_box(open()));
    let mut bytes = 0;
    let minute = best(|| {
        let mut recording = open();
        assert!(recording.select(from, from + 60 * SECOND), "it has an index");
        bytes = 0;
        while let Some(item) = recording.next_item().expect("a disk that works") {
            bytes += if let Item::Chunk { chunk, .. } = item { chunk.bytes.len() } else { 0 };
        }
    });
    let megabytes = size(path) / 1_000_000;
    println!(
        "{megabytes} MB: opened in {opening:.1?}; opened and read a minute, {bytes} bytes, in {minute:.1?}"
    );
}

fn report(name: &str, megabytes: usize, time: Duration, baseline: Duration) {
    let rate = megabytes as f64 / time.as_secs_f64();
    let share = baseline.as_secs_f64() / time.as_secs_f64();
    println!("{name:28} {rate:7.1} MB/s  {share:5.2} of the speed of raw bytes");
}
