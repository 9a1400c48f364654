//! Hex text: a line a read, optionally with the time at which its last byte had been received.
//!
//! ```text
//! # line 9600-8N1
//! # bus 'pump'
//! 2026-01-01T00:00:00.123456789Z > 01 03 26 00 00 04 4f 41   # a comment
//! [1767225600.141] rx 0x01,0x03,0x08 …
//! ```

use std::collections::BTreeMap;
use std::fmt;
use std::io::Read;

use super::BUS;
use super::directive::Directives;
use super::hex_bus;
use super::hex_comment;
use super::instant;
use super::mcap::BusSettings;
use super::reader::{Failure, Forward, ReadChunks, TimesBack};
use super::window::Window;
use crate::decode::chunk::{Chunk, LineError, Lost, ReadTime};
use crate::line::LineSettings;
use crate::time::Timestamp;

/// How much text is held at once; a longer line becomes several chunks.
const WINDOW: usize = 64 * 1024;

/// Says where hex text cannot be understood, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HexError {
    /// Counts lines from 1.
    pub line: u64,
    /// Counts bytes of the line from 1.
    pub column: u64,
    problem: Problem,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Problem {
    HalfByte(u8),
    NotHex(u8),
    PrefixAlone,
    Time(&'static str),
    NoPoint,
    AfterTime,
    Unclosed(u8),
}

impl HexError {
    /// Returns what could be done about it.
    pub fn hint(&self) -> &'static str {
        match self.problem {
            Problem::HalfByte(_) | Problem::NotHex(_) | Problem::PrefixAlone => {
                "write two hex digits a byte; '#' starts a comment; raw bytes need --input-format raw"
            }
            Problem::Time(_) | Problem::NoPoint | Problem::AfterTime | Problem::Unclosed(_) => {
                "write times like 2026-01-01T00:00:00.5Z or 1767225600.5, with a space after"
            }
        }
    }
}

impl HexError {
    /// Tells whether it is a time that is wrong.
    pub(super) fn is_time(&self) -> bool {
        matches!(self.problem, Problem::Time(_))
    }
}

/// Tells whether bytes are text of nothing but what hex text is made of, comments aside.
pub(super) fn is_hex_alike(bytes: &[u8]) -> bool {
    let is_known = |c: &u8| c.is_ascii_hexdigit() || is_separator(*c) || b"xX\\[]()<>rRtT\r".contains(c);
    bytes.split(|&c| c == b'\n').all(|line| line.iter().take_while(|&&c| c != b'#').all(is_known))
}

impl fmt::Display for HexError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}, column {}: ", self.line, self.column)?;
        match self.problem {
            Problem::HalfByte(digit) => write!(f, "'{}' is half a byte", digit.escape_ascii()),
            Problem::NotHex(c) => write!(f, "'{}' is not a hex digit", c.escape_ascii()),
            Problem::PrefixAlone => write!(f, "no byte after '0x' or '\\x'"),
            Problem::Time(what) => write!(f, "{what}"),
            Problem::NoPoint => write!(f, "the brackets hold no time; seconds need a decimal point"),
            Problem::AfterTime => write!(f, "no space after the time"),
            Problem::Unclosed(bracket) => write!(f, "no '{}' after the time", char::from(bracket)),
        }
    }
}

/// Returns why the first 4 KiB of an input are no hex text; what is only cut off at their end is.
pub(super) fn problem_in(prefix: &[u8]) -> Option<HexError> {
    let whole_lines = prefix.iter().filter(|&&c| c == b'\n').count() as u64;
    let last_line = prefix.iter().rev().take_while(|&&c| c != b'\n').count() as u64;
    let mut text = HexText::new(prefix);
    loop {
        match text.advance() {
            Ok(true) => {}
            Ok(false) | Err(Failure::Io(_) | Failure::Malformed(_)) => return None,
            Err(Failure::Hex(error)) => {
                let cut = prefix.len() as u64 >= super::PREFIX
                    && error.line > whole_lines
                    && error.column >= last_line;
                return (!cut).then_some(error);
            }
        }
    }
}

/// Reads hex text, a line at a time.
pub(super) struct HexText<R> {
    window: Window<R>,
    line_number: u64,
    rest: Option<Rest>,
    bytes: Vec<u8>,
    line_errors: Vec<LineError>,
    lost: Option<Lost>,
    silence: Option<Timestamp>,
    /// The bus of the lines below the last comment that named one.
    bus: String,
    /// What that comment says of its line.
    settings: Option<BusSettings>,
    time: ReadTime,
    forward: Forward,
    /// Those of the other buses.
    others: BTreeMap<String, Forward>,
    directives: Directives,
    begun: bool,
}

/// Is the state within a line longer than the window.
#[derive(Clone, Copy, Default)]
struct Rest {
    column: u64,
    comment: bool,
    prefix: bool,
}

