//! Comments that say what hex text has no bytes for: line errors behind a read, and bytes that were lost.
//!
//! ```text
//! 2026-01-01T00:00:00.123Z 01 AB # parity-or-framing at 0, overrun at 1
//! # lost 5 queue 2026-01-01T00:00:00.2Z
//! ```

use std::fmt::Write;

use chrono::{DateTime, SecondsFormat};

use super::instant;
use crate::decode::chunk::{LineError, LineErrorKind, Lost, LostKind};
use crate::time::Timestamp;

const LINE_ERRORS: [LineErrorKind; 3] =
    [LineErrorKind::ParityOrFraming, LineErrorKind::Break, LineErrorKind::Overrun];
const LOSSES: [LostKind; 4] = [LostKind::Overrun, LostKind::Queue, LostKind::Disk, LostKind::SourceGone];

/// Writes a time as hex text has it: RFC 3339 in UTC, with nanoseconds.
pub(super) fn time_text(time: Timestamp) -> String {
    DateTime::from_timestamp_nanos(time.as_ns()).to_rfc3339_opts(SecondsFormat::Nanos, true)
}

/// Writes line errors as a comment, which is empty without any.
pub(super) fn line_errors_text(errors: &[LineError]) -> String {
    let mut text = String::new();
    for (index, error) in errors.iter().enumerate() {
        let separator = if index == 0 { "#" } else { "," };
        let _ = write!(text, "{separator} {} at {}", error.kind.name(), error.offset); // writing to a string cannot fail
    }
    text
}

/// Reads line errors from a comment with its `#`; `None` when it says anything else.
pub(super) fn line_errors(comment: &[u8]) -> Option<Vec<LineError>> {
    let text = str::from_utf8(comment.strip_prefix(b"#")?).ok()?;
    let read = |part: &str| {
        let (name, offset) = part.trim().split_once(" at ")?;
        let kind = LINE_ERRORS.into_iter().find(|kind| kind.name() == name)?;
        Some(LineError { offset: offset.parse().ok()?, kind })
    };
    text.split(',').map(read).collect()
}

/// Writes as a comment, without the line's end, that bytes were lost here.
pub fn hex_lost(lost: &Lost) -> String {
    let time = lost.time.map(|time| format!(" {}", time_text(time))).unwrap_or_default();
    format!("# lost {} {}{time}", lost.count, lost.kind.name())
}

/// Reads from a comment with its `#` that bytes were lost; `None` when it says anything else.
///
/// Where in the stream they are missing is for the reader to say.
pub(super) fn lost(comment: &[u8]) -> Option<Lost> {
    let text = str::from_utf8(comment.strip_prefix(b"#")?).ok()?.trim();
    let mut words = text.strip_prefix("lost ")?.splitn(3, ' ');
    let count = words.next()?.parse().ok()?;
    let name = words.next()?;
    let kind = LOSSES.into_iter().find(|kind| kind.name() == name)?;
    let time = match words.next().map(|time| (time, instant::read(time.as_bytes()))) {
        None => None,
        Some((text, Some(Ok((time, length))))) if length == text.len() => Some(time),
        Some(_) => return None,
    };
    Some(Lost { time, stream_offset: 0, kind, count })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_errors_and_losses_are_read_as_they_were_written() {
        let errors = LINE_ERRORS.map(|kind| LineError { offset: kind as u32 * 7, kind });
        assert_eq!(line_errors(line_errors_text(&errors).as_bytes()), Some(errors.to_vec()));
        for kind in LOSSES {
            for time in [None, Some(Timestamp::from_ns(1_767_225_600_123_456_789))] {
                let it = Lost { time, stream_offset: 0, kind, count: 12 };
                assert_eq!(lost(hex_lost(&it).as_bytes()), Some(it));
            }
        }
    }

    #[test]
    fn what_people_write_is_no_line_error_and_no_loss() {
        for comment in ["", "#", "# break", "# break at lunch", "# break at 1, why?", "# breaks at 1"] {
            assert_eq!(line_errors(comment.as_bytes()), None, "{comment}");
        }
        for comment in
            ["# lost 5", "# lost 5 bytes", "# lost it queue", "# lost 5 queue yesterday", "lost 5 queue"]
        {
            assert_eq!(lost(comment.as_bytes()), None, "{comment}");
        }
    }
}
