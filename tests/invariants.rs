//! What holds for every input: any bytes, cut into reads of any length, at any times.
//!
//! `PROPTEST_CASES=20000 cargo test --release --test invariants` pushes harder;
//! `cargo test --release --test invariants -- --ignored` holds the short cut against the lattice over every
//! scenario behind every adapter.

mod support;

use std::sync::Arc;

use proptest::prelude::*;
use rtutap::decode::chunk::{Chunk, ReadTime};
use rtutap::decode::frame::Place;
use rtutap::decode::framer::Framer;
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Pipeline};
use rtutap::simulate::{Adapter, Scenario};
use rtutap::time::{MILLISECOND, Span, Timestamp};
use support::traffic::{
    any_bytes, any_reads, any_timed, crc, cuts, sealed, simulated, spoilt_traffic, timed, untimed,
    whole_exchanges,
};
use support::{Read, assert_same_rows, decode, drain, feed, pipeline, profiles};

fn new() -> Pipeline {
    pipeline(LineSettings::default(), None)
}

/// Draws what the adapter is said to keep back: nothing said, nothing kept, 16 ms, and what cannot be.
fn hold() -> impl Strategy<Value = Option<i64>> {
    let known =
        prop_oneof![4 => Just(0), 4 => Just(16 * MILLISECOND), 1 => Just(i64::MAX), 1 => Just(i64::MIN)];
    prop_oneof![Just(None), known.prop_map(Some)]
}

/// Checks one frame or run against the input and those before, and returns where it ends.
fn check_place(place: &Place<'_>, input: &[u8], end: u64, id: u64) -> u64 {
    assert_eq!(place.id, id, "ids run");
    assert_eq!(place.stream_offset, end, "no byte left out, none twice");
    assert!(!place.bytes.is_empty());
    let end = place.stream_offset as usize + place.bytes.len();
    assert_eq!(input.get(place.stream_offset as usize..end), Some(place.bytes));
    if let Some(time) = place.time {
        assert!(time.start.earliest <= time.start.latest, "{time:?}");
        assert!(time.end.earliest <= time.end.latest, "{time:?}");
        assert!(time.start.earliest <= time.end.earliest, "{time:?}");
        assert!(time.start.latest <= time.end.latest, "{time:?}");
        assert!(time.start.midpoint() <= time.end.midpoint(), "{time:?}");
        assert!(time.uncertainty_ns() >= 0);
    }
    check_span(place.gap_before);
    end as u64
}

fn check_span(span: Option<Span>) {
    if let Some(span) = span {
        assert!(0 <= span.least && span.least <= span.most && span.half_width() >= 0, "{span:?}");
    }
}

/// Checks all that must hold for each row by itself and for the rows together.
fn check_rows(mut pipeline: Pipeline, reads: &[Read]) {
    let input: Vec<u8> = reads.iter().flat_map(|read| read.bytes.clone()).collect();
    let (mut end, mut id, mut transactions) = (0, 0, 0);
    let mut check = |pipeline: &mut Pipeline| {
        while let Some(event) = pipeline.poll_event() {
            match &event {
                Event::Frame(frame) => {
                    end = check_place(&frame.place, &input, end, id);
                    id += 1;
                    assert!((4..=256).contains(&frame.place.bytes.len()), "{frame:?}");
                    assert_eq!(crc(frame.place.bytes), 0, "{frame:?}");
                    assert!((0.0..=1.0).contains(&frame.confidence));
                }
                Event::Damaged(damaged) => {
                    end = check_place(&damaged.place, &input, end, id);
                    id += 1;
                }
                Event::Transaction { transaction, .. } => {
                    assert_eq!(transaction.id, transactions, "ids run");
                    transactions += 1;
                    let sides = [transaction.request, transaction.response];
                    assert!(sides.iter().flatten().any(|side| !side.damaged), "{transaction:?}");
                    assert!(sides.iter().flatten().all(|side| side.id < id), "after its last frame");
                    check_span(transaction.latency);
                }
                Event::Reading { transaction, .. } => assert_eq!(transaction + 1, transactions),
                Event::Identified { .. } | Event::Lost(_) | Event::Finding(_) => {}
            }
        }
        assert!(pipeline.settled_frame_id() <= pipeline.next_ids().0);
    };
    for read in reads {
        feed(&mut pipeline, read);
        check(&mut pipeline);
    }
    pipeline.finish();
    check(&mut pipeline);
    assert_eq!(pipeline.next_ids(), (id, transactions));
    assert_eq!(end, input.len() as u64, "every byte comes back");
}

