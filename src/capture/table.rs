//! Tables of bytes with their times, as logic analysers export them (CSV, with a header).
//!
//! Saleae Logic 2 writes `name,type,start_time,duration,data,error`, Logic 1 and KingstVIS
//! `Time [s],Value,Parity Error,Framing Error`, DSView of the sigrok family `Id,Time[ns],1:UART: RX/TX`. A time
//! is that of the start bit; the byte ends after its duration, or a character of the line settings.

mod columns;
mod decimal;

use std::io::Read;

use super::instant::{self, OUT_OF_RANGE};
use super::reader::{Failure, Forward, Malformed, ReadChunks, TimesBack};
use super::window::Window;
use crate::decode::chunk::{Chunk, LineError, LineErrorKind, ReadTime};
use crate::line::LineSettings;
use crate::time::Timestamp;
use columns::{Columns, Row};

/// How much of a table is held at once, in bytes: the longest row.
const WINDOW: usize = 64 * 1024;
/// 2000-01-01T00:00:00Z, where times are counted from that begin with the capture or its trigger.
const ORIGIN: i64 = 946_684_800;
/// Seconds from which on a time is taken to count from the Unix epoch: 2001, or 31 years after a trigger.
const UNIX: i64 = 1_000_000_000;

const HEADER: &str = "the first line names the columns, among them one of times (start_time, Time [s]) and one of bytes (data, Value)";
const CELL: &str = "export bytes as hexadecimal, such as 0x4F; times in seconds, or as RFC 3339";

/// Tells whether an input begins with the header of a table.
pub(super) fn is_table(prefix: &[u8]) -> bool {
    let mut table = Table::new(prefix);
    while table.columns.is_none() {
        // Only comments and empty lines may stand before the header.
        let Ok(Some(_)) = table.row() else { return false };
    }
    true
}

/// Reads a table, a byte at a time.
pub(super) struct Table<R> {
    window: Window<R>,
    line_number: u64,
    columns: Option<Columns>,
    /// From when times are counted, in seconds since the Unix epoch; the first time decides.
    origin: Option<i64>,
    forward: Forward,
    character_ns: i64,
    byte: Byte,
    /// The byte after it: what comes between may be about the one before.
    ahead: Option<Byte>,
    /// What went wrong after it.
    failure: Option<Failure>,
}

/// Is a byte of the table.
#[derive(Clone, Copy, Debug, Default)]
struct Byte {
    time: Timestamp,
    /// Whether the time is that of its start bit, not its end.
    starts: bool,
    value: [u8; 1],
    error: Option<LineError>,
}

/// Is what a line of the table says.
enum Entry {
    /// The header, a comment, or something that is no byte.
    Nothing,
    Byte(Byte),
    /// Something was wrong with the byte before.
    Error(LineErrorKind),
}

impl<R: Read> Table<R> {
    pub(super) fn new(source: R) -> Self {
        Table {
            window: Window::new(source, WINDOW),
            line_number: 0,
            columns: None,
            origin: None,
            forward: Forward::new("line"),
            character_ns: LineSettings::default().character_ns(),
            byte: Byte::default(),
            ahead: None,
            failure: None,
        }
    }

    /// Reads a line; `None` at the end.
    fn row(&mut self) -> Result<Option<Entry>, Failure> {
        let Some((length, is_whole)) = self.window.line()? else { return Ok(None) };
        self.line_number += 1;
        if !is_whole {
            return Err(malformed(self.line_number, None, format!("more than {WINDOW} bytes"), HEADER));
        }
        let text = &self.window.data()[..length];
        let text = text.strip_suffix(b"\r").unwrap_or(text);
        let entry = if text.trim_ascii().is_empty() || text.starts_with(b"#") {
            Ok(Entry::Nothing)
        } else if let Some(columns) = &mut self.columns {
            let row = columns.row(text);
            read(&row, &mut self.origin)
        } else {
            self.columns = Columns::find(text);
            let problem = || (None, "no header with a column of times and one of bytes".to_owned(), HEADER);
            self.columns.is_some().then_some(Entry::Nothing).ok_or_else(problem)
        };
        let line = self.line_number;
        let entry = entry.map_err(|(column, problem, hint)| malformed(line, column, problem, hint))?;
        self.window.consume(length + 1);
        Ok(Some(match entry {
            Entry::Byte(byte) => {
                Entry::Byte(Byte { time: self.forward.forward(byte.time, self.line_number), ..byte })
            }
            other => other,
        }))
    }
}

fn malformed(line: u64, column: Option<&str>, problem: String, hint: &'static str) -> Failure {
    let place = match column {
        Some(name) => format!("line {line}, column '{name}'"),
        None => format!("line {line}"),
    };
    Failure::Malformed(Malformed { place, problem, hint })
}

type Wrong<'a> = (Option<&'a str>, String, &'static str);

/// Reads a row; the first time decides from when times are counted.
fn read<'a>(row: &Row<'a>, origin: &mut Option<i64>) -> Result<Entry, Wrong<'a>> {
    if row.kind().is_some_and(|kind| !kind.eq_ignore_ascii_case(b"data")) {
        return Ok(Entry::Nothing);
    }
    let (name, cell) = row.data();
    let value = match byte(cell) {
        Some(value) => value,
        None => {
            return match annotation(cell) {
                Some(Some(kind)) => Ok(Entry::Error(kind)),
                Some(None) => Ok(Entry::Nothing),
                None => Err((Some(name), format!("'{}' is not a byte", cell.escape_ascii()), CELL)),
            };
        }
    };
    let (time, starts) = time(row, origin)?;
    let error = row.has_error().then_some(LineError { offset: 0, kind: LineErrorKind::ParityOrFraming });
    Ok(Entry::Byte(Byte { time, starts, value: [value], error }))
}

