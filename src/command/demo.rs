//! `rtutap demo`: a simulated installation with faults in it, as it happens, through a pty where there are ptys.

mod played;
#[cfg(unix)]
mod pty;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::failure::Failure;
use super::live::{self, Job, Opened, Status};
use super::output::Output;
use super::printing::Printing;
use super::session::Setup;
use super::{listen, message, simulate, ui};
use crate::capture::BUS;
use crate::capture::mcap::BusSettings;
use crate::cli::{self, RowFormat};
use crate::config::Screen;
use crate::device::Profiles;
use crate::line::LineSettings;
use crate::report::info::Info;
use crate::report::{Clock, Csv, Json, Show, Text, TimeStyle};
use crate::simulate::{Adapter, Config, Simulation};
use crate::source::{self, Source, SystemClock};
use crate::time::SECOND;
use crate::tui::app::Options;
use played::Played;

/// How long lines are printed, in seconds.
const LINES_FOR: u32 = 10;

/// Runs the command.
pub(super) fn run(args: &cli::Demo, verbose: bool, screen: Screen) -> Result<(), Failure> {
    let config = Config {
        seed: args.seed,
        frames: u64::MAX,
        line: LineSettings::default(),
        adapter: Adapter::Usb1,
        scenario: simulate::scenario("demo")?,
    };
    let profiles = Arc::new(Profiles::built_in());
    let adapter_hold_ns = Some(config.adapter.hold_ns(config.line));
    let setup =
        Setup { adapter_hold_ns, readings: false, findings: true, ..Setup::new(Arc::clone(&profiles)) };
    let stop = live::stop_flag()?;
    let clock: Arc<dyn source::Clock> = Arc::new(SystemClock);
    let (source, _wire) = connect(config, &clock);
    let settings = BusSettings { name: BUS.to_owned(), line: config.line, ..BusSettings::default() };
    let opened =
        Opened { name: source.name().to_owned(), source, settings, is_patient: false, searches: false };
    if args.format.is_none() && ui::has_terminal() {
        let mut options = ui::options(screen, &profiles, TimeStyle::Local, None, "simulation".to_owned());
        options.must_record = false;
        let shown = Shown { setup: &setup, opened, clock, stop, options, duration_s: args.duration };
        return show(shown);
    }
    message::note("a simulated installation: one master, three sensors, and faults; nothing is connected");
    let (printing, output) = printing(args.format.unwrap_or_default(), verbose, &profiles);
    let report = live::run(Job {
        setup: &setup,
        sources: vec![opened],
        anchor: live::anchor(&*clock),
        clock,
        rows: Some((printing, output)),
        recording: None,
        info: Some(Info::new(&profiles)),
        screen: None,
        audit: None,
        status: Status::new(false, true),
        stop,
        duration_ns: Some(u64::from(args.duration.unwrap_or(LINES_FOR)).saturating_mul(SECOND as u64)),
    })?;
    report.ended?;
    if args.format.is_some_and(|format| format != RowFormat::Text) {
        return Ok(());
    }
    let mut output = Output::stdout();
    output.buffer.push(b'\n');
    let summary = report.info.map(|info| info.to_text(Clock::new(TimeStyle::Relative)));
    output.buffer.extend_from_slice(summary.unwrap_or_default().as_bytes());
    output.flush()
}

/// Returns what makes lines, and where they go.
fn printing(format: RowFormat, verbose: bool, profiles: &Profiles) -> (Printing, Output) {
    let clock = Clock::new(TimeStyle::Relative);
    match format {
        RowFormat::Text => {
            let (output, colour) = Output::terminal();
            let text = Text::new(clock, colour, verbose, profiles);
            (Printing::of(vec![Show::Devices, Show::Transactions], Box::new(text), None, false), output)
        }
        RowFormat::Json => {
            let show = vec![Show::Devices, Show::Transactions];
            (Printing::of(show, Box::new(Json::default()), None, false), Output::stdout())
        }
        RowFormat::Csv => {
            let csv = Csv::new(Show::Transactions, clock);
            (Printing::of(vec![Show::Transactions], Box::new(csv), None, false), Output::stdout())
        }
    }
}

/// Holds what the demo shows.
struct Shown<'a> {
    setup: &'a Setup,
    opened: Opened,
    clock: Arc<dyn source::Clock>,
    stop: Arc<AtomicBool>,
    options: Options,
    duration_s: Option<u32>,
}

/// Shows the simulation in the terminal UI; it is recorded only when that is asked for.
fn show(shown: Shown<'_>) -> Result<(), Failure> {
    let Shown { setup, opened, clock, stop, options, duration_s } = shown;
    let again = listen::kept()?;
    let equipment =
        cli::Equipment { devices: Vec::new(), profiles: Vec::new(), salinity: None, pressure_kpa: None };
    let report = ui::live(ui::Live {
        setup,
        sources: vec![opened],
        anchor: live::anchor(&*clock),
        clock,
        recording: None,
        again: Box::new(move || listen::recording(again.clone(), Vec::new())),
        stop,
        duration_s,
        options,
        equipment,
    })?;
    if let Some(recorded) = report.recorded {
        live::say_recorded(recorded, &live::counts(&report.tally, true))?;
    }
    report.ended
}

/// Is what has to be kept for the simulation to go on.
#[cfg(unix)]
type Wire = Option<pty::Wire>;
#[cfg(not(unix))]
type Wire = ();

/// Returns the simulation as a source: a pty if the system has one to give, else without the way through it.
#[cfg(unix)]
fn connect(config: Config, clock: &Arc<dyn source::Clock>) -> (Box<dyn Source>, Wire) {
    match pty::connect(Simulation::new(config), config.line, clock) {
        Ok((source, wire)) => (source, Some(wire)),
        Err(_) => (Box::new(Played::new(Simulation::new(config), Arc::clone(clock))), None),
    }
}

#[cfg(not(unix))]
fn connect(config: Config, clock: &Arc<dyn source::Clock>) -> (Box<dyn Source>, Wire) {
    (Box::new(Played::new(Simulation::new(config), Arc::clone(clock))), ())
}
