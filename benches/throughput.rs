//! How fast a recording is decoded, against reading its bytes and summing them up, and what memory it takes.
//!
//! `cargo bench` decodes 100 MB; `MEGABYTES=20 cargo bench` as many. Ratios are to the baseline of the same run, so
//! that they can be compared between machines; the best of three runs counts.

#![allow(clippy::print_stdout, reason = "the figures are what it is for")]

mod measure;
#[path = "../tests/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::time::Duration;

use crc::{CRC_16_MODBUS, Crc};
use measure::best;
use rtutap::decode::chunk::{Chunk, ReadTime};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Pipeline};
use rtutap::report::audit::{Audit, Judgement};
use rtutap::report::info::Info;
use rtutap::report::{Json, Rows, Show, TimeStyle};
use rtutap::simulate::{Adapter, Config, Scenario, Simulation};
use rtutap::time::Timestamp;
use support::traffic::random;

/// Bytes a read, as `decode` reads raw files.
const BLOCK: usize = 65536;
/// Frames simulated for each half of the traffic; it is repeated up to the size asked for.
const FRAMES: u64 = 50_000;
/// Bytes of garbage, a read each.
const GARBAGE: usize = 200_000;

fn main() {
    let megabytes = std::env::var("MEGABYTES").ok().and_then(|text| text.parse().ok()).unwrap_or(100);
    let total = megabytes * 1_000_000;
    let traffic = traffic();
    println!("{megabytes} MB of clean traffic, {} kB over and over", traffic.len() / 1000);
    let baseline = best(|| sum(&traffic, total));
    report("read and one CRC", total, baseline, baseline);
    report("frames alone", total, best(|| decode(&traffic, total, |event| _ = black_box(event))), baseline);
    let info = best(|| {
        let mut info = Info::default();
        decode(&traffic, total, |event| info.event("bus0", event));
        black_box(info.to_json());
    });
    report("as info counts", total, info, baseline);
    for (name, show) in [
        ("JSON of transactions", &[Show::Transactions][..]),
        ("JSON of all rows", &[Show::Frames, Show::Transactions, Show::Readings]),
    ] {
        let mut written = 0;
        let time = best(|| written = json(&traffic, total, show));
        report(name, total, time, baseline);
        println!("{:24} {:.0} MB written", "", written as f64 / 1e6);
    }
    report("as verify judges", total, best(|| verify(&traffic, total)), baseline);
    let garbage = best(garbage);
    let micros = garbage.as_secs_f64() * 1e6 / GARBAGE as f64;
    println!("{:24} {micros:.2} µs a byte, a read each", "garbage");
    match peak_memory() {
        Some(peak) => println!("{:24} {peak}", "peak memory"),
        None => println!("{:24} not known on this system", "peak memory"),
    }
}

/// Returns the bytes of an installation, and of a bus of any make, one after the other.
fn traffic() -> Vec<u8> {
    ["installation", "clean"]
        .into_iter()
        .filter_map(Scenario::named)
        .flat_map(|scenario| {
            let (line, adapter) = (LineSettings::default(), Adapter::Idle64);
            Simulation::new(Config { seed: 1, frames: FRAMES, line, adapter, scenario })
        })
        .flat_map(|read| read.bytes)
        .collect()
}

/// Hands over blocks of the traffic, over and over, up to `total` bytes.
fn blocks(traffic: &[u8], total: usize) -> impl Iterator<Item = &[u8]> {
    let mut left = total;
    traffic.chunks(BLOCK).cycle().map_while(move |block| {
        let block = &block[..block.len().min(left)];
        left -= block.len();
        (!block.is_empty()).then_some(block)
    })
}

fn sum(traffic: &[u8], total: usize) {
    const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_MODBUS);
    for block in blocks(traffic, total) {
        black_box(CRC.checksum(black_box(block)));
    }
}

/// Decodes the traffic; `take` gets every event.
fn decode(traffic: &[u8], total: usize, take: impl FnMut(&Event<'_>)) {
    run(support::pipeline(LineSettings::default(), None), traffic, total, take);
}

fn run(mut pipeline: Pipeline, traffic: &[u8], total: usize, mut take: impl FnMut(&Event<'_>)) {
    for block in blocks(traffic, total).map(Some).chain([None]) {
        match block {
            Some(bytes) => {
                pipeline.handle_bytes(&Chunk { time: ReadTime::Unknown, bytes, line_errors: &[] });
            }
            None => pipeline.finish(),
        }
        while let Some(event) = pipeline.poll_event() {
            take(&event);
        }
    }
}

/// Writes JSON lines to nowhere; returns how many bytes.
fn json(traffic: &[u8], total: usize, show: &[Show]) -> u64 {
    let mut rows = Rows::new(show.to_vec(), Box::new(Json::default()), None);
    let (mut out, mut written) = (Vec::new(), 0);
    decode(traffic, total, |event| {
        rows.event("bus0", event, &mut out);
        if out.len() > BLOCK {
            written += black_box(&out).len() as u64;
            out.clear();
        }
    });
    written + out.len() as u64
}

/// Judges the traffic, as `verify` does; compare with the JSON of transactions.
fn verify(traffic: &[u8], total: usize) {
    let mut audit = Audit::new(Judgement::default(), None);
    audit.begin("bus0", LineSettings::default(), false);
    let pipeline = support::judging_pipeline(LineSettings::default());
    run(pipeline, traffic, total, |event| audit.event("bus0", event));
    audit.finish();
    black_box(audit.to_text(TimeStyle::Relative, false, false));
}

/// Decodes garbage, a byte a read, at line speed.
fn garbage() {
    let line = LineSettings::default();
    let mut pipeline = support::pipeline(line, None);
    let (mut random, mut now) = (random(1), Timestamp::from_ns(0));
    for _ in 0..GARBAGE {
        now = now + line.character_ns();
        let bytes = [random() as u8];
        pipeline.handle_bytes(&Chunk { time: ReadTime::At(now), bytes: &bytes, line_errors: &[] });
        while let Some(event) = pipeline.poll_event() {
            black_box(&event);
        }
    }
}

fn report(name: &str, total: usize, time: Duration, baseline: Duration) {
    let rate = total as f64 / 1e6 / time.as_secs_f64();
    let ratio = time.as_secs_f64() / baseline.as_secs_f64();
    println!("{name:24} {rate:7.1} MB/s  {ratio:6.2} × the baseline");
}

/// Returns the most memory the process ever had, as Linux words it.
fn peak_memory() -> Option<String> {
    #[expect(clippy::disallowed_methods, reason = "the system tells it in a file")]
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().to_owned())
}
