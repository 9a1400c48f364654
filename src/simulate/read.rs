//! What the listener gets: the bytes of one `read()`.

use std::fmt::Write;

use chrono::{DateTime, SecondsFormat};

use crate::decode::chunk::LineError;
use crate::time::Timestamp;

/// Is what one `read()` of the serial port returns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Read {
    /// When the read ended.
    pub time: Timestamp,
    /// What was received; never empty.
    pub bytes: Vec<u8>,
    /// What the adapter complained about, in order of their offsets in `bytes`.
    pub line_errors: Vec<LineError>,
}

/// Writes a read as a line of hex text, without the line's end: the time in UTC, then the bytes.
///
/// Line errors follow as a comment.
pub fn hex_line(read: &Read) -> String {
    let mut line =
        DateTime::from_timestamp_nanos(read.time.as_ns()).to_rfc3339_opts(SecondsFormat::Nanos, true);
    for byte in &read.bytes {
        let _ = write!(line, " {byte:02X}"); // writing to a string cannot fail
    }
    for (index, error) in read.line_errors.iter().enumerate() {
        let separator = if index == 0 { " #" } else { "," };
        let _ = write!(line, "{separator} {} at {}", error.kind.name(), error.offset); // see above
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::chunk::LineErrorKind;

    #[test]
    fn a_hex_line_has_nanoseconds_and_says_line_errors_in_a_comment() {
        let mut read = Read {
            time: Timestamp::from_ns(1_767_225_600_123_456_789),
            bytes: vec![0x01, 0xAB],
            line_errors: Vec::new(),
        };
        assert_eq!(hex_line(&read), "2026-01-01T00:00:00.123456789Z 01 AB");
        read.line_errors =
            [0, 1].map(|offset| LineError { offset, kind: LineErrorKind::ParityOrFraming }).to_vec();
        let commented =
            "2026-01-01T00:00:00.123456789Z 01 AB # parity-or-framing at 0, parity-or-framing at 1";
        assert_eq!(hex_line(&read), commented);
    }
}
