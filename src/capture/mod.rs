//! Recordings: what they are, told apart by content, and their bytes, read by read.
//!
//! Knows bytes and times, no Modbus. Memory stays flat whatever the length of the recording.

mod directive;
mod error;
mod hex_bus;
mod hex_comment;
mod hex_line;
mod hex_text;
mod instant;
mod interface_name;
pub mod mcap;
mod origin;
mod pcap;
mod raw;
mod reader;
mod rtac;
mod table;
mod window;

use std::fs::File;
use std::io;
use std::path::Path;

use self::mcap::{BusSettings, Facts, Recording};
use crate::decode::chunk::{Chunk, Lost};
use crate::line::LineSettings;
use crate::time::Timestamp;
pub use error::InputError;
pub use hex_bus::{hex_bus, hex_silence};
pub use hex_comment::hex_lost;
pub use hex_line::{hex_heading, hex_line};
pub use hex_text::HexError;
use hex_text::HexText;
use origin::{Origin, PREFIX, is_mcap, is_text};
use pcap::Pcap;
use raw::Raw;
use reader::{Failure, ReadChunks};
pub use reader::{Malformed, TimesBack};
use table::Table;

/// What the bus of an input is called that names none.
pub const BUS: &str = "bus0";

/// Names the formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputFormat {
    /// A recording in MCAP.
    Mcap,
    /// Hex text: a line a read, with or without a time.
    Hex,
    /// The bytes themselves, without times.
    Raw,
    /// pcapng or pcap: a packet a read.
    Pcap,
    /// A table of bytes with their times, as logic analysers export it.
    Table,
}

/// Is what comes next in an input.
#[derive(Clone, Copy, Debug)]
pub enum Item<'a> {
    /// The settings of a bus from here on; decoding starts afresh.
    Line(&'a BusSettings),
    /// The bytes of one read.
    Chunk {
        /// The bus.
        bus: &'a str,
        /// The bytes.
        chunk: Chunk<'a>,
        /// When the bytes were first there to be read, where that is known.
        ready: Option<Timestamp>,
    },
    /// Bytes are missing.
    Lost {
        /// The bus.
        bus: &'a str,
        /// How, and how many.
        lost: Lost,
    },
    /// Nothing was received until then, and that decided something while the bus was live.
    Silence {
        /// The bus.
        bus: &'a str,
        /// The time of the poll that came back empty.
        until: Timestamp,
    },
    /// What both clocks of the host showed, beside the anchor that a session begins with.
    Clock {
        /// The monotonic clock, in nanoseconds.
        monotonic_ns: u64,
        /// The wall clock.
        realtime: Timestamp,
    },
    /// Somebody noted something.
    Note {
        /// The time of the traffic that it is about, where that is known.
        time: Option<Timestamp>,
        /// What was noted.
        text: &'a str,
    },
}

impl<'a> Item<'a> {
    /// Returns the bus it is about; clocks and notes are about none.
    pub fn bus(&self) -> Option<&'a str> {
        match *self {
            Item::Line(settings) => Some(&settings.name),
            Item::Chunk { bus, .. } | Item::Lost { bus, .. } | Item::Silence { bus, .. } => Some(bus),
            Item::Clock { .. } | Item::Note { .. } => None,
        }
    }
}

/// Is what reads an input.
enum Reader {
    /// A format that holds bytes, and little else.
    Plain(Box<dyn ReadChunks + Send>),
    Mcap(Box<Recording>),
}

/// Reads one recording, an item at a time.
pub struct Input {
    name: String,
    size: Option<u64>,
    format: InputFormat,
    reader: Reader,
    /// Whether the next chunk has been read already.
    ahead: bool,
    misread: Option<HexError>,
    /// Whether bytes of a bus were read.
    has_bytes: bool,
    /// Whether it begins as no MCAP file does, and is to be read as one all the same.
    is_forced: bool,
}

