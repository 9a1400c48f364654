//! Messages on standard error: `error:`, `warning:`, `note:` and `hint:`; the log file has them too.

use std::fmt::Display;
use std::io::Write;

use anstyle::{AnsiColor, Style};

fn say(style: Style, kind: &str, text: impl Display) {
    // When standard error cannot be written to, there is nobody to tell.
    let _ = writeln!(anstream::stderr(), "{style}{kind}:{style:#} {text}");
}

fn bold(colour: AnsiColor) -> Style {
    colour.on_default().bold()
}

pub(super) fn error(text: impl Display) {
    tracing::error!("{text}");
    say(bold(AnsiColor::Red), "error", text);
}

pub(super) fn warning(text: impl Display) {
    tracing::warn!("{text}");
    say(bold(AnsiColor::Yellow), "warning", text);
}

pub(super) fn note(text: impl Display) {
    tracing::info!("{text}");
    say(Style::new().bold(), "note", text);
}

pub(super) fn hint(text: impl Display) {
    say(bold(AnsiColor::Cyan), "hint", text);
}
