//! `rtutap decode`: prints a recording.

use super::bus::{self, Wanted};
use super::failure::Failure;
use super::message;
use super::output::Output;
use super::session::{Origin, Sink};
use crate::analyze::filter::Filter;
use crate::cli::{self, RowFormat};
use crate::pipeline::Event;
use crate::report::{self, Clock, Csv, Format, Json, Rows, Show, Text};

/// Runs the command.
pub(super) fn run(args: &cli::Decode, verbose: bool) -> Result<(), Failure> {
    let format = args.format.unwrap_or_default();
    let mut show: Vec<Show> = args.show.iter().copied().map(Show::from).collect();
    show.dedup();
    if show.is_empty() {
        show.push(Show::Transactions);
    }
    let profiles = bus::profiles(&args.bus.profiles, &args.bus.inputs)?;
    let judge = args.filter.as_deref().map(judge).transpose()?;
    let clock = Clock::new(args.time.unwrap_or_default().into());
    let (output, writer): (Output, Box<dyn Format>) = match (format, &show[..]) {
        (RowFormat::Text, _) => {
            let (output, colour) = Output::terminal();
            (output, Box::new(Text::new(clock, colour, verbose, &profiles)))
        }
        (RowFormat::Json, _) => (Output::stdout(), Box::new(Json::default())),
        (RowFormat::Csv, [show]) => (Output::stdout(), Box::new(Csv::new(*show, clock))),
        (RowFormat::Csv, _) => {
            let hint = "give one --show, or --format json for several";
            return Err(Failure::hinted("CSV has one kind of row", hint));
        }
    };
    let wanted = Wanted {
        readings: show.contains(&Show::Readings),
        prints: true,
        follow: args.follow,
        ..Wanted::default()
    };
    let says_environment = format != RowFormat::Text;
    let mut printer = Printer { rows: Rows::new(show, writer, judge), output, derived: false };
    printer.rows.heading(&mut printer.output.buffer);
    let result = bus::read(&args.bus, &profiles, wanted, &mut printer, |_| {});
    // What was decoded before something went wrong is shown first.
    printer.output.flush()?;
    result?;
    if printer.derived && says_environment {
        bus::say_environment(&args.bus);
    }
    if let Some(guess) = printer.rows.guess() {
        message::hint(format_args!(
            "devices marked '?' are likely, not proven; --device {}={} settles it",
            guess.address, guess.device
        ));
    }
    Ok(())
}

/// Reads a filter.
pub(super) fn judge(text: &str) -> Result<report::Judge, Failure> {
    let filter = Filter::parse(text).map_err(|error| {
        let hint = error.hint().map_or_else(
            || "a filter reads like 'addr == 1 && temperature > 20'".to_owned(),
            |hint| hint.to_owned(),
        );
        Failure::hinted(format!("--filter '{text}': {error}"), hint)
    })?;
    Ok(Box::new(move |bus, event| report::passes(&filter, bus, event)))
}

/// Prints rows as they come.
struct Printer {
    rows: Rows,
    output: Output,
    derived: bool,
}

impl Sink for Printer {
    fn begin(&mut self, _origin: &Origin) -> Result<(), Failure> {
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        if let Event::Reading { reading, .. } = event {
            self.derived |= reading.derived;
        }
        self.rows.event(bus, event, &mut self.output.buffer);
    }

    fn pause(&mut self, settled_frame: u64, waits: bool) -> Result<(), Failure> {
        self.rows.settle(settled_frame, &mut self.output.buffer);
        if waits { self.output.flush() } else { self.output.drain() }
    }
}
