//! The connection check, on simulated buses that are well and on such as are not.

use std::sync::Arc;

use rtutap::analyze::connection::{Connection, Diagnosis, Trouble};
use rtutap::decode::chunk::{Chunk, LineError, ReadTime};
use rtutap::decode::frame::Role;
use rtutap::device::{Devices, Environment, Profiles};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Options, Pipeline};
use rtutap::simulate::AfterFramingError::WaitForMark;
use rtutap::simulate::{Adapter, Config, Scenario, Simulation, TruthFrame, Uart, Wire};
use rtutap::time::{MILLISECOND, SECOND, Timestamp};

const BEGIN: Timestamp = Timestamp::from_ns(1_767_225_600 * SECOND);

/// Is a read of the tests.
struct Read {
    time: Timestamp,
    bytes: Vec<u8>,
    line_errors: Vec<LineError>,
}

fn line(text: &str) -> LineSettings {
    text.parse().expect("a line setting of this test")
}

fn config(scenario: &str, line: LineSettings, adapter: Adapter, seed: u64, frames: u64) -> Config {
    let scenario = Scenario::named(scenario).expect("a scenario");
    Config { seed, frames, line, adapter, scenario }
}

/// Decodes reads as a live bus, looks every 200 ms, and goes on for a while after the last.
///
/// Returns what was told, each with its time from the beginning in seconds.
fn told(line: LineSettings, reads: impl IntoIterator<Item = Read>, after_ns: i64) -> Vec<(f64, Diagnosis)> {
    let profiles = Arc::new(Profiles::built_in());
    let options = Options::new(line, None);
    let devices = Devices::new(Arc::clone(&profiles), Environment::default());
    let mut pipeline = Pipeline::new(options, devices, profiles.shapes());
    let (mut connection, mut told) = (Connection::new(BEGIN), Vec::new());
    let mut now = BEGIN;
    let mut look = |until: Timestamp, pipeline: &mut Pipeline, connection: &mut Connection| {
        while until - now >= 200 * MILLISECOND {
            now = now + 200 * MILLISECOND;
            pipeline.handle_timeout(now);
            take(pipeline, connection);
            connection.handle_timeout(now);
            if let Some(diagnosis) = connection.poll_diagnosis() {
                told.push(((now - BEGIN) as f64 / 1e9, diagnosis));
            }
        }
    };
    let mut end = BEGIN;
    for read in reads {
        look(read.time, &mut pipeline, &mut connection);
        let Read { time, bytes, line_errors } = &read;
        connection.handle_bytes(*time, bytes.len(), line_errors);
        pipeline.handle_bytes(&Chunk { time: ReadTime::At(*time), bytes, line_errors });
        take(&mut pipeline, &mut connection);
        end = *time;
    }
    look(end + after_ns, &mut pipeline, &mut connection);
    told
}

fn take(pipeline: &mut Pipeline, connection: &mut Connection) {
    while let Some(event) = pipeline.poll_event() {
        if let Event::Frame(frame) = event {
            connection.handle_frame(&frame);
        }
    }
}

fn simulated(config: Config) -> impl Iterator<Item = Read> {
    Simulation::new(config).map(|read| {
        let rtutap::simulate::Read { time, bytes, line_errors } = read;
        Read { time, bytes, line_errors }
    })
}

/// Delivers what a receiver hears in reads of 16 ms, for so many seconds.
fn heard(mut uart: Uart, seconds: i64) -> impl Iterator<Item = Read> {
    (1..seconds * 1000 / 16).filter_map(move |tick| {
        let time = BEGIN + tick * 16 * MILLISECOND;
        let characters: Vec<_> = std::iter::from_fn(|| uart.receive(time)).collect();
        let error = |(offset, character): (u32, &rtutap::simulate::Character)| {
            character.error.map(|kind| LineError { offset, kind })
        };
        let line_errors = (0..).zip(&characters).filter_map(error).collect();
        let bytes: Vec<u8> = characters.iter().map(|character| character.value).collect();
        (!bytes.is_empty()).then_some(Read { time, bytes, line_errors })
    })
}

