//! `rtutap listen`: watches live buses.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use etcetera::BaseStrategy;

use super::bus;
use super::failure::Failure;
use super::live::{self, Job, Recording, Status};
use super::printing::{Printing, filter_of};
use super::session::Setup;
use super::ui;
use crate::capture::mcap::Options;
use crate::cli;
use crate::config::Screen;
use crate::source::{Clock, SystemClock};

/// How many bytes stay free on the disk.
const MIN_FREE: u64 = 100_000_000;
/// Where a new file begins: nobody listens that long, but memory is to stay small.
const ROTATE_SIZE: u64 = 1_000_000_000;
const ROTATE_CHUNKS: u64 = 10_000;

/// Runs the command.
pub(super) fn run(args: &cli::Listen, verbose: bool, screen: Screen) -> Result<(), Failure> {
    if !args.wants_lines && ui::has_terminal() {
        return show(args, screen);
    }
    let no_inputs: [&Path; 0] = [];
    let equipment = &args.live.equipment;
    let profiles = bus::profiles(&equipment.profiles, &no_inputs)?;
    let (printing, output) = Printing::new(&args.printing, &profiles, verbose)?;
    let is_recorded = args.record.is_some();
    let setup = Setup {
        findings: printing.needs_findings() || is_recorded,
        ..live::setup(&args.live, &profiles, printing.shows_readings() || is_recorded, true)?
    };
    let stop = live::stop_flag()?;
    let clock: Arc<dyn Clock> = Arc::new(SystemClock);
    let anchor = live::anchor(&*clock);
    let sources = live::open(&args.live, &clock)?;
    let attachments = bus::given_attachments(equipment)?;
    let recording = args.record.clone().map(|path| self::recording(path, attachments));
    let report = live::run(Job {
        setup: &setup,
        sources,
        clock,
        anchor,
        rows: Some((printing, output)),
        recording,
        info: None,
        screen: None,
        audit: None,
        status: Status::new(false, true),
        stop,
        duration_ns: None,
    })?;
    if let Some(printing) = report.printing {
        printing.say(equipment);
    }
    if let Some(recorded) = report.recorded {
        live::say_recorded(recorded, &live::counts(&report.tally, true))?;
    }
    report.ended
}

/// Says how a session is recorded.
pub(super) fn recording(path: PathBuf, attachments: Vec<(String, String, Vec<u8>)>) -> Recording {
    Recording {
        path,
        options: Options {
            rotate_size: Some(ROTATE_SIZE),
            rotate_chunks: Some(ROTATE_CHUNKS),
            attachments,
            ..Options::default()
        },
        min_free: MIN_FREE,
        drop_oldest: false,
        raw_only: false,
        around: None,
        is_all: false,
    }
}

/// Shows live buses in the terminal UI; the session is kept in a recording, unless that was refused.
fn show(args: &cli::Listen, screen: Screen) -> Result<(), Failure> {
    let no_inputs: [&Path; 0] = [];
    let equipment = &args.live.equipment;
    let profiles = bus::profiles(&equipment.profiles, &no_inputs)?;
    let filter = args.printing.filter.as_deref();
    let filter = filter.map(|text| filter_of("--filter", text, &profiles)).transpose()?;
    let setup = Setup { findings: true, ..live::setup(&args.live, &profiles, true, true)? };
    let stop = live::stop_flag()?;
    let clock: Arc<dyn Clock> = Arc::new(SystemClock);
    let anchor = live::anchor(&*clock);
    let sources = live::open(&args.live, &clock)?;
    let attachments = bus::given_attachments(equipment)?;
    let path = match &args.record {
        Some(path) => path.clone(),
        None => kept()?,
    };
    let begin = (!args.no_record).then(|| recording(path, attachments.clone()));
    let again = kept()?;
    let names: Vec<_> = sources.iter().map(|source| source.name.clone()).collect();
    let time = args.printing.time.unwrap_or_default().into();
    let report = ui::live(ui::Live {
        setup: &setup,
        sources,
        clock,
        anchor,
        recording: begin,
        again: Box::new(move || recording(again.clone(), attachments.clone())),
        stop,
        duration_s: None,
        options: ui::options(screen, &profiles, time, filter, names.join(" ")),
        equipment: equipment.clone(),
    })?;
    if let Some(recorded) = report.recorded {
        live::say_recorded(recorded, &live::counts(&report.tally, true))?;
    }
    report.ended
}

/// Returns the directory in which sessions of the terminal UI are kept.
///
/// # Errors
/// When there is none, and it cannot be made.
pub(super) fn kept() -> Result<PathBuf, Failure> {
    let hint = "say where with --record FILE, or refuse it with --no-record";
    let strategy = etcetera::choose_base_strategy().map_err(|error| Failure::hinted(error, hint))?;
    let state = strategy.state_dir().unwrap_or_else(|| strategy.data_dir());
    let directory = state.join("rtutap");
    let failed = |error: std::io::Error| {
        Failure::hinted(format!("cannot keep the session in '{}': {error}", directory.display()), hint)
    };
    std::fs::create_dir_all(&directory).map_err(failed)?;
    Ok(directory)
}
