//! What is said: clear words for what cannot be done, for what is missing, and for what is under way.

use std::path::Path;

use predicates::prelude::*;
use predicates::str::contains;
use rtutap::capture::mcap::{Anchor, BusSettings, Options, Recorder};
use rtutap::decode::chunk::{Chunk, LineError, LineErrorKind, Lost, LostKind, ReadTime};
use rtutap::time::{SECOND, Timestamp};

use crate::export::{arg, temporary};
use crate::{rtutap, stdout};

const REQUEST: [u8; 8] = [1, 3, 0x26, 0, 0, 4, 0x4F, 0x41];

fn at(second: i64) -> Timestamp {
    Timestamp::from_ns((1_767_225_600 + second) * SECOND)
}

/// Begins a recording of two buses, on which requests go unanswered.
fn two_buses(path: &Path, is_durable: bool) -> Recorder {
    let anchor = Anchor { monotonic_ns: 7, realtime: at(0) };
    let options =
        Options { session_id: "one".into(), anchor: Some(anchor), is_durable, ..Options::default() };
    let mut recorder = Recorder::create(path, options).expect("a disk that works");
    let buses = ["pump", "reservoir"].map(|name| {
        let line = if name == "pump" { "9600-8N1" } else { "19200-8E1" };
        let line = line.parse().expect("line settings");
        let settings = BusSettings { name: name.into(), line, ..BusSettings::default() };
        recorder.add_bus(settings).expect("a disk that works")
    });
    for second in 1..=6 {
        let chunk = Chunk { time: ReadTime::At(at(second)), bytes: &REQUEST, line_errors: &[] };
        recorder.write_chunk(buses[second as usize % 2], &chunk, None).expect("a disk that works");
    }
    let lost = Lost { time: Some(at(7)), stream_offset: 0, kind: LostKind::SourceGone, count: 0 };
    recorder.write_lost(buses[0], &lost).expect("a disk that works");
    let lost = Lost { kind: LostKind::Queue, count: 5, ..lost };
    recorder.write_lost(buses[0], &lost).expect("a disk that works");
    let chunk = Chunk { time: ReadTime::At(at(37)), bytes: &REQUEST, line_errors: &[] };
    recorder.write_chunk(buses[0], &chunk, None).expect("a disk that works");
    recorder
}

#[test]
fn rows_and_summary_of_several_buses_name_them() {
    let (_directory, path) = temporary();
    let file = path("it.mcap");
    two_buses(&file, false).finish("finished").expect("a disk that works");
    let text = stdout(&["decode", arg(&file), "--time=utc", "--show=frames", "--show=transactions"], b"");
    assert!(text.lines().count() > 12);
    for line in text.lines() {
        assert!(line[24..].starts_with("  pump     ") || line[24..].starts_with("  reservoir"), "{line}");
    }
    let info = stdout(&["info", arg(&file), "--time=utc"], b"");
    for line in ["line          pump: 9600-8N1, ", "line          reservoir: 19200-8E1, "] {
        assert!(info.contains(line), "{info}");
    }
}

#[test]
fn a_hole_of_unknown_size_is_neither_no_bytes_nor_one() {
    let (_directory, path) = temporary();
    let file = path("it.mcap");
    two_buses(&file, false).finish("finished").expect("a disk that works");
    let text = stdout(&["decode", arg(&file), "--show=frames"], b"");
    assert!(text.contains("! an unknown number of bytes lost (source-gone) before byte 24"), "{text}");
    assert!(text.contains("! 5 bytes lost (queue) before byte 24"), "{text}");
    let info = stdout(&["info", arg(&file)], b"");
    let said = "lost          5 bytes, and an unknown number of bytes in 1 hole of 29.987 s\n";
    assert!(info.contains(said), "{info}");
    let json: serde_json::Value =
        serde_json::from_str(&stdout(&["info", arg(&file), "--format=json"], b"")).expect("JSON");
    assert_eq!((&json["lost_bytes"], &json["holes"]), (&5.into(), &1.into()));
    assert_eq!(json["complete"], false);
}

