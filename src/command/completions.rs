//! `rtutap completions`: prints what makes a shell complete the command line.

use clap::CommandFactory;

use super::failure::Failure;
use super::output::Output;
use crate::cli::{Cli, Completions};

/// Runs the command.
pub(super) fn run(args: &Completions) -> Result<(), Failure> {
    let mut output = Output::stdout();
    clap_complete::generate(args.shell, &mut Cli::command(), "rtutap", &mut output.buffer);
    output.flush()
}
