//! `rtutap info`: says what a recording holds.

use super::bus::{self, Wanted};
use super::failure::Failure;
use super::output::Output;
use super::session::{Origin, Sink};
use crate::capture::mcap::Facts;
use crate::cli::{self, InfoFormat};
use crate::pipeline::Event;
use crate::report::Clock;
use crate::report::info::{Info, Recording};

/// Runs the command.
pub(super) fn run(args: &cli::Info) -> Result<(), Failure> {
    let profiles = bus::profiles(&args.bus.equipment.profiles, &args.bus.inputs)?;
    let mut info = Info::new(&profiles);
    let mut recordings = Vec::new();
    let result = bus::read(&args.bus, &profiles, Wanted::default(), &mut info, |facts| {
        recordings.push(recording(facts));
    });
    result?;
    info.recordings = recordings;
    let mut output = Output::stdout();
    let text = match args.format {
        InfoFormat::Text => info.to_text(Clock::new(args.time.unwrap_or_default().into())),
        InfoFormat::Json => info.to_json() + "\n",
    };
    output.buffer.extend_from_slice(text.as_bytes());
    output.flush()
}

fn recording(facts: &Facts) -> Recording {
    let session = facts.session.clone().unwrap_or_default();
    Recording {
        session_id: facts.session.is_some().then_some(session.id),
        part_index: session.part_index,
        tool: session.tool,
        buses: facts.buses.clone(),
        end: facts.end.clone(),
        is_complete: facts.is_complete(),
        damage: facts.damage_count,
        damage_bytes: facts.damage_bytes,
        lost_bytes: facts.lost_bytes,
    }
}

impl Sink for Info {
    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        Info::begin(self, &origin.settings.name, origin.settings.line);
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        Info::event(self, bus, event);
    }

    fn pause(&mut self, _settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        Ok(())
    }
}