/// Feeds reads to a framer alone; returns the most bytes it kept undecided.
fn most_undecided(reads: &[Read]) -> u64 {
    let mut framer = Framer::new(LineSettings::default(), None, Arc::new(profiles().shapes()));
    let take = |framer: &mut Framer| {
        while framer.next_piece(false).is_some() {}
        framer.undecided()
    };
    let mut most = 0;
    for read in reads {
        if let Some(now) = framer.stamper().silent_until(read.time, read.bytes.len()) {
            framer.expire(now);
            take(&mut framer);
        }
        framer.push(&Chunk { time: read.time, bytes: &read.bytes, line_errors: &[] });
        most = most.max(take(&mut framer));
    }
    most
}

/// Decodes with a call of `handle_timeout` wherever `times` wants one before a read.
fn decode_with(
    mut pipeline: Pipeline,
    reads: &[Read],
    mut timeouts: impl FnMut(&mut Pipeline, Timestamp, &mut Vec<String>),
) -> Vec<String> {
    let mut rows = Vec::new();
    let (mut now, mut last) = (Timestamp::MIN, Timestamp::MIN);
    let character = LineSettings::default().character_ns();
    for read in reads {
        if let ReadTime::At(time) = read.time {
            // It was silent until the first byte; a time that goes back is taken as the one before.
            let first = time - character.saturating_mul(read.bytes.len().saturating_sub(1) as i64);
            now = now.max(first).max(last);
            last = last.max(time);
            timeouts(&mut pipeline, now, &mut rows);
        }
        feed(&mut pipeline, read);
        drain(&mut pipeline, &mut rows);
    }
    pipeline.finish();
    drain(&mut pipeline, &mut rows);
    rows
}

/// Holds the short cut against the lattice; the rows of both must be the same at every moment.
#[track_caller]
fn assert_short_cut_equals_lattice(make: impl Fn() -> Pipeline, reads: &[Read], what: &str) -> usize {
    let (mut fast, mut slow) = (make(), make().without_short_cut());
    let (mut left, mut right) = (Vec::new(), Vec::new());
    let mut count = 0;
    for read in reads.iter().map(Some).chain([None]) {
        for (pipeline, rows) in [(&mut fast, &mut left), (&mut slow, &mut right)] {
            match read {
                Some(read) => feed(pipeline, read),
                None => pipeline.finish(),
            }
            drain(pipeline, rows);
        }
        // A row may come a read earlier on one side, never another row.
        let common = left.len().min(right.len());
        assert_same_rows(&left[..common], &right[..common], what);
        left.drain(..common);
        right.drain(..common);
        count += common;
    }
    assert_same_rows(&left, &right, what);
    count
}

