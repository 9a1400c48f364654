//! Exports: what leaves the program means what it meant inside.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use predicates::prelude::*;
use serde_json::Value;
use tempfile::TempDir;

use crate::{rtutap, stdout};

const EVERYTHING: [&str; 9] = [
    "decode",
    "-",
    "--format",
    "json",
    "--show=frames",
    "--show=transactions",
    "--show=readings",
    "--time",
    "utc",
];

fn simulated(scenario: &str) -> String {
    stdout(&["simulate", "-o", "-", "--scenario", scenario, "--frames", "600", "--adapter", "usb1"], b"")
}

/// Returns what an export of an input holds.
fn export(format: &str, args: &[&str], input: &[u8]) -> Vec<u8> {
    let args = [&["export", "-", "-o", "-", "--format", format], args].concat();
    rtutap(&args).write_stdin(input).assert().success().get_output().stdout.clone()
}

fn export_text(format: &str, args: &[&str], input: &[u8]) -> String {
    String::from_utf8(export(format, args, input)).expect("UTF-8")
}

fn rows(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).expect(line)).collect()
}

/// Says of two places in hex text that bytes were lost there.
fn with_losses(hex: &str) -> String {
    let mut lines: Vec<&str> = hex.lines().collect();
    let time = |line: &str| line.split(' ').next().expect("a time").to_owned();
    let (queue, gone) = (
        format!("# lost 5 queue {}", time(lines[100])),
        format!("# lost 0 source-gone {}", time(lines[200])),
    );
    lines.insert(201, &gone);
    lines.insert(101, &queue);
    lines.join("\n") + "\n"
}

#[test]
fn hex_text_and_back_decodes_to_the_letter() {
    for scenario in ["installation", "demo"] {
        let input = with_losses(&simulated(scenario));
        let exported = export_text("hex", &["--adapter-hold", "1.5"], input.as_bytes());
        let hold: Vec<&str> = EVERYTHING.into_iter().chain(["--adapter-hold", "1.5"]).collect();
        let before = stdout(&hold, input.as_bytes());
        assert!(before.lines().count() > 500);
        assert_eq!(before.matches("\"type\":\"lost\"").count(), 2);
        assert_eq!(before.contains("\"kind\":\"parity-or-framing\""), scenario == "demo");
        assert_eq!(stdout(&EVERYTHING, exported.as_bytes()), before, "{scenario}");
    }
}

#[test]
fn untimed_input_stays_untimed() {
    let hex = simulated("installation");
    let reads = hex.lines().filter(|line| !line.starts_with('#'));
    let untimed: String =
        reads.map(|line| line.split_once(' ').expect("a time").1.to_owned() + "\n").collect();
    let digits = untimed.replace([' ', '\n'], "");
    let raw: Vec<u8> = (0..digits.len() / 2)
        .map(|at| u8::from_str_radix(&digits[2 * at..2 * at + 2], 16).expect("hex digits"))
        .collect();
    for input in [untimed.as_bytes(), &raw] {
        let exported = export("hex", &[], input);
        assert_eq!(stdout(&EVERYTHING, &exported), stdout(&EVERYTHING, input));
    }
}

#[test]
fn json_lines_are_those_of_decode() {
    let input = simulated("everything-bad");
    let decoded = stdout(&EVERYTHING, input.as_bytes());
    assert_eq!(export_text("jsonl", &[], input.as_bytes()), decoded);
    let filter = ["--filter", "fn == 3 && outcome == answered"];
    let decoded = stdout(&[&EVERYTHING[..], &filter].concat(), input.as_bytes());
    assert_eq!(export_text("jsonl", &filter, input.as_bytes()), decoded);
}

#[test]
fn filtered_hex_text_holds_the_bytes_of_what_passes() {
    let input = simulated("everything-bad");
    let filter = "fn == 3 || damaged";
    let rows = rows(&stdout(
        &["decode", "-", "--show=frames", "--format=json", "--filter", filter],
        input.as_bytes(),
    ));
    let wanted: String = rows.iter().filter_map(|row| row["bytes"].as_str()).collect();
    let exported = export_text("hex", &["--filter", filter], input.as_bytes());
    let lines = exported.lines().filter(|line| !line.starts_with('#'));
    let bytes: String =
        lines.flat_map(|line| line.split('#').next().unwrap_or("").split(' ').skip(1)).collect();
    assert!(wanted.len() > 1000 && wanted.len() < input.len());
    assert_eq!(bytes.to_lowercase(), wanted);
    let times: BTreeSet<&str> = input.lines().filter_map(|line| line.split(' ').next()).collect();
    assert!(exported.lines().filter_map(|line| line.split(' ').next()).all(|time| times.contains(time)));
}

