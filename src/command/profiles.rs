//! `rtutap profiles`: lists, shows and checks device profiles.

use std::fmt::{self, Write};
use std::path::Path;

use super::failure::Failure;
use super::output::Output;
use super::{bus, message};
use crate::cli::{self, ProfileAction};
use crate::device::{Command, FieldSpec, Kind, Measuring, Profile, Profiles};
use crate::time::SECOND;

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
    };
    let mut output = Output::stdout();
    output.buffer.extend_from_slice(text.as_bytes());
    output.flush()
}

fn list(profiles: &Profiles, out: &mut String) -> fmt::Result {
    let width = profiles.iter().map(|profile| profile.id.len()).max().unwrap_or(0);
    for profile in profiles.iter() {
        writeln!(out, "{:<width$}  {:>2} commands  {}", profile.id, profile.commands.len(), profile.name)?;
    }
    Ok(())
}

fn show(profile: &Profile, out: &mut String) -> fmt::Result {
    writeln!(out, "{}: {}", profile.id, profile.name)?;
    if let Some(vendor) = &profile.vendor {
        writeln!(out, "made by {vendor}")?;
    }
    if let Some(manual) = &profile.manual {
        writeln!(out, "after {manual}")?;
    }
    show_measuring(&profile.measuring, out)?;
    for command in &profile.commands {
        show_command(command, out)?;
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
        writeln!(out, "measures only after a start")?;
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

fn show_command(command: &Command, out: &mut String) -> fmt::Result {
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
