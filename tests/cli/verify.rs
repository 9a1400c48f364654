//! `rtutap verify`: its reports, what fails it, and plans.

use std::path::{Path, PathBuf};

use predicates::prelude::*;

use crate::{rtutap, stdout};

/// A conductivity probe asked for too little, among what is right.
const MISTAKE: &str = "\
# line 9600-8N1
2026-01-01T00:00:00.010Z > 01 03 09 00 00 07 07 94
2026-01-01T00:00:00.050Z < 01 03 0E 09 59 4C 30 39 31 36 31 31 32 31 30 31 00 D9 90
2026-01-01T00:00:03.010Z > 01 03 26 00 00 04 4F 41
2026-01-01T00:00:03.040Z < 01 03 08 00 00 8D 41 66 66 73 3F 2C B2
2026-01-01T00:00:08.010Z > 01 03 26 00 00 04 4F 41
2026-01-01T00:00:08.040Z < 01 03 08 00 00 8D 41 66 66 73 3F 2C B2
";
/// The same probe, asked as its manual says.
const GOOD: &str = "\
# line 9600-8N1
2026-01-01T00:00:00.010Z > 01 03 09 00 00 07 07 94
2026-01-01T00:00:00.050Z < 01 03 0E 09 59 4C 30 39 31 36 31 31 32 31 30 31 00 D9 90
";

fn capture(name: &str) -> String {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "captures", name].iter().collect();
    path.to_str().expect("UTF-8").to_owned()
}

#[test]
fn the_sample_masters_have_their_reports() {
    for name in ["good-master", "mistaken-master"] {
        let output = rtutap(&["verify", &capture(&format!("{name}.mcap")), "--time", "relative"]).output();
        let output = output.expect("the program runs");
        assert_eq!(output.status.code(), Some(i32::from(name == "mistaken-master")));
        assert_eq!(String::from_utf8_lossy(&output.stderr), "");
        insta::assert_snapshot!(format!("verify_{name}"), String::from_utf8_lossy(&output.stdout));
    }
}

#[test]
fn the_exit_status_tells_what_was_found() {
    let status = |args: &[&str], input: &str| {
        let output = rtutap(&[&["verify", "-"], args].concat()).write_stdin(input).output();
        output.expect("the program runs").status.code()
    };
    assert_eq!(status(&[], GOOD), Some(0));
    assert_eq!(status(&[], MISTAKE), Some(1));
    assert_eq!(status(&["--fail-on", "never"], MISTAKE), Some(0));
    assert_eq!(status(&["--ignore", "d03"], MISTAKE), Some(0));
    assert_eq!(status(&["--ignore", "D03", "--fail-on", "note"], MISTAKE), Some(0), "nothing else is found");
    assert_eq!(status(&["--party", "line"], MISTAKE), Some(0));
    assert_eq!(status(&["--party", "line", "--party", "master"], MISTAKE), Some(1));
    assert_eq!(status(&["--ignore", "D99"], MISTAKE), Some(2));
    assert_eq!(status(&[], ""), Some(2), "an input without a byte");
    assert_eq!(status(&["--duration", "1s"], GOOD), Some(2), "a recording ends by itself");
}

#[test]
fn bytes_without_a_single_good_frame_are_an_error_of_the_line() {
    let noise = "# line 9600-8N1\n2026-01-01T00:00:00.010Z 81 43 09 10 22 87 07 95 31 33\n";
    let output = rtutap(&["verify", "-", "--format", "json"]).write_stdin(noise).assert().code(1);
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    assert!(text.contains("\"code\":\"L04\"") && text.contains("is probably not 9600-8N1"), "{text}");
    let good = rtutap(&["verify", "-", "--format", "json"]).write_stdin(GOOD).assert().code(0);
    good.stdout(predicate::str::contains("L04").not());
}