#[test]
fn wide_csv_has_a_row_a_poll_and_every_reading_in_its_column() {
    let input = simulated("installation");
    let readings = rows(&stdout(&["decode", "-", "--show=readings", "--format=json"], input.as_bytes()));
    let table = export_text("csv", &["--wide", "--time", "utc"], input.as_bytes());
    let mut table = csv::Reader::from_reader(table.as_bytes());
    let heading = table.headers().expect("a heading").clone();
    let mut cells = Vec::new();
    let mut polls = BTreeSet::new();
    for row in table.records() {
        let row = row.expect("as many cells as the heading");
        let transaction = &row[5];
        assert!(polls.insert(transaction.to_owned()), "one row for {transaction}");
        for (key, cell) in heading.iter().zip(&row).skip(6).filter(|(_, cell)| !cell.is_empty()) {
            let value: f64 = cell.parse().expect("a number");
            cells.push((transaction.to_owned(), key.to_owned(), format!("{value:.6}")));
        }
    }
    let wanted: Vec<_> = readings
        .iter()
        .map(|row| {
            let key = format!(
                "{} [{}]",
                row["quantity"].as_str().expect("a name"),
                row["unit"].as_str().expect("a unit")
            );
            (row["transaction"].to_string(), key, format!("{:.6}", row["value"].as_f64().expect("a number")))
        })
        .collect();
    cells.sort();
    let mut sorted = wanted;
    sorted.sort();
    assert!(sorted.len() > 300);
    assert!(cells == sorted, "{} cells, {} readings", cells.len(), sorted.len());
}

/// Returns the serial numbers in rows.
fn serial_numbers(rows: &[Value]) -> BTreeSet<String> {
    let numbers = rows.iter().filter_map(|row| row["serial_number"].as_str());
    numbers.map(str::to_owned).collect()
}

/// Serial numbers in the clear: the kind of device, then digits.
pub fn leaks(text: &[u8]) -> bool {
    text.windows(6).any(|window| window.starts_with(b"YL") && window[2..].iter().all(u8::is_ascii_digit))
}

#[test]
fn a_redacted_export_has_no_serial_number_and_means_the_same_otherwise() {
    let input = simulated("installation");
    let plain = rows(&export_text("jsonl", &[], input.as_bytes()));
    assert!(serial_numbers(&plain).contains("YL0119052307"));
    let hex = export_text("hex", &["--redact"], input.as_bytes());
    let redacted = rows(&stdout(&EVERYTHING, hex.as_bytes()));
    assert!(serial_numbers(&redacted).contains("YL01XXXXXXXX"));
    assert_eq!(plain.len(), redacted.len());
    for (plain, redacted) in plain.iter().zip(&redacted) {
        for key in ["type", "id", "device", "command", "role", "outcome", "start_ns", "value", "quantity"] {
            assert_eq!(plain[key], redacted[key], "{plain}");
        }
    }
    let bytes: Vec<u8> = redacted
        .iter()
        .filter_map(|row| row["bytes"].as_str())
        .flat_map(|digits| {
            (0..digits.len() / 2).map(|at| u8::from_str_radix(&digits[2 * at..2 * at + 2], 16))
        })
        .collect::<Result<_, _>>()
        .expect("hex digits");
    assert!(!leaks(&bytes));
    for (format, args) in [("csv", &["--wide"][..]), ("csv", &[]), ("jsonl", &[]), ("pcapng", &[])] {
        assert!(leaks(&export(format, args, input.as_bytes())), "{format} has them otherwise");
        let redacted = export(format, &[args, &["--redact"]].concat(), input.as_bytes());
        assert!(!leaks(&redacted), "{format}");
        assert!(redacted.windows(8).any(|window| window == b"redacted"), "{format} says so");
    }
}

/// What a probe answers to a request for its serial number, the CRC good.
const ASKED: &str = "# line 9600-8N1\n1.0 01 03 09 00 00 07 07 94\n";
const ANSWER: &str = "01 03 0E 00 59 4C 30 31 31 34 30 31 30 30 32 32 00 19 66";

