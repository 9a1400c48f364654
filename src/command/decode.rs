//! `rtutap decode`: prints a recording.

use super::bus::{self, Wanted};
use super::failure::Failure;
use super::output::Output;
use super::printing::Printing;
use super::session::{Origin, Sink};
use crate::cli;
use crate::pipeline::Event;

/// Runs the command.
pub(super) fn run(args: &cli::Decode, verbose: bool) -> Result<(), Failure> {
    let profiles = bus::profiles(&args.bus.equipment.profiles, &args.bus.inputs)?;
    let (mut printing, mut output) = Printing::new(&args.printing, &profiles, verbose)?;
    printing.heading(&mut output.buffer);
    let wanted = Wanted {
        readings: printing.shows_readings(),
        findings: printing.needs_findings(),
        prints: true,
        follow: args.follow,
        ..Wanted::default()
    };
    let mut printer = Printer { printing, output };
    let result = bus::read(&args.bus, &profiles, wanted, &mut printer, |_, _| {});
    // What was decoded before something went wrong is shown first.
    printer.output.flush()?;
    result?;
    printer.printing.say(&args.bus.equipment);
    Ok(())
}

/// Prints rows as they come.
struct Printer {
    printing: Printing,
    output: Output,
}

impl Sink for Printer {
    const RECEIVES: bool = false;

    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        self.printing.begin(&origin.settings, &mut self.output.buffer);
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        self.printing.event(bus, event, &mut self.output.buffer);
    }

    fn pause(&mut self, settled_frame: u64, waits: bool) -> Result<(), Failure> {
        self.printing.settle(settled_frame, &mut self.output.buffer);
        if waits { self.output.flush() } else { self.output.drain() }
    }
}
