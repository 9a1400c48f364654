//! Text for people: a line a row, aligned; with details and bytes beneath when asked for.
//!
//! ```text
//! time                     unit  device         command                  latency  what it means
//! 2026-01-01 00:00:07.512    1  do             get-measurement       18.4 ±0.3 ms  temperature 17.625 °C · …
//! 2026-01-01 00:00:08.031    9  -              FC03 0x0010 ×2                      no response
//! ```

mod detail;
mod style;

use std::fmt::{self, Write};
use std::io::Write as _;

use super::{Clock, Format, columns};
use crate::analyze::verify::Finding;
use crate::decode::frame::{Damaged, Frame, Role};
use crate::decode::function::FunctionCode;
use crate::decode::pdu::{self, PduValue};
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::device::{Field, Identified, Meaning, Profiles};
use crate::pipeline::{Event, Lost};
use crate::time::{MILLISECOND, Span, Timestamp};
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
    /// What the ids of all profiles begin with, up to a hyphen: not worth repeating on every line.
    prefix: String,
    device_width: usize,
    guess: Option<Guess>,
    line: String,
}

impl Text {
    /// Makes a writer; `colour` allows escape sequences, `verbose` adds fields and bytes.
    pub fn new(clock: Clock, colour: bool, verbose: bool, profiles: &Profiles) -> Self {
        let ids: Vec<&str> = profiles.iter().map(|profile| &*profile.id).collect();
        let prefix = common_prefix(&ids).to_owned();
        let device_width = ids.iter().map(|id| id.len() - prefix.len()).max().unwrap_or(1) + 1;
        let styles = if colour { Styles::coloured() } else { Styles::default() };
        Text { clock, styles, verbose, prefix, device_width, guess: None, line: String::new() }
    }

