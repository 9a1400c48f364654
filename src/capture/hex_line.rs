//! Writes what `hex_text` reads.

use std::fmt::Write;

use chrono::{DateTime, SecondsFormat};

use crate::decode::chunk::{Chunk, ReadTime};

/// Writes a read as a line of hex text, without the line's end: its time in UTC if it has one, then the bytes.
///
/// Line errors follow as a comment.
pub fn hex_line(chunk: &Chunk<'_>) -> String {
    let mut line = match chunk.time {
        ReadTime::At(time) => {
            DateTime::from_timestamp_nanos(time.as_ns()).to_rfc3339_opts(SecondsFormat::Nanos, true)
        }
        ReadTime::Unknown | ReadTime::UnknownAfterSilence => String::new(),
    };
    for byte in chunk.bytes {
        let separator = if line.is_empty() { "" } else { " " };
        let _ = write!(line, "{separator}{byte:02X}"); // writing to a string cannot fail
    }
    for (index, error) in chunk.line_errors.iter().enumerate() {
        let separator = if index == 0 { " #" } else { "," };
        let _ = write!(line, "{separator} {} at {}", error.kind.name(), error.offset); // see above
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