impl Input {
    /// Opens a file, or standard input for `-`; `format` overrides what the content looks like.
    ///
    /// # Errors
    /// When it cannot be opened, is a directory or empty, an MCAP file of something else, or its first line is no hex
    /// text. That an MCAP file is empty may show only at its end.
    pub fn open(path: &Path, format: Option<InputFormat>) -> Result<Input, InputError> {
        if path.as_os_str() == "-" {
            #[expect(clippy::disallowed_methods, reason = "standard input is one of the inputs")]
            let stdin = io::stdin();
            return Input::new("standard input".to_owned(), None, Origin::Stream(Box::new(stdin)), format);
        }
        let name = path.display().to_string();
        let io_error = |error| InputError::Io { name: name.clone(), error };
        #[expect(clippy::disallowed_methods, reason = "recordings are files")]
        let file = File::open(path).map_err(io_error)?;
        let metadata = file.metadata().map_err(io_error)?;
        if metadata.is_dir() {
            return Err(InputError::Directory(name));
        }
        let size = metadata.is_file().then_some(metadata.len());
        // What can be sought is read by its index.
        let origin = if size.is_some() { Origin::File(file) } else { Origin::Stream(Box::new(file)) };
        Input::new(name, size, origin, format)
    }

    /// Looks whether there is such a file, without opening it: a pipe can be opened but once.
    ///
    /// # Errors
    /// When there is none, or it is a directory.
    pub fn check(path: &Path) -> Result<(), InputError> {
        let name = path.display().to_string();
        if path.as_os_str() == "-" {
            return Ok(());
        }
        match path.metadata() {
            Ok(metadata) if metadata.is_dir() => Err(InputError::Directory(name)),
            Ok(_) => Ok(()),
            Err(error) => Err(InputError::Io { name, error }),
        }
    }

    fn new(
        name: String,
        size: Option<u64>,
        mut origin: Origin,
        format: Option<InputFormat>,
    ) -> Result<Input, InputError> {
        let io_error = |error| InputError::Io { name: name.clone(), error };
        let mut misread = None;
        let mut is_forced = false;
        let format = match format {
            Some(InputFormat::Mcap) => {
                let prefix;
                (prefix, origin) = origin.prefix().map_err(io_error)?;
                is_forced = !prefix.is_empty() && !is_mcap(&prefix);
                InputFormat::Mcap
            }
            Some(format) => format,
            None => {
                let prefix;
                (prefix, origin) = origin.prefix().map_err(io_error)?;
                if is_mcap(&prefix) {
                    InputFormat::Mcap
                } else if pcap::is_pcap(&prefix) {
                    InputFormat::Pcap
                } else if table::is_table(&prefix) {
                    InputFormat::Table
                } else if let Some(error) = hex_text::problem_in(&prefix) {
                    let is_text = is_text(&prefix);
                    if is_text && (error.is_time() || hex_text::is_hex_alike(&prefix)) {
                        return Err(InputError::Hex { name, error });
                    }
                    misread = is_text.then_some(error);
                    InputFormat::Raw
                } else {
                    InputFormat::Hex
                }
            }
        };
        let reader = match format {
            InputFormat::Hex => Reader::Plain(Box::new(HexText::new(origin.stream()))),
            InputFormat::Raw => Reader::Plain(Box::new(Raw::new(origin.stream()))),
            InputFormat::Pcap => Reader::Plain(Box::new(Pcap::new(origin.stream()))),
            InputFormat::Table => Reader::Plain(Box::new(Table::new(origin.stream()))),
            InputFormat::Mcap => Reader::Mcap(Box::new(match origin {
                Origin::File(file) => Recording::from_file(file).map_err(io_error)?,
                Origin::Stream(stream) => Recording::from_stream(stream),
            })),
        };
        let mut input =
            Input { name, size, format, reader, ahead: false, misread, has_bytes: false, is_forced };
        // The first chunk is read ahead: an empty input is an error, and line settings stand before it.
        match &mut input.reader {
            Reader::Plain(reader) => match reader.advance() {
                Ok(true) => {
                    input.ahead = true;
                    Ok(input)
                }
                Ok(false) => Err(InputError::Empty(input.name)),
                Err(failure) => Err(input.error(failure)),
            },
            Reader::Mcap(_) => input.foreign().map_or(Ok(input), Err),
        }
    }

