//! Writes what `hex_text` reads.

use std::fmt::Write;

use super::directive;
use super::hex_comment::{line_errors_text, time_text};
use crate::decode::chunk::{Chunk, ReadTime};
use crate::line::LineSettings;
use crate::time::MILLISECOND;

/// Writes the comments that say how the bytes were received, as far as it is known, each with its line's end.
///
/// `is_raw` says that lines will have no times and be no reads.
pub fn hex_heading(line: Option<LineSettings>, adapter_hold_ns: Option<i64>, is_raw: bool) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    if let Some(line) = line {
        let _ = writeln!(text, "# line {line}");
    }
    if let Some(ns) = adapter_hold_ns {
        let _ = writeln!(text, "# adapter-hold {} ms", ns as f64 / MILLISECOND as f64);
    }
    if is_raw {
        let _ = writeln!(text, "# {}", directive::RAW);
    }
    text
}

/// Writes a read as a line of hex text, without the line's end: its time in UTC if it has one, then the bytes.
///
/// Line errors follow as a comment.
pub fn hex_line(chunk: &Chunk<'_>) -> String {
    let mut line = match chunk.time {
        ReadTime::At(time) => time_text(time),
        ReadTime::Unknown | ReadTime::UnknownAfterSilence => String::new(),
    };
    for byte in chunk.bytes {
        let separator = if line.is_empty() { "" } else { " " };
        let _ = write!(line, "{separator}{byte:02X}"); // writing to a string cannot fail
    }
    if !chunk.line_errors.is_empty() {
        let _ = write!(line, " {}", line_errors_text(chunk.line_errors)); // see above
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::chunk::{LineError, LineErrorKind};
    use crate::time::Timestamp;

    #[test]
    fn a_hex_line_has_nanoseconds_and_says_line_errors_in_a_comment() {
        let time = ReadTime::At(Timestamp::from_ns(1_767_225_600_123_456_789));
        let bytes = &[0x01, 0xAB];
        let good = Chunk { time, bytes, line_errors: &[] };
        assert_eq!(hex_line(&good), "2026-01-01T00:00:00.123456789Z 01 AB");
        assert_eq!(hex_line(&Chunk { time: ReadTime::Unknown, ..good }), "01 AB");
        let errors = [0, 1].map(|offset| LineError { offset, kind: LineErrorKind::ParityOrFraming });
        let commented =
            "2026-01-01T00:00:00.123456789Z 01 AB # parity-or-framing at 0, parity-or-framing at 1";
        assert_eq!(hex_line(&Chunk { line_errors: &errors, ..good }), commented);
    }
}