/// Reads a byte: two hex digits, after `0x` or in brackets or alone.
fn byte(cell: &[u8]) -> Option<u8> {
    let digits = match cell {
        [b'0', b'x' | b'X', digits @ ..] => digits,
        [b'[', digits @ .., b']'] => digits,
        digits => digits,
    };
    let digits = <[u8; 2]>::try_from(digits).ok()?;
    let value = |digit: u8| char::from(digit).to_digit(16);
    u8::try_from(value(digits[0])? << 4 | value(digits[1])?).ok()
}

/// Knows what sigrok's UART decoder says beside bytes: what it says of the byte before, if anything.
fn annotation(cell: &[u8]) -> Option<Option<LineErrorKind>> {
    match &cell.to_ascii_lowercase()[..] {
        b"" | b"start bit" | b"stop bit" | b"parity bit" | b"idle" => Some(None),
        b"parity error" | b"frame error" => Some(Some(LineErrorKind::ParityOrFraming)),
        b"break condition" => Some(Some(LineErrorKind::Break)),
        _ => None,
    }
}

/// Reads when a byte ended, or when it began if the row does not say how long it lasted.
fn time<'a>(row: &Row<'a>, origin: &mut Option<i64>) -> Result<(Timestamp, bool), Wrong<'a>> {
    let (name, cell, decimals) = row.time();
    let wrong = |problem: String| (Some(name), problem, CELL);
    let attoseconds = if cell.get(..5).is_some_and(|head| head.ends_with(b"-")) && cell[0] != b'-' {
        let (time, length) = match instant::read(cell) {
            Some(read) => read.map_err(|error| wrong(error.what.to_owned()))?,
            None => return Err(wrong(format!("'{}' is no time", cell.escape_ascii()))),
        };
        if length < cell.len() {
            return Err(wrong(format!("'{}' is no time", cell.escape_ascii())));
        }
        i128::from(time.as_ns()) * decimal::PER_NANOSECOND
    } else {
        let time = decimal::attoseconds(cell, decimals)
            .ok_or_else(|| wrong(format!("'{}' is no time", cell.escape_ascii())))?;
        let counts_from_1970 = time >= i128::from(UNIX) * decimal::PER_SECOND;
        let origin = origin.get_or_insert(if counts_from_1970 { 0 } else { ORIGIN });
        time.saturating_add(i128::from(*origin) * decimal::PER_SECOND)
    };
    let duration = match row.duration() {
        Some((_, b"", _)) | None => None,
        Some((name, cell, decimals)) => {
            let duration = decimal::attoseconds(cell, decimals).filter(|&duration| duration >= 0);
            let problem = || (Some(name), format!("'{}' is no duration", cell.escape_ascii()), CELL);
            Some(duration.ok_or_else(problem)?)
        }
    };
    let end = attoseconds.saturating_add(duration.unwrap_or(0)).div_euclid(decimal::PER_NANOSECOND);
    let end = instant::from_ns(end).ok_or_else(|| wrong(OUT_OF_RANGE.to_owned()))?;
    Ok((end, duration.is_none()))
}

impl<R: Read> ReadChunks for Table<R> {
    /// Goes on to the next byte.
    fn advance(&mut self) -> Result<bool, Failure> {
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        loop {
            match self.row() {
                Ok(None) => {
                    let last = self.ahead.take();
                    self.byte = last.unwrap_or_default();
                    return Ok(last.is_some());
                }
                Ok(Some(Entry::Nothing)) => {}
                Ok(Some(Entry::Error(kind))) => {
                    if let Some(byte) = &mut self.ahead {
                        byte.error.get_or_insert(LineError { offset: 0, kind });
                    }
                }
                Ok(Some(Entry::Byte(next))) => {
                    if let Some(byte) = self.ahead.replace(next) {
                        self.byte = byte;
                        return Ok(true);
                    }
                }
                Err(failure) => match self.ahead.take() {
                    Some(byte) => {
                        self.failure = Some(failure);
                        self.byte = byte;
                        return Ok(true);
                    }
                    None => return Err(failure),
                },
            }
        }
    }

    fn chunk(&self) -> Chunk<'_> {
        let character = if self.byte.starts { self.character_ns } else { 0 };
        Chunk {
            time: ReadTime::At(self.byte.time + character),
            bytes: &self.byte.value,
            line_errors: self.byte.error.as_slice(),
        }
    }

    fn position(&self) -> u64 {
        self.window.position()
    }

    fn is_drained(&self) -> bool {
        self.window.awaits_line()
    }

    fn use_line(&mut self, line: LineSettings) {
        self.character_ns = line.character_ns();
    }

    /// Returns 0: a logic analyser keeps nothing back.
    fn adapter_hold_ns(&self) -> Option<i64> {
        Some(0)
    }

    fn times_back(&self) -> Option<TimesBack> {
        self.forward.times_back()
    }
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