    /// Returns the error that a file holds something else, if that is known.
    fn foreign(&self) -> Option<InputError> {
        let topics = self.recording()?.foreign_topics()?;
        if topics.is_empty() && self.is_forced {
            return Some(InputError::NotMcap(self.name.clone()));
        }
        // What ends before its first channel may have been about to become anything.
        if topics.is_empty() && self.facts().is_some_and(|facts| !facts.is_indexed) {
            return None;
        }
        let mut has: Vec<String> =
            topics.iter().map(|(topic, schema)| format!("{topic} ({schema})")).collect();
        has.sort();
        has.truncate(5);
        let more = topics.len().saturating_sub(has.len());
        let has = match (has.is_empty(), more) {
            (true, _) => "no channels at all".to_owned(),
            (_, 0) => has.join(", "),
            _ => format!("{} and {more} more", has.join(", ")),
        };
        Some(InputError::Foreign { name: self.name.clone(), has })
    }

    /// Returns the error that there is not a byte of a bus, with the reason as far as it is known.
    fn nothing(&self) -> InputError {
        let name = self.name.clone();
        if let Some(foreign) = self.foreign() {
            return foreign;
        }
        match self.facts() {
            Some(facts) if facts.undefined_messages > 0 => {
                InputError::Undefined { name, messages: facts.undefined_messages }
            }
            Some(facts) if facts.ends_early() => InputError::CutShort(name),
            Some(Facts { damage, .. }) if !damage.is_empty() => InputError::Lost { name, damage: damage[0] },
            Some(_) => InputError::Silent(name),
            None => InputError::Empty(name),
        }
    }

    fn error(&self, failure: Failure) -> InputError {
        let name = self.name.clone();
        match failure {
            Failure::Io(error) => InputError::Io { name, error },
            Failure::Hex(error) => InputError::Hex { name, error },
            Failure::Malformed(error) => InputError::Malformed { name, error },
        }
    }

