//! Messages on standard error: `error:`, `warning:`, `note:` and `hint:`; the log file has them too.

use std::fmt::Display;
use std::io::Write;
use std::sync::{Mutex, PoisonError};

use anstyle::{AnsiColor, Style};

use super::ui::{Teller, Word};
use crate::tui::store::Tone;

/// The screen that shows messages while it has the terminal.
static SCREEN: Mutex<Option<Teller>> = Mutex::new(None);

/// Shows messages on a screen from now on, or on standard error again.
pub(super) fn show_on(screen: Option<Teller>) {
    *SCREEN.lock().unwrap_or_else(PoisonError::into_inner) = screen;
}

/// Tells whether a screen has the terminal.
pub(super) fn has_screen() -> bool {
    SCREEN.lock().unwrap_or_else(PoisonError::into_inner).is_some()
}

fn say(style: Style, kind: &str, text: impl Display) {
    if let Some(screen) = &*SCREEN.lock().unwrap_or_else(PoisonError::into_inner) {
        let tone = match kind {
            "error" => Tone::Bad,
            "warning" => Tone::Warn,
            _ => Tone::Info,
        };
        return screen.tell(Word::Said(tone, text.to_string()));
    }
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
