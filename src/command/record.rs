//! `rtutap record`: records live buses, unattended.

use std::path::Path;
use std::sync::Arc;

use super::bus;
use super::failure::Failure;
use super::live::{self, Job, Recording, Status};
use super::output::Output;
use super::printing::judge;
use crate::capture::mcap::Options;
use crate::cli;
use crate::source::{Clock, SystemClock};

/// Runs the command.
pub(super) fn run(args: &cli::Record) -> Result<(), Failure> {
    let no_inputs: [&Path; 0] = [];
    let profiles = bus::profiles(&args.live.equipment.profiles, &no_inputs)?;
    let around = match (&args.trigger, args.ring) {
        (Some(trigger), Some(ring)) => Some((judge("--trigger", trigger, &profiles)?, ring.0)),
        _ => None,
    };
    let decodes = !args.raw_only || around.is_some();
    let setup = live::setup(&args.live, &profiles, decodes, decodes)?;
    let stop = live::stop_flag()?;
    let clock: Arc<dyn Clock> = Arc::new(SystemClock);
    let anchor = live::anchor(&*clock);
    let recording = Recording {
        path: args.output.clone(),
        options: Options {
            rotate_time_ns: Some(args.rotate_time.0).filter(|ns| *ns > 0),
            rotate_size: Some(args.rotate_size).filter(|size| *size > 0),
            rotate_chunks: Some(args.rotate_chunks).filter(|chunks| *chunks > 0),
            attachments: bus::given_attachments(&args.live.equipment)?,
            ..Options::default()
        },
        min_free: args.min_free,
        drop_oldest: args.drop_oldest,
        raw_only: args.raw_only,
        around,
        is_all: true,
    };
    let report = live::run(Job {
        setup: &setup,
        sources: live::open(&args.live, &clock)?,
        clock,
        anchor,
        rows: None,
        recording: Some(recording),
        info: None,
        audit: None,
        status: Status::new(true, decodes),
        stop,
        duration_ns: None,
    })?;
    let Some(recorded) = report.recorded else { return report.ended };
    let mut output = Output::stdout();
    for file in live::say_recorded(recorded, &live::counts(&report.tally, decodes))? {
        output.buffer.extend_from_slice(file.display().to_string().as_bytes());
        output.buffer.push(b'\n');
    }
    output.flush()?;
    report.ended
}
