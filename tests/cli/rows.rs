//! What comes out: rows keep the promises made about them.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::{rtutap, stdout};

/// The keys of each row, in their order.
const KEYS: [(&str, &str); 5] = [
    (
        "frame",
        "type id bus start_ns end_ns uncertainty_ns stream_offset bytes role echo address function boundary \
         confidence gap_before_ns gap_error_ns line_errors",
    ),
    (
        "damaged",
        "type id bus start_ns end_ns uncertainty_ns stream_offset bytes reason role address function \
         gap_before_ns gap_error_ns line_errors",
    ),
    ("identified", "type bus t_ns address device serial_number evidence frames"),
    (
        "transaction",
        "type id bus start_ns end_ns address function start_register quantity outcome exception_code latency_ns \
         latency_error_ns request response request_bytes response_bytes device candidates command fields",
    ),
    ("reading", "type bus t_ns address device serial_number quantity value unit derived transaction"),
];

const ALL: [&str; 8] =
    ["decode", "--show", "frames", "--show", "transactions", "--show", "readings", "--format"];

/// Returns a simulated recording with everything wrong in it, and its bytes.
fn bad_bus() -> (String, String) {
    let args =
        ["simulate", "-o", "-", "--scenario", "everything-bad", "--frames", "600", "--adapter", "usb1"];
    let text = stdout(&args, b"");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let bytes = lines.flat_map(|line| line.split('#').next().unwrap_or("").split(' ').skip(1));
    let bytes = bytes.collect::<String>().to_lowercase();
    (text, bytes)
}

fn rows(args: &[&str], input: &str) -> Vec<Value> {
    let text = stdout(args, input.as_bytes());
    text.lines().map(|line| serde_json::from_str(line).expect(line)).collect()
}

#[test]
fn frames_and_damaged_runs_in_order_give_back_the_bytes() {
    let (text, bytes) = bad_bus();
    let rows = rows(&["decode", "-", "--show", "frames", "--format", "json"], &text);
    let runs: Vec<&Value> =
        rows.iter().filter(|row| row["type"] == "frame" || row["type"] == "damaged").collect();
    let mut offset = 0;
    for (id, run) in runs.iter().enumerate() {
        assert_eq!((run["id"].as_u64(), run["stream_offset"].as_u64()), (Some(id as u64), Some(offset)));
        offset += run["bytes"].as_str().expect("hex").len() as u64 / 2;
    }
    let joined: String = runs.iter().filter_map(|run| run["bytes"].as_str()).collect();
    assert_eq!(joined, bytes);
    assert!(runs.iter().any(|run| run["type"] == "damaged"));
}

#[test]
fn filters_see_derived_values_and_unknown_names_are_warned_of() {
    let text = stdout(&["simulate", "-o", "-", "--frames", "200"], b"");
    let decode = ["decode", "-", "--device", "1=yosemitech-do", "--filter"];
    assert!(!stdout(&[&decode[..], &["do_mg_l > 0.1"]].concat(), text.as_bytes()).is_empty());
    let warned =
        rtutap(&["decode", "-", "--filter", "temprature > 1"]).write_stdin("01 03").assert().success();
    warned.stderr(predicates::str::contains(
        "warning: --filter: no profile has a field 'temprature'; did you mean 'temperature'?",
    ));
}

#[test]
fn findings_can_be_asked_for() {
    let findings =
        |format, input: &[u8]| stdout(&["decode", "-", "--show", "findings", "--format", format], input);
    for format in ["text", "json"] {
        assert_eq!(findings(format, b"01 03 26 00 00 04 4F 41 01 03 08 00 00 8D 41 66 66 73 3F 2C B2"), "");
        assert!(findings(format, b"01 03").contains("2 bytes belong to no frame"));
    }
}