#[test]
fn findings_are_folded_in_json_lines_and_single_in_decode() {
    let output = rtutap(&["verify", "-", "--format", "json"]).write_stdin(MISTAKE).assert().code(1);
    let text = String::from_utf8(output.get_output().stdout.clone()).expect("UTF-8");
    let rows: Vec<serde_json::Value> =
        text.lines().map(|row| serde_json::from_str(row).expect("a JSON object")).collect();
    assert_eq!(rows.len(), 1, "{text}");
    let row = &rows[0];
    assert_eq!((&row["code"], &row["party"], &row["count"]), (&"D03".into(), &"master".into(), &2.into()));
    assert_eq!((&row["frames"], &row["span"]), (&serde_json::json!([2]), &serde_json::json!([4, 6])));
    assert!(row["first_ns"].as_i64() < row["last_ns"].as_i64() && row["t_ns"] == row["first_ns"]);
    let decoded = stdout(&["decode", "-", "--show", "findings", "--format", "json"], MISTAKE.as_bytes());
    assert_eq!(decoded.matches("\"count\":1,").count(), 2, "{decoded}");
    let csv = stdout(&["decode", "-", "--show", "findings", "--format", "csv"], MISTAKE.as_bytes());
    assert!(csv.starts_with("type,bus,t_ns,code,name,severity,party,address,frames,span,count,"), "{csv}");
}

#[test]
fn a_filter_finds_the_transactions_of_a_finding() {
    let rows = |filter: &str| {
        stdout(&["decode", "-", "--format", "json", "--filter", filter], MISTAKE.as_bytes()).lines().count()
    };
    assert_eq!((rows("finding == D03"), rows("finding == D06"), rows("!(finding == D03)")), (2, 0, 1));
}

#[test]
fn a_filter_finds_the_frames_and_damaged_runs_that_a_finding_names() {
    let damaged =
        MISTAKE.replace("00:00:08.010Z > 01 03 26 00 00 04 4F 41", "00:00:08.010Z > 01 03 26 00 00 04 4F 43");
    let types = |filter: &str| -> Vec<String> {
        let args =
            ["decode", "-", "--show", "frames", "--show", "findings", "--format", "json", "--filter", filter];
        let text = stdout(&args, damaged.as_bytes());
        text.lines().map(|row| row.split('"').nth(3).expect("a type").to_owned()).collect()
    };
    assert_eq!(types("finding == F01"), ["damaged", "finding"]);
    assert_eq!(types("finding == D03"), ["frame", "frame", "finding"], "its whole transaction");
    assert_eq!(types("finding == D06"), [""; 0]);
}

#[test]
fn findings_come_after_their_transaction_and_its_readings() {
    let args = [
        "decode",
        "-",
        "--format",
        "json",
        "--show",
        "transactions",
        "--show",
        "readings",
        "--show",
        "findings",
    ];
    let rows = stdout(&args, MISTAKE.as_bytes());
    let kinds: Vec<&str> = rows.lines().map(|row| row.split('"').nth(3).expect("a type")).collect();
    assert_eq!(kinds[1..6], ["transaction", "reading", "reading", "reading", "finding"], "{rows}");
}

#[test]
fn junit_has_a_case_a_finding() {
    let output = rtutap(&["verify", "-", "--format", "junit"]).write_stdin(MISTAKE).assert().code(1);
    let xml = String::from_utf8(output.get_output().stdout.clone()).expect("UTF-8");
    let case =
        "<testcase classname=\"rtutap.master\" name=\"D03 wrong-quantity: bus0 address 1 #1\" time=\"0\">";
    assert!(xml.contains(case) && xml.contains("timestamp=\"2026-01-01T00:00:00."), "{xml}");
    assert!(xml.contains("frames 2, bytes 4 to 5"), "{xml}");
    assert!(
        xml.contains("<failure type=\"error\" message=\"get-measurement takes 2 or 5 registers, not 4\">")
    );
}

