//! The program as its users meet it: run as a process.

#![allow(clippy::disallowed_methods)] // tests write their own inputs

mod config;
mod export;
mod golden;
mod imports;
mod input;
mod ports;
mod profiles;
mod recordings;
mod redact;
mod rows;
mod verify;
mod wireshark;
mod words;

use assert_cmd::Command;

/// Returns the program, with times of day and colours that do not depend on the machine.
fn rtutap(args: &[&str]) -> Command {
    let mut command = assert_cmd::cargo::cargo_bin_cmd!("rtutap");
    command.args(args).env("TZ", "UTC").env("XDG_CONFIG_HOME", "nowhere");
    for variable in
        ["NO_COLOR", "CLICOLOR_FORCE", "RTUTAP_CONFIG", "RTUTAP_FORMAT", "RTUTAP_TIME", "RTUTAP_LINE"]
    {
        command.env_remove(variable);
    }
    command
}

/// Returns what the program prints for an input.
fn stdout(args: &[&str], input: &[u8]) -> String {
    let output = rtutap(args).write_stdin(input).assert().success().get_output().stdout.clone();
    String::from_utf8(output).expect("UTF-8")
}
