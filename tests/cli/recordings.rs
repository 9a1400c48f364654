//! What an export to a recording keeps of one, and what it must not tell.

use std::collections::BTreeMap;
use std::path::Path;

use predicates::prelude::*;
use rtutap::capture::mcap::{Anchor, BusSettings, Options, Recorder};
use rtutap::capture::{Input, Item};
use rtutap::decode::chunk::{Chunk, ReadTime};
use rtutap::time::Timestamp;

use crate::export::{arg, leaks, temporary};
use crate::rtutap;

/// Writes a recording behind an adapter with a serial number, with a clock that was set and a read after it.
fn recorded(path: &Path) {
    let facts = [
        ("source", "/dev/serial/by-id/usb-FTDI_UART_A50285BI-if00"),
        ("usb_serial", "A50285BI"),
        ("usb_vid_pid", "0403:6001"),
    ];
    let facts = facts.map(|(key, fact)| (key.to_owned(), fact.to_owned())).into();
    let settings = BusSettings { name: "pump".into(), facts, ..BusSettings::default() };
    let anchor = Anchor { monotonic_ns: 7, realtime: at(0) };
    let options = Options { session_id: "one".into(), anchor: Some(anchor), ..Options::default() };
    let mut recorder = Recorder::create(path, options).expect("a disk that works");
    let bus = recorder.add_bus(settings).expect("a disk that works");
    for ms in [20, 500] {
        let time = ReadTime::At(at(ms));
        let chunk = Chunk { time, bytes: &[1, 3, 0x26, 0, 0, 4, 0x4F, 0x41], line_errors: &[] };
        recorder.write_chunk(bus, &chunk, None).expect("a disk that works");
        recorder.write_clock(7 + ms as u64 * 1_000_000, at(ms + 3_600_000)).expect("a disk that works");
    }
    recorder.finish("finished").expect("a disk that works");
}

fn at(ms: i64) -> Timestamp {
    Timestamp::from_ns((1_767_225_600_000 + ms) * 1_000_000)
}

/// Returns the facts of the bus of a recording, and its clocks after the first.
fn facts_and_clocks(path: &Path) -> (BTreeMap<String, String>, Vec<(u64, Timestamp)>) {
    let mut input = Input::open(path, None).expect("a recording");
    let (mut facts, mut clocks) = (BTreeMap::new(), Vec::new());
    while let Some(item) = input.next_item().expect("a disk that works") {
        match item {
            Item::Line(settings) => facts = settings.facts.clone(),
            Item::Clock { monotonic_ns, realtime } => clocks.push((monotonic_ns, realtime)),
            _ => {}
        }
    }
    (facts, clocks)
}

#[test]
fn an_export_of_a_recording_keeps_its_adapter_and_its_clocks() {
    let (_directory, path) = temporary();
    let (input, output) = (path("it.mcap"), path("out.mcap"));
    recorded(&input);
    rtutap(&["export", arg(&input), "-o", arg(&output)]).assert().success();
    let (facts, clocks) = facts_and_clocks(&output);
    assert_eq!((&facts, &clocks), (&facts_and_clocks(&input).0, &facts_and_clocks(&input).1));
    assert_eq!(facts["usb_vid_pid"], "0403:6001");
    assert_eq!(clocks, [(20_000_007, at(3_600_020)), (500_000_007, at(3_600_500))]);
    rtutap(&["info", arg(&output)]).assert().success().stdout(predicate::str::contains(
        "source        pump: /dev/serial/by-id/usb-FTDI_UART_A50285BI-if00 (0403:6001, A50285BI)\n",
    ));
}

#[test]
fn that_a_recording_was_redacted_stays_with_it_and_its_names_do_not() {
    let (_directory, path) = temporary();
    let (input, once, again) = (path("YL0119052307.mcap"), path("once.mcap"), path("again.mcap"));
    recorded(&input);
    rtutap(&["export", arg(&input), "-o", arg(&once), "--redact"]).assert().success();
    rtutap(&["export", arg(&once), "-o", arg(&again), "--filter", "addr == 1"]).assert().success();
    let bytes = std::fs::read(&once).expect("a file");
    assert!(!leaks(&bytes), "metadata, with the name of the session, is not compressed");
    let (facts, clocks) = facts_and_clocks(&again);
    assert_eq!(facts["source"], "/dev/serial/by-id/usb-FTDI_UART_XXXXXXXX-if00");
    assert_eq!((&*facts["usb_serial"], &*facts["usb_vid_pid"]), ("XXXXXXXX", "0403:6001"));
    assert_eq!(clocks.len(), 2);
    let hex = rtutap(&["export", arg(&once), "-o", "-", "--format", "hex"]).assert().success();
    let hex = String::from_utf8_lossy(&hex.get_output().stdout).into_owned();
    assert!(hex.contains("\n# redacted: serial numbers are blanked"), "{hex}");
    let said = "remark        pump: redacted: serial numbers are blanked with X, and CRCs mended; decoded \
                messages: only what passes: addr == 1\n";
    rtutap(&["info", arg(&again)]).assert().success().stdout(predicate::str::contains(said));
}

#[test]
fn what_a_recording_says_of_itself_stays_a_comment_in_hex_text() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("it.mcap");
    let remark = ("remark".to_owned(), "only a part\n01 03\u{1b}[2J".to_owned());
    let settings = BusSettings { name: "a/b\n01".into(), facts: [remark].into(), ..BusSettings::default() };
    let mut recorder = Recorder::create(&path, Options::default()).expect("a disk that works");
    let bus = recorder.add_bus(settings).expect("a disk that works");
    let chunk = Chunk { time: ReadTime::At(at(20)), bytes: &[1, 3], line_errors: &[] };
    recorder.write_chunk(bus, &chunk, None).expect("a disk that works");
    recorder.finish("finished").expect("a disk that works");
    let path = path.to_str().expect("UTF-8");
    let hex = crate::stdout(&["export", path, "-o", "-", "--format", "hex"], b"");
    assert!(hex.contains("\n# only a part 01 03 [2J\n# bus 'a/b\\u{a}01' line 9600-8N1\n"), "{hex}");
    let frames = ["decode", "--show=frames", "--format=json"];
    let read = crate::stdout(&[&frames[..], &["-"]].concat(), hex.as_bytes());
    assert_eq!(read, crate::stdout(&[&frames[..], &[path]].concat(), b""));
    assert!(read.contains(r"a/b\n01"), "{read}");
}
