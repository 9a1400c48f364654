//! Text for people: a line a row, aligned; with details and bytes beneath when asked for.
//!
//! ```text
//! time                     unit  device         command                  latency  what it means
//! 2026-01-01 00:00:07.512    1  do             get-measurement       18.4 ±0.3 ms  temperature 17.625 °C · …
//! 2026-01-01 00:00:08.031    9  -              FC03 0x0010 ×2                      no response
//! ```
//!
//! Where there are several buses, their names stand behind the time.

mod detail;
mod style;

use std::fmt::{self, Write};
use std::io::Write as _;

use super::words::{self, Labels, arrow, function, latency, marked_fields, write_meaning};
use super::{Clock, Format, columns};
use crate::analyze::verify::Finding;
use crate::decode::frame::{Damaged, Frame};
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::{Identified, Meaning, Profiles};
use crate::line::LineSettings;
use crate::pipeline::{Event, Lost};
use crate::time::Timestamp;
pub(super) use style::Styles;

/// Is the likeliest reading of a device's words, shown although the device is not known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guess {
    /// The unit address.
    pub address: u8,
    /// The likeliest profile.
    pub device: String,
}

/// Writes text.
pub struct Text {
    clock: Clock,
    styles: Styles,
    verbose: bool,
    labels: Labels,
    guess: Option<Guess>,
    /// The buses so far; from the second one on a row names its own.
    buses: Vec<String>,
    /// Which of them the row is about.
    bus: usize,
    line: String,
}

impl Text {
    /// Makes a writer; `colour` allows escape sequences, `verbose` adds fields and bytes.
    pub fn new(clock: Clock, colour: bool, verbose: bool, profiles: &Profiles) -> Self {
        let styles = if colour { Styles::coloured() } else { Styles::default() };
        let labels = Labels::new(profiles);
        let (buses, line) = (Vec::new(), String::new());
        Text { clock, styles, verbose, labels, guess: None, buses, bus: 0, line }
    }

    /// Returns the place of a bus among those known.
    fn place_of(&mut self, bus: &str) -> usize {
        self.buses.iter().position(|known| known == bus).unwrap_or_else(|| {
            self.buses.push(bus.to_owned());
            self.buses.len() - 1
        })
    }

    /// Writes the time, or the row's number where there is none, and the bus where there are several.
    fn time(&mut self, time: Option<Timestamp>, id: u64) {
        let dim = self.styles.dim;
        let _ = match time {
            Some(time) => write!(self.line, "{dim}{:>9}{dim:#}", self.clock.short(time)),
            None => write!(self.line, "{dim}{:>9}{dim:#}", format_args!("#{id}").to_string()),
        };
        if let [_, _, ..] = &self.buses[..] {
            let width = self.buses.iter().map(|bus| bus.chars().count()).max().unwrap_or(0);
            let bus = self.buses.get(self.bus).map_or("", String::as_str);
            let _ = write!(self.line, "  {bus:<width$}");
        }
    }

    fn address(&mut self, address: Option<u8>) {
        let bold = self.styles.bold;
        let _ = match address {
            Some(address) => write!(self.line, "  {bold}{address:>3}{bold:#}"),
            None => write!(self.line, "    -"),
        };
    }

    fn transaction(&mut self, row: &Transaction<'_>, meaning: &Meaning<'_>) -> fmt::Result {
        self.time(columns::began(row), row.id);
        self.address(Some(row.address));
        let (dim, accent) = (self.styles.dim, self.styles.accent);
        let likely = if meaning.device().is_none() { meaning.likely() } else { None };
        let device = self.labels.of(meaning);
        write!(self.line, "  {device:<width$}", width = self.labels.width())?;
        let command = words::command(row, meaning);
        write!(self.line, "  {accent}{command:<20}{accent:#}  {dim}{:>15}{dim:#}  ", latency(row.latency))?;
        // Values out of range are shown, but are no reason to settle on the device.
        if let Some(likely) = likely.filter(|_| !meaning.likely_fields().any(|field| field.is_implausible()))
        {
            let device = likely.device.to_owned();
            self.guess.get_or_insert(Guess { address: row.address, device });
        }
        self.outcome(row, meaning)
    }

    /// Writes how a transaction ended, and what it said.
    fn outcome(&mut self, row: &Transaction<'_>, meaning: &Meaning<'_>) -> fmt::Result {
        let (good, warn, bad) = (self.styles.good, self.styles.warn, self.styles.bad);
        let line = &mut self.line;
        let style = match row.outcome {
            Outcome::Late | Outcome::Unsolicited => warn,
            _ => bad,
        };
        if let Some(outcome) = words::outcome(row) {
            write!(line, "{style}{outcome}{style:#}")?;
        }
        let separator = match row.outcome {
            Outcome::Answered | Outcome::Broadcast => "",
            Outcome::Exception => return Ok(()),
            _ => " · ",
        };
        let start = line.len();
        line.push_str(separator);
        let said = line.len();
        write_meaning(line, row, meaning)?;
        if line.len() > said {
            return Ok(());
        }
        line.truncate(start);
        match row.outcome {
            Outcome::Answered => write!(line, "{good}done{good:#}"),
            Outcome::Broadcast => write!(line, "broadcast"),
            _ => Ok(()),
        }
    }

