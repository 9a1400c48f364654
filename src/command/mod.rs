//! One file a command: the only place that owns output, clocks and what becomes of errors.

mod ahead;
mod being_written;
mod bus;
mod completions;
mod decode;
mod demo;
mod export;
mod failure;
mod info;
mod journal;
mod listen;
mod live;
mod log;
mod man;
mod message;
mod output;
mod ports;
mod printing;
mod profiles;
mod progress;
mod record;
mod recover;
mod replay;
mod scribe;
mod session;
mod simulate;
mod ui;
mod verify;

use std::process::ExitCode;

use crate::cli::{self, Cli, Command};
use crate::config::Config;
use failure::Failure;

/// Runs what the command line asks for; returns 0 when done, 1 when `verify` found something, 2 when it could not
/// be done.
pub fn run(mut cli: Cli) -> ExitCode {
    match run_command(&mut cli) {
        // Who reads the output has had enough: nothing went wrong.
        Ok(()) | Err(Failure::ClosedPipe) => {
            tracing::info!("ends, done");
            ExitCode::SUCCESS
        }
        Err(Failure::Findings) => {
            tracing::info!("ends, with findings");
            ExitCode::from(1)
        }
        Err(failure) => {
            failure.say();
            tracing::info!("ends, not done");
            ExitCode::from(2)
        }
    }
}

fn run_command(cli: &mut Cli) -> Result<(), Failure> {
    if let Some(path) = &cli.log {
        log::begin(path, cli.verbose)?;
    }
    match &cli.command {
        Command::Completions(args) => return completions::run(args),
        Command::Man => return man::run(),
        Command::Decode(args) => bus::check(&args.bus)?,
        Command::Info(args) => bus::check(&args.bus)?,
        Command::Export(args) => {
            bus::check(&args.bus)?;
            export::check_time(args)?;
        }
        Command::Replay(args) => replay::check(args)?,
        Command::Profiles(cli::Profiles { action: Some(cli::ProfileAction::New(args)) }) => {
            bus::check(&args.bus)?;
        }
        Command::Listen(args) => bus::check_devices(&args.live.equipment)?,
        Command::Record(args) => bus::check_devices(&args.live.equipment)?,
        _ => {}
    }
    if let Command::Listen(args) = &mut cli.command {
        args.wants_lines = args.printing.format.is_some();
    }
    let mut config = Config::load(cli.config.as_deref())?;
    let screen = std::mem::take(&mut config.screen);
    config.complete(&mut cli.command);
    match &cli.command {
        Command::Listen(args) => listen::run(args, cli.verbose, screen),
        Command::Record(args) => record::run(args),
        Command::Replay(args) => replay::run(args, screen),
        Command::Decode(args) => decode::run(args, cli.verbose),
        Command::Verify(args) => verify::run(args, cli.verbose),
        Command::Info(args) => info::run(args),
        Command::Export(args) => export::run(args),
        Command::Recover(args) => recover::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Demo(args) => demo::run(args, cli.verbose, screen),
        Command::Ports(args) => ports::run(args),
        Command::Profiles(args) => profiles::run(args),
        Command::Completions(_) | Command::Man => Ok(()),
    }
}
