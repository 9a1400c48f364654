//! `rtutap profiles new`: a draft that the program itself reads, and plain words where there is none.

use predicates::prelude::*;
use predicates::str::{contains, starts_with};

use crate::{rtutap, stdout};

/// A meter at address 7 that no built-in profile has: a float with its words swapped at 0x2000,
/// 229.5, 230.25 and 231.125 V.
const METER: &[u8] = b"\
07 03 20 00 00 02 CF AD\n07 03 04 80 00 43 65 44 E8\n\
07 03 20 00 00 02 CF AD\n07 03 04 40 00 43 66 38 E9\n\
07 03 20 00 00 02 CF AD\n07 03 04 20 00 43 67 E7 29\n";

#[test]
fn a_draft_is_a_profile_that_decodes_what_it_was_drafted_from() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("meter.toml");
    let path = path.to_str().expect("UTF-8");
    rtutap(&["profiles", "new", "-", "-o", path])
        .write_stdin(METER)
        .assert()
        .success()
        .stdout("")
        .stderr(contains(format!("--profile {path} --device 7=unknown-7")));
    assert!(stdout(&["profiles", "check", path], b"").contains("good: unknown-7, 1 commands"));
    let args = [
        "decode",
        "-",
        "--profile",
        path,
        "--device",
        "7=unknown-7",
        "--show",
        "readings",
        "--format",
        "csv",
    ];
    let readings = stdout(&args, METER);
    for voltage in ["229.5", "230.25", "231.125"] {
        assert!(readings.contains(&format!("value_2000,{voltage},")), "{readings}");
    }
    rtutap(&["profiles", "new", "-", "-o", path])
        .write_stdin(METER)
        .assert()
        .code(2)
        .stderr(contains("is there already").and(contains("name another file")));
}

#[test]
fn without_one_unknown_device_it_says_what_there_is() {
    const PROBE: &[u8] = include_bytes!("../../captures/y511.hex");
    let refuses = |args: &[&str], input: &[u8], said: &str, hint: &str| {
        let args = [&["profiles", "new", "-"], args].concat();
        let refused = rtutap(&args).write_stdin(input).assert().code(2).stdout("");
        refused.stderr(contains(said).and(contains(format!("hint: {hint}"))));
    };
    refuses(&[], PROBE, "every device that answered is known: 3 (yosemitech-turb-wiper)", "--address N");
    refuses(&["--address", "9"], PROBE, "no device answered at address 9; those at 3", "choose one of those");
    refuses(&[], b"07 03 20 00 00 02 CF AD\n", "no device accepted a request", "'rtutap info'");
    let two = [METER, b"08 03 20 00 00 02 CF 52\n08 03 04 80 00 43 65 BB E8\n"].concat();
    refuses(&[], &two, "more than one device is unknown: 7, 8", "choose one with --address");
    let draft = rtutap(&["profiles", "new", "-", "--address", "3"]).write_stdin(PROBE).assert().success();
    draft.stdout(starts_with("# Drafted by rtutap").and(contains("It is known as yosemitech-turb-wiper")));
}