proptest! {
    #![proptest_config(ProptestConfig {
        max_shrink_iters: 20_000,
        failure_persistence: None, // what it finds becomes a test of its own
        ..ProptestConfig::default()
    })]

    #[test]
    fn every_byte_comes_back_once_in_order_and_rows_are_sound(reads in any_reads(), hold in hold()) {
        check_rows(pipeline(LineSettings::default(), hold), &reads);
        check_rows(pipeline("115200-8E1".parse().expect("a line of this test"), hold), &reads);
    }

    #[test]
    fn how_an_untimed_stream_is_cut_changes_nothing(bytes in any_bytes(), a in cuts(), b in cuts()) {
        let left = decode(new(), &untimed(&bytes, &a));
        let right = decode(new(), &untimed(&bytes, &b));
        assert_same_rows(&left, &right, "two ways to cut");
    }

    #[test]
    fn rows_do_not_change_when_more_bytes_come(bytes in any_bytes(), at in any::<prop::sample::Index>(), a in cuts()) {
        let all = decode(new(), &untimed(&bytes, &a));
        let head = &bytes[..at.index(bytes.len() + 1)];
        let (mut pipeline, mut rows) = (new(), Vec::new());
        for read in untimed(head, &a) {
            feed(&mut pipeline, &read);
            drain(&mut pipeline, &mut rows);
        }
        assert_same_rows(&rows, &all[..rows.len().min(all.len())], "the rows of the first bytes");
    }

    #[test]
    fn few_bytes_are_undecided_whatever_comes(reads in any_reads()) {
        prop_assert!(most_undecided(&reads) <= 1024);
    }

    #[test]
    fn the_short_cut_equals_the_lattice_on_spoilt_traffic(
        bytes in spoilt_traffic(0..40), lengths in cuts(), steps in support::traffic::steps(), hold in hold(),
    ) {
        let make = || pipeline(LineSettings::default(), hold);
        assert_short_cut_equals_lattice(make, &untimed(&bytes, &lengths), "untimed");
        let begin = 1_767_225_600_000_000_000;
        assert_short_cut_equals_lattice(make, &timed(&bytes, &lengths, begin, &steps), "timed");
    }

    #[test]
    fn the_short_cut_equals_the_lattice_on_anything(reads in any_reads(), hold in hold()) {
        assert_short_cut_equals_lattice(|| pipeline(LineSettings::default(), hold), &reads, "anything");
    }

    #[test]
    fn a_timeout_at_the_instant_of_a_read_changes_nothing(reads in any_timed()) {
        let without = decode(new(), &reads);
        let with = decode_with(new(), &reads, |pipeline, now, rows| {
            pipeline.handle_timeout(now);
            drain(pipeline, rows);
        });
        assert_same_rows(&without, &with, "a timeout at the time of the read");
        let (mut pipeline, mut after) = (new(), Vec::new());
        let mut latest = Timestamp::MIN;
        for read in &reads {
            feed(&mut pipeline, read);
            if let ReadTime::At(time) = read.time {
                latest = latest.max(time);
                pipeline.handle_timeout(latest);
            }
            drain(&mut pipeline, &mut after);
        }
        pipeline.finish();
        drain(&mut pipeline, &mut after);
        assert_same_rows(&without, &after, "a timeout right after the read");
    }

    #[test]
    fn firing_every_deadline_at_its_time_equals_firing_none(reads in any_timed()) {
        let without = decode(new(), &reads);
        let with = decode_with(new(), &reads, |pipeline, now, rows| {
            let mut calls = 0;
            while let Some(deadline) = pipeline.poll_timeout().filter(|deadline| *deadline <= now) {
                pipeline.handle_timeout(deadline);
                drain(pipeline, rows);
                calls += 1;
                assert!(calls < 10_000, "a deadline that is not met by its time: {deadline:?}");
            }
        });
        assert_same_rows(&without, &with, "every deadline fired");
    }

    #[test]
    fn a_timeout_without_need_does_nothing(reads in any_timed(), share in 0_i64..1000) {
        let without = decode(new(), &reads);
        let mut last = None;
        let with = decode_with(new(), &reads, |pipeline, now, rows| {
            let from = last.unwrap_or(now);
            let between = from + ((now - from) / 1000).saturating_mul(share);
            pipeline.handle_timeout(between);
            pipeline.handle_timeout(Timestamp::MIN);
            drain(pipeline, rows);
            last = Some(now);
        });
        assert_same_rows(&without, &with, "timeouts in between");
    }

    #[test]
    fn frames_far_apart_are_the_same_however_they_are_read(
        frames in whole_exchanges(1..12), a in cuts(), b in cuts(), late in 0_i64..16, hold in hold(),
    ) {
        let left = frames_of(hold, &far_apart(&frames, &a, 0));
        let right = frames_of(hold, &far_apart(&frames, &b, late * MILLISECOND));
        prop_assert_eq!(&left, &right);
        prop_assert_eq!(left, frames);
    }
}

/// A request is given up while what came after it is undecided: it is due once that is decided.
///
/// An unanswered write to unit 3, damaged broadcasts, then a poll; found at random and cut down.
#[test]
fn what_waits_for_an_undecided_frame_is_given_up_in_time() {
    let bytes = [
        "031011000004080000803f0000000003af01030200000705b00094c3001030000001",
        "02140094c300101c00000000d89211080000a537d81d001030000001021400995301030200000185b244",
    ];
    let digits = bytes.concat();
    let byte = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).expect("two hexadecimal digits");
    let read = |at: usize| {
        let time = 1_767_225_600_000_000_000 + at as i64 / 2 * 29_500_000;
        Read { time: ReadTime::At(Timestamp::from_ns(time)), bytes: vec![byte(at)] }
    };
    let reads: Vec<Read> = (0..digits.len()).step_by(2).map(read).collect();
    let without = decode(new(), &reads);
    let with = decode_with(new(), &reads, |pipeline, now, rows| {
        pipeline.handle_timeout(now);
        pipeline.handle_timeout(Timestamp::MIN);
        drain(pipeline, rows);
    });
    assert_same_rows(&without, &with, "asked before every byte");
}