#[test]
fn notes_and_hints_are_about_rows_that_were_printed() {
    let text = stdout(&["simulate", "-o", "-", "--frames", "60"], b"");
    let csv = ["decode", "-", "--show", "readings", "--format", "csv"];
    let said = |args: &[&str]| {
        let output = rtutap(args).write_stdin(&*text).assert().success().get_output().stderr.clone();
        String::from_utf8(output).expect("UTF-8")
    };
    assert!(said(&csv).contains("salinity"));
    let none = "note: nothing passes --filter: 0 of 30 transactions match\n";
    assert_eq!(said(&[&csv[..], &["--filter", "addr == 99"]].concat()), none);
    assert_eq!(said(&["decode", "-", "--filter", "addr == 99"]), none);
}

#[test]
fn every_row_has_its_keys_in_order() {
    let (text, _) = bad_bus();
    let installation = stdout(&["simulate", "-o", "-", "--frames", "60"], b"");
    let mut seen = BTreeMap::new();
    for input in [text, installation] {
        for line in stdout(&[&ALL[..], &["json", "-"]].concat(), input.as_bytes()).lines() {
            let row: Value = serde_json::from_str(line).expect(line);
            let kind = row["type"].as_str().expect("a type").to_owned();
            let keys = KEYS.iter().find(|(name, _)| *name == kind).map(|(_, keys)| *keys).expect(&kind);
            let mut rest = line;
            for key in keys.split_whitespace() {
                let quoted = format!("\"{key}\":");
                let at = rest.find(&quoted).unwrap_or_else(|| panic!("{key} in {line}"));
                rest = &rest[at + quoted.len()..];
            }
            assert_eq!(row.as_object().map(|row| row.len()), Some(keys.split_whitespace().count()), "{line}");
            *seen.entry(kind).or_insert(0) += 1;
        }
    }
    assert_eq!(seen.len(), KEYS.len(), "{seen:?}");
}

#[test]
fn a_transaction_comes_after_its_frames_and_its_readings_right_after_it() {
    let text = stdout(&["simulate", "-o", "-", "--frames", "200"], b"");
    let rows = rows(&[&ALL[..], &["json", "-"]].concat(), &text);
    let mut last_run = None;
    let mut last_transaction = None;
    let mut readings = 0;
    for row in &rows {
        match row["type"].as_str() {
            Some("frame" | "damaged") => last_run = row["id"].as_u64(),
            Some("transaction") => {
                last_transaction = row["id"].as_u64();
                assert!(row["request"].as_u64() <= last_run && row["response"].as_u64() <= last_run, "{row}");
            }
            Some("reading") => {
                readings += 1;
                assert_eq!(row["transaction"].as_u64(), last_transaction, "{row}");
            }
            _ => {}
        }
    }
    assert!(readings > 50, "{readings}");
}

#[test]
fn info_counts_what_decode_prints() {
    let (text, bytes) = bad_bus();
    let info: Value =
        serde_json::from_str(&stdout(&["info", "-", "--format", "json"], text.as_bytes())).expect("JSON");
    let rows = rows(&[&ALL[..], &["json", "-"]].concat(), &text);
    let count = |kind: &str| rows.iter().filter(|row| row["type"] == kind).count() as u64;
    assert_eq!(info["bytes"].as_u64(), Some(bytes.len() as u64 / 2));
    assert_eq!(info["frames"].as_u64(), Some(count("frame")));
    assert_eq!(info["damaged"].as_u64(), Some(count("damaged")));
    let outcomes = info["transactions"].as_object().expect("an object");
    for (outcome, number) in outcomes {
        let of_outcome =
            rows.iter().filter(|row| row["type"] == "transaction" && row["outcome"] == outcome.as_str());
        assert_eq!(number.as_u64(), Some(of_outcome.count() as u64), "{outcome}");
    }
    assert_eq!(outcomes.values().filter_map(Value::as_u64).sum::<u64>(), count("transaction"));
}