#[test]
fn what_holds_nothing_of_a_bus_is_not_recovered_and_leaves_no_file() {
    let (_directory, path) = temporary();
    let foreign = path("foreign.mcap");
    let file = std::fs::File::create(&foreign).expect("a file");
    let mut writer = mcap::Writer::new(file).expect("MCAP");
    let channel = writer.add_channel(0, "/camera", "json", &Default::default()).expect("MCAP");
    let header =
        mcap::records::MessageHeader { channel_id: channel, sequence: 1, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, b"{}").expect("MCAP");
    writer.finish().expect("MCAP");
    let silent = path("silent.mcap");
    let options = Options { session_id: "one".into(), ..Options::default() };
    let mut recorder = Recorder::create(&silent, options).expect("a disk that works");
    recorder.add_bus(BusSettings { name: "pump".into(), ..BusSettings::default() }).expect("a disk");
    recorder.finish("finished").expect("a disk that works");
    std::fs::write(path("empty.mcap"), b"").expect("a file");
    for (name, words) in [
        ("foreign.mcap", "no recording of a bus"),
        ("silent.mcap", "not a byte of a bus in it"),
        ("empty.mcap", "not one message in it"),
    ] {
        let output = path("out.mcap");
        let recover = rtutap(&["recover", arg(&path(name)), "-o", arg(&output)]).assert().code(2);
        recover.stderr(contains(words).and(contains("hint:")));
        let left = std::fs::read_dir(path(".")).expect("a directory").flatten();
        let left: Vec<_> =
            left.filter(|entry| entry.file_name().to_string_lossy().starts_with("out")).collect();
        assert!(left.is_empty(), "{name}: {left:?}");
    }
}

