//! `rtutap info`: says what a recording holds.

use super::bus::{self, BUS, Origin, Sink, Wanted};
use super::failure::Failure;
use super::output::Output;
use crate::cli::{self, InfoFormat};
use crate::pipeline::Event;
use crate::report::Clock;
use crate::report::info::Info;

/// Runs the command.
pub(super) fn run(args: &cli::Info) -> Result<(), Failure> {
    let profiles = bus::profiles(&args.bus.profiles)?;
    let mut info = Info::new(&profiles);
    bus::read(&args.bus, &profiles, Wanted::default(), &mut info)?;
    let mut output = Output::stdout();
    let text = match args.format {
        InfoFormat::Text => info.to_text(Clock::new(args.time.unwrap_or_default().into())),
        InfoFormat::Json => info.to_json() + "\n",
    };
    output.buffer.extend_from_slice(text.as_bytes());
    output.flush()
}

impl Sink for Info {
    const PRINTS: bool = false;

    fn begin(&mut self, origin: &Origin) {
        Info::begin(self, origin.line);
    }

    fn event(&mut self, event: &Event<'_>) {
        Info::event(self, BUS, event);
    }

    fn pause(&mut self, _settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        Ok(())
    }
}
