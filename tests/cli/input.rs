//! What goes in: bad inputs and bad arguments are a message and exit status 2, never a panic.

use std::io::{BufRead, BufReader, Read};
use std::process::Stdio;

use predicates::prelude::*;

use crate::{rtutap, stdout};

const FRAME: &str = "01 03 26 00 00 04 4F 41\n";

/// Holds that a command fails with status 2, an `error:` line with `part` in it, and nothing on standard output.
fn refuses(args: &[&str], input: &[u8], part: &str) {
    let contains = predicate::str::starts_with("error: ").and(predicate::str::contains(part));
    rtutap(args).write_stdin(input).assert().code(2).stdout("").stderr(contains);
}

#[test]
fn an_input_that_cannot_be_read_is_named() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = |name: &str| directory.path().join(name).to_str().expect("UTF-8").to_owned();
    std::fs::write(path("empty"), "").expect("written");
    std::fs::write(path("comments"), "# only\n\n# comments\n").expect("written");
    std::fs::write(path("mcap"), b"\x89MCAP0\r\n\x01\x02").expect("written");
    for command in ["decode", "info"] {
        refuses(&[command, &path("empty")], b"", "empty' is empty");
        refuses(&[command, &path("comments")], b"", "comments' is empty");
        refuses(&[command, &path("missing")], b"", "missing': No such file");
        refuses(&[command, &path("")], b"", "it is a directory");
        refuses(&[command, &path("mcap")], b"", "ends before the first byte of a bus");
        refuses(&[command, "-", "--input-format", "mcap"], b"01", "is no MCAP file");
        refuses(&[command, "-"], b"", "'standard input' is empty");
        refuses(&[command, "-", "--input-format", "raw"], b"", "'standard input' is empty");
    }
}

#[test]
fn hex_text_that_is_none_is_refused_with_line_and_column() {
    for (text, place) in [
        ("hello world\n", "line 1, column 1: 'h'"),
        ("01 03\n0x0g\n", "line 2, column 3: '0' is half a byte"),
        ("01 0xZZ\n", "line 1, column 6: 'Z'"),
        ("2026-01-01T00:00:00 01\n", "line 1, column 20: the time has neither"),
        ("99999999999.0 01\n", "line 1, column 1: the time is not between"),
    ] {
        let args = ["decode", "-", "--input-format", "hex"];
        rtutap(&args).write_stdin(text).assert().code(2).stderr(predicate::str::contains(place));
    }
}

#[test]
fn hex_text_with_a_slip_is_not_taken_for_raw_bytes() {
    for (text, place) in [
        ("2026-01-01T00:00:00.5 01 03\n", "line 1, column 22: the time has neither"),
        ("01 03\n2026-02-30T00:00:00Z 01 03\n", "line 2, column 9: the month has no such day"),
        ("01 03 2 00 # short\n", "line 1, column 7: '2' is half a byte"),
    ] {
        refuses(&["decode", "-"], text.as_bytes(), place);
    }
}

#[test]
fn rubbish_is_decoded_as_damage_and_text_that_is_no_hex_text_is_said() {
    let rows = stdout(&["decode", "-", "--show", "frames", "--format", "json"], &[0xFE; 300]);
    assert!(
        rows.lines().count() > 0 && rows.lines().all(|row| row.contains("\"reason\":\"noise\"")),
        "{rows}"
    );
    let warned = predicate::str::contains("warning: ").and(predicate::str::contains("line 1, column 1"));
    rtutap(&["decode", "-"]).write_stdin("hello world\n").assert().success().stderr(warned);
}

#[test]
fn many_bytes_without_a_frame_are_warned_of() {
    let part = || {
        predicate::str::contains("warning: no frame in 1001 bytes of 'standard input'")
            .and(predicate::str::contains("--line"))
    };
    for command in ["decode", "info"] {
        rtutap(&[command, "-"]).write_stdin(vec![0xFE; 1001]).assert().success().stderr(part());
        let few = rtutap(&[command, "-"]).write_stdin(vec![0xFE; 1000]).assert().success();
        few.stderr(predicate::str::contains("warning").not());
    }
}

