//! Options from the command line, the environment and the configuration file; completions and the manual page.

use predicates::prelude::*;
use rtutap::cli::{FailOn, RowFormat, ShowKind, TimeKind};
use rtutap::config::Config;
use rtutap::device::Environment;

use crate::{rtutap, stdout};

const FRAME: &str = "01 03 26 00 00 04 4F 41\n";

/// Writes a configuration file; returns its directory and path.
fn config(text: &str) -> (tempfile::TempDir, String) {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("config.toml");
    std::fs::write(&path, text).expect("written");
    let path = path.to_str().expect("UTF-8").to_owned();
    (directory, path)
}

#[test]
fn the_sample_says_exactly_what_holds_without_it() {
    let environment = Environment::default();
    let defaults = Config {
        line: None,
        adapter_hold: None,
        devices: Vec::new(),
        profiles: Vec::new(),
        salinity: Some(environment.salinity),
        pressure_kpa: Some(environment.pressure_kpa),
        show: Some(vec![ShowKind::Transactions]),
        format: Some(RowFormat::default()),
        time: Some(TimeKind::default()),
        fail_on: Some(FailOn::Error),
        ignore: Vec::new(),
        severities: Vec::new(),
    };
    assert_eq!(Config::from_toml(include_str!("../../config.sample.toml")), Ok(defaults));
}

#[test]
fn flags_go_before_the_environment_and_that_before_the_file_and_that_before_the_default() {
    let (_directory, path) = config("line = '19200-8E1'\n");
    let line = |flag: &[&str], environment: Option<&str>, file: bool| {
        let mut command = rtutap(&["info", "-"]);
        command.args(flag).write_stdin(FRAME).envs(environment.map(|line| ("RTUTAP_LINE", line)));
        if file {
            command.env("RTUTAP_CONFIG", &path);
        }
        let stdout = command.assert().success().get_output().stdout.clone();
        let text = String::from_utf8(stdout).expect("UTF-8");
        let line = text.split_whitespace().find(|word| word.contains("-8") || word.contains("-7"));
        line.expect("line settings").to_owned()
    };
    assert_eq!(line(&["--line", "300-7O2"], Some("4800-8N2"), true), "300-7O2");
    assert_eq!(line(&[], Some("4800-8N2"), true), "4800-8N2");
    assert_eq!(line(&[], None, true), "19200-8E1");
    assert_eq!(line(&[], None, false), "9600-8N1");
    // What is recorded has settings; only live ports have them found.
    std::fs::write(&path, "line = 'auto'\n").expect("a file");
    assert_eq!(line(&[], None, true), "9600-8N1");
    let mut listen = rtutap(&["listen", "tcp://127.0.0.1:9", "--config", &path]);
    listen
        .assert()
        .code(2)
        .stderr(predicate::str::contains("no line settings that --line auto could change"));
}

#[test]
fn the_file_sets_what_is_printed_and_which_device_is_where() {
    let (_directory, path) =
        config("show = ['frames']\nformat = 'csv'\n[devices]\n1 = 'yosemitech-do'\n2 = 'yosemitech-do'\n");
    let frames = stdout(&["decode", "-", "--config", &path], FRAME.as_bytes());
    assert!(frames.starts_with("type,id,bus,"), "{frames}");
    let args = ["decode", "-", "--config", &path, "--show", "transactions", "--format", "json"];
    let row = stdout(&args, FRAME.as_bytes());
    assert!(row.contains("\"device\":\"yosemitech-do\""), "{row}");
    let args = [&args[..], &["--device", "1=yosemitech-conductivity"]].concat();
    let row = stdout(&args, FRAME.as_bytes());
    assert!(row.contains("\"device\":\"yosemitech-conductivity\""), "the flag has the last word: {row}");
}

#[test]
fn profiles_of_the_file_are_beside_it() {
    let (directory, path) = config("profiles = ['mine.toml']\n");
    let refused = predicate::str::contains("mine.toml': No such file");
    rtutap(&["decode", "-", "--config", &path]).write_stdin(FRAME).assert().code(2).stderr(refused);
    let profile =
        include_str!("../../src/device/profiles/yosemitech-do.toml").replace("yosemitech-do", "mine");
    std::fs::write(directory.path().join("mine.toml"), profile).expect("written");
    let args = ["decode", "-", "--config", &path, "--device", "1=mine", "--format", "json"];
    assert!(stdout(&args, FRAME.as_bytes()).contains("\"device\":\"mine\""));
}

#[test]
fn the_file_in_the_users_configuration_directory_is_found() {
    let directory = tempfile::tempdir().expect("a directory");
    std::fs::create_dir(directory.path().join("rtutap")).expect("created");
    std::fs::write(directory.path().join("rtutap/config.toml"), "format = 'json'\n").expect("written");
    let mut command = rtutap(&["decode", "-"]);
    command.env("XDG_CONFIG_HOME", directory.path()).write_stdin(FRAME);
    command.assert().success().stdout(predicate::str::starts_with("{\"type\":\"transaction\""));
}

#[test]
fn a_bad_file_is_refused_with_every_place_and_a_missing_one_by_name() {
    let (_directory, path) = config("lines = '9600-8N1'\nsalinity = 'sea'\n");
    let places =
        predicate::str::contains(format!("error: {path}:1:1: unknown key 'lines'; did you mean 'line'?"))
            .and(predicate::str::contains(format!("error: {path}:2:12: 'salinity'")));
    rtutap(&["decode", "-", "--config", &path]).assert().code(2).stdout("").stderr(places);
    let missing = predicate::str::contains("cannot read 'nowhere.toml'");
    rtutap(&["info", "-", "--config", "nowhere.toml"]).assert().code(2).stderr(missing);
}

#[test]
fn completions_know_the_commands_in_every_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = stdout(&["completions", shell], b"");
        assert!(script.contains("rtutap") && script.contains("simulate"), "{shell}");
    }
    rtutap(&["completions", "cmd"]).assert().code(2);
}

#[test]
fn the_manual_page_has_every_command_with_its_options() {
    let page = stdout(&["man"], b"");
    for part in [
        ".TH rtutap 1",
        ".SH \"RTUTAP DECODE\"",
        ".SH \"RTUTAP SIMULATE\"",
        "\\-\\-adapter\\-hold",
        "RTUTAP_CONFIG",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert_eq!(page.matches("\n.SH NAME").count(), 1);
}