#[test]
fn a_rule_explains_itself_without_an_input() {
    let text = stdout(&["verify", "--explain", "D06"], b"");
    assert!(
        text.starts_with("D06 read-too-early: warning, master\n") && text.contains("Manuals, 3"),
        "{text}"
    );
    let unknown = predicate::str::contains("no rule has the code 'D99'");
    rtutap(&["verify", "--explain", "D99"]).assert().code(2).stderr(unknown);
}

#[test]
fn the_configuration_silences_and_raises_codes() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("config.toml");
    let status = |config: &str, args: &[&str]| {
        std::fs::write(&path, config).expect("written");
        let path = path.to_str().expect("UTF-8");
        let mut command = rtutap(&[&["verify", "-", "--config", path], args].concat());
        command.write_stdin(MISTAKE).output().expect("the program runs").status.code()
    };
    assert_eq!(status("[verify]\nignore = ['D03']\n", &[]), Some(0));
    assert_eq!(status("[verify]\nfail-on = 'never'\n", &[]), Some(0));
    assert_eq!(status("[verify]\nfail-on = 'never'\n", &["--fail-on", "error"]), Some(1));
    assert_eq!(status("[verify.severity]\nD03 = 'note'\n", &[]), Some(0));
    assert_eq!(status("[verify.severity]\nD03 = 'grave'\n", &[]), Some(2));
    assert_eq!(status("[verify]\nignore = ['X1']\n", &[]), Some(2));
}

/// Writes the plan of a recording.
fn plan(directory: &Path, recording: &str) -> String {
    let path = directory.join("plan.toml");
    std::fs::write(&path, stdout(&["info", "--plan", &capture(recording)], b"")).expect("written");
    path.to_str().expect("UTF-8").to_owned()
}

#[test]
fn a_master_keeps_its_own_plan_and_another_does_not() {
    let directory = tempfile::tempdir().expect("a directory");
    let plan = plan(directory.path(), "good-master.mcap");
    let codes = |recording: &str| {
        let args =
            ["verify", &capture(recording), "--expect", &plan, "--format", "json", "--fail-on", "never"];
        let rows = stdout(&args, b"");
        let code = |row: &str| serde_json::from_str::<serde_json::Value>(row).expect("JSON")["code"].clone();
        let codes = rows.lines().map(|row| code(row).as_str().expect("a code").to_owned());
        codes.filter(|code| code.starts_with('P')).collect::<std::collections::BTreeSet<_>>()
    };
    assert!(codes("good-master.mcap").is_empty());
    let other = codes("mistaken-master.mcap");
    for code in ["P02", "P03", "P04", "P05", "P06"] {
        assert!(other.contains(code), "{code} in {other:?}");
    }
}

#[test]
fn a_plan_of_nothing_is_refused() {
    let noise = "# line 9600-8N1\n2026-01-01T00:00:00.010Z 81 43 09 10 22 87 07 95 31 33\n";
    let said = predicate::str::contains("no request was heard in -: there is nothing to plan");
    rtutap(&["info", "--plan", "-"]).write_stdin(noise).assert().code(2).stdout("").stderr(said);
}

#[test]
fn a_plan_that_is_wrong_is_refused_with_its_place() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("plan.toml");
    std::fs::write(&path, "[[device]]\nadress = 1\n").expect("written");
    let path = path.to_str().expect("UTF-8");
    let said = predicate::str::contains("plan.toml:2:1: unknown key 'adress'; did you mean 'address'?");
    rtutap(&["verify", "-", "--expect", path]).write_stdin(GOOD).assert().code(2).stderr(said);
}

#[test]
fn a_source_that_is_not_there_is_named() {
    let said = predicate::str::contains("/dev/ttyNOWHERE");
    rtutap(&["verify", "/dev/ttyNOWHERE", "--duration", "1s"]).assert().code(2).stderr(said);
    let mixed = predicate::str::contains("is a recording, and others are live sources");
    rtutap(&["verify", "a.mcap", "tcp://localhost:1"]).assert().code(2).stderr(mixed);
}
