//! Parses the arguments, runs the command, and ends with its exit status.

use std::process::ExitCode;

use clap::Parser;
use rtutap::{cli, command};

fn main() -> ExitCode {
    command::run(cli::Cli::parse())
}
