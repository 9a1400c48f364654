//! A bar on standard error for files that take longer than a second.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::{message, output};
use crate::capture::Input;

/// How long an input may take before a bar appears.
const PATIENCE: Duration = Duration::from_secs(1);

/// Shows how much of an input has been read.
pub(super) struct Progress {
    begun: Instant,
    bar: Option<ProgressBar>,
    is_wanted: bool,
}

impl Progress {
    /// Begins an input; rows on a terminal show the progress themselves.
    pub(super) fn new(rows_are_printed: bool) -> Self {
        #[expect(clippy::disallowed_methods, reason = "a bar appears after a second")]
        let begun = Instant::now();
        let is_wanted = !(rows_are_printed && output::stdout_is_terminal()) && !message::has_screen();
        Progress { begun, bar: None, is_wanted }
    }

    /// Takes note of how much has been read; indicatif draws on a terminal only.
    pub(super) fn update(&mut self, input: &Input) {
        let Some(size) = input.size().filter(|_| self.is_wanted) else { return };
        if self.bar.is_none() && self.begun.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(size).with_message(input.name().to_owned());
            match ProgressStyle::with_template("{wide_bar} {bytes}/{total_bytes} {eta} {msg}") {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        bar.set_position(input.position());
    }

    /// Removes the bar.
    pub(super) fn finish(self) {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
    }
}
