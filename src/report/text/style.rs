//! The colours of text: one accent, and three for good, doubtful and bad.

use anstyle::{AnsiColor, Style};

use crate::analyze::verify::Severity;

/// Holds the styles; the default has none.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Styles {
    pub(super) dim: Style,
    pub(super) bold: Style,
    pub(super) accent: Style,
    pub(super) good: Style,
    pub(super) warn: Style,
    pub(super) bad: Style,
}

impl Styles {
    pub(super) fn severity(&self, severity: Severity) -> Style {
        match severity {
            Severity::Error => self.bad,
            Severity::Warning => self.warn,
            Severity::Note => self.accent,
        }
    }

    pub(super) fn coloured() -> Self {
        let colour = |colour: AnsiColor| colour.on_default();
        Styles {
            dim: Style::new().dimmed(),
            bold: Style::new().bold(),
            accent: colour(AnsiColor::Cyan),
            good: colour(AnsiColor::Green),
            warn: colour(AnsiColor::Yellow),
            bad: colour(AnsiColor::Red),
        }
    }
}
