//! `rtutap info`: says what a recording holds.

use std::sync::Arc;

use super::bus::{self, Wanted};
use super::failure::Failure;
use super::output::Output;
use super::session::{Origin, Sink};
use crate::analyze::plan::Draft;
use crate::capture::mcap::Facts;
use crate::cli::{self, InfoFormat};
use crate::device::Profiles;
use crate::pipeline::Event;
use crate::report::Clock;
use crate::report::info::{Info, Recording};

/// Runs the command.
pub(super) fn run(args: &cli::Info) -> Result<(), Failure> {
    let profiles = bus::profiles(&args.bus.equipment.profiles, &args.bus.inputs)?;
    if args.plan {
        return write_plan(args, &profiles);
    }
    let mut info = Info::new(&profiles);
    let mut recordings = Vec::new();
    let result = bus::read(&args.bus, &profiles, Wanted::default(), &mut info, |facts, is_being_written| {
        recordings.push(Recording { is_being_written, ..recording(facts) });
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

/// Writes down what the master does.
fn write_plan(args: &cli::Info, profiles: &Arc<Profiles>) -> Result<(), Failure> {
    let mut planner = Planner::default();
    bus::read(&args.bus, profiles, Wanted::default(), &mut planner, |_, _| {})?;
    let inputs: Vec<String> = args.bus.inputs.iter().map(|input| input.display().to_string()).collect();
    let plan = planner.draft.finish();
    if plan.devices.is_empty() {
        let hint = "record a master that is known to be good; 'rtutap info' says what the recording holds";
        return Err(Failure::hinted(
            format!("no request was heard in {}: there is nothing to plan", inputs.join(", ")),
            hint,
        ));
    }
    let mut output = Output::stdout();
    let heading = format!(
        "# What the master of {} does, as 'rtutap info --plan' saw it; 'rtutap verify --expect' holds another against it.\n\
         # Remove or widen what does not matter: each key but address, name and function may be left out.\n\n",
        inputs.join(", ")
    );
    output.buffer.extend_from_slice(heading.as_bytes());
    output.buffer.extend_from_slice(plan.to_string().as_bytes());
    output.flush()
}

/// Gathers a plan.
#[derive(Default)]
struct Planner {
    draft: Draft,
    bus: Option<String>,
}

impl Sink for Planner {
    const RECEIVES: bool = false;

    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        let name = &origin.settings.name;
        match self.bus.get_or_insert_with(|| name.clone()) {
            known if known == name => Ok(()),
            known => {
                let message = format!("a plan is of one bus, and this has '{known}' and '{name}'");
                Err(Failure::hinted(message, "give recordings of one bus alone"))
            }
        }
    }

    fn event(&mut self, _bus: &str, event: &Event<'_>) {
        if let Event::Transaction { transaction, meaning, .. } = event {
            self.draft.transaction(transaction, meaning);
        }
    }

    fn pause(&mut self, _settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        Ok(())
    }
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
        is_being_written: false,
    }
}

impl Sink for Info {
    const RECEIVES: bool = false;

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
