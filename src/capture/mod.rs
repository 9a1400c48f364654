//! Recordings: what they are, told apart by content, and their bytes, read by read.
//!
//! Knows bytes and times, no Modbus. Memory stays flat whatever the length of the recording.

mod directive;
mod hex_line;
mod hex_text;
mod instant;
mod pcap;
mod raw;
mod reader;
mod rtac;
mod table;
mod window;

use std::fs::File;
use std::io::{self, Cursor, Read};
use std::path::Path;

use thiserror::Error;

use crate::decode::chunk::Chunk;
use crate::line::LineSettings;
pub use hex_line::{hex_heading, hex_line};
pub use hex_text::HexError;
use hex_text::HexText;
use pcap::Pcap;
use raw::Raw;
use reader::{Failure, ReadChunks};
pub use reader::{Malformed, TimesBack};
use table::Table;

/// The first bytes of every MCAP file (MCAP specification, "Magic").
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// How much of an input decides what it is, in bytes.
const PREFIX: u64 = 4096;

/// Names the formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputFormat {
    /// MCAP, which this version cannot read.
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

/// Says why an input could not be read; `hint` says what to do about it.
#[derive(Debug, Error)]
pub enum InputError {
    /// The system refused to open or to read it.
    #[error("cannot read '{name}': {error}")]
    Io {
        /// The input's name.
        name: String,
        /// What the system said.
        error: io::Error,
    },
    /// It is a directory.
    #[error("cannot read '{0}': it is a directory")]
    Directory(String),
    /// It is an MCAP recording, which this version cannot read.
    #[error("'{0}' is an MCAP recording, and this version of rtutap cannot read those yet")]
    Mcap(String),
    /// It holds no byte of a bus.
    #[error("'{0}' is empty: there is not a byte in it")]
    Empty(String),
    /// It is hex text with something in it that is not.
    #[error("'{name}', {error}")]
    Hex {
        /// The input's name.
        name: String,
        /// Where and what.
        error: HexError,
    },
    /// It is an import with something in it that cannot be understood.
    #[error("'{name}', {error}")]
    Malformed {
        /// The input's name.
        name: String,
        /// Where and what.
        error: Malformed,
    },
}

impl InputError {
    /// Returns what could be done about it.
    pub fn hint(&self) -> &'static str {
        match self {
            InputError::Io { error, .. } => match error.kind() {
                io::ErrorKind::NotFound => "check the path; '-' reads standard input",
                io::ErrorKind::PermissionDenied => "check who may read the file",
                _ => "check that the file can be read to its end",
            },
            InputError::Directory(_) => "name the recordings in it, such as DIRECTORY/*",
            InputError::Mcap(_) => "give hex text or raw bytes",
            InputError::Empty(_) => "check that the recording was written; comments and times alone are none",
            InputError::Hex { error, .. } => error.hint(),
            InputError::Malformed { error, .. } => error.hint,
        }
    }
}

/// Reads one recording, a chunk at a time.
pub struct Input {
    name: String,
    size: Option<u64>,
    format: InputFormat,
    reader: Box<dyn ReadChunks>,
    /// Whether the next chunk has been read already.
    ahead: bool,
    misread: Option<HexError>,
}