/// Delivers the frames of a bus that `choose` chooses, as often as it says, each in a read.
fn frames(scenario: &str, count: u64, choose: impl Fn(&TruthFrame) -> usize) -> Vec<Read> {
    let mut simulation = Simulation::new(config(scenario, line("9600-8N1"), Adapter::Uart, 5, count));
    while simulation.next().is_some() {}
    let mut reads = Vec::new();
    for frame in simulation.take_truth() {
        let copies = choose(&frame);
        for copy in 0..copies {
            let time = frame.end_time + copy as i64 * 2 * MILLISECOND;
            reads.push(Read { time, bytes: frame.bytes.clone(), line_errors: Vec::new() });
        }
    }
    reads
}

/// Asserts that one trouble was told by a time in seconds, with such evidence, and nothing else.
#[track_caller]
fn assert_told(told: &[(f64, Diagnosis)], trouble: Trouble, by: f64, evidence: &str) {
    let [(at, diagnosis)] = told else { panic!("{told:#?}") };
    assert_eq!(diagnosis.trouble, Some(trouble), "{diagnosis}");
    assert!(*at <= by, "after {at} s");
    assert!(diagnosis.evidence.contains(evidence) && !diagnosis.advice.is_empty(), "{diagnosis}");
}

#[test]
fn a_bus_that_works_is_never_called_ill() {
    let mut wrong = Vec::new();
    for scenario in Scenario::all().iter().filter(|scenario| !scenario.echo) {
        for (seed, adapter) in (0..).zip(Adapter::ALL) {
            for sent in ["9600-8N1", "19200-8E1", "1200-8N1"] {
                let told =
                    told(line(sent), simulated(config(scenario.name, line(sent), adapter, seed, 600)), 0);
                if !told.is_empty() {
                    wrong.push(format!("{} {sent} {adapter}: {told:?}", scenario.name));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn silence_is_told_after_a_while_and_once() {
    assert_told(&told(line("9600-8N1"), [], 600 * SECOND), Trouble::Silence, 10.3, "not a byte in 10 s");
    // A bus that was busy until then.
    let busy = simulated(config("clean", line("9600-8N1"), Adapter::Uart, 1, 300));
    let told = told(line("9600-8N1"), busy, 60 * SECOND);
    assert_told(&told, Trouble::Silence, 60.0, "not a byte in ");
}

#[test]
fn a_bus_that_is_polled_once_a_minute_is_silent_once_and_then_well() {
    let exchanges = frames("clean", 100, |_| 1);
    let reads = exchanges.into_iter().enumerate().map(|(index, read)| {
        let minute = (index / 2) as i64 * 60 * SECOND;
        Read { time: BEGIN + minute + (index % 2) as i64 * 30 * MILLISECOND, ..read }
    });
    let told = told(line("9600-8N1"), reads, 0);
    let troubles: Vec<_> = told.iter().map(|(_, diagnosis)| diagnosis.trouble).collect();
    assert_eq!(troubles, [Some(Trouble::Silence), None], "{told:#?}");
}

#[test]
fn a_wrong_speed_gives_bytes_and_no_frames() {
    for (sent, received) in [("19200-8N1", "9600-8N1"), ("9600-8N1", "19200-8N1"), ("9600-8N1", "9600-8E1")] {
        let wire = Wire::traffic(config("clean", line(sent), Adapter::Uart, 2, 600));
        let told = told(line(received), heard(Uart::new(wire, line(received), WaitForMark), 25), 0);
        assert_told(&told, Trouble::NoFrames, 10.0, "% of them with line errors");
        assert!(told[0].1.advice.contains("--line auto"));
    }
}

#[test]
fn a_swapped_pair_gives_bytes_and_no_frames() {
    for (received, seed) in [("9600-8N1", 3), ("19200-8N1", 4), ("9600-8E1", 5)] {
        let wire = Wire::traffic(config("clean", line("9600-8N1"), Adapter::Uart, seed, 600)).swapped();
        let told = told(line(received), heard(Uart::new(wire, line(received), WaitForMark), 25), 0);
        assert_told(&told, Trouble::NoFrames, 10.0, "of them in frames");
        assert!(told[0].1.advice.contains("swap A and B"));
    }
}

#[test]
fn noise_gives_bytes_and_no_frames() {
    for seed in 0..10 {
        let uart = Uart::new(Wire::noise(seed), line("9600-8N1"), WaitForMark);
        let told = told(line("9600-8N1"), heard(uart, 30), 0);
        assert_told(&told, Trouble::NoFrames, 10.0, "of them in frames");
    }
}

#[test]
fn a_tap_that_hears_one_side_only_is_told_which() {
    let requests = frames("clean", 200, |frame| usize::from(frame.role == Role::Request));
    let told_requests = told(line("9600-8N1"), requests, 0);
    assert_told(&told_requests, Trouble::OnlyRequests, 10.0, "requests and 0 responses");
    let responses = frames("clean", 200, |frame| usize::from(frame.role == Role::Response));
    let told_responses = told(line("9600-8N1"), responses, 0);
    assert_told(&told_responses, Trouble::OnlyResponses, 10.0, "responses and ");
}

#[test]
fn echoes_are_told_of_requests_and_of_everything() {
    let requests = simulated(config("echo", line("9600-8N1"), Adapter::Ftdi16, 4, 600));
    assert_told(&told(line("9600-8N1"), requests, 0), Trouble::Echo, 10.0, "requests were repeated");
    let everything = frames("installation", 200, |_| 2);
    assert_told(&told(line("9600-8N1"), everything, 0), Trouble::Echo, 30.0, "were repeated");
}

#[test]
fn a_wrong_parity_gives_frames_and_line_errors_without_end() {
    for (sent, received) in [("9600-8E1", "9600-8N1"), ("9600-8O1", "9600-8E1")] {
        let wire = Wire::traffic(config("clean", line(sent), Adapter::Uart, 6, 600));
        let told = told(line(received), heard(Uart::new(wire, line(received), WaitForMark), 25), 0);
        assert_told(&told, Trouble::LineErrors, 10.0, "though they make up frames");
        assert!(told[0].1.advice.contains("--line auto"));
    }
}

#[test]
fn line_errors_that_are_only_counted_are_told_too() {
    let mut connection = Connection::new(BEGIN);
    let told = (1..60).find_map(|second| {
        let now = BEGIN + second * SECOND;
        connection.handle_bytes(now, 100, &[]);
        connection.handle_counters(1000 + 40 * second.unsigned_abs());
        connection.handle_timeout(now);
        connection.poll_diagnosis()
    });
    let told = told.expect("bytes without frames").to_string();
    assert_eq!(told, "no frames: 600 bytes in 5 s, 33 % of them with line errors, and 0 of them in frames");
}

#[test]
fn when_it_is_well_again_that_is_told() {
    let wrong = frames("clean", 200, |frame| usize::from(frame.role == Role::Request));
    let end = wrong.last().expect("frames").time;
    let right = frames("clean", 600, |_| 1).into_iter();
    let right = right.map(|read| Read { time: end + (read.time - BEGIN), ..read });
    let told = told(line("9600-8N1"), wrong.into_iter().chain(right), 0);
    let troubles: Vec<_> = told.iter().map(|(_, diagnosis)| diagnosis.trouble).collect();
    assert_eq!(troubles, [Some(Trouble::OnlyRequests), None], "{told:#?}");
    assert!(told[1].1.to_string().starts_with("the connection is well again: "), "{}", told[1].1);
}
