//! Rows on standard output, as `decode` and `listen` print them.

use super::bus;
use super::failure::Failure;
use super::message;
use super::output::Output;
use crate::analyze::filter::Filter;
use crate::capture::mcap::BusSettings;
use crate::cli::{self, RowFormat};
use crate::device::Profiles;
use crate::pipeline::Event;
use crate::report::{self, Clock, Csv, Format, Json, Rows, Show, Text};
use crate::section::nearest;

/// Turns events into the rows that were asked for.
pub(super) struct Printing {
    rows: Rows,
    shows_readings: bool,
    needs_findings: bool,
    /// Whether what derived values rest on is worth a note.
    says_environment: bool,
}

impl Printing {
    /// Returns what makes the rows asked for, and where they go.
    pub(super) fn new(
        args: &cli::Printing,
        profiles: &Profiles,
        verbose: bool,
    ) -> Result<(Self, Output), Failure> {
        let format = args.format.unwrap_or_default();
        let mut show: Vec<Show> = args.show.iter().copied().map(Show::from).collect();
        show.dedup();
        if show.is_empty() {
            show.push(Show::Transactions);
        }
        let judge = args.filter.as_deref().map(|text| judge("--filter", text, profiles)).transpose()?;
        let clock = Clock::new(args.time.unwrap_or_default().into());
        let (output, writer): (Output, Box<dyn Format>) = match (format, &show[..]) {
            (RowFormat::Text, _) => {
                let (output, colour) = Output::terminal();
                (output, Box::new(Text::new(clock, colour, verbose, profiles)))
            }
            (RowFormat::Json, _) => (Output::stdout(), Box::new(Json::default())),
            (RowFormat::Csv, [show]) => (Output::stdout(), Box::new(Csv::new(*show, clock))),
            (RowFormat::Csv, _) => {
                let hint = "give one --show, or --format json for several";
                return Err(Failure::hinted("CSV has one kind of row", hint));
            }
        };
        let mut printing = Printing::of(show, writer, judge, format != RowFormat::Text);
        let filter = args.filter.as_deref().and_then(|text| Filter::parse(text).ok());
        if filter.is_some_and(|filter| filter.asks_for_findings()) {
            printing.needs_findings = true;
            printing.rows = printing.rows.asking_for_findings();
        }
        Ok((printing, output))
    }

    /// Makes rows in a format.
    pub(super) fn of(
        show: Vec<Show>,
        format: Box<dyn Format>,
        judge: Option<report::Judge>,
        says_environment: bool,
    ) -> Self {
        let shows_readings = show.contains(&Show::Readings);
        let needs_findings = show.contains(&Show::Findings);
        Printing { rows: Rows::new(show, format, judge), shows_readings, needs_findings, says_environment }
    }

    /// Tells whether readings are among the rows.
    pub(super) fn shows_readings(&self) -> bool {
        self.shows_readings
    }

    /// Tells whether findings are among the rows, or decide which pass.
    pub(super) fn needs_findings(&self) -> bool {
        self.needs_findings
    }

    /// Appends what stands before the first row.
    pub(super) fn heading(&mut self, out: &mut Vec<u8>) {
        self.rows.heading(out);
    }

    /// Takes note of a bus that begins, or goes on with other settings.
    pub(super) fn begin(&mut self, settings: &BusSettings, out: &mut Vec<u8>) {
        self.rows.begin(&settings.name, settings.line, out);
    }

    /// Takes an event; appends to `out` what can be shown now.
    pub(super) fn event(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        self.rows.event(bus, event, out);
    }

    /// Appends what can be shown once every frame before `settled_frame` has its transaction or none.
    pub(super) fn settle(&mut self, settled_frame: u64, out: &mut Vec<u8>) {
        self.rows.settle(settled_frame, out);
    }

    /// Says what the rows rest on, and what would settle a guess among them.
    pub(super) fn say(&self, args: &cli::Equipment) {
        say_none(self.rows.none_of());
        if self.rows.needs_environment() && self.says_environment {
            bus::say_environment(args);
        }
        if let Some(guess) = self.rows.guess() {
            message::hint(format_args!(
                "devices marked '?' are likely, not proven; --device {}={} settles it",
                guess.address, guess.device
            ));
        }
    }
}

/// Says that a filter let nothing pass of so many transactions.
pub(super) fn say_none(none_of: Option<u64>) {
    if let Some(transactions) = none_of {
        message::note(format_args!("nothing passes --filter: 0 of {transactions} transactions match"));
    }
}

/// Reads a filter; `option` is what it was given with.
pub(super) fn judge(option: &str, text: &str, profiles: &Profiles) -> Result<report::Judge, Failure> {
    let filter = filter_of(option, text, profiles)?;
    Ok(Box::new(move |bus, event| report::passes(&filter, bus, event)))
}

/// Reads a filter as [`judge`] does.
pub(super) fn filter_of(option: &str, text: &str, profiles: &Profiles) -> Result<Filter, Failure> {
    let filter = Filter::parse(text).map_err(|error| {
        let hint = error.hint().unwrap_or("a filter reads like 'addr == 1 && temperature > 20'");
        let said = error.to_string();
        // The hint gets a line of its own.
        let said = said.strip_suffix(hint).map_or(&*said, |said| said.trim_end_matches("; "));
        Failure::hinted(format!("{option} '{text}': {said}"), hint)
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
        message::warning(format_args!("{option}: no profile has a field '{name}'{near}"));
    }
    Ok(filter)
}