impl Input {
    /// Opens a file, or standard input for `-`; `format` overrides what the content looks like.
    ///
    /// # Errors
    /// When it cannot be opened, is a directory, MCAP or empty, or its first line is no hex text.
    pub fn open(path: &Path, format: Option<InputFormat>) -> Result<Input, InputError> {
        if path.as_os_str() == "-" {
            #[expect(clippy::disallowed_methods, reason = "standard input is one of the inputs")]
            let stdin = io::stdin();
            return Input::new("standard input".to_owned(), None, Box::new(stdin), format);
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
        Input::new(name, size, Box::new(file), format)
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
        mut source: Box<dyn Read>,
        format: Option<InputFormat>,
    ) -> Result<Input, InputError> {
        let mut misread = None;
        let (source, format) = match format {
            Some(format) => (source, format),
            None => {
                let mut prefix = Vec::new();
                let taken = (&mut source).take(PREFIX).read_to_end(&mut prefix);
                taken.map_err(|error| InputError::Io { name: name.clone(), error })?;
                if prefix.starts_with(MCAP_MAGIC) {
                    return Err(InputError::Mcap(name));
                }
                let format = if pcap::is_pcap(&prefix) {
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
                };
                (Box::new(Cursor::new(prefix).chain(source)) as Box<dyn Read>, format)
            }
        };
        let reader: Box<dyn ReadChunks> = match format {
            InputFormat::Mcap => return Err(InputError::Mcap(name)),
            InputFormat::Hex => Box::new(HexText::new(source)),
            InputFormat::Raw => Box::new(Raw::new(source)),
            InputFormat::Pcap => Box::new(Pcap::new(source)),
            InputFormat::Table => Box::new(Table::new(source)),
        };
        let mut input = Input { name, size, format, reader, ahead: false, misread };
        // The first chunk is read ahead: an empty input is an error, and line settings stand before it.
        match input.reader.advance() {
            Ok(true) => {
                input.ahead = true;
                Ok(input)
            }
            Ok(false) => Err(InputError::Empty(input.name)),
            Err(failure) => Err(input.error(failure)),
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

    /// Returns the next read, or `None` at the end.
    ///
    /// # Errors
    /// When the system cannot read on, or hex text cannot be understood.
    pub fn next_chunk(&mut self) -> Result<Option<Chunk<'_>>, InputError> {
        let more = std::mem::take(&mut self.ahead) || self.reader.advance().map_err(|f| self.error(f))?;
        Ok(more.then(|| self.reader.chunk()))
    }

    /// Tells whether the next chunk has to be waited for: a good moment to show what is there.
    pub fn is_drained(&self) -> bool {
        !self.ahead && self.reader.is_drained()
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
        self.reader.position()
    }

    /// Returns the line settings that the recording names before its first byte.
    pub fn line(&self) -> Option<LineSettings> {
        self.reader.line()
    }

    /// Takes in the line settings that are used: some formats time the start of a byte, not its end.
    pub fn use_line(&mut self, line: LineSettings) {
        self.reader.use_line(line);
    }

    /// Returns the longest time a byte was kept back before it was timed, in nanoseconds, where it is known.
    pub fn adapter_hold_ns(&self) -> Option<i64> {
        self.reader.adapter_hold_ns()
    }

    /// Returns where times go back, as far as the input has been read.
    pub fn times_back(&self) -> Option<TimesBack> {
        self.reader.times_back()
    }

    /// Returns why an input that is text was taken for raw bytes: likely a slip in hex text.
    pub fn misread(&self) -> Option<&HexError> {
        self.misread.as_ref()
    }
}

/// Tells whether bytes are printable ASCII and white space: a Modbus frame never is, for its function code.
fn is_text(bytes: &[u8]) -> bool {
    bytes.iter().all(|byte| matches!(byte, b' '..=b'~' | b'\t' | b'\r' | b'\n'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(content: &[u8], format: Option<InputFormat>) -> Result<Input, InputError> {
        Input::new("it".into(), None, Box::new(Cursor::new(content.to_vec())), format)
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
    fn mcap_is_recognised_unless_overridden() {
        assert!(matches!(open(b"\x89MCAP0\r\n....", None), Err(InputError::Mcap(_))));
        assert!(open(b"\x89MCAP0\r\n....", Some(InputFormat::Raw)).is_ok());
    }

    #[test]
    fn the_override_reads_digits_as_raw_bytes() {
        let mut input = open(b"0103", Some(InputFormat::Raw)).expect("raw bytes");
        assert_eq!(input.next_chunk().expect("readable").expect("a chunk").bytes, b"0103");
    }
}
