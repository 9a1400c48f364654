//! `rtutap replay`: shows a recording in the terminal UI.

use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;

use tempfile::NamedTempFile;

use super::bus;
use super::failure::Failure;
use super::message;
use super::printing::filter_of;
use super::session::Setup;
use super::ui;
use crate::capture::{Input, InputFormat};
use crate::cli;
use crate::config::Screen;
use crate::source::SystemClock;

/// Refuses what cannot be shown.
pub(super) fn check(args: &cli::Replay) -> Result<(), Failure> {
    bus::check(&args.bus)?;
    if args.bus.inputs.len() > 1 && !bus::is_one_session(&args.bus.inputs) {
        let hint = "give one recording, or the parts of one session; 'rtutap decode' prints several";
        return Err(Failure::hinted("these are recordings of several sessions", hint));
    }
    Ok(())
}

/// Runs the command.
pub(super) fn run(args: &cli::Replay, screen: Screen) -> Result<(), Failure> {
    if !ui::has_terminal() {
        let hint = "'rtutap decode' prints a recording; it takes the same inputs";
        return Err(Failure::hinted("replay needs a terminal to show the recording on", hint));
    }
    let kept = args.bus.inputs.iter().any(|path| path.as_os_str() == "-").then(keep_input).transpose()?;
    let paths: Vec<PathBuf> = match &kept {
        Some(file) => vec![file.path().to_owned()],
        None => bus::in_order(&args.bus.inputs).into(),
    };
    let format: Option<InputFormat> = args.bus.input_format.map(Into::into);
    if args.follow {
        follow_or_refuse(&paths, format)?;
    }
    let profiles = bus::profiles(&args.bus.equipment.profiles, &paths)?;
    let filter = args.filter.as_deref();
    let filter = filter.map(|text| filter_of("--filter", text, &profiles)).transpose()?;
    let setup = Setup {
        line: args.bus.line.and_then(cli::Line::settings),
        adapter_hold_ns: args.bus.adapter_hold.map(|hold| hold.0),
        devices: bus::devices(&args.bus.equipment, &profiles)?,
        readings: false,
        findings: true,
        ..Setup::new(Arc::clone(&profiles))
    };
    let mut options =
        ui::options(screen, &profiles, args.time.unwrap_or_default().into(), filter, name(&args.bus.inputs));
    (options.is_live, options.must_record) = (false, false);
    ui::replay(ui::Replayed {
        setup: &setup,
        paths,
        format,
        follows: args.follow,
        clock: Arc::new(SystemClock),
        options,
        equipment: args.bus.equipment.clone(),
    })
}

/// Returns what is shown as the source.
fn name(inputs: &[PathBuf]) -> String {
    let name = |path: &PathBuf| path.file_name().unwrap_or(path.as_os_str()).display().to_string();
    match inputs {
        [one] if one.as_os_str() == "-" => "standard input".to_owned(),
        [first, _, ..] => format!("{} and {} more", name(first), inputs.len() - 1),
        _ => inputs.first().map(name).unwrap_or_default(),
    }
}

/// Refuses to follow what does not say where it ends.
fn follow_or_refuse(paths: &[PathBuf], format: Option<InputFormat>) -> Result<(), Failure> {
    for path in paths {
        let mut input = Input::open(path, format)?;
        if !input.follow() {
            let hint = "only recordings in MCAP say where they end";
            return Err(Failure::hinted(format!("cannot follow '{}'", input.name()), hint));
        }
    }
    Ok(())
}

/// Keeps standard input in a file: a replay goes back in it.
fn keep_input() -> Result<NamedTempFile, Failure> {
    let failed = |error: io::Error| Failure::new(format!("cannot keep standard input in a file: {error}"));
    let mut file = NamedTempFile::new().map_err(failed)?;
    message::note("reads standard input to its end first");
    #[expect(clippy::disallowed_methods, reason = "standard input is one of the inputs")]
    let mut stdin = io::stdin().lock();
    io::copy(&mut stdin, &mut file).map_err(failed)?;
    file.flush().map_err(failed)?;
    Ok(file)
}
