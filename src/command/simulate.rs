//! `rtutap simulate`: writes a recording of a bus that isn't there.

use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use super::failure::Failure;
use super::output::{Output, real, unfinished};
use super::scribe::Scribe;
use super::session::{Session, Setup, Sink};
use crate::capture::mcap::{BusSettings, Options};
use crate::capture::{BUS, Item, hex_heading, hex_line};
use crate::cli;
use crate::device::Profiles;
use crate::simulate::{Adapter, Config, Scenario, Simulation, truth_json_line};

/// Runs the command.
pub(super) fn run(args: &cli::Simulate) -> Result<(), Failure> {
    let config = Config {
        seed: args.seed,
        frames: args.frames,
        line: args.line,
        adapter: args.adapter.unwrap_or(Adapter::Ftdi16),
        scenario: scenario(&args.scenario)?,
    };
    let is_mcap = is_mcap(&args.output)?;
    if args.raw_only && !is_mcap {
        return Err(Failure::hinted("--raw-only is for MCAP", "name the output .mcap"));
    }
    if args.truth.as_ref() == Some(&args.output) {
        return Err(Failure::new("--output and --truth are the same file"));
    }
    let truth = args.truth.as_deref().map(Output::create).transpose()?;
    if is_mcap { write_mcap(args, config, truth) } else { write_hex(args, config, truth) }
}

/// Tells whether MCAP is to be written by what the output is called, else hex text.
fn is_mcap(output: &Path) -> Result<bool, Failure> {
    let Some(extension) = output.extension() else { return Ok(false) };
    let is = |name| extension.eq_ignore_ascii_case(name);
    if is("mcap") || is("hex") || is("txt") {
        return Ok(is("mcap"));
    }
    let message = format!("--output '{}': simulate writes .mcap, and .hex or .txt", output.display());
    Err(Failure::hinted(message, "write MCAP, and make something else of it with 'rtutap export'"))
}

fn write_hex(args: &cli::Simulate, config: Config, mut truth: Option<Output>) -> Result<(), Failure> {
    let mut output = Output::create(&args.output)?;
    // Who does not ask for an adapter gets hex text as it comes from elsewhere.
    let hold_ns = args.adapter.map(|adapter| adapter.hold_ns(args.line));
    write_heading(&mut output.buffer, &config, hold_ns);
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

fn write_mcap(args: &cli::Simulate, config: Config, truth: Option<Output>) -> Result<(), Failure> {
    let session_id = arguments(&config).replace("--", "").replace(' ', "-");
    let output = real(&args.output);
    let mut scribe = Scribe::create(&output, Options { session_id, ..Options::default() })?;
    let result = match fill(args, config, truth, &mut scribe) {
        Ok(()) => scribe.finish().map(drop),
        Err(failure) => {
            scribe.abandon();
            Err(failure)
        }
    };
    if result.is_err() {
        // It is there where writing to it failed.
        let _ = std::fs::remove_file(unfinished(&output));
    }
    result
}

fn fill(
    args: &cli::Simulate,
    config: Config,
    mut truth: Option<Output>,
    scribe: &mut Scribe,
) -> Result<(), Failure> {
    let setup =
        Setup { decodes: !args.raw_only, findings: true, ..Setup::new(Arc::new(Profiles::built_in())) };
    let mut session = Session::new(&setup);
    let settings = BusSettings {
        name: BUS.to_owned(),
        line: config.line,
        adapter_hold_ns: Some(config.adapter.hold_ns(config.line)),
        facts: [("source".to_owned(), format!("rtutap simulate {}", arguments(&config)))].into(),
    };
    session.begin(settings, scribe)?;
    let mut simulation = Simulation::new(config);
    while let Some(read) = simulation.next() {
        session.take(&Item::Chunk { bus: BUS, chunk: read.chunk(), ready: None }, scribe)?;
        scribe.pause(0, false)?;
        write_truth(&mut simulation, truth.as_mut())?;
    }
    write_truth(&mut simulation, truth.as_mut())?;
    session.finish(scribe)?;
    truth.as_mut().map_or(Ok(()), Output::flush)
}

/// Finds a scenario by its name.
pub(super) fn scenario(name: &str) -> Result<Scenario, Failure> {
    Scenario::named(name).ok_or_else(|| Failure::new(format!("there is no scenario '{name}'")))
}

fn write_heading(out: &mut Vec<u8>, config: &Config, hold_ns: Option<i64>) {
    // Writing to memory cannot fail.
    let _ = writeln!(out, "# rtutap simulate {}", arguments(config));
    out.extend_from_slice(hex_heading(Some(config.line), hold_ns, false).as_bytes());
}

/// Returns the arguments that give the same simulation again.
fn arguments(config: &Config) -> String {
    let Config { seed, frames, line, adapter, scenario } = config;
    format!("--scenario {} --adapter {adapter} --seed {seed} --frames {frames} --line {line}", scenario.name)
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