#[test]
fn serial_numbers_are_blanked_in_damaged_unasked_and_headless_answers_too() {
    let redact = |input: &str| {
        let text = export_text("hex", &["--redact"], input.as_bytes());
        let read = text.lines().rfind(|line| !line.starts_with('#')).expect("a read");
        read.split_once(' ').expect("a time").1.to_owned()
    };
    let good = redact(&format!("{ASKED}1.05 {ANSWER}\n"));
    assert!(good.starts_with("01 03 0E 00 59 4C 30 31 58 58 58 58 58 58 58 58 00 "), "{good}");
    let unasked = redact(&format!("1.05 {ANSWER}\n"));
    assert_eq!(unasked, good, "the maker's prefix gives it away");
    let damaged = redact(&format!("{ASKED}1.05 {}\n", ANSWER.replace("59 4C", "D9 4C")));
    assert!(!damaged.contains("34 30") && damaged.starts_with("01 03 0E 00 D9"), "{damaged}");
    let headless = redact(&format!("{ASKED}1.05 {}\n", &ANSWER[6..]));
    assert!(!headless.contains("34 30"), "{headless}");
    let cut = redact(&format!("{ASKED}1.05 {}\n", &ANSWER[..42]));
    assert!(!cut.contains("34 30"), "{cut}");
}

#[test]
fn a_redacted_file_does_not_tell_the_filter() {
    let filter = "serial != \"YL0119052307\"";
    let input = simulated("installation");
    let told = export_text("hex", &["--filter", filter], input.as_bytes());
    assert!(told.contains(filter), "otherwise it does");
    let redacted = export_text("hex", &["--filter", filter, "--redact"], input.as_bytes());
    assert!(!leaks(redacted.as_bytes()) && redacted.contains("chosen by a filter"));
}

#[test]
fn packets_and_back_are_the_same_frames() {
    let input = simulated("installation");
    let packets = export("pcapng", &["--link-type", "250"], input.as_bytes());
    let frames = |input: &[u8]| {
        let rows = rows(&stdout(&["decode", "-", "--show=frames", "--format=json"], input));
        let frames = rows.into_iter().filter(|row| row["type"] == "frame");
        frames
            .map(|row| (row["bytes"].clone(), row["role"].clone(), row["end_ns"].as_i64()))
            .collect::<Vec<_>>()
    };
    let (before, after) = (frames(input.as_bytes()), frames(&packets));
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(&after) {
        assert_eq!((&before.0, &before.1), (&after.0, &after.1));
    }
    let user = export("pcapng", &["--link-type", "147"], input.as_bytes());
    assert_eq!(user.len() + 12 * before.len(), packets.len(), "without headers it is the same");
}

pub fn temporary() -> (TempDir, impl Fn(&str) -> PathBuf) {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().to_owned();
    (directory, move |name| path.join(name))
}

