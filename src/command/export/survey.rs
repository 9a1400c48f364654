//! Reads an input once for the serial numbers in it, so that the first byte written has none.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use tempfile::TempDir;

use super::super::bus;
use super::super::failure::Failure;
use super::super::session::{Origin, Session, Setup, Sink};
use crate::capture::mcap::BusSettings;
use crate::capture::{BUS, Input, InputError};
use crate::cli;
use crate::device::Profiles;
use crate::pipeline::Event;
use crate::report::redact::{Secrets, Survey};

/// Puts what can be read but once into files, which last as long as the directory returned.
pub(super) fn keep_streams(inputs: &mut [PathBuf]) -> Result<Option<TempDir>, Failure> {
    let failed = |error: io::Error| Failure::new(format!("cannot keep the input in a file: {error}"));
    let mut directory = None;
    for (index, input) in inputs.iter_mut().enumerate().filter(|(_, input)| !input.is_file()) {
        let kept = match &mut directory {
            Some(directory) => directory,
            none => none.insert(tempfile::tempdir().map_err(failed)?),
        };
        #[expect(clippy::disallowed_methods, reason = "standard input and pipes are inputs")]
        let (name, mut stream): (_, Box<dyn io::Read>) = match input.as_os_str() == "-" {
            true => ("standard input".to_owned(), Box::new(io::stdin())),
            false => {
                let file = std::fs::File::open(&*input).map_err(|error| Failure::reading(input, &error))?;
                (format!("input {}", index + 1), Box::new(file))
            }
        };
        let path = kept.path().join(name);
        #[expect(clippy::disallowed_methods, reason = "a file without a name could be opened but once, too")]
        let mut file = std::fs::File::create(&path).map_err(failed)?;
        io::copy(&mut stream, &mut file).map_err(failed)?;
        *input = path;
    }
    Ok(directory)
}

/// Returns the serial numbers in the inputs; what is wrong with them is said when they are read again.
pub(super) fn secrets(args: &cli::Bus, profiles: &Arc<Profiles>) -> Result<Secrets, Failure> {
    let setup = Setup {
        line: args.line.and_then(cli::Line::settings),
        adapter_hold_ns: args.adapter_hold.map(|hold| hold.0),
        devices: bus::devices(&args.equipment, profiles)?,
        readings: false,
        ..Setup::new(Arc::clone(profiles))
    };
    let mut learning = Learning(Survey::new(Arc::clone(profiles)));
    for path in bus::in_order(&args.inputs) {
        let Ok(mut input) = Input::open(&path, args.input_format.map(Into::into)) else { continue };
        let mut session = Session::new(&setup);
        while let Ok(true) = read_item(&mut input, &mut session, &mut learning)? {}
        session.finish(&mut learning)?;
    }
    Ok(learning.0.finish())
}

/// Takes the next item of an input into a session; tells whether there was one.
fn read_item(
    input: &mut Input,
    session: &mut Session<'_>,
    learning: &mut Learning,
) -> Result<Result<bool, InputError>, Failure> {
    match input.advance() {
        Ok(true) => {}
        ended => return Ok(ended),
    }
    let item = input.item();
    if !session.take(&item, learning)? {
        let settings = BusSettings {
            name: item.bus().unwrap_or(BUS).to_owned(),
            line: input.line().unwrap_or_default(),
            adapter_hold_ns: input.adapter_hold_ns(),
            ..BusSettings::default()
        };
        session.begin(settings, learning)?;
        session.take(&item, learning)?;
    }
    Ok(Ok(true))
}

/// Learns from what a session decodes.
struct Learning(Survey);

impl Sink for Learning {
    const RECEIVES: bool = false;

    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        self.0.facts(&origin.settings.facts);
        Ok(())
    }

    fn event(&mut self, _bus: &str, event: &Event<'_>) {
        self.0.event(event);
    }

    fn pause(&mut self, _settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        Ok(())
    }
}
