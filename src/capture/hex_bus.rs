//! Comments of hex text that say which bus the lines below are of, and when a bus was found silent.
//!
//! ```text
//! # bus 'pump' line 9600-8N1 adapter-hold 16 ms
//! # bus 'pump'
//! # silence until 2026-01-01T00:00:00.2Z
//! ```

use std::fmt::Write;

use super::directive;
use super::hex_comment::time_text;
use super::instant;
use super::mcap::BusSettings;
use crate::line::LineSettings;
use crate::time::{MILLISECOND, Timestamp};

/// Writes as a comment, without the line's end, that the lines below are of a bus, with its settings where they begin.
pub fn hex_bus(name: &str, settings: Option<(LineSettings, Option<i64>)>) -> String {
    let mut text = format!("# bus '{}'", escaped(name));
    if let Some((line, hold_ns)) = settings {
        text += &format!(" line {line}");
        if let Some(ns) = hold_ns {
            text += &format!(" adapter-hold {} ms", ns as f64 / MILLISECOND as f64);
        }
    }
    text
}

/// Reads from a comment with its `#` which bus the lines below are of, and its settings where it says them.
pub(super) fn bus(comment: &[u8]) -> Option<(String, Option<BusSettings>)> {
    let text = str::from_utf8(comment.strip_prefix(b"#")?).ok()?.trim();
    let (name, rest) = text.strip_prefix("bus '")?.rsplit_once('\'')?;
    let name = unescaped(name);
    if rest.is_empty() {
        return Some((name, None));
    }
    let rest = rest.strip_prefix(" line ")?;
    let (line, rest) = rest.split_once(' ').unwrap_or((rest, ""));
    let adapter_hold_ns = if rest.is_empty() { None } else { Some(directive::adapter_hold(rest)?) };
    let settings = BusSettings {
        name: name.clone(),
        line: line.parse().ok()?,
        adapter_hold_ns,
        ..BusSettings::default()
    };
    Some((name, Some(settings)))
}

/// Writes a name so that it stays within its line: control characters as `\u{a}`, a backslash twice.
fn escaped(name: &str) -> String {
    let mut text = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            '\\' => text.push_str("\\\\"),
            c if c.is_control() => {
                let _ = write!(text, "{}", c.escape_unicode()); // writing to a string cannot fail
            }
            c => text.push(c),
        }
    }
    text
}

/// Reads what `escaped` wrote; a backslash before anything else is one, as somebody may write by hand.
fn unescaped(text: &str) -> String {
    let mut name = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('\\') {
        name.push_str(before);
        let (c, length) = character(after).unwrap_or(('\\', 0));
        name.push(c);
        rest = &after[length..];
    }
    name + rest
}

/// Reads what stands after a backslash; returns the character it is, and how many bytes say so.
fn character(text: &str) -> Option<(char, usize)> {
    if text.starts_with('\\') {
        return Some(('\\', 1));
    }
    let (digits, _) = text.strip_prefix("u{")?.split_once('}')?;
    let number = u32::from_str_radix(digits, 16).ok()?;
    Some((char::from_u32(number)?, "u{}".len() + digits.len()))
}

/// Writes as a comment, without the line's end, that nothing was received until then.
pub fn hex_silence(until: Timestamp) -> String {
    format!("# silence until {}", time_text(until))
}

/// Reads from a comment with its `#` until when nothing was received.
pub(super) fn silence(comment: &[u8]) -> Option<Timestamp> {
    let text = str::from_utf8(comment.strip_prefix(b"#")?).ok()?.trim();
    let text = text.strip_prefix("silence until ")?;
    match instant::read(text.as_bytes()) {
        Some(Ok((time, length))) if length == text.len() => Some(time),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn every_name_stays_in_its_line_and_is_read_as_it_was(name in any::<String>(), has_settings: bool) {
            let line: LineSettings = "19200-8E1".parse().expect("line settings");
            let text = hex_bus(&name, has_settings.then_some((line, Some(MILLISECOND))));
            prop_assert!(!text.contains(char::is_control));
            let (read, settings) = bus(text.as_bytes()).expect("a bus");
            prop_assert_eq!((&read, settings.is_some()), (&name, has_settings));
            prop_assert!(settings.is_none_or(|settings| settings.name == name && settings.line == line));
        }
    }

    #[test]
    fn names_of_all_kinds_are_read_as_they_were_written() {
        for name in
            ["", "a/b", "a\n01 03", "\u{1b}[2J", "\\\\.\\COM10", "\\u{a}", "' line 9600-8N1", "ä'\u{85}"]
        {
            let text = hex_bus(name, None);
            assert!(!text.contains(char::is_control), "{text}");
            assert_eq!(bus(text.as_bytes()), Some((name.to_owned(), None)), "{text}");
        }
        for (text, name) in [("# bus 'C:\\bus'", "C:\\bus"), ("# bus '\\u{110000}\\'", "\\u{110000}\\")] {
            assert_eq!(bus(text.as_bytes()), Some((name.to_owned(), None)), "{text}");
        }
    }

    #[test]
    fn buses_and_silences_are_read_as_they_were_written() {
        let line = "19200-8E1".parse().expect("line settings");
        for hold in [None, Some(16_500_000)] {
            let (name, settings) = bus(hex_bus("it's a pump", Some((line, hold))).as_bytes()).expect("a bus");
            let settings = settings.expect("settings");
            assert_eq!((name.as_str(), settings.line, settings.adapter_hold_ns), ("it's a pump", line, hold));
        }
        assert_eq!(bus(hex_bus("pump", None).as_bytes()), Some(("pump".to_owned(), None)));
        let until = Timestamp::from_ns(1_767_225_600_123_456_789);
        assert_eq!(silence(hex_silence(until).as_bytes()), Some(until));
    }

    #[test]
    fn what_people_write_is_no_bus_and_no_silence() {
        for comment in ["# bus was quiet", "# bus 'a", "# bus 'a' b", "# bus 'a' line fast"] {
            assert_eq!(bus(comment.as_bytes()), None, "{comment}");
        }
        for comment in ["# silence", "# silence until noon", "# silence until 2026-01-01T00:00:00Z or so"] {
            assert_eq!(silence(comment.as_bytes()), None, "{comment}");
        }
    }
}
