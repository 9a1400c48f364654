//! `rtutap listen`: watches live buses.

use std::path::Path;
use std::sync::Arc;

use super::bus;
use super::failure::Failure;
use super::live::{self, Job, Recording, Status};
use super::printing::Printing;
use super::session::Setup;
use crate::capture::mcap::Options;
use crate::cli;
use crate::source::{Clock, SystemClock};

/// How many bytes stay free on the disk.
const MIN_FREE: u64 = 100_000_000;
/// Where a new file begins: nobody listens that long, but memory is to stay small.
const ROTATE_SIZE: u64 = 1_000_000_000;
const ROTATE_CHUNKS: u64 = 10_000;

/// Runs the command.
pub(super) fn run(args: &cli::Listen, verbose: bool) -> Result<(), Failure> {
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
    let recording = args.record.as_ref().map(|path| Recording {
        path: path.clone(),
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
    });
    let report = live::run(Job {
        setup: &setup,
        sources,
        clock,
        anchor,
        rows: Some((printing, output)),
        recording,
        info: None,
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
