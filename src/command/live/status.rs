//! A line on the terminal that says how a recording goes.

use std::path::{Path, PathBuf};

use indicatif::{HumanBytes, ProgressBar, ProgressStyle};

use super::super::ui::{Teller, Word};
use super::notice::Notice;
use super::tally::Tally;
use crate::report::words;
use crate::time::SECOND;

/// Shows the line; indicatif draws on a terminal only.
pub(in crate::command) struct Status {
    bar: Option<ProgressBar>,
    file: Option<PathBuf>,
    decodes: bool,
    /// Who wants to know of files.
    teller: Option<Teller>,
}

impl Status {
    /// Begins the line, if one is wanted; `decodes` tells whether frames are counted.
    pub(in crate::command) fn new(is_wanted: bool, decodes: bool) -> Self {
        let bar = is_wanted.then(|| {
            let bar = ProgressBar::new_spinner();
            match ProgressStyle::with_template("{spinner} {wide_msg}") {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        Status { bar, file: None, decodes, teller: None }
    }

    /// Shows nothing, but tells a screen of files.
    pub(in crate::command) fn told(teller: Teller) -> Self {
        Status { teller: Some(teller), ..Status::new(false, true) }
    }

    /// Takes note of the file that is being written.
    pub(super) fn file(&mut self, file: PathBuf) {
        if let Some(teller) = &self.teller {
            teller.tell(Word::Recording(Some(file.clone())));
        }
        self.file = Some(file);
    }

    /// Takes note that nothing is written any more.
    pub(super) fn closed(&mut self) {
        if let Some(teller) = &self.teller {
            teller.tell(Word::Recording(None));
        }
        self.file = None;
    }

    /// Shows how it goes after so many nanoseconds.
    pub(super) fn update(&self, elapsed_ns: i64, tally: &Tally) {
        if let Some(bar) = &self.bar {
            bar.set_message(text(elapsed_ns, tally, self.file.as_deref(), self.decodes));
            bar.tick();
        }
    }

    /// Says something above the line.
    pub(super) fn say(&self, notice: &Notice) {
        match &self.bar {
            Some(bar) => bar.suspend(|| notice.say()),
            None => notice.say(),
        }
    }

    /// Removes the line.
    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Returns the line.
fn text(elapsed_ns: i64, tally: &Tally, file: Option<&Path>, decodes: bool) -> String {
    let seconds = elapsed_ns / SECOND;
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    let mut text = format!("{hours}:{minutes:02}:{seconds:02}  {}", counts(tally, decodes));
    text += &format!("  load {:.0} %", tally.load() * 100.0);
    if let Some(file) = file {
        text += &format!("  {}", file.display());
    }
    text
}

/// Says what was counted.
pub(in crate::command) fn counts(tally: &Tally, decodes: bool) -> String {
    let mut text = HumanBytes(tally.bytes).to_string();
    if decodes {
        let runs = if tally.damaged == 1 { "run" } else { "runs" };
        text += &format!("  {} frames  {} damaged {runs}, kept", tally.frames, tally.damaged);
    }
    let errors = match tally.line_errors {
        0 if !tally.counts_line_errors() => "line errors not available".to_owned(),
        count => format!("{count} line errors"),
    };
    text += "  ";
    text += &errors;
    if tally.lost > 0 {
        text += &format!("  {} lost", words::bytes(tally.lost));
    }
    match tally.holes {
        0 => {}
        1 => text += "  1 hole of unknown size",
        holes => text += &format!("  {holes} holes of unknown size"),
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_says_what_is_known() {
        let mut tally = Tally { bytes: 2048, frames: 12, damaged: 1, ..Tally::default() };
        let said = text(3_725 * SECOND, &tally, Some(Path::new("a.mcap.part")), true);
        assert_eq!(
            said,
            "1:02:05  2.00 KiB  12 frames  1 damaged run, kept  line errors not available  load 0 %  a.mcap.part"
        );
        (tally.line_errors, tally.lost, tally.holes) = (3, 7, 2);
        let said = text(0, &tally, None, false);
        assert_eq!(said, "0:00:00  2.00 KiB  3 line errors  7 bytes lost  2 holes of unknown size  load 0 %");
    }
}