#[test]
fn a_frame_passes_the_filter_when_its_transaction_does() {
    let (text, _) = bad_bus();
    let all = rows(&[&ALL[..4], &["transactions", "--format", "json", "-"]].concat(), &text);
    let filter = "outcome == answered && fn == 3";
    let passed =
        rows(&[&ALL[..4], &["transactions", "--format", "json", "-", "--filter", filter]].concat(), &text);
    let mut ids: Vec<u64> = Vec::new();
    for row in all.iter().filter(|row| row["outcome"] == "answered" && row["function"] == 3) {
        ids.extend(["request", "response"].iter().filter_map(|side| row[*side].as_u64()));
    }
    ids.sort_unstable();
    let expected: Vec<&Value> = all
        .iter()
        .filter(|row| match row["type"].as_str() {
            Some("transaction") => row["outcome"] == "answered" && row["function"] == 3,
            Some("frame" | "damaged") => ids.binary_search(&row["id"].as_u64().unwrap_or(0)).is_ok(),
            _ => false,
        })
        .collect();
    assert!(expected.len() > 10);
    assert_eq!(passed.iter().collect::<Vec<_>>(), expected);
}

#[test]
fn counters_run_on_over_inputs_and_offsets_start_afresh() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("bus.hex");
    let path = path.to_str().expect("UTF-8");
    std::fs::write(path, "1.5 01 03 26 00 00 04 4F 41\n").expect("written");
    let rows = rows(&["decode", path, path, "--show", "frames", "--format", "json"], "");
    let places: Vec<_> = rows.iter().map(|row| (row["id"].as_u64(), row["stream_offset"].as_u64())).collect();
    assert_eq!(places, [(Some(0), Some(0)), (Some(1), Some(0))]);
}

#[test]
fn raw_bytes_and_hex_text_without_times_give_the_same_frames() {
    let bytes = [0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41];
    let args = ["decode", "-", "--show", "frames", "--format", "json"];
    let raw = stdout(&args, &bytes);
    assert_eq!(raw, stdout(&args, b"0103260000044F41"));
    assert!(raw.contains("\"start_ns\":null") && raw.contains("\"gap_before_ns\":null"), "{raw}");
}

#[test]
fn a_32_bit_float_is_written_as_its_shortest_decimal() {
    let text = "# line 9600-8N1\n1.5 01 03 1E 00 00 02 C2 23\n1.55 01 03 04 CD CC FC 40 44 50\n";
    let args = ["decode", "-", "--format", "json", "--device", "1=yosemitech-sonde"];
    let row = stdout(&args, text.as_bytes());
    assert!(row.contains("\"name\":\"supply_voltage\",\"value\":7.9,\"text\":\"7.9 V\""), "{row}");
}

#[test]
fn the_same_seed_simulates_the_same_bytes_and_truth() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = |name: &str| directory.path().join(name).to_str().expect("UTF-8").to_owned();
    for run in ["1", "2"] {
        let (bus, truth) = (path(&format!("bus{run}")), path(&format!("truth{run}")));
        rtutap(&["simulate", "-o", &bus, "--truth", &truth, "--seed", "7", "--frames", "50"])
            .assert()
            .success();
    }
    let read = |name: &str| std::fs::read_to_string(path(name)).expect("written");
    assert_eq!(read("bus1"), read("bus2"));
    assert_eq!(read("truth1"), read("truth2"));
    let truth: Vec<Value> =
        read("truth1").lines().map(|line| serde_json::from_str(line).expect(line)).collect();
    let frames = rows(&["decode", &path("bus1"), "--show", "frames", "--format", "json"], "");
    let frames = frames.iter().filter(|row| row["type"] == "frame");
    let found: Vec<_> = frames.map(|row| (row["stream_offset"].as_u64(), row["role"].clone())).collect();
    let sent: Vec<_> = truth.iter().map(|frame| (frame["start"].as_u64(), frame["role"].clone())).collect();
    assert_eq!(found, sent);
}
