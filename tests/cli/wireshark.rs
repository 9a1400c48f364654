//! Packets as Wireshark sees them: `cargo test -- --ignored wireshark`, where tshark is installed.

#![allow(clippy::print_stdout)] // the figures are what the ignored test is for

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::{rtutap, stdout};

/// A packet as tshark has it: event, query or response, whether the CRC is right, whether it is malformed, comment.
struct Packet {
    event: String,
    info: String,
    crc_is_good: bool,
    is_malformed: bool,
    comment: String,
}

/// Dissects a file; `None` where there is no tshark.
fn dissect(file: &Path) -> Option<Vec<Packet>> {
    let mut command = Command::new("tshark");
    command.arg("-r").arg(file).args(["-d", "rtacser.data,mbrtu", "-o", "mbrtu.crc_verification:TRUE"]);
    command.args(["-T", "fields", "-E", "separator=|"]);
    for field in ["rtacser.eventtype", "_ws.col.Info", "mbrtu.crc16.status", "_ws.malformed", "frame.comment"]
    {
        command.args(["-e", field]);
    }
    let Ok(output) = command.output() else {
        println!("skipped: there is no tshark");
        return None;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let packets = text.lines().map(|line| {
        let cells: Vec<&str> = line.split('|').collect();
        Packet {
            event: cells[0].to_owned(),
            info: cells[1].to_owned(),
            crc_is_good: cells[2] == "1",
            is_malformed: !cells[3].is_empty(),
            comment: cells[4].to_owned(),
        }
    });
    Some(packets.collect())
}

/// Tells whether Wireshark's Modbus RTU can take a frame apart at all.
///
/// It takes no broadcast, nothing below five bytes, and no answer of a Yosemitech probe to `start-measurement`: a byte
/// count of 0, then a byte.
fn can_be_dissected(row: &Value) -> bool {
    let bytes = row["bytes"].as_str().expect("hex");
    let is_start = row["role"] == "response" && bytes.get(2..6) == Some("0300") && bytes.len() > 10;
    row["address"] != 0 && bytes.len() >= 10 && !is_start
}

/// Returns what is dissected: two simulations, and all samples.
fn inputs(directory: &Path) -> Vec<PathBuf> {
    let mut inputs = Vec::new();
    for scenario in ["installation", "everything-bad"] {
        let input = directory.join(scenario).with_extension("hex");
        let name = input.to_str().expect("UTF-8");
        rtutap(&["simulate", "-o", name, "--scenario", scenario, "--frames", "2000"]).assert().success();
        inputs.push(input);
    }
    let samples = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/captures")).expect("samples");
    inputs.extend(samples.map(|entry| entry.expect("an entry").path()));
    inputs.retain(|path| path.extension().is_some_and(|extension| extension != "md"));
    inputs
}

#[test]
#[ignore = "needs tshark"]
fn every_frame_is_dissected_as_it_was_decoded() {
    let directory = tempfile::tempdir().expect("a directory");
    for input in inputs(directory.path()) {
        let scenario = input.file_name().expect("a name").display();
        let input = input.to_str().expect("UTF-8");
        let file = directory.path().join("it.pcapng");
        rtutap(&["export", input, "-o", file.to_str().expect("UTF-8")]).assert().success();
        let Some(packets) = dissect(&file) else { return };
        let rows = stdout(&["decode", input, "--show=frames", "--format=json"], b"");
        let rows = rows.lines().map(|row| serde_json::from_str::<Value>(row).expect("JSON"));
        let rows: Vec<Value> =
            rows.filter(|row| row["type"] == "frame" || row["type"] == "damaged").collect();
        let packets: Vec<Packet> =
            packets.into_iter().filter(|packet| packet.event.as_str() <= "0x02").collect();
        assert_eq!(packets.len(), rows.len(), "{scenario}");
        let (mut dissected, mut unclassified) = (0, 0);
        for (packet, row) in packets.iter().zip(&rows) {
            if row["type"] == "damaged" {
                assert!(packet.comment.starts_with("damaged: "), "{row}");
                continue;
            }
            let event = if row["role"] == "request" { "0x01" } else { "0x02" };
            assert_eq!(packet.event, event, "{row}");
            assert!(!packet.is_malformed, "{row}");
            if !can_be_dissected(row) {
                continue;
            }
            dissected += 1;
            assert!(packet.crc_is_good, "{row}");
            // Over a serial line Wireshark guesses from length and function; often it says that it cannot.
            match packet.info.split(':').next().unwrap_or_default().trim() {
                "Query" => assert_eq!(row["role"], "request", "{row}"),
                "Response" => assert_eq!(row["role"], "response", "{row}"),
                other => {
                    assert_eq!(other, "unknown", "{row}");
                    unclassified += 1;
                }
            }
        }
        println!(
            "{scenario}: {} frames and runs, {dissected} dissected, {unclassified} of unknown direction to Wireshark",
            rows.len()
        );
        assert!(dissected * 4 >= rows.len() * 3, "{scenario}: {dissected} of {}", rows.len());
    }
}