pub fn arg(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[test]
fn a_recording_is_never_written_over() {
    let (_directory, path) = temporary();
    let input = path("it.hex");
    std::fs::write(&input, simulated("installation")).expect("a file");
    let before = std::fs::read(&input).expect("a file");
    let beside = path(".").join("it.hex");
    rtutap(&["export", arg(&input), "-o", arg(&beside)])
        .assert()
        .code(2)
        .stderr(predicate::str::contains("is an input as well"));
    assert_eq!(std::fs::read(&input).expect("a file"), before);
    let output = path("kept.csv");
    std::fs::write(&output, "kept").expect("a file");
    rtutap(&["export", arg(&path("none.hex")), "-o", arg(&output)]).assert().code(2);
    assert_eq!(std::fs::read(&output).expect("a file"), b"kept", "the input could not be read");
}

#[test]
fn what_cannot_be_written_is_said_with_a_way_out() {
    for (args, message) in [
        (&["-o", "it.xyz"][..], "no format is called 'xyz'"),
        (&["-o", "it"], "no extension"),
        (&["-o", "-"], "no extension"),
        (&["-o", "it.hex", "--wide"], "--wide is for CSV"),
        (&["-o", "it.csv", "--show=frames", "--show=readings"], "CSV has one kind of row"),
        (&["-o", "it.pcapng", "--show=frames"], "--show has nothing to choose"),
        (&["-o", "/nowhere/at/all.csv"], "create the directory first"),
    ] {
        let assert =
            rtutap(&[&["export", "-"], args].concat()).write_stdin("01 03 26 00 00 04 4F 41\n").assert();
        assert.code(2).stderr(predicate::str::contains(message).and(predicate::str::contains("hint:")));
    }
}

/// Returns the rows of a file of its own, in the order of `decode`.
fn rows_of(file: &Path) -> Vec<Value> {
    let args = [&["decode", arg(file)][..], &EVERYTHING[2..]].concat();
    rows(&stdout(&args, b""))
}

#[test]
fn mcap_keeps_every_byte_and_beside_them_what_passes() {
    let (_directory, path) = temporary();
    let input = path("it.hex");
    std::fs::write(&input, with_losses(&simulated("demo"))).expect("a file");
    let (whole, part) = (path("whole.mcap"), path("part.mcap"));
    rtutap(&["export", arg(&input), "-o", arg(&whole)]).assert().success();
    rtutap(&["export", arg(&input), "-o", arg(&part), "--filter", "addr == 1"]).assert().success();
    assert_eq!(rows_of(&whole), rows_of(&input));
    assert_eq!(rows_of(&part), rows_of(&input), "the bytes are all there");
    let back = path("back.hex");
    rtutap(&["export", arg(&part), "-o", arg(&back)]).assert().success();
    assert_eq!(rows_of(&back), rows_of(&input));
    let topics = |file: &Path| {
        let bytes = std::fs::read(file).expect("a file");
        let summary = mcap::Summary::read(&bytes).expect("MCAP").expect("a summary");
        summary.channels.values().map(|channel| channel.topic.clone()).collect::<BTreeSet<_>>()
    };
    let of_two = |topic: &&String| topic.starts_with("/bus0/sensor/2/");
    assert!(topics(&whole).iter().any(|topic| of_two(&topic)));
    assert!(!topics(&part).iter().any(|topic| of_two(&topic)));
    assert!(topics(&part).iter().any(|topic| topic.starts_with("/bus0/sensor/1/")));
}

#[test]
fn a_redacted_mcap_has_no_serial_number_and_says_so() {
    let (_directory, path) = temporary();
    let (input, output) = (path("it.hex"), path("it.mcap"));
    std::fs::write(&input, simulated("installation")).expect("a file");
    rtutap(&["export", arg(&input), "-o", arg(&output), "--redact"]).assert().success();
    let rows = rows_of(&output);
    assert!(serial_numbers(&rows).contains("YL01XXXXXXXX"));
    assert!(serial_numbers(&rows).iter().all(|number| !leaks(number.as_bytes())));
    let bytes = std::fs::read(&output).expect("a file");
    for message in mcap::MessageStream::new(&bytes).expect("MCAP") {
        assert!(!leaks(&message.expect("a message").data));
    }
    assert!(bytes.windows(8).any(|window| window == b"redacted"), "metadata is not compressed");
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_has_every_reading_in_typed_columns() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::{Field, RowAccessor};

    let input = simulated("installation");
    let wanted = rows(&stdout(&["decode", "-", "--show=readings", "--format=json"], input.as_bytes()));
    let (_directory, path) = temporary();
    let file = path("it.parquet");
    rtutap(&["export", "-", "-o", arg(&file), "--redact"]).write_stdin(input).assert().success();
    let reader = SerializedFileReader::new(std::fs::File::open(&file).expect("a file")).expect("Parquet");
    let metadata = reader.metadata().file_metadata().key_value_metadata().expect("metadata").clone();
    assert!(
        metadata.iter().any(|entry| entry.value.as_ref().is_some_and(|value| value.contains("redacted")))
    );
    let mut count = 0;
    for (row, wanted) in reader.get_row_iter(None).expect("rows").zip(&wanted) {
        let row = row.expect("a row");
        let columns: Vec<&str> = row.get_column_iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(columns[..4], ["type", "bus", "t", "t_ns"]);
        assert_eq!(Some(row.get_long(3).expect("nanoseconds")), wanted["t_ns"].as_i64());
        assert_eq!(
            Some(row.get_timestamp_micros(2).expect("a time")),
            wanted["t_ns"].as_i64().map(|ns| ns / 1000)
        );
        assert_eq!(Some(u64::from(row.get_ubyte(4).expect("an address"))), wanted["address"].as_u64());
        assert_eq!(row.get_string(7).ok().map(String::as_str), wanted["quantity"].as_str());
        let value = row.get_double(8).expect("a number");
        assert!((value - wanted["value"].as_f64().expect("a number")).abs() < 1e-9, "{wanted}");
        let serial_number = row.get_column_iter().find(|(name, _)| *name == "serial_number").map(|it| it.1);
        assert!(!matches!(serial_number, Some(Field::Str(text)) if leaks(text.as_bytes())));
        count += 1;
    }
    assert_eq!((count, count > 300), (wanted.len(), true));
}

#[test]
fn what_stood_there_stays_when_an_export_fails_in_every_format() {
    let (_directory, path) = temporary();
    let input = path("long.hex");
    let line = "2026-01-01T00:00:00Z 01 03 26 00 00 04 4f 41\n";
    std::fs::write(&input, line.repeat(5000) + "2026-01-01T00:00:00Z 01 03 2G\n").expect("a disk that works");
    for name in ["a.mcap", "a.hex", "a.csv", "a.jsonl", "a.pcapng"] {
        let output = path(name);
        let export = || rtutap(&["export", arg(&input), "-o", arg(&output)]).assert().code(2);
        export().stderr(predicate::str::contains("line 5001"));
        let partial = std::fs::read(&output).expect("what was read before is there where nothing stood");
        assert!(!partial.is_empty(), "{name}");
        std::fs::write(&output, "precious").expect("a disk that works");
        export().stderr(predicate::str::contains(format!("'{}' is left as it was", output.display())));
        assert_eq!(std::fs::read_to_string(&output).expect("it is there"), "precious", "{name}");
        assert!(!path(&format!("{name}.unfinished")).exists(), "{name}");
    }
}

#[test]
fn a_recording_left_unfinished_is_not_written_over_by_its_own_export() {
    let (_directory, path) = temporary();
    let (part, whole) = (path("a.mcap.part"), path("a.mcap"));
    let sample = std::fs::read("captures/good-master.mcap").expect("a sample");
    std::fs::write(&part, &sample[..60_000]).expect("a disk that works");
    rtutap(&["export", arg(&part), "-o", arg(&whole)]).assert().success();
    assert_eq!(std::fs::read(&part).expect("it is there"), sample[..60_000]);
    assert!(whole.exists());
}

#[cfg(target_os = "linux")]
#[test]
fn an_export_that_a_full_disk_cuts_leaves_no_file_with_a_hole() {
    let (_directory, path) = temporary();
    for name in ["a.mcap", "a.hex", "a.csv", "a.jsonl", "a.pcapng"] {
        let output = path(name);
        let unfinished = path(&format!("{name}.unfinished"));
        std::os::unix::fs::symlink("/dev/full", unfinished).expect("a link");
        rtutap(&["export", "captures/troubled.mcap", "-o", arg(&output)])
            .assert()
            .code(2)
            .stderr(predicate::str::contains("No space left"));
        assert!(!output.exists(), "{name}");
    }
}

#[test]
fn an_input_is_not_taken_for_the_file_on_its_way() {
    let (_directory, path) = temporary();
    let sample = std::fs::read("captures/good-master.mcap").expect("a sample");
    for (command, suffix) in [("export", "unfinished"), ("recover", "recovered")] {
        let input = path(&format!("a.mcap.{suffix}"));
        std::fs::write(&input, &sample).expect("a disk that works");
        rtutap(&[command, arg(&input), "-o", arg(&path("a.mcap"))])
            .assert()
            .code(2)
            .stderr(predicate::str::contains("until it is whole"));
        assert_eq!(std::fs::read(&input).expect("it is there"), sample);
    }
}

#[cfg(unix)]
#[test]
fn an_export_through_a_link_writes_what_the_link_leads_to_and_spares_its_input() {
    let (_directory, path) = temporary();
    let sample = std::fs::read("captures/good-master.mcap").expect("a sample");
    for name in ["a.mcap", "a.hex"] {
        let (real, link) = (path(name), path(&format!("link-{name}")));
        std::fs::write(&real, "stale").expect("a disk that works");
        std::os::unix::fs::symlink(&real, &link).expect("a link");
        let on_the_way = path(&format!("{name}.unfinished"));
        std::fs::write(&on_the_way, &sample).expect("a disk that works");
        rtutap(&["export", arg(&on_the_way), "--input-format", "mcap", "-o", arg(&link)])
            .assert()
            .code(2)
            .stderr(predicate::str::contains("until it is whole"));
        assert_eq!(std::fs::read(&on_the_way).expect("the input is there"), sample, "{name}");
        rtutap(&["export", "captures/good-master.mcap", "-o", arg(&link)]).assert().success();
        assert!(link.is_symlink(), "{name}");
        assert_ne!(std::fs::read(&real).expect("it is there"), b"stale", "{name}");
    }
}