    fn frame(&mut self, frame: &Frame<'_>) -> fmt::Result {
        let place = &frame.place;
        self.time(place.time.map(|time| time.start.midpoint()), place.id);
        let (dim, accent, warn) = (self.styles.dim, self.styles.accent, self.styles.warn);
        let arrow = arrow(frame.role);
        self.address(Some(frame.address()));
        write!(self.line, "  {arrow}")?;
        let function = function(frame.function());
        write!(
            self.line,
            "  {accent}{function:<5}{accent:#}  {dim}{:>15}{dim:#}  ",
            latency(place.gap_before)
        )?;
        self.bytes(place.bytes);
        if frame.echo {
            write!(self.line, "  {warn}echo{warn:#}")?;
        }
        self.line_errors(place.line_errors.len());
        Ok(())
    }

    fn damaged(&mut self, damaged: &Damaged<'_>) -> fmt::Result {
        let place = &damaged.place;
        self.time(place.time.map(|time| time.start.midpoint()), place.id);
        let (dim, bad) = (self.styles.dim, self.styles.bad);
        self.address(damaged.address);
        write!(self.line, "  {bad}✗{bad:#}")?;
        let reason = damaged.reason.name();
        let gap = latency(place.gap_before);
        // The reason is longer than a function code: it takes what it needs from the gap's column.
        let width = 21_usize.saturating_sub(reason.len()).max(1);
        write!(self.line, "  {bad}{reason}{bad:#} {dim}{gap:>width$}{dim:#}  ")?;
        self.bytes(place.bytes);
        self.line_errors(place.line_errors.len());
        Ok(())
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for (index, byte) in bytes.iter().enumerate() {
            let space = if index == 0 { "" } else { " " };
            let _ = write!(self.line, "{space}{byte:02x}");
        }
    }

    fn line_errors(&mut self, count: usize) {
        let bad = self.styles.bad;
        if count > 0 {
            let _ =
                write!(self.line, "  {bad}{count} line error{}{bad:#}", if count == 1 { "" } else { "s" });
        }
    }

    fn identified(&mut self, identified: &Identified, time: Option<Timestamp>) -> fmt::Result {
        self.time(time, identified.frames.last().copied().unwrap_or(0));
        let (good, bold) = (self.styles.good, self.styles.bold);
        self.address(Some(identified.address));
        write!(self.line, "  {good}●{good:#} {bold}{}{bold:#}", identified.device)?;
        write!(self.line, " recognised by {}", identified.evidence)
    }

    fn lost(&mut self, lost: &Lost) -> fmt::Result {
        self.time(lost.time, lost.stream_offset);
        let bad = self.styles.bad;
        write!(self.line, "  {bad}! {}{bad:#}", words::lost(lost))
    }

    fn finding(&mut self, finding: &Finding) -> fmt::Result {
        self.time(finding.time, finding.frames.last().copied().unwrap_or(0));
        self.address(finding.address);
        let Finding { rule, severity, party, message, .. } = finding;
        let (style, dim) = (self.styles.severity(*severity), self.styles.dim);
        write!(self.line, "  {style}{:<7} {} {}{style:#}", severity.name(), rule.code, rule.name)?;
        write!(self.line, " {dim}({}){dim:#} {message}", party.name())?;
        if self.verbose { write!(self.line, "\n    {dim}{}{dim:#}", finding.help()) } else { Ok(()) }
    }

    fn write_row(&mut self, event: &Event<'_>) -> fmt::Result {
        match event {
            Event::Frame(frame) => {
                self.frame(frame)?;
                if self.verbose {
                    detail::place(&mut self.line, &self.styles, &frame.place)?;
                    detail::adu(&mut self.line, &self.styles, frame.place.bytes, frame.role)?;
                }
            }
            Event::Damaged(damaged) => {
                self.damaged(damaged)?;
                if self.verbose {
                    detail::place(&mut self.line, &self.styles, &damaged.place)?;
                    detail::adu(&mut self.line, &self.styles, damaged.place.bytes, damaged.role)?;
                }
            }
            Event::Lost(lost) => self.lost(lost)?,
            Event::Identified { identified, time } => self.identified(identified, *time)?,
            Event::Transaction { transaction, meaning, .. } => {
                self.transaction(transaction, meaning)?;
                if self.verbose {
                    detail::transaction(&mut self.line, &self.styles, transaction, meaning)?;
                }
            }
            Event::Reading { reading, time, address, transaction } => {
                self.time(*time, *transaction);
                self.address(Some(*address));
                let (accent, dim) = (self.styles.accent, self.styles.dim);
                let device = self.labels.short(reading.device.unwrap_or("-"));
                let width = self.labels.width();
                write!(
                    self.line,
                    "  {device:<width$}  {accent}{:<14}{accent:#}  {reading}",
                    reading.quantity
                )?;
                if reading.derived {
                    write!(self.line, "  {dim}derived{dim:#}")?;
                }
            }
            Event::Finding(finding) => self.finding(finding)?,
        }
        Ok(())
    }
}

impl Format for Text {
    fn begin(&mut self, bus: &str, _line: LineSettings, _out: &mut Vec<u8>) {
        self.place_of(bus);
    }

    fn row(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        self.clock.note(event);
        self.bus = self.place_of(bus);
        self.line.clear();
        // Writing to a string fails only when a value's `Display` does; then the row ends there.
        let _ = self.write_row(event);
        let _ = writeln!(out, "{}", self.line.trim_end());
    }

    fn note_time(&mut self, event: &Event<'_>) {
        self.clock.note(event);
    }

    fn guess(&self) -> Option<Guess> {
        self.guess.clone()
    }
}