impl<R: Read> HexText<R> {
    pub(super) fn new(source: R) -> Self {
        HexText {
            window: Window::new(source, WINDOW),
            line_number: 0,
            rest: None,
            bytes: Vec::new(),
            line_errors: Vec::new(),
            lost: None,
            silence: None,
            bus: BUS.to_owned(),
            settings: None,
            time: ReadTime::Unknown,
            forward: Forward::new("line"),
            others: BTreeMap::new(),
            directives: Directives::default(),
            begun: false,
        }
    }

    /// Tells whether the line has something to hand out.
    fn has_item(&self) -> bool {
        !self.bytes.is_empty()
            || !self.line_errors.is_empty()
            || self.lost.is_some()
            || self.silence.is_some()
            || self.settings.is_some()
    }

    /// Reads a line or a piece of one into `bytes` and `time`.
    fn piece(&mut self, length: usize, is_whole: bool) -> Result<(), HexError> {
        let text = &self.window.data()[..length];
        let text = if is_whole { text.strip_suffix(b"\r").unwrap_or(text) } else { text };
        let mut state = self.rest.take().unwrap_or_default();
        let mut at = 0;
        if state.column == 0 {
            self.line_number += 1;
        }
        let line = self.line_number;
        let located =
            |(offset, problem)| HexError { line, column: state.column + offset as u64 + 1, problem };
        if state.column == 0 {
            let (time, body) = head(text).map_err(located)?;
            at = body;
            let untimed =
                if self.directives.is_raw { ReadTime::Unknown } else { ReadTime::UnknownAfterSilence };
            self.time = time.map_or(untimed, ReadTime::At);
        }
        let body = body(&text[at..], !is_whole, state, &mut self.bytes);
        let body = body.map_err(|(offset, problem)| located((at + offset, problem)))?;
        if let Some(offset) = body.comment_at.filter(|_| !self.begun && self.bytes.is_empty()) {
            self.directives.read(&text[at + offset..]);
        }
        // Only of lines that fit: there is no other place to point at the bytes of a longer one.
        if let (Some(offset), true, 0) = (body.comment_at, is_whole, state.column) {
            let comment = &text[at + offset..];
            let errors = hex_comment::line_errors(comment).unwrap_or_default();
            let last = self.bytes.len();
            self.line_errors.extend(errors.into_iter().filter(|error| error.offset as usize <= last));
            if self.bytes.is_empty() {
                self.lost = hex_comment::lost(comment);
                self.silence = hex_bus::silence(comment);
                if let Some((bus, settings)) = hex_bus::bus(comment) {
                    self.settings = settings;
                    // Times go forward on each bus.
                    let forward = self.others.remove(&bus).unwrap_or_else(|| Forward::new("line"));
                    let before = std::mem::replace(&mut self.bus, bus);
                    self.others.insert(before, std::mem::replace(&mut self.forward, forward));
                }
            }
        }
        let read = at + body.read;
        if let (ReadTime::At(time), true, 0) = (self.time, self.has_item(), state.column) {
            self.time = ReadTime::At(self.forward.forward(time, self.line_number));
        }
        if is_whole {
            self.window.consume(length + 1);
        } else {
            state.column += read as u64;
            state.comment = body.comment_at.is_some();
            state.prefix = body.prefix;
            self.rest = Some(state);
            self.window.consume(read);
        }
        Ok(())
    }
}

impl<R: Read> ReadChunks for HexText<R> {
    /// Goes on to the next line with bytes, or with what its comment says.
    fn advance(&mut self) -> Result<bool, Failure> {
        self.bytes.clear();
        self.line_errors.clear();
        (self.lost, self.silence, self.settings) = (None, None, None);
        while !self.has_item() {
            let (length, is_whole) = match self.window.line()? {
                Some(piece) => piece,
                None if self.rest.is_some() => (0, true), // a line begun before has to be ended once
                None => return Ok(false),
            };
            self.piece(length, is_whole).map_err(Failure::Hex)?;
        }
        self.begun = true;
        Ok(true)
    }

    fn chunk(&self) -> Chunk<'_> {
        Chunk { time: self.time, bytes: &self.bytes, line_errors: &self.line_errors }
    }

    fn bus(&self) -> &str {
        &self.bus
    }

    fn settings(&self) -> Option<&BusSettings> {
        self.settings.as_ref()
    }

    fn silence(&self) -> Option<Timestamp> {
        self.silence
    }

    fn lost(&self) -> Option<Lost> {
        self.lost
    }

    fn is_drained(&self) -> bool {
        self.window.awaits_line()
    }

    fn position(&self) -> u64 {
        self.window.position()
    }

    fn line(&self) -> Option<LineSettings> {
        self.directives.line
    }

    fn adapter_hold_ns(&self) -> Option<i64> {
        self.directives.adapter_hold_ns
    }

    fn times_back(&self) -> Option<TimesBack> {
        TimesBack::of([&self.forward].into_iter().chain(self.others.values()))
    }
}

