//! `rtutap profiles new`: drafts a profile of an unknown device from a recording.

use crate::analyze::draft::{Drafter, NoDraft};
use crate::cli;
use crate::command::bus::{self, Wanted};
use crate::command::failure::Failure;
use crate::command::message;
use crate::command::output::Output;
use crate::command::session::{Origin, Sink};
use crate::decode::transaction::Outcome;
use crate::device::{NEW_ADDRESS, Profile};
use crate::pipeline::Event;

/// Runs the command.
pub(super) fn run(args: &cli::NewProfile) -> Result<(), Failure> {
    if let Some(path) = args.output.as_deref().filter(|path| path.as_os_str() != "-" && path.exists()) {
        let hint = "name another file with -o, or move that one away";
        return Err(Failure::hinted(format!("'{}' is there already", path.display()), hint));
    }
    let profiles = bus::profiles(&args.bus.equipment.profiles, &args.bus.inputs)?;
    let mut collector = Collector::default();
    bus::read(&args.bus, &profiles, Wanted::default(), &mut collector, |_, _| {})?;
    let draft = collector.drafter.draft(args.address).map_err(|error| {
        let hint = hint(&error);
        Failure::hinted(error, hint)
    })?;
    // What is drafted is a profile, whatever was on the bus.
    Profile::from_toml(&draft.toml, &draft.id).map_err(Failure::new)?;
    let mut output = match &args.output {
        Some(path) => Output::create(path)?,
        None => Output::stdout(),
    };
    output.buffer.extend_from_slice(draft.toml.as_bytes());
    output.flush()?;
    if let Some(path) = args.output.as_deref().filter(|path| path.as_os_str() != "-") {
        let (file, address) = (path.display(), draft.address);
        message::note(format_args!(
            "'{file}' holds the draft; try it with --profile {file} --device {address}={}",
            draft.id
        ));
    }
    Ok(())
}

fn hint(error: &NoDraft) -> &'static str {
    match error {
        NoDraft::Silence => "'rtutap info' says what the recording holds",
        NoDraft::AllKnown(_) => "--address N drafts a profile of a known device all the same",
        NoDraft::Several(_) => "choose one with --address; export one bus where several have it",
        NoDraft::NotHeard { .. } => "choose one of those with --address",
        NoDraft::NoRegisters(_) => "choose another with --address",
    }
}

/// Hands what devices say to the drafter.
#[derive(Default)]
struct Collector {
    drafter: Drafter,
}

impl Sink for Collector {
    const RECEIVES: bool = false;

    fn begin(&mut self, _origin: &Origin) -> Result<(), Failure> {
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        if let Event::Transaction { transaction, meaning, .. } = event {
            self.drafter.observe(bus, transaction, meaning.device(), meaning.candidates());
            let is_accepted = matches!(transaction.outcome, Outcome::Answered | Outcome::Late);
            let new_address = meaning.fields().find(|field| field.name == NEW_ADDRESS);
            let address = new_address.filter(|_| is_accepted).and_then(|field| field.value.as_f64());
            if address.is_some_and(|address| address != f64::from(transaction.address)) {
                self.drafter.leave(bus, transaction.address);
            }
        }
    }

    fn pause(&mut self, _settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        Ok(())
    }
}
