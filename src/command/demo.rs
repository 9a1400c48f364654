//! `rtutap demo`: a simulated installation with faults in it, as it happens, through a pty where there are ptys.

mod played;
#[cfg(unix)]
mod pty;

use std::sync::Arc;

use super::failure::Failure;
use super::live::{self, Job, Opened, Status};
use super::output::Output;
use super::printing::Printing;
use super::session::Setup;
use super::{message, simulate};
use crate::capture::BUS;
use crate::capture::mcap::BusSettings;
use crate::cli;
use crate::device::Profiles;
use crate::line::LineSettings;
use crate::report::info::Info;
use crate::report::{Clock, Show, Text, TimeStyle};
use crate::simulate::{Adapter, Config, Simulation};
use crate::source::{self, Source, SystemClock};
use crate::time::SECOND;
use played::Played;

/// Runs the command.
pub(super) fn run(args: &cli::Demo, verbose: bool) -> Result<(), Failure> {
    let config = Config {
        seed: args.seed,
        frames: u64::MAX,
        line: LineSettings::default(),
        adapter: Adapter::Usb1,
        scenario: simulate::scenario("demo")?,
    };
    let profiles = Arc::new(Profiles::built_in());
    let (output, colour) = Output::terminal();
    let text = Text::new(Clock::new(TimeStyle::Relative), colour, verbose, &profiles);
    let printing = Printing::of(vec![Show::Devices, Show::Transactions], Box::new(text), None, false);
    let adapter_hold_ns = Some(config.adapter.hold_ns(config.line));
    let setup = Setup { adapter_hold_ns, readings: false, ..Setup::new(Arc::clone(&profiles)) };
    message::note("a simulated installation: one master, three sensors, and faults; nothing is connected");
    let stop = live::stop_flag()?;
    let clock: Arc<dyn source::Clock> = Arc::new(SystemClock);
    let (source, _wire) = connect(config, &clock);
    let settings = BusSettings { name: BUS.to_owned(), line: config.line, ..BusSettings::default() };
    let opened =
        Opened { name: source.name().to_owned(), source, settings, is_patient: false, searches: false };
    let report = live::run(Job {
        setup: &setup,
        sources: vec![opened],
        anchor: live::anchor(&*clock),
        clock,
        rows: Some((printing, output)),
        recording: None,
        info: Some(Info::new(&profiles)),
        audit: None,
        status: Status::new(false, true),
        stop,
        duration_ns: Some(u64::from(args.duration).saturating_mul(SECOND as u64)),
    })?;
    report.ended?;
    let mut output = Output::stdout();
    output.buffer.push(b'\n');
    let summary = report.info.map(|info| info.to_text(Clock::new(TimeStyle::Relative)));
    output.buffer.extend_from_slice(summary.unwrap_or_default().as_bytes());
    output.flush()
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
