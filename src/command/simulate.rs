//! `rtutap simulate`: writes a recording of a bus that isn't there.

use std::io::Write;

use super::failure::Failure;
use super::output::Output;
use crate::capture::{hex_heading, hex_line};
use crate::cli;
use crate::simulate::{Config, Scenario, Simulation, truth_json_line};

/// Runs the command.
pub(super) fn run(args: &cli::Simulate) -> Result<(), Failure> {
    let config = Config {
        seed: args.seed,
        frames: args.frames,
        line: args.line,
        adapter: args.adapter,
        scenario: scenario(&args.scenario)?,
    };
    if args.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap")) {
        let hint = "name the file .hex: it will be hex text";
        return Err(Failure::hinted("this version of rtutap cannot write MCAP yet", hint));
    }
    if args.truth.as_ref() == Some(&args.output) {
        return Err(Failure::new("--output and --truth are the same file"));
    }
    let mut output = Output::create(&args.output)?;
    let mut truth = args.truth.as_deref().map(Output::create).transpose()?;
    write_heading(&mut output.buffer, &config);
    let mut simulation = Simulation::new(config);
    while let Some(read) = simulation.next() {
        output.buffer.extend_from_slice(hex_line(&read.chunk()).as_bytes());
        output.buffer.push(b'\n');
        output.drain()?;
        write_truth(&mut simulation, truth.as_mut())?;
    }
    // Frames of which the last byte was lost end with the simulation.
    write_truth(&mut simulation, truth.as_mut())?;
    truth.as_mut().map_or(Ok(()), Output::flush)?;
    output.flush()
}

/// Finds a scenario by its name.
pub(super) fn scenario(name: &str) -> Result<Scenario, Failure> {
    Scenario::named(name).ok_or_else(|| Failure::new(format!("there is no scenario '{name}'")))
}

fn write_heading(out: &mut Vec<u8>, config: &Config) {
    let Config { seed, frames, line, adapter, scenario } = config;
    // Writing to memory cannot fail.
    let _ = writeln!(
        out,
        "# rtutap simulate --scenario {} --adapter {adapter} --seed {seed} --frames {frames} --line {line}",
        scenario.name
    );
    out.extend_from_slice(hex_heading(Some(*line), None, false).as_bytes());
}

fn write_truth(simulation: &mut Simulation, truth: Option<&mut Output>) -> Result<(), Failure> {
    let frames = simulation.take_truth();
    let Some(truth) = truth else { return Ok(()) };
    for frame in &frames {
        truth.buffer.extend_from_slice(truth_json_line(frame).as_bytes());
        truth.buffer.push(b'\n');
    }
    truth.drain()
}