#[test]
fn a_name_that_ends_in_another_format_is_refused_with_the_way_to_it() {
    let (_directory, path) = temporary();
    let recording = path("it.mcap");
    two_buses(&recording, false).finish("finished").expect("a disk that works");
    for (args, words) in [
        (&["record", "-", "-o", "y.hex"][..], "rtutap export y.mcap -o y.hex"),
        (&["record", "-", "-o", "night"], "name it 'night.mcap', or create the directory first"),
        (&["listen", "-", "--format=text", "--record", "y.csv"], "writes MCAP"),
        (&["recover", arg(&recording), "-o", "x.hex"], "rtutap export x.mcap -o x.hex"),
        (&["simulate", "-o", "x.xyz"], "simulate writes .mcap, and .hex or .txt"),
        (&["simulate", "-o", "x.csv"], "rtutap export"),
        (&["simulate", "-o", "x.hex", "--raw-only"], "--raw-only is for MCAP"),
    ] {
        rtutap(args)
            .current_dir(path("."))
            .write_stdin(&REQUEST[..])
            .assert()
            .code(2)
            .stderr(contains(words).and(contains("hint:")));
        assert_eq!(std::fs::read_dir(path(".")).expect("a directory").count(), 1, "{args:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_recording_under_way_is_being_written_not_broken() {
    let (_directory, path) = temporary();
    let mut recorder = two_buses(&path("it.mcap"), true);
    recorder.tick(at(60)).expect("a disk that works");
    let file = path("it.mcap.part");
    for command in ["info", "decode"] {
        let assert = rtutap(&[command, arg(&file)]).assert().success();
        assert.stderr(
            contains("is being written").and(contains("not closed").not()).and(contains("recover").not()),
        );
    }
    assert!(stdout(&["info", arg(&file)], b"").contains(", being written\n"));
    drop(recorder);
    let left = rtutap(&["info", arg(&file)]).assert().success();
    left.stderr(contains("was not closed").and(contains("rtutap recover")));
}

#[test]
fn what_is_no_mcap_is_said_to_be_none_and_what_is_cut_in_its_first_bytes_is_unfinished() {
    let (_directory, path) = temporary();
    std::fs::write(path("it.hex"), "01 03 26 00 00 04 4F 41\n").expect("a file");
    rtutap(&["decode", arg(&path("it.hex")), "--input-format", "mcap"]).assert().code(2).stderr(
        contains("is no MCAP file, as which it was to be read").and(contains("leave out --input-format")),
    );
    for length in 1..=8 {
        std::fs::write(path("cut.mcap"), &mcap::MAGIC[..length]).expect("a file");
        let decode = rtutap(&["decode", arg(&path("cut.mcap"))]).assert().code(2);
        decode.stderr(contains("is an unfinished recording that ends before the first byte of a bus"));
    }
}

#[test]
fn options_that_would_do_nothing_are_refused() {
    let (_directory, path) = temporary();
    let input = path("it.hex");
    std::fs::write(&input, "# line 9600-8N1\n1.0 01 03 26 00 00 04 4F 41\n").expect("a file");
    for (args, words) in [
        (&["-o", "a.csv", "--link-type", "147"][..], "--link-type is for pcapng"),
        (&["-o", "a.mcap", "--raw-only", "--filter", "addr == 1"], "--raw-only leaves nothing to --filter"),
        (&["-o", "a.jsonl", "--time", "utc"], "--time is for CSV"),
    ] {
        let args = [&["export", arg(&input)], args].concat();
        let assert = rtutap(&args).current_dir(path(".")).assert().code(2);
        assert.stderr(contains(words).and(contains("hint:")));
    }
    let export = ["export", arg(&input), "-o", "-", "--format=jsonl"];
    rtutap(&export).env("RTUTAP_TIME", "utc").assert().success();
}

#[test]
fn a_filter_that_lets_nothing_pass_says_of_how_many() {
    let (_directory, path) = temporary();
    let (input, none) = (path("it.mcap"), "note: nothing passes --filter: 0 of 7 transactions match\n");
    two_buses(&input, false).finish("finished").expect("a disk that works");
    let input = arg(&input).to_owned();
    rtutap(&["decode", &input, "--filter", "addr == 9"]).assert().success().stdout("").stderr(contains(none));
    for name in ["a.csv", "b.mcap", "c.hex", "d.jsonl", "e.pcapng"] {
        let args = ["export", &input, "-o", name, "--filter", "addr == 9"];
        // Hex text holds one bus.
        let hex = ["--filter", "addr == 9 && bus == pump"];
        let args =
            if name == "c.hex" { [&["export", "-", "-o", name], &hex[..]].concat() } else { args.to_vec() };
        let assert =
            rtutap(&args).current_dir(path(".")).write_stdin("1.0 01 03 26 00 00 04 4F 41\n").assert();
        let said = if name == "c.hex" { "0 of 1 transactions match" } else { none };
        assert.success().stderr(contains(said));
    }
    let passes = rtutap(&["decode", &input, "--filter", "addr == 1"]).assert().success();
    passes.stderr(contains("nothing passes").not());
}

#[test]
fn auto_in_the_environment_means_nothing_to_a_file() {
    let hex = "1.0 01 03 26 00 00 04 4F 41\n";
    for command in ["decode", "info"] {
        let assert = rtutap(&[command, "-"]).env("RTUTAP_LINE", "auto").write_stdin(hex).assert();
        assert.success().stderr(contains("9600-8N1 assumed"));
    }
    rtutap(&["verify", "-"]).env("RTUTAP_LINE", "auto").write_stdin(hex).assert().stderr(contains("assumed"));
}

#[test]
fn numbers_out_of_range_are_refused_with_the_reason() {
    for (args, words) in [
        (&["--rotate-time", "1ms"][..], "not within 1s to 366d, nor 0 for never"),
        (&["--rotate-size", "-5MB"], "it is negative"),
        (&["--rotate-size", "99999999999999TB"], "more than can be counted"),
        (&["--rotate-chunks", "0"], "memory would grow without end"),
        (&["--ring", "0", "--trigger", "addr == 1"], "nothing would be kept around a match"),
        (&["--min-free", "1000000TB"], "can never be met: the whole disk has"),
    ] {
        let (_directory, path) = temporary();
        let args = [&["record", "-", "-o", "a.mcap"], args].concat();
        rtutap(&args)
            .current_dir(path("."))
            .write_stdin(&REQUEST[..])
            .assert()
            .code(2)
            .stderr(contains(words));
        assert_eq!(std::fs::read_dir(path(".")).expect("a directory").count(), 0, "{args:?}");
    }
    for (duration, words) in [("0", "not within 1s to 1d"), ("2x", "give a unit"), ("-1s", "it is negative")]
    {
        rtutap(&["demo", "--duration", duration]).assert().code(2).stderr(contains(words));
    }
}

#[test]
fn simulated_hex_text_says_the_adapter_that_was_asked_for() {
    let args = ["simulate", "-o", "-", "--frames", "40"];
    assert!(!stdout(&args, b"").contains("adapter-hold"));
    let hex = stdout(&[&args[..], &["--adapter", "ftdi16"]].concat(), b"");
    let heading = hex.lines().find(|line| line.starts_with("# adapter-hold ")).expect("a heading");
    let again = stdout(&["export", "-", "-o", "-", "--format", "hex"], hex.as_bytes());
    assert!(again.contains(heading), "{again}");
}

#[test]
fn what_a_device_could_be_is_a_few_and_a_count() {
    let hex = "1.0 01 03 26 00 00 04 4F 41\n1.1 01 03 08 00 00 8d 41 00 00 8d 41 1f f0\n";
    let text = stdout(&["decode", "-", "-v"], hex.as_bytes());
    let line = text.lines().find(|line| line.contains("could be")).expect("several fit");
    assert!(line.matches(", ").count() == 2 && line.contains(" or ") && line.ends_with(" others"), "{line}");
}

#[test]
fn no_line_of_the_help_is_broken_twice() {
    for command in
        ["", "listen", "record", "replay", "decode", "verify", "export", "recover", "simulate", "ports"]
    {
        let args: Vec<&str> = [command, "--help"].into_iter().filter(|word| !word.is_empty()).collect();
        let help = stdout(&args, b"");
        let lines: Vec<&str> = help.lines().collect();
        // What was broken twice leaves a short line in the middle of a paragraph.
        for pair in lines.windows(2).filter(|pair| !pair[1].is_empty() && !pair[1].starts_with(' ')) {
            let first_word = pair[1].split(' ').next().map_or(0, str::len);
            let is_prose = pair[0].starts_with(|c: char| c.is_ascii_alphabetic()) && !pair[0].ends_with(':');
            assert!(!is_prose || pair[0].len() + 1 + first_word > 100, "{command}: {pair:?}");
        }
    }
}

#[test]
fn what_stood_there_stays_when_an_export_is_refused_and_a_plan_is_of_one_bus() {
    let (_directory, path) = temporary();
    let recording = path("two.mcap");
    two_buses(&recording, false).finish("finished").expect("a disk that works");
    let before = path("before.hex");
    std::fs::write(&before, "precious").expect("a disk that works");
    rtutap(&["export", arg(&recording), "--filter", "address == 1", "-o", arg(&before)])
        .assert()
        .code(2)
        .stderr(contains("hex text of what passes a filter holds one bus"));
    assert_eq!(std::fs::read_to_string(&before).expect("it is there"), "precious");
    rtutap(&["info", "--plan", arg(&recording)])
        .assert()
        .code(2)
        .stdout("")
        .stderr(contains("a plan is of one bus, and this has 'pump' and 'reservoir'"));
}

#[test]
fn packets_of_two_buses_come_back_as_two_buses() {
    let (_directory, path) = temporary();
    let (recording, packets) = (path("two.mcap"), path("two.pcapng"));
    two_buses(&recording, false).finish("finished").expect("a disk that works");
    rtutap(&["export", arg(&recording), "-o", arg(&packets)]).assert().success();
    let frames = |file: &Path| {
        let text = stdout(&["decode", arg(file), "--show=frames", "--format=json"], b"");
        let rows = text.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).expect(line));
        let frames = rows.filter(|row| row["type"] == "frame");
        let number = |row: &serde_json::Value, key: &str| row[key].as_i64().expect("a number");
        let mut frames: Vec<_> = frames
            .map(|row| {
                let what = ["bus", "bytes", "role", "echo"].map(|key| row[key].to_string());
                (what, number(&row, "end_ns"), number(&row, "uncertainty_ns"))
            })
            .collect();
        frames.sort();
        frames
    };
    let (before, after) = (frames(&recording), frames(&packets));
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(&after) {
        assert_eq!(before.0, after.0);
        // A packet has one time: that of the frame's end, as far as it is known.
        assert!((before.1 - after.1).abs() <= before.2, "{before:?} {after:?}");
    }
    let lines = stdout(&["info", arg(&packets)], b"");
    assert!(before.len() == 7 && lines.contains("19200-8E1") && lines.contains("9600-8N1"), "{lines}");
}