#[test]
fn numbers_out_of_range_are_refused() {
    for (option, value, part) in [
        ("--salinity", "-5", "not within 0 to 100"),
        ("--salinity", "NaN", "not within 0 to 100"),
        ("--pressure-kpa", "0", "not within 20 to 200"),
        ("--pressure-kpa", "1013.25", "not within 20 to 200"),
        ("--pressure-kpa", "high", "not a number"),
        ("--adapter-hold", "-1", "not within 0 to 10000"),
        ("--line", "9600", "no '-'"),
        ("--line", "1-8N1", "between 50 and"),
        ("--line", "99999999999-8N1", "whole number"),
        ("--device", "300=yosemitech-do", "'300' is not a unit address"),
        ("--device", "0=yosemitech-do", "'0' is not a unit address"),
        ("--device", "yosemitech-do", "ADDRESS=PROFILE"),
        ("--device", "1=nothing", "nothing"),
        ("--profile", "/nowhere.toml", "/nowhere.toml"),
        ("--show", "nothing", "nothing"),
        ("--filter", "addr ==", "--filter 'addr =='"),
    ] {
        refuses(&["decode", "-", option, value], FRAME.as_bytes(), part);
    }
    refuses(&["simulate", "-o", "-", "--frames", "0"], b"", "0 is not in 1..");
    refuses(&["simulate", "-o", "-", "--scenario", "nothing"], b"", "invalid value 'nothing'");
    refuses(&["simulate", "-o", "-", "--adapter", "nothing"], b"", "nothing");
    refuses(&["simulate", "-o", "/nowhere/bus.hex"], b"", "/nowhere/bus.hex");
    refuses(&["simulate", "-o", "/nowhere/bus.mcap"], b"", "/nowhere/bus.mcap");
    refuses(&["demo", "--duration", "0"], b"", "not within 1s to 1d");
    refuses(&["listen", "/nowhere/port"], b"", "/nowhere/port");
    refuses(&["listen", "a=-", "a=/nowhere/port"], b"", "two buses are called 'a'");
    refuses(&["listen", "-", "b=-"], b"", "'-' was given twice");
    let record = ["record", "-", "--line", "9600-8N1", "-o"];
    refuses(&[&record[..], &["/nowhere/a.mcap"]].concat(), b"01", "create the directory first");
    refuses(&["record", "-", "-o", "a.mcap", "--ring", "10m"], b"01", "--trigger");
    refuses(&["record", "-", "-o", "a.mcap", "--rotate-time", "10"], b"01", "give a unit");
    refuses(&["profiles", "show", "nothing"], b"", "no profile 'nothing'");
    refuses(&["decode", "-", "--format", "csv", "--show", "frames", "--show", "readings"], b"01", "CSV");
}

#[test]
fn a_leap_of_a_year_is_legal_and_said_by_nobody() {
    let text = "# line 9600-8N1\n2026-01-01T00:00:00Z 01 03 26 00 00 04 4F 41\n2027-01-01T00:00:00Z 01 03 26 00 00 04 4F 41\n";
    rtutap(&["decode", "-"]).write_stdin(text).assert().success().stderr("");
    assert!(stdout(&["info", "-"], text.as_bytes()).contains("(365 d 0 h)"));
}

#[test]
fn neither_a_service_address_nor_one_that_was_given_up_counts_as_a_device() {
    let text = "3.0 01 10 30 00 00 01 02 14 00 99 53\n3.1 01 10 30 00 00 01 0e c9\n\
                6.0 ff 03 30 00 00 01 9e d4\n6.1 ff 03 02 14 00 9e 90\n";
    let told = stdout(&["info", "-", "--device", "1=yosemitech-do"], text.as_bytes());
    let devices: Vec<&str> = told.lines().skip_while(|line| !line.starts_with("devices")).collect();
    let [count, old, new] = devices[..] else { panic!("{told}") };
    assert!(count.ends_with(" 1") && old.ends_with("moved to 20") && new.contains("yosemitech-do"), "{told}");
}

#[test]
fn one_of_a_kind_is_told_in_the_singular() {
    let told = stdout(&["info", "-"], b"01 03 26 00 00 04 4F 41 99\n");
    assert!(told.contains("1 run, 1 byte, "), "{told}");
}

#[test]
fn line_settings_are_those_asked_for_then_the_recordings_then_said() {
    let named = format!("# line 19200-8E1\n{FRAME}");
    assert!(stdout(&["info", "-", "--line", "300-7O2"], named.as_bytes()).contains("300-7O2"));
    assert!(stdout(&["info", "-"], named.as_bytes()).contains("19200-8E1"));
    let said = "note: 'standard input' does not name its line settings: 9600-8N1 assumed\n";
    rtutap(&["info", "-"]).write_stdin(FRAME).assert().success().stderr(said);
}

