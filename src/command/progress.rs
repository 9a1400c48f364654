//! A bar on standard error for files that take longer than a second.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::output;

/// How long an input may take before a bar appears.
const PATIENCE: Duration = Duration::from_secs(1);

/// Shows how much of an input has been read.
pub(super) struct Progress {
    name: String,
    /// Bytes of the input; without it there is no bar.
    size: Option<u64>,
    begun: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Begins an input of so many bytes, if that is known; rows on a terminal show the progress themselves.
    pub(super) fn new(name: &str, size: Option<u64>, rows_are_printed: bool) -> Self {
        #[expect(clippy::disallowed_methods, reason = "a bar appears after a second")]
        let begun = Instant::now();
        let size = size.filter(|_| !(rows_are_printed && output::stdout_is_terminal()));
        Progress { name: name.to_owned(), size, begun, bar: None }
    }

    /// Takes note of how much has been read; indicatif draws on a terminal only.
    pub(super) fn update(&mut self, position: u64) {
        let Some(size) = self.size else { return };
        if self.bar.is_none() && self.begun.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(size).with_message(self.name.clone());
            match ProgressStyle::with_template("{wide_bar} {bytes}/{total_bytes} {eta} {msg}") {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        bar.set_position(position);
    }

    /// Removes the bar.
    pub(super) fn finish(self) {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
        }
    }
}