#[test]
fn hex_text_of_two_buses_decodes_to_the_letter_with_losses_line_errors_and_silences() {
    let (_directory, path) = temporary();
    let recording = path("two.mcap");
    let mut recorder = two_buses(&recording, false);
    let line = "38400-8N2".parse().expect("line settings");
    let attic = BusSettings {
        name: "attic".into(),
        line,
        adapter_hold_ns: Some(2_500_000),
        ..BusSettings::default()
    };
    let attic = recorder.add_bus(attic).expect("a disk that works");
    let line_errors = [LineError { offset: 3, kind: LineErrorKind::ParityOrFraming }];
    for (second, length) in [(38, 8), (39, 5), (41, 8)] {
        // Read before what the other bus had, and written later.
        let time = ReadTime::At(at(second - 10));
        let chunk = Chunk { time, bytes: &REQUEST[..length], line_errors: &line_errors };
        recorder.write_chunk(attic, &chunk, None).expect("a disk that works");
        recorder.write_silence(attic, at(second - 9)).expect("a disk that works");
        for kind in [LostKind::Overrun, LostKind::Disk] {
            let lost = Lost { time: Some(at(second - 9)), stream_offset: 0, kind, count: 3 };
            recorder.write_lost(attic, &lost).expect("a disk that works");
        }
    }
    recorder.finish("finished").expect("a disk that works");
    let text = path("two.hex");
    rtutap(&["export", arg(&recording), "-o", arg(&text)]).assert().success();
    let shows = ["--show=frames", "--show=transactions", "--show=readings", "--show=findings"];
    let decoded = |file: &Path| stdout(&[&["decode", arg(file), "--format=json"], &shows[..]].concat(), b"");
    let before = decoded(&recording);
    assert!(before.lines().count() > 20);
    assert_same_rows(&before, &decoded(&text));
}

/// Holds rows against others, one by one.
fn assert_same_rows(before: &str, after: &str) {
    for (before, after) in before.lines().zip(after.lines()) {
        assert_eq!(before, after);
    }
    assert_eq!(before.lines().count(), after.lines().count());
}