#[test]
fn a_closed_pipe_is_no_error() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("bus.hex");
    let path = path.to_str().expect("UTF-8");
    rtutap(&["simulate", "-o", path, "--frames", "5000"]).assert().success().stdout("").stderr("");
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("rtutap"))
        .args(["decode", path, "--format", "json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut row = String::new();
    let stdout = child.stdout.take().expect("piped");
    BufReader::with_capacity(100, stdout).read_line(&mut row).expect("a row"); // and closed
    let mut errors = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut errors).expect("UTF-8");
    assert_eq!((child.wait().expect("ended").code(), errors.as_str()), (Some(0), ""));
    assert!(row.starts_with("{\"type\":\"transaction\""));
}

#[test]
fn colours_are_for_terminals_only() {
    assert!(!stdout(&["decode", "-"], FRAME.as_bytes()).contains('\x1b'));
    let forced =
        rtutap(&["decode", "-"]).env("CLICOLOR_FORCE", "1").write_stdin(FRAME).output().expect("runs");
    assert!(forced.stdout.contains(&0x1b));
}

#[test]
fn a_profile_with_problems_is_refused_with_their_places() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("bad.toml");
    std::fs::write(&path, "id = 5\n").expect("written");
    let path = path.to_str().expect("UTF-8");
    refuses(&["profiles", "check", path], b"", "bad.toml:1:");
    refuses(&["decode", "-", "--profile", path], FRAME.as_bytes(), "bad.toml:1:");
}

#[test]
fn a_command_line_that_contradicts_itself_is_refused_before_any_output() {
    let devices = ["decode", "-", "--device", "1=yosemitech-do", "--device", "1=yosemitech-sonde"];
    refuses(&devices, FRAME.as_bytes(), "1 is yosemitech-do and that it is yosemitech-sonde");
    refuses(&["decode", "-", "-"], FRAME.as_bytes(), "'-' was given twice");
    refuses(&["decode", "-", "missing", "--format", "csv"], FRAME.as_bytes(), "missing");
}

#[test]
fn errors_hint_at_their_mend() {
    let directory = tempfile::tempdir().expect("a directory");
    let binary = directory.path().join("binary");
    std::fs::write(&binary, [0xFF; 9]).expect("written");
    let [directory, binary] = [directory.path(), &binary].map(|path| path.to_str().expect("UTF-8"));
    for (args, part) in [
        (&["decode", "-", "--profile", "nofile.toml"][..], "hint: check the path"),
        (&["profiles", "check", "nofile"], "hint: check the path"),
        (&["profiles", "check", directory], "hint: name a TOML file in it"),
        (&["profiles", "check", binary], "hint: a profile is a TOML file"),
        (&["decode", "-", "--filter", "addr=1"], "found '='\nhint: write '==' to compare\n"),
        (&["simulate", "-o", "-", "--seed", "-1"], "not a whole number from 0 to 18446744073709551615"),
    ] {
        rtutap(args).write_stdin(FRAME).assert().code(2).stderr(predicate::str::contains(part));
    }
}

#[test]
fn help_names_every_command_and_a_wrong_one_is_status_2() {
    let help = stdout(&["--help"], b"");
    for command in ["decode", "info", "simulate", "demo", "profiles", "completions", "man"] {
        assert!(help.contains(command), "{command}");
    }
    refuses(&["listen"], b"", "SOURCE");
    rtutap(&["--version"]).assert().success().stdout(predicate::str::starts_with("rtutap "));
}

#[test]
fn a_log_has_what_was_done_and_said_with_times() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let log = folder.path().join("rtutap.log");
    let path = log.to_str().expect("UTF-8");
    stdout(&["--log", path, "info", "-"], b"01 03 26 00 00 04 4F 41\n");
    rtutap(&["decode", "nowhere.mcap", "--log", path]).assert().code(2);
    let text = std::fs::read_to_string(&log).expect("a log");
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines.iter().all(|line| line.starts_with("20") && line.contains("Z ")), "{text}");
    for (what, count) in [
        ("begins: ", 2),
        ("9600-8N1 assumed", 1),
        ("8 bytes, 1 frames", 1),
        ("ends, done", 1),
        ("ERROR", 1),
        ("ends, not", 1),
    ] {
        assert_eq!(lines.iter().filter(|line| line.contains(what)).count(), count, "{what} in {text}");
    }
}
