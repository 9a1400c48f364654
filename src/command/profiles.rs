//! `rtutap profiles`: lists, shows, checks and drafts device profiles.

mod draft;

use std::fmt::{self, Write};
use std::path::Path;

use super::failure::Failure;
use super::output::Output;
use super::{bus, message};
use crate::cli::{self, ProfileAction};
use crate::device::{Command, Confidence, FieldSpec, Kind, Measuring, Profile, Profiles, Source};
use crate::time::SECOND;

/// Says what the last columns of the list mean.
const CONFIDENCE: &str = "\
source and confidence of the facts: high where real traffic agrees with a manual, medium where a manual or a
program that many use is all there is, low where a single report or a conclusion is";

/// Stands in the place of the manual.
const NO_MANUAL: &str = "no manual is known";

/// Runs the command.
pub(super) fn run(args: &cli::Profiles) -> Result<(), Failure> {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = match &args.action {
        None | Some(ProfileAction::List) => list(&Profiles::built_in(), &mut text),
        Some(ProfileAction::Show { id }) => {
            let profiles = Profiles::built_in();
            let profile = profiles.get(id).ok_or_else(|| {
                let hint = "'rtutap profiles list' lists them";
                Failure::hinted(format!("there is no profile '{id}'"), hint)
            })?;
            show(profile, &mut text)
        }
        Some(ProfileAction::Check { file }) => check(file, &mut text)?,
        Some(ProfileAction::New(args)) => return draft::run(args),
    };
    let mut output = Output::stdout();
    output.buffer.extend_from_slice(text.as_bytes());
    output.flush()
}

fn list(profiles: &Profiles, out: &mut String) -> fmt::Result {
    let width = profiles.iter().map(|profile| profile.id.len()).max().unwrap_or(0);
    for profile in profiles.iter() {
        let confidence = profile.confidence.map_or("not stated", Confidence::name);
        write!(out, "{:<width$}  {:>2} commands  ", profile.id, profile.commands.len())?;
        writeln!(out, "{:<9}  {confidence:<6}  {}{}", profile.source.name(), profile.name, models(profile))?;
        writeln!(out, "{:width$}  {}", "", profile.manual.as_deref().unwrap_or(NO_MANUAL))?;
    }
    writeln!(out, "\n{CONFIDENCE}")
}

fn models(profile: &Profile) -> String {
    if profile.models.is_empty() { String::new() } else { format!(" ({})", profile.models.join(", ")) }
}

fn show(profile: &Profile, out: &mut String) -> fmt::Result {
    writeln!(out, "{}: {}{}", profile.id, profile.name, models(profile))?;
    if let Some(vendor) = &profile.vendor {
        writeln!(out, "made by {vendor}")?;
    }
    match &profile.manual {
        Some(manual) => writeln!(out, "after {manual}")?,
        None => writeln!(out, "{NO_MANUAL}")?,
    }
    write!(out, "source: {}", profile.source.name())?;
    match profile.confidence {
        Some(confidence) => writeln!(out, "; confidence: {}", confidence.name())?,
        None => writeln!(out)?,
    }
    if let Some(rule) = &profile.serial_number {
        let codes = if rule.type_codes.is_empty() {
            "of no known type".to_owned()
        } else {
            rule.type_codes.join(" or ")
        };
        writeln!(out, "serial numbers begin with {}, then {codes}", rule.prefix)?;
    }
    show_measuring(&profile.measuring, out)?;
    for command in &profile.commands {
        show_command(command, profile.source, out)?;
    }
    for derived in &profile.derived {
        writeln!(out, "\n{} is derived, by the formula {}", derived.name, derived.formula.name())?;
    }
    for remark in &profile.remarks {
        writeln!(out, "\n{remark}")?;
    }
    Ok(())
}

/// Shows what the device asks of a master that measures.
fn show_measuring(measuring: &Measuring, out: &mut String) -> fmt::Result {
    if measuring.needs_start {
        write!(out, "measures only after a start")?;
        match measuring.starts_itself_software {
            Some(software) => writeln!(out, "; by itself from software {software} on")?,
            None => writeln!(out)?,
        }
    }
    let lengths = [
        ("the first value counts", measuring.warm_up_ns, "after a start"),
        ("a read", measuring.cycle_ns, "after the one before, not sooner"),
        ("the brush sweeps for", measuring.brush_sweep_ns, "after it was started"),
    ];
    for (what, ns, since) in lengths {
        if let Some(ns) = ns {
            writeln!(out, "{what} {} s {since}", ns as f64 / SECOND as f64)?;
        }
    }
    Ok(())
}

fn show_command(command: &Command, source: Source, out: &mut String) -> fmt::Result {
    let quantities: Vec<String> = command.quantities.iter().map(u16::to_string).collect();
    write!(out, "\n{:<22} FC{:02} 0x{:04x}", command.name, command.function, command.start_register)?;
    let kind = match command.kind {
        Kind::Other => String::new(),
        _ => format!("  {}", command.kind_name()),
    };
    writeln!(out, " ×{}{kind}{}", quantities.join(" or "), contested(command.is_contested))?;
    for (side, fields) in [("request", &command.request), ("response", &command.response)] {
        for field in fields {
            show_field(side, field, out)?;
        }
    }
    if command.source != source {
        writeln!(out, "    source: {}", command.source.name())?;
    }
    if command.is_fingerprint {
        writeln!(out, "    only this kind of device accepts it")?;
    }
    match &command.remark {
        Some(remark) => writeln!(out, "    {remark}"),
        None => Ok(()),
    }
}

fn show_field(side: &str, field: &FieldSpec, out: &mut String) -> fmt::Result {
    let span = field.span();
    let unit = field.unit.as_deref().unwrap_or("");
    let last = span.end.saturating_sub(1);
    let bytes = match last.saturating_sub(span.start) {
        0 => format!("{side} data {last}"),
        _ => format!("{side} data {}-{last}", span.start),
    };
    let row = format!("    {:<20} {bytes:<20} {unit}", field.name);
    writeln!(out, "{}{}", row.trim_end(), contested(field.is_contested))
}

/// Marks what other models have otherwise.
fn contested(is_contested: bool) -> &'static str {
    if is_contested { "  (told only once the device is known: other models mean something else)" } else { "" }
}

/// Checks a profile; every problem is an error of its own.
fn check(file: &Path, out: &mut String) -> Result<fmt::Result, Failure> {
    let profile = bus::profile(file)?;
    let known = Profiles::built_in();
    if known.get(&profile.id).is_some() {
        message::note(format_args!("with --profile it takes the place of the built-in {}", profile.id));
    }
    let commands = profile.commands.len();
    Ok(writeln!(out, "{}: good: {}, {commands} commands", file.display(), profile.id))
}