/// A request whose time is over with the last byte is given up then, whether or not anything is asked after it.
#[test]
fn what_is_due_with_the_last_read_comes_before_what_only_the_end_decides() {
    let at = |ms: i64, bytes: Vec<u8>| Read {
        time: ReadTime::At(Timestamp::from_ns(1_767_225_600_000_000_000 + ms * MILLISECOND)),
        bytes,
    };
    let reads = [
        at(0, sealed(vec![3, 3, 0, 0, 0, 2])), // unanswered
        at(100, sealed(vec![1, 3, 0, 0, 0, 2])),
        at(150, sealed(vec![1, 3, 4, 0, 0, 0, 0])),
        at(1600, vec![0, 0, 0, 0, 0]), // 1.5 s after the request that put an end to waiting
    ];
    let (mut pipeline, mut asked) = (new(), Vec::new());
    for read in &reads {
        feed(&mut pipeline, read);
        let ReadTime::At(time) = read.time else { panic!("timed above") };
        pipeline.handle_timeout(time);
        drain(&mut pipeline, &mut asked);
    }
    pipeline.finish();
    drain(&mut pipeline, &mut asked);
    assert_same_rows(&decode(new(), &reads), &asked, "asked after the last read");
    let given_up = asked.iter().position(|row| row.contains("NoResponse")).expect("unanswered");
    assert!(asked[given_up + 1].starts_with("Damaged"), "{asked:?}");
}

/// Without times, what is given up is given up by the bytes that come: 1440 of them take 1.5 s at 9600 baud.
#[test]
fn how_a_long_untimed_stream_is_cut_changes_nothing() {
    let mut random = support::traffic::random(7);
    let frames = [sealed(vec![3, 3, 0, 0, 0, 2]), sealed(vec![1, 3, 0, 0, 0, 2])];
    let tails =
        [sealed(vec![1, 3, 4, 0, 0, 0, 1]), sealed(vec![1, 6, 0, 1, 0, 3]), vec![1, 16, 28, 0, 0, 0, 9]];
    let answer = sealed(vec![1, 3, 4, 0, 0, 0, 0]);
    for _ in 0..200 {
        let mut bytes = [frames.concat(), answer.clone()].concat();
        bytes.extend((0..1300 + random() % 160).map(|_| random() as u8));
        bytes.extend_from_slice(&tails[random() as usize % tails.len()]);
        bytes.extend((0..random() % 60).map(|_| [1, 3, 16, 0, 255][random() as usize % 5]));
        let whole = decode(new(), &untimed(&bytes, &[bytes.len()]));
        for length in [1, 7, 1000] {
            assert_same_rows(&whole, &decode(new(), &untimed(&bytes, &[length])), &format!("by {length}"));
        }
    }
}

/// Puts frames on a line with silences of 300 ms between them; reads never span two, and come `late`.
fn far_apart(frames: &[Vec<u8>], lengths: &[usize], late: i64) -> Vec<Read> {
    let character = LineSettings::default().character_ns();
    let mut now = 1_767_225_600_000_000_000;
    let mut reads = Vec::new();
    for frame in frames {
        now += 300 * MILLISECOND;
        for bytes in support::traffic::cut(frame, lengths) {
            now += bytes.len() as i64 * character;
            reads.push(Read { time: ReadTime::At(Timestamp::from_ns(now + late)), bytes: bytes.to_vec() });
        }
    }
    reads
}