type Found<T> = Result<T, (usize, Problem)>;

fn is_separator(c: u8) -> bool {
    matches!(c, b' ' | b'\t' | b',' | b':')
}

/// Reads what may stand before the bytes: a time, a direction mark; returns the time and where bytes begin.
fn head(text: &[u8]) -> Found<(Option<Timestamp>, usize)> {
    let skip = |mut at: usize| {
        while text.get(at).is_some_and(|&c| is_separator(c)) {
            at += 1;
        }
        at
    };
    let mut at = skip(0);
    let closing = match text.get(at) {
        Some(b'[') => Some(b']'),
        Some(b'(') => Some(b')'),
        _ => None,
    };
    at += usize::from(closing.is_some());
    let mut time = None;
    match instant::read(&text[at..]) {
        None if closing.is_some() => {
            let digits = text[at..].iter().take_while(|c| c.is_ascii_digit()).count();
            return Err((at + digits, Problem::NoPoint));
        }
        None => {}
        Some(Err(wrong)) => return Err((at + wrong.offset, Problem::Time(wrong.what))),
        Some(Ok((read, length))) => {
            time = Some(read);
            at += length;
            match (closing, text.get(at)) {
                (Some(bracket), Some(&c)) if c == bracket => at += 1,
                (Some(bracket), _) => return Err((at, Problem::Unclosed(bracket))),
                (None, Some(&c)) if !is_separator(c) && !b"#<>".contains(&c) => {
                    return Err((at, Problem::AfterTime));
                }
                (None, _) => {}
            }
        }
    }
    at = skip(at);
    at += match text[at..] {
        [b'<' | b'>', ..] => 1,
        [b'r' | b'R' | b't' | b'T', b'x' | b'X', ..] => 2,
        _ => 0,
    };
    Ok((time, at))
}

/// Is how far the bytes of a line were read.
struct Body {
    read: usize,
    comment_at: Option<usize>,
    prefix: bool,
}

/// Reads bytes up to a comment or the end of `text`; `goes_on` when the line does.
fn body(text: &[u8], goes_on: bool, state: Rest, bytes: &mut Vec<u8>) -> Found<Body> {
    let mut prefix = state.prefix;
    let mut at = 0;
    if state.comment {
        return Ok(Body { read: text.len(), comment_at: Some(0), prefix: false });
    }
    while let Some(&c) = text.get(at) {
        let high = NIBBLE[usize::from(c)];
        let next = text.get(at + 1).copied();
        if high < 16 {
            let low = next.map_or(NO_NIBBLE, |c| NIBBLE[usize::from(c)]);
            if low < 16 {
                bytes.push(high << 4 | low);
                prefix = false;
            } else if c == b'0' && matches!(next, Some(b'x' | b'X')) {
                prefix = true;
            } else if next.is_none() && goes_on {
                break;
            } else {
                return Err((at, Problem::HalfByte(c)));
            }
            at += 2;
        } else if is_separator(c) {
            at += 1;
        } else if c == b'\\' && matches!(next, Some(b'x' | b'X')) {
            prefix = true;
            at += 2;
        } else if c == b'\\' && next.is_none() && goes_on {
            break;
        } else if c == b'#' {
            if prefix {
                return Err((at, Problem::PrefixAlone));
            }
            check_comment(&text[at..]).map_err(|(offset, problem)| (at + offset, problem))?;
            return Ok(Body { read: text.len(), comment_at: Some(at), prefix });
        } else {
            return Err((at, Problem::NotHex(c)));
        }
    }
    if prefix && !goes_on {
        return Err((at, Problem::PrefixAlone));
    }
    Ok(Body { read: at, comment_at: None, prefix })
}

/// Refuses control characters in a comment: bytes of a bus that happen to begin with '#' have them.
fn check_comment(comment: &[u8]) -> Found<()> {
    match comment.iter().position(|&c| c.is_ascii_control() && c != b'\t') {
        Some(offset) => Err((offset, Problem::NotHex(comment[offset]))),
        None => Ok(()),
    }
}

const NO_NIBBLE: u8 = 0xFF;

/// Gives each hex digit its value, and all else `NO_NIBBLE`.
const NIBBLE: [u8; 256] = {
    let mut table = [NO_NIBBLE; 256];
    let mut value = 0;
    while value < 16 {
        table[b"0123456789abcdef"[value] as usize] = value as u8;
        table[b"0123456789ABCDEF"[value] as usize] = value as u8;
        value += 1;
    }
    table
};

#[cfg(test)]
#[path = "hex_text_tests.rs"]
mod tests;
