//! Bytes that mean nothing: how many frames the program sees in them all the same.
//!
//! `cargo test --release --test garbage -- --ignored --nocapture` runs the full megabytes and prints the figures.

#![allow(clippy::print_stdout)] // the figures are what the ignored test is for

mod support;

use rtutap::decode::chunk::ReadTime;
use rtutap::line::LineSettings;
use rtutap::pipeline::Event;
use rtutap::time::Timestamp;
use support::traffic::random;
use support::{Read, feed, pipeline};

/// Phantom frames in a megabyte at most.
const MOST: u64 = 20;
const MEGABYTE: usize = 1_000_000;

/// Names how garbage is made.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// All bytes alike: a receiver at the wrong speed in busy traffic, at its worst.
    Uniform,
    /// Half of the bytes 00 or FF, as a line without bias or an open end gives.
    Biased,
}

/// Names how it is delivered.
#[derive(Clone, Copy, Debug)]
enum Delivery {
    /// Without times.
    Raw,
    /// With times, so many bytes a read, at line speed.
    Timed(usize),
}

const DELIVERIES: [Delivery; 3] = [Delivery::Raw, Delivery::Timed(1), Delivery::Timed(62)];

fn garbage(kind: Kind, seed: u64, length: usize) -> Vec<u8> {
    let mut random = random(seed);
    let mut byte = || match (kind, random()) {
        (Kind::Biased, word) if word & 0x300 == 0x000 => 0x00,
        (Kind::Biased, word) if word & 0x300 == 0x100 => 0xFF,
        (_, word) => word as u8,
    };
    (0..length).map(|_| byte()).collect()
}

/// Counts the frames that the program sees; checks on the way that all bytes come back.
fn phantoms(bytes: &[u8], delivery: Delivery) -> u64 {
    let line = LineSettings::default();
    let mut pipeline = pipeline(line, None);
    let (mut frames, mut given_back, mut now) = (0, 0, Timestamp::from_ns(0));
    let size = match delivery {
        Delivery::Raw => 65536,
        Delivery::Timed(size) => size,
    };
    for bytes in bytes.chunks(size).map(Some).chain([None]) {
        match bytes {
            Some(bytes) => {
                now = now + line.character_ns() * bytes.len() as i64;
                let time = if let Delivery::Raw = delivery { ReadTime::Unknown } else { ReadTime::At(now) };
                feed(&mut pipeline, &Read { time, bytes: bytes.to_vec() });
            }
            None => pipeline.finish(),
        }
        while let Some(event) = pipeline.poll_event() {
            match event {
                Event::Frame(frame) => {
                    frames += 1;
                    given_back += frame.place.bytes.len();
                }
                Event::Damaged(damaged) => given_back += damaged.place.bytes.len(),
                _ => {}
            }
        }
    }
    assert_eq!(given_back, bytes.len());
    frames
}

fn check(seeds: std::ops::RangeInclusive<u64>, length: usize) {
    for kind in [Kind::Uniform, Kind::Biased] {
        for delivery in DELIVERIES {
            let counts: Vec<u64> =
                seeds.clone().map(|seed| phantoms(&garbage(kind, seed, length), delivery)).collect();
            println!("{kind:?} {delivery:?}: {counts:?} phantoms in {length} bytes each");
            let megabytes = (counts.len() * length) as f64 / MEGABYTE as f64;
            let most = (MOST as f64 * megabytes).ceil() as u64;
            let sum: u64 = counts.iter().sum();
            assert!(sum <= most, "{kind:?} {delivery:?}: {sum} phantoms in {megabytes} MB");
        }
    }
}

#[test]
fn hardly_a_frame_is_seen_in_garbage() {
    check(1..=2, 100_000);
}

#[test]
#[ignore = "36 megabytes; run in release"]
fn at_most_twenty_frames_are_seen_in_each_megabyte_of_garbage() {
    for seed in 1..=6 {
        check(seed..=seed, MEGABYTE);
    }
}
