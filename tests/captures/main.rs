//! The sample captures decode to what they are said to hold, and can be made again.

mod hex;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use assert_cmd::Command;

fn path(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "captures", name].iter().collect()
}

fn content(name: &str) -> String {
    #[expect(clippy::disallowed_methods, reason = "captures are files")]
    let text = std::fs::read_to_string(path(name));
    text.expect("a capture")
}

fn rtutap(args: &[&str]) -> Command {
    let mut command = assert_cmd::cargo::cargo_bin_cmd!("rtutap");
    command.args(args).env("XDG_CONFIG_HOME", "nowhere").env_remove("RTUTAP_CONFIG");
    command
}

/// Returns the rows of a capture, which nobody complains about.
fn rows(name: &str, show: &str) -> Vec<serde_json::Value> {
    let output = rtutap(&["decode", "--format", "json", "--show", show]).arg(path(name)).assert();
    let output = output.success().stderr("").get_output().stdout.clone();
    let rows = String::from_utf8(output).expect("UTF-8");
    rows.lines().map(|row| serde_json::from_str(row).expect("a JSON object")).collect()
}

/// Counts rows by a text of them.
fn count(rows: &[serde_json::Value], key: &str) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    for row in rows {
        *counts.entry(row[key].as_str().unwrap_or("none").to_owned()).or_default() += 1;
    }
    counts
}

fn counts<const N: usize>(expected: [(&str, usize); N]) -> BTreeMap<String, usize> {
    expected.map(|(name, count)| (name.to_owned(), count)).into()
}

#[test]
fn every_frame_of_the_manuals_is_one_and_every_exchange_has_its_command() {
    for (name, device, commands) in [
        (
            "manual-do.hex",
            "yosemitech-do",
            &[
                "get-serial-number",
                "start-measurement",
                "get-measurement",
                "get-version",
                "stop-measurement",
                "get-calibration",
                "set-calibration",
                "set-cap-coefficients",
                "set-address",
            ][..],
        ),
        (
            "manual-conductivity.hex",
            "yosemitech-conductivity",
            &[
                "get-serial-number",
                "start-measurement",
                "get-measurement",
                "get-conductivity",
                "get-version",
                "stop-measurement",
                "get-calibration",
                "set-calibration",
                "get-address",
                "set-address",
            ],
        ),
        (
            "manual-sonde.hex",
            "yosemitech-sonde",
            &[
                "get-measurement",
                "get-serial-number",
                "get-error-flag",
                "get-error-flag",
                "get-error-flag",
                "get-error-flag",
                "get-error-flag",
                "get-brush-interval",
                "set-brush-interval",
                "set-time",
                "get-time",
                "get-supply-voltage",
                "start-brush",
                "set-address",
            ],
        ),
    ] {
        let lines = content(name).lines().filter(|line| line.starts_with(['<', '>'])).count();
        let kinds = count(&rows(name, "frames"), "type");
        assert_eq!((kinds.get("frame"), kinds.get("damaged")), (Some(&lines), None), "{name}");
        let transactions = rows(name, "transactions");
        let found: Vec<_> =
            transactions.iter().map(|row| row["command"].as_str().unwrap_or("none")).collect();
        assert_eq!(found, commands, "{name}");
        for row in &transactions {
            assert_eq!(row["outcome"], "answered", "{name}: {row}");
            assert!(row["device"] == device || row["address"] == 255, "{name}: {row}");
        }
    }
}

#[test]
fn the_real_probe_is_known_by_its_serial_number() {
    assert_eq!(count(&rows("y511.hex", "frames"), "type"), counts([("frame", 20), ("identified", 1)]));
    let transactions = rows("y511.hex", "transactions");
    assert_eq!(count(&transactions, "outcome"), counts([("answered", 10)]));
    assert_eq!(count(&transactions, "device"), counts([("yosemitech-turb-wiper", 10)]));
    let readings = rows("y511.hex", "readings");
    assert_eq!(count(&readings, "quantity"), counts([("temperature", 1), ("turbidity", 1)]));
}

#[test]
fn the_clean_session_has_no_fault_and_all_three_sensors() {
    let frames = rows("installation.mcap", "frames");
    assert_eq!(count(&frames, "type"), counts([("frame", 2000), ("identified", 3)]));
    let transactions = rows("installation.mcap", "transactions");
    assert_eq!(count(&transactions, "outcome"), counts([("answered", 1000)]));
}

#[test]
fn the_troubled_bus_has_silence_late_answers_and_damage() {
    let outcomes = count(&rows("troubled.mcap", "transactions"), "outcome");
    for outcome in ["answered", "no-response", "late", "unsolicited", "damaged"] {
        assert!(outcomes.get(outcome).is_some_and(|&count| count > 0), "{outcome}: {outcomes:?}");
    }
}

/// Returns every message of a recording: topic, schema, number, times and content.
fn messages(path: &Path) -> Vec<(String, String, u32, u64, u64, Vec<u8>)> {
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    let file = std::fs::read(path).expect("a recording");
    let messages = mcap::MessageStream::new(&file).expect("MCAP").map(|message| {
        let message = message.expect("whole");
        let channel = &message.channel;
        let schema = channel.schema.as_ref().map(|schema| schema.name.clone()).unwrap_or_default();
        let times = (message.log_time, message.publish_time);
        (channel.topic.clone(), schema, message.sequence, times.0, times.1, message.data.to_vec())
    });
    messages.collect()
}

#[test]
fn the_recordings_are_what_their_documented_commands_make() {
    let readme = content("README.md");
    for name in ["installation.mcap", "troubled.mcap", "good-master.mcap", "mistaken-master.mcap"] {
        let target = format!(" -o captures/{name}");
        let documented = readme.lines().find(|line| line.ends_with(&target)).expect("a command");
        let command = documented.strip_prefix("cargo run --release -- ").expect("a command of rtutap");
        let directory = tempfile::tempdir().expect("a directory");
        let made = directory.path().join(name);
        let args: Vec<&str> = command.strip_suffix(&target).expect("found by it").split(' ').collect();
        rtutap(&args).arg("-o").arg(&made).assert().success().stderr("");
        // Messages, not bytes: another version of a library may compress them otherwise.
        let (committed, made) = (messages(&path(name)), messages(&made));
        assert!(committed.len() > 1000, "{name} has {} messages", committed.len());
        assert_eq!(committed.len(), made.len(), "make it again: {documented}");
        for (committed, made) in committed.iter().zip(&made) {
            assert_eq!(committed, made, "make it again: {documented}");
        }
    }
}

#[test]
fn every_capture_is_described() {
    let readme = content("README.md");
    for entry in std::fs::read_dir(path("")).expect("captures/") {
        let name = entry.expect("an entry").file_name().into_string().expect("UTF-8");
        assert!(name == "README.md" || readme.contains(&format!("| `{name}` |")), "{name}");
        let size = std::fs::metadata(path(&name)).expect("a file").len();
        assert!(size < 320_000, "{name} has {size} bytes; a sample is small");
    }
}
