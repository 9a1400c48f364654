//! The colours of text: one accent, and three for good, doubtful and bad.

use anstyle::{AnsiColor, Style};

use crate::analyze::verify::Severity;

/// Holds the styles; the default has none.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::report) struct Styles {
    pub(in crate::report) dim: Style,
    pub(in crate::report) bold: Style,
    pub(in crate::report) accent: Style,
    pub(in crate::report) good: Style,
    pub(in crate::report) warn: Style,
    pub(in crate::report) bad: Style,
}

impl Styles {
    pub(in crate::report) fn severity(&self, severity: Severity) -> Style {
        match severity {
            Severity::Error => self.bad,
            Severity::Warning => self.warn,
            Severity::Note => self.accent,
        }
    }

    pub(in crate::report) fn coloured() -> Self {
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