    /// Returns what comes next, or `None` at the end; of a file that is followed, `None` while nothing is there.
    ///
    /// # Errors
    /// As [`Input::advance`].
    pub fn next_item(&mut self) -> Result<Option<Item<'_>>, InputError> {
        Ok(if self.advance()? { Some(self.item()) } else { None })
    }

    /// Goes on to the next item; tells whether there is one.
    ///
    /// # Errors
    /// When the system cannot read on, hex text cannot be understood, or an MCAP file ends without a byte of a bus.
    pub fn advance(&mut self) -> Result<bool, InputError> {
        let more = match &mut self.reader {
            Reader::Plain(_) if std::mem::take(&mut self.ahead) => Ok(true),
            Reader::Plain(reader) => reader.advance(),
            Reader::Mcap(recording) => recording.advance().map_err(Failure::Io),
        };
        let more = more.map_err(|failure| self.error(failure))?;
        if more {
            self.has_bytes = self.has_bytes || matches!(self.item(), Item::Chunk { .. });
        } else if self.is_finished() && !self.has_bytes {
            return Err(self.nothing());
        }
        Ok(more)
    }

    /// Returns the bus of the read gone on to, where the item is one and the input can hand out several at once.
    #[inline]
    pub fn bus_of_read(&self) -> Option<&str> {
        self.recording()?.bus_of_read()
    }

    /// Hands out the read gone on to and those after it in its message, each with when its bytes were first there.
    ///
    /// `take` tells whether it wants more; the last read it got is then the one gone on to.
    #[inline]
    pub fn each_read(&mut self, take: impl FnMut(Chunk<'_>, Option<Timestamp>) -> bool) {
        if let Reader::Mcap(recording) = &mut self.reader {
            recording.each_read(take);
        }
    }

    /// Returns the item gone on to.
    pub fn item(&self) -> Item<'_> {
        match &self.reader {
            Reader::Plain(reader) => {
                let bus = reader.bus();
                if let Some(settings) = reader.settings() {
                    return Item::Line(settings);
                }
                match (reader.lost(), reader.silence()) {
                    (Some(lost), _) => Item::Lost { bus, lost },
                    (None, Some(until)) => Item::Silence { bus, until },
                    (None, None) => Item::Chunk { bus, chunk: reader.chunk(), ready: None },
                }
            }
            Reader::Mcap(recording) => recording.item(),
        }
    }

    /// Returns the next read of whatever bus, or `None` at the end; passes over what is none.
    ///
    /// # Errors
    /// As [`Input::advance`].
    pub fn next_chunk(&mut self) -> Result<Option<Chunk<'_>>, InputError> {
        loop {
            if !self.advance()? {
                return Ok(None);
            }
            if matches!(self.item(), Item::Chunk { .. }) {
                break;
            }
        }
        let Item::Chunk { chunk, .. } = self.item() else { return Ok(None) };
        Ok(Some(chunk))
    }

    /// Waits at the end for the input to grow; tells whether it can: only recordings in MCAP say where they end.
    pub fn follow(&mut self) -> bool {
        if let Reader::Mcap(recording) = &mut self.reader {
            recording.follow();
        }
        matches!(self.reader, Reader::Mcap(_))
    }

    /// Returns where to go on later; `None` while that is no place for it, and where it never is.
    pub fn place(&self) -> Option<mcap::Place> {
        self.recording()?.place()
    }

    /// Goes on from a place in the same file.
    ///
    /// # Errors
    /// When the system cannot go there.
    pub fn go(&mut self, place: &mcap::Place) -> Result<(), InputError> {
        let Reader::Mcap(recording) = &mut self.reader else { return Ok(()) };
        self.has_bytes = true;
        recording.go(place).map_err(|error| self.error(Failure::Io(error)))
    }

    /// Reads only what leads up to a time, as [`Recording::start_near`]; tells whether it does.
    pub fn start_near(&mut self, time: Timestamp, bytes: u64) -> bool {
        let Reader::Mcap(recording) = &mut self.reader else { return false };
        let is_near = recording.start_near(time, bytes);
        self.has_bytes |= is_near;
        is_near
    }

    /// Returns the first and the last time of a recording whose index says them.
    pub fn times(&self) -> Option<(Timestamp, Timestamp)> {
        self.recording()?.times()
    }

    /// Tells whether the input has come to its end.
    pub fn is_finished(&self) -> bool {
        self.recording().is_none_or(Recording::is_finished)
    }

    /// Goes on with the streams of an earlier input, if this one is a later part of its session; tells whether it is.
    pub fn continue_after(&mut self, earlier: &Input) -> bool {
        let Reader::Mcap(recording) = &mut self.reader else { return false };
        let Some(before) = earlier.recording() else { return false };
        let continues = recording.continue_after(before);
        // The last part of a session may hold nothing but what silence decided.
        self.has_bytes |= continues && earlier.has_bytes;
        continues
    }

    fn recording(&self) -> Option<&Recording> {
        match &self.reader {
            Reader::Mcap(recording) => Some(recording),
            Reader::Plain(_) => None,
        }
    }

    /// Returns what a recording in MCAP says beside its bytes, as far as it was read.
    pub fn facts(&self) -> Option<&Facts> {
        self.recording().map(Recording::facts)
    }

    /// Tells whether the next chunk has to be waited for: a good moment to show what is there.
    pub fn is_drained(&self) -> bool {
        match &self.reader {
            Reader::Plain(reader) => !self.ahead && reader.is_drained(),
            Reader::Mcap(recording) => recording.is_drained(),
        }
    }

    /// Returns the name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the size in bytes, where it is known beforehand.
    pub fn size(&self) -> Option<u64> {
        self.size
    }

    /// Returns the format it is read as.
    pub fn format(&self) -> InputFormat {
        self.format
    }

    /// Returns how many bytes of the file have been read.
    pub fn position(&self) -> u64 {
        match &self.reader {
            Reader::Plain(reader) => reader.position(),
            Reader::Mcap(recording) => recording.position(),
        }
    }

    fn plain(&self) -> Option<&dyn ReadChunks> {
        match &self.reader {
            Reader::Plain(reader) => Some(&**reader),
            Reader::Mcap(_) => None,
        }
    }

    /// Returns the line settings that the recording names before its first byte; those in MCAP have items for them.
    pub fn line(&self) -> Option<LineSettings> {
        self.plain()?.line()
    }

    /// Takes in the line settings that are used: some formats time the start of a byte, not its end.
    pub fn use_line(&mut self, line: LineSettings) {
        if let Reader::Plain(reader) = &mut self.reader {
            reader.use_line(line);
        }
    }

    /// Returns the longest time a byte was kept back before it was timed, in nanoseconds, where it is known.
    pub fn adapter_hold_ns(&self) -> Option<i64> {
        self.plain()?.adapter_hold_ns()
    }

    /// Returns where times go back, as far as the input has been read.
    pub fn times_back(&self) -> Option<TimesBack> {
        self.plain()?.times_back()
    }

    /// Returns where an import ends within something, once it was read up to there.
    pub fn cut(&self) -> Option<&Malformed> {
        self.plain()?.cut()
    }

    /// Returns why an input that is text was taken for raw bytes: likely a slip in hex text.
    pub fn misread(&self) -> Option<&HexError> {
        self.misread.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn open(content: &[u8], format: Option<InputFormat>) -> Result<Input, InputError> {
        Input::new("it".into(), None, Origin::Stream(Box::new(Cursor::new(content.to_vec()))), format)
    }

    fn is_hex(content: &[u8]) -> bool {
        open(content, None).is_ok_and(|input| input.format == InputFormat::Hex)
    }

    #[test]
    fn hex_text_is_told_from_raw_bytes_by_content() {
        assert!(is_hex(b"01 03 26 00\n"));
        assert!(is_hex(b"# only later\n\n0103"));
        assert!(!is_hex(b"\x01\x03\x26\x00\x00\x04\x4f\x41"));
        assert!(!is_hex(b"#\x03\x00\x00\x00\x01\x4f\x41"), "unit 35 is no comment");
        assert!(!is_hex(b"hello world"));
    }

    #[test]
    fn only_the_first_4_kib_decide_and_a_line_cut_there_does_not_count() {
        let mut long = b"01 03 26 00 00 04 4f 41\n".repeat(200);
        assert!(is_hex(&long), "the 4 KiB end within a byte");
        long.extend_from_slice(b"rubbish\n");
        assert!(is_hex(&long));
        assert!(is_hex(&b"0103".repeat(5000)), "one long line");
        for cut in 1..30 {
            let line = "[2026-01-01T00:00:00.5+00:00] rx \\x01 0x03\n";
            let text = " ".repeat(PREFIX as usize - cut) + line;
            assert!(is_hex(text.as_bytes()), "{:?}", &line[..cut]);
        }
        let mut early = b"rubbish\n".to_vec();
        early.extend_from_slice(&long);
        assert!(!is_hex(&early));
        assert!(!is_hex(&[1, 3, 0, 0].repeat(5000)), "no newline in it");
        assert!(!is_hex(&b"\n\x01\x03\x00\x00".repeat(5000)));
    }

    #[test]
    fn text_that_is_no_hex_text_is_raw_but_said() {
        let input = open(b"01 03 26 0G\n", None).expect("raw bytes");
        assert_eq!(input.misread().map(|error| (error.line, error.column)), Some((1, 10)));
        assert!(open(b"\x01\x03", None).expect("raw bytes").misread().is_none());
    }

    #[test]
    fn an_input_without_a_byte_is_empty_whatever_its_format() {
        for content in [&b""[..], b"\n\n", b"# nothing\n", b"2026-01-01T00:00:00Z\n"] {
            assert!(matches!(open(content, None), Err(InputError::Empty(_))), "{content:?}");
        }
        assert!(matches!(open(b"", Some(InputFormat::Raw)), Err(InputError::Empty(_))));
    }

    #[test]
    fn mcap_is_recognised_by_its_magic_one_wrong_byte_or_none_unless_overridden() {
        let is_mcap = |content: &[u8], format| {
            open(content, format).is_ok_and(|input| input.format == InputFormat::Mcap)
        };
        assert!(is_mcap(b"\x89MCAP0\r\n....", None));
        assert!(is_mcap(b"\x89MCAQ0\r\n....", None));
        assert!(!is_mcap(b"\x89MCAQ1\r\n....", None));
        assert!(!is_mcap(b"\x89MCAP0\r\n....", Some(InputFormat::Raw)));
    }

    #[test]
    fn mcap_without_a_byte_of_a_bus_is_an_error_at_its_end() {
        let mut input = open(b"\x89MCAP0\r\n", None).expect("MCAP");
        assert!(matches!(input.next_item(), Err(InputError::CutShort(_))));
    }

    #[test]
    fn the_override_reads_digits_as_raw_bytes() {
        let mut input = open(b"0103", Some(InputFormat::Raw)).expect("raw bytes");
        assert_eq!(input.next_chunk().expect("readable").expect("a chunk").bytes, b"0103");
    }
}