/// Returns the bytes of all frames; damaged runs come as they are, and fail a comparison.
fn frames_of(hold: Option<i64>, reads: &[Read]) -> Vec<Vec<u8>> {
    let mut pipeline = pipeline(LineSettings::default(), hold);
    let mut frames = Vec::new();
    for read in reads.iter().map(Some).chain([None]) {
        match read {
            Some(read) => feed(&mut pipeline, read),
            None => pipeline.finish(),
        }
        while let Some(event) = pipeline.poll_event() {
            match event {
                Event::Frame(frame) => frames.push(frame.place.bytes.to_vec()),
                Event::Damaged(damaged) => frames.push(damaged.place.bytes.to_vec()),
                _ => {}
            }
        }
    }
    frames
}

/// Holds the short cut against the lattice on every scenario behind every adapter; returns the rows compared.
fn compare_scenarios(line: &str, seeds: std::ops::Range<u64>, frames: u64) -> usize {
    let line: LineSettings = line.parse().expect("a line of this test");
    let mut rows = 0;
    for scenario in Scenario::all() {
        for adapter in Adapter::ALL {
            for seed in seeds.clone() {
                let reads = simulated(*scenario, adapter, line, seed, frames);
                let what = format!("{line} {} behind {adapter}, seed {seed}", scenario.name);
                let bytes: Vec<u8> = reads.iter().flat_map(|read| read.bytes.clone()).collect();
                for reads in [reads, untimed(&bytes, &[1000])] {
                    rows += assert_short_cut_equals_lattice(|| pipeline(line, None), &reads, &what);
                }
            }
        }
    }
    rows
}

#[test]
fn the_short_cut_equals_the_lattice_in_every_scenario() {
    let rows = compare_scenarios("9600-8N1", 300..301, 150);
    assert!(rows > 20_000, "{rows}");
}

#[test]
#[ignore = "two million rows; run in release"]
fn the_short_cut_equals_the_lattice_over_hundreds_of_thousands_of_frames() {
    for line in ["9600-8N1", "19200-8E1", "115200-8N1"] {
        let rows = compare_scenarios(line, 500..505, 1000);
        println!("{line}: {rows} rows the same");
    }
}

#[test]
fn a_silence_that_later_bytes_rule_out_decides_the_same_with_and_without_the_short_cut() {
    // Unit 3 is known, so `03 41` may begin a frame of an unknown function, if silence may lie before it. The
    // read that follows at the same instant shows that there was none.
    let exchange = [sealed(vec![3, 3, 2, 0, 0, 1]), sealed(vec![3, 3, 2, 0, 7])].concat();
    let strange = [sealed(vec![4, 0x11, 3, 0x41, 0xFF, 0]), sealed(vec![3, 3, 4, 0, 1, 0, 2])].concat();
    let at = |ms: i64| ReadTime::At(Timestamp::from_ns(ms * MILLISECOND));
    let reads = [
        Read { time: at(1000), bytes: exchange.clone() },
        Read { time: at(2000), bytes: exchange },
        Read { time: at(2011), bytes: strange[..4].to_vec() },
        Read { time: at(2011), bytes: strange[4..].to_vec() },
    ];
    let make = || pipeline(LineSettings::default(), Some(0));
    assert_short_cut_equals_lattice(make, &reads, "a silence ruled out");
}

#[test]
fn the_rows_of_a_recording_are_those_of_the_bus() {
    let line = LineSettings::default();
    let scenario = Scenario::named("everything-bad").expect("a scenario of the simulator");
    let reads = simulated(scenario, Adapter::Ftdi16, line, 9, 500);
    let live = decode(new(), &reads);
    assert_same_rows(&live, &decode(new(), &reads), "the same reads again");
    let file = tempfile::NamedTempFile::new().expect("a file to record to");
    let lines = reads.iter().map(|read| {
        rtutap::capture::hex_line(&Chunk { time: read.time, bytes: &read.bytes, line_errors: &[] })
    });
    let text = lines.collect::<Vec<_>>().join("\n");
    std::io::Write::write_all(&mut file.as_file(), text.as_bytes()).expect("the file takes it");
    let mut input = rtutap::capture::Input::open(file.path(), None).expect("hex text");
    let (mut pipeline, mut recorded) = (new(), Vec::new());
    while let Some(chunk) = input.next_chunk().expect("hex text") {
        pipeline.handle_bytes(&chunk);
        drain(&mut pipeline, &mut recorded);
    }
    pipeline.finish();
    drain(&mut pipeline, &mut recorded);
    assert_same_rows(&live, &recorded, "the recording");
}