    fn label<'a>(&self, device: &'a str) -> &'a str {
        device.strip_prefix(self.prefix.as_str()).unwrap_or(device)
    }

    /// Writes the time, or the row's number where there is none.
    fn time(&mut self, time: Option<Timestamp>, id: u64) {
        let dim = self.styles.dim;
        let _ = match time {
            Some(time) => write!(self.line, "{dim}{:>9}{dim:#}", self.clock.short(time)),
            None => write!(self.line, "{dim}{:>9}{dim:#}", format_args!("#{id}").to_string()),
        };
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
        let (device, mark) = match (meaning.device(), &likely) {
            (Some(device), _) => (device, ""),
            (None, Some(likely)) => (likely.device, "?"),
            (None, None) => ("-", ""),
        };
        let device = format!("{}{mark}", self.label(device));
        write!(self.line, "  {device:<width$}", width = self.device_width)?;
        let command = match (meaning.command(), &likely) {
            (Some(command), _) => command.to_owned(),
            (None, Some(likely)) => format!("{}?", likely.command),
            (None, None) => function_and_register(row),
        };
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
        match row.outcome {
            Outcome::Answered | Outcome::Broadcast => {}
            Outcome::NoResponse => write!(line, "{bad}no response{bad:#}")?,
            Outcome::Exception => match row.exception_code {
                Some(code) => match code.name() {
                    Some(name) => write!(line, "{bad}exception {}: {name}{bad:#}", code.0)?,
                    None => write!(line, "{bad}exception {}{bad:#}", code.0)?,
                },
                None => write!(line, "{bad}exception{bad:#}")?,
            },
            Outcome::Late => write!(line, "{warn}late{warn:#}")?,
            Outcome::Unsolicited => write!(line, "{warn}unsolicited{warn:#}")?,
            Outcome::Damaged => {
                let request = row.request.is_some_and(|side| side.damaged);
                write!(line, "{bad}{} damaged{bad:#}", if request { "request" } else { "response" })?;
            }
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
        let count = lost.count;
        let at = lost.stream_offset;
        write!(self.line, "  {bad}! {count} bytes lost ({}) before byte {at}{bad:#}", lost.kind.name())
    }

    fn finding(&mut self, finding: &Finding) -> fmt::Result {
        self.time(finding.time, finding.frames.last().copied().unwrap_or(0));
        self.address(finding.address);
        let Finding { rule, severity, party, message, .. } = finding;
        let (style, dim) = (self.styles.severity(*severity), self.styles.dim);
        write!(self.line, "  {style}{:<7} {} {}{style:#}", severity.name(), rule.code, rule.name)?;
        write!(self.line, " {dim}({}){dim:#} {message}", party.name())?;
        if self.verbose { write!(self.line, "\n    {dim}{}{dim:#}", rule.help) } else { Ok(()) }
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
                let device = self.label(reading.device.unwrap_or("-"));
                let width = self.device_width;
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
    fn row(&mut self, _bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        self.clock.note(event);
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

/// Returns the fields that are sure, then those of the likeliest reading, each with the mark it is shown with.
fn marked_fields<'a>(meaning: &Meaning<'a>) -> impl Iterator<Item = (Field<'a>, &'static str)> {
    let sure = meaning.fields().map(|field| (field, ""));
    sure.chain(meaning.likely_fields().map(|field| (field, "?")))
}

/// Writes fields; without a profile, the data of the PDU.
fn write_meaning(line: &mut String, row: &Transaction<'_>, meaning: &Meaning<'_>) -> fmt::Result {
    let mut separator = "";
    let mut known = false;
    let mut field = |line: &mut String, text: fmt::Arguments<'_>| {
        let before = std::mem::replace(&mut separator, " · ");
        known = true;
        write!(line, "{before}{text}")
    };
    for (f, mark) in marked_fields(meaning) {
        field(line, format_args!("{}{mark} {f}", f.name))?;
    }
    if known || meaning.command().is_some() || meaning.likely().is_some() {
        return Ok(());
    }
    let mut sides = [(row.request, Role::Request), (row.response, Role::Response)];
    if !is_write(row.function) {
        sides.reverse();
    }
    for (side, role) in sides {
        let Some(side) = side.filter(|side| !side.damaged) else { continue };
        if write_data(line, side, role)? {
            break;
        }
    }
    Ok(())
}

/// Tells whether what a function is about is in its request.
fn is_write(function: FunctionCode) -> bool {
    matches!(
        function,
        FunctionCode::WRITE_SINGLE_COIL
            | FunctionCode::WRITE_SINGLE_REGISTER
            | FunctionCode::WRITE_MULTIPLE_COILS
            | FunctionCode::WRITE_MULTIPLE_REGISTERS
            | FunctionCode::WRITE_FILE_RECORD
            | FunctionCode::MASK_WRITE_REGISTER
    )
}

/// Writes what a PDU carries besides its header; tells whether there was something.
fn write_data(line: &mut String, side: Side<'_>, role: Role) -> Result<bool, fmt::Error> {
    let mut separator = "";
    for field in pdu::dissect(side.bytes, role).fields {
        let is_header = matches!(
            field.name,
            "address"
                | "function"
                | "start register"
                | "start address"
                | "quantity"
                | "byte count"
                | "register"
                | "reference type"
                | "file response length"
                | "MEI type"
                | "read device ID code"
                | "conformity level"
                | "more follows"
                | "next object ID"
                | "number of objects"
                | "object ID"
                | "object length"
        ) || field.span.end == side.bytes.len()
            || matches!(field.value, PduValue::Raw([]) | PduValue::Registers([]));
        if !is_header {
            write!(line, "{separator}{}", field.value)?;
            separator = " · ";
        }
    }
    Ok(!separator.is_empty())
}

/// Writes function code and register in the shorthand of the trade, such as `FC03 0x2600 ×4`.
fn function_and_register(row: &Transaction<'_>) -> String {
    let mut text = function(row.function);
    if let Some(register) = row.start_register {
        let _ = write!(text, " 0x{register:04x}");
    }
    if let Some(quantity) = row.quantity {
        let _ = write!(text, " ×{quantity}");
    }
    text
}

fn function(code: FunctionCode) -> String {
    let mark = if code.is_exception() { "!" } else { "" };
    format!("FC{:02}{mark}", code.without_exception().0)
}

fn arrow(role: Role) -> char {
    match role {
        Role::Request => '→',
        Role::Response => '←',
        Role::Unknown => '·',
    }
}

/// Writes a length of time in milliseconds with its error, such as `18.4 ±0.3 ms`.
fn latency(span: Option<Span>) -> String {
    let ms = |ns: i64| ns as f64 / MILLISECOND as f64;
    match span {
        Some(span) => format!("{:.1} ±{:.1} ms", ms(span.midpoint()), ms(span.half_width())),
        None => String::new(),
    }
}

/// Returns what all ids begin with, up to and with a hyphen.
fn common_prefix<'a>(ids: &[&'a str]) -> &'a str {
    let Some(first) = ids.first() else { return "" };
    let end = first.find('-').map_or(0, |hyphen| hyphen + 1);
    let prefix = &first[..end];
    if ids.iter().all(|id| id.len() > end && id.starts_with(prefix)) { prefix } else { "" }
}
