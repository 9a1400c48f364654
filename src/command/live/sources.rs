//! From the sources on the command line to open ones with their buses.

use std::sync::Arc;

use super::super::bus;
use super::super::failure::Failure;
use super::super::message;
use super::super::session::Setup;
use crate::analyze::line_search::LineSearch;
use crate::capture::mcap::BusSettings;
use crate::cli;
use crate::device::Profiles;
use crate::line::LineSettings;
use crate::source::{self, Clock, Place, Source, SourceError};

/// Is a source that is open.
pub(in crate::command) struct Opened {
    /// What the user calls it.
    pub(in crate::command) name: String,
    pub(in crate::command) source: Box<dyn Source>,
    pub(in crate::command) settings: BusSettings,
    /// Whether its line settings are to be found from its traffic.
    pub(in crate::command) searches: bool,
    /// Whether it can wait while there is no room for its bytes.
    pub(in crate::command) is_patient: bool,
}

impl From<SourceError> for Failure {
    fn from(error: SourceError) -> Self {
        match &error.hint {
            Some(hint) => Failure::hinted(&error, hint),
            None => Failure::new(&error),
        }
    }
}

/// Opens the sources that were asked for.
///
/// # Errors
/// When one cannot be opened, or two are the same or have the same name.
pub(in crate::command) fn open(args: &cli::Live, clock: &Arc<dyn Clock>) -> Result<Vec<Opened>, Failure> {
    let names = names(args)?;
    let line = match args.line {
        Some(cli::Line::Is(line)) => line,
        Some(cli::Line::Auto) => first_to_try(args)?,
        None => LineSettings::default(),
    };
    let mut opened = Vec::new();
    for (spec, bus) in args.sources.iter().zip(names) {
        let source = source::open(spec, line, Arc::clone(clock))?;
        opened.push(Opened {
            name: spec.place.to_string(),
            settings: settings(&*source, bus, line),
            source,
            searches: args.line == Some(cli::Line::Auto),
            is_patient: !matches!(spec.place, Place::Serial(_)),
        });
    }
    match args.line {
        Some(cli::Line::Is(_)) => {}
        Some(cli::Line::Auto) => message::note(format_args!("looking for the line settings; trying {line}")),
        None => message::note(format_args!("line settings {line} assumed; --line says others, or auto")),
    }
    Ok(opened)
}

/// Returns the settings that a search begins with.
///
/// # Errors
/// When a source has no line settings that could be changed.
fn first_to_try(args: &cli::Live) -> Result<LineSettings, Failure> {
    if let Some(spec) = args.sources.iter().find(|spec| !matches!(spec.place, Place::Serial(_))) {
        let text = format!("'{}' has no line settings that --line auto could change", spec.place);
        return Err(Failure::hinted(
            text,
            "say what they are, as in --line 9600-8N1; auto is for serial ports",
        ));
    }
    Ok(LineSearch::first())
}

/// Returns the settings of a bus, with what its source says of itself.
pub(in crate::command) fn settings(source: &dyn Source, bus: String, line: LineSettings) -> BusSettings {
    let mut facts = source.facts();
    facts.insert("source".to_owned(), source.name().to_owned());
    BusSettings { name: bus, line, adapter_hold_ns: source.adapter_hold_ns(), facts }
}

/// Names the buses: as asked for, or bus0, bus1 and so on by their place.
fn names(args: &cli::Live) -> Result<Vec<String>, Failure> {
    let mut names: Vec<String> = Vec::new();
    for (index, spec) in args.sources.iter().enumerate() {
        let name = spec.name.clone().unwrap_or_else(|| format!("bus{index}"));
        if names.contains(&name) {
            let hint = "name each bus, as in pump=/dev/ttyUSB0 tank=/dev/ttyUSB1";
            return Err(Failure::hinted(format!("two buses are called '{name}'"), hint));
        }
        if args.sources[..index].iter().any(|other| other.place == spec.place) {
            return Err(Failure::hinted(
                format!("'{}' was given twice", spec.place),
                "give each source once",
            ));
        }
        names.push(name);
    }
    Ok(names)
}

/// Returns how to decode live sources.
///
/// # Errors
/// When a device is said to be what no profile is.
pub(in crate::command) fn setup(
    args: &cli::Live,
    profiles: &Arc<Profiles>,
    readings: bool,
    decodes: bool,
) -> Result<Setup, Failure> {
    Ok(Setup {
        // Each bus has its own, which may change while it is tapped.
        line: None,
        adapter_hold_ns: args.adapter_hold.map(|hold| hold.0),
        devices: bus::devices(&args.equipment, profiles)?,
        profiles: Arc::clone(profiles),
        readings,
        findings: readings,
        decodes,
        secrets: None,
    })
}
