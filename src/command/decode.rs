//! `rtutap decode`: prints a recording.

use super::bus::{self, Wanted};
use super::failure::Failure;
use super::message;
use super::output::Output;
use super::session::{Origin, Sink};
use crate::analyze::filter::Filter;
use crate::cli::{self, RowFormat};
use crate::device::Profiles;
use crate::pipeline::Event;
use crate::report::{self, Clock, Csv, Format, Json, Rows, Show, Text};
use crate::section::nearest;

/// Runs the command.
pub(super) fn run(args: &cli::Decode, verbose: bool) -> Result<(), Failure> {
    let format = args.format.unwrap_or_default();
    let mut show: Vec<Show> = args.show.iter().copied().map(Show::from).collect();
    show.dedup();
    if show.is_empty() {
        show.push(Show::Transactions);
    }
    let profiles = bus::profiles(&args.bus.profiles, &args.bus.inputs)?;
    let judge = args.filter.as_deref().map(|text| judge(text, &profiles)).transpose()?;
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
    let mut printer = Printer { rows: Rows::new(show, writer, judge), output };
    printer.rows.heading(&mut printer.output.buffer);
    let result = bus::read(&args.bus, &profiles, wanted, &mut printer, |_| {});
    // What was decoded before something went wrong is shown first.
    printer.output.flush()?;
    result?;
    if printer.rows.needs_environment() && says_environment {
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
pub(super) fn judge(text: &str, profiles: &Profiles) -> Result<report::Judge, Failure> {
    let filter = Filter::parse(text).map_err(|error| {
        let hint = error.hint().unwrap_or("a filter reads like 'addr == 1 && temperature > 20'");
        let said = error.to_string();
        // The hint gets a line of its own.
        let said = said.strip_suffix(hint).map_or(&*said, |said| said.trim_end_matches("; "));
        Failure::hinted(format!("--filter '{text}': {said}"), hint)
    })?;
    let commands = || profiles.iter().flat_map(|profile| &profile.commands);
    let fields = commands().flat_map(|command| command.request.iter().chain(&command.response));
    let derived = profiles.iter().flat_map(|profile| &profile.derived);
    let mut names: Vec<&str> = fields.map(|field| &*field.name).collect();
    names.extend(derived.map(|derived| &*derived.name));
    let known: Vec<&str> = Filter::known_names().collect();
    for name in filter.field_names().into_iter().filter(|name| !names.contains(name)) {
        let near = nearest(name, known.iter().copied().chain(names.iter().copied()));
        let near = near.map_or_else(String::new, |near| format!("; did you mean '{near}'?"));
        message::warning(format_args!("--filter: no profile has a field '{name}'{near}"));
    }
    Ok(Box::new(move |bus, event| report::passes(&filter, bus, event)))
}

/// Prints rows as they come.
struct Printer {
    rows: Rows,
    output: Output,
}

impl Sink for Printer {
    fn begin(&mut self, _origin: &Origin) -> Result<(), Failure> {
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        self.rows.event(bus, event, &mut self.output.buffer);
    }

    fn pause(&mut self, settled_frame: u64, waits: bool) -> Result<(), Failure> {
        self.rows.settle(settled_frame, &mut self.output.buffer);
        if waits { self.output.flush() } else { self.output.drain() }
    }
}
