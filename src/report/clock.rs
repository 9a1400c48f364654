//! How points in time are shown: local time, UTC, or seconds since the first byte.

use std::fmt;

use chrono::{DateTime, Datelike, Local, NaiveDateTime, Timelike};

use super::columns;
use crate::pipeline::Event;
use crate::time::{SECOND, Timestamp};

/// Names the ways to show a point in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeStyle {
    /// The time zone of this machine.
    Local,
    /// Coordinated universal time.
    Utc,
    /// Seconds since the first byte of the first input.
    Relative,
}

/// Shows points in time in one style.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    style: TimeStyle,
    origin: Option<Timestamp>,
}

impl Clock {
    /// Makes a clock whose origin is the first time it takes note of.
    pub fn new(style: TimeStyle) -> Self {
        Clock { style, origin: None }
    }

    /// Returns a clock whose origin is this time.
    pub fn since(self, origin: Timestamp) -> Clock {
        Clock { origin: Some(origin), ..self }
    }

    /// Takes note of an event: the first frame or run with a time is the origin.
    pub(super) fn note(&mut self, event: &Event<'_>) {
        if self.origin.is_none() {
            self.origin = time_of(event);
        }
    }

    /// Takes a time as the origin, unless there is one.
    pub(super) fn begin(&mut self, origin: Timestamp) {
        self.origin.get_or_insert(origin);
    }

    /// Shows a time to the nanosecond, for programs.
    pub(super) fn exact(self, time: Timestamp) -> Shown {
        Shown { clock: self, time, exact: true }
    }

    /// Shows a time to the millisecond, for people; always equally wide within a day.
    pub fn short(self, time: Timestamp) -> Shown {
        Shown { clock: self, time, exact: false }
    }

    /// Returns the time of day to the millisecond, or the seconds since the origin; always equally wide.
    pub fn of_day(self, time: Timestamp) -> String {
        let text = self.short(time).to_string();
        match self.style {
            TimeStyle::Relative => format!("{text:>12}"),
            TimeStyle::Local | TimeStyle::Utc => {
                text.split_once(' ').map_or(text.clone(), |(_, time)| time.trim_end_matches('Z').to_owned())
            }
        }
    }
}

/// Returns when an event began.
fn time_of(event: &Event<'_>) -> Option<Timestamp> {
    match event {
        Event::Frame(frame) => Some(frame.place.time?.start.midpoint()),
        Event::Damaged(damaged) => Some(damaged.place.time?.start.midpoint()),
        Event::Transaction { transaction, .. } => columns::began(transaction),
        Event::Lost(lost) => lost.time,
        Event::Identified { time, .. } | Event::Reading { time, .. } => *time,
        Event::Finding(finding) => finding.time,
    }
}

/// Is a time to be shown.
pub struct Shown {
    clock: Clock,
    time: Timestamp,
    exact: bool,
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = DateTime::from_timestamp_nanos(self.time.as_ns());
        match (self.clock.style, self.exact) {
            (TimeStyle::Relative, exact) => {
                relative(self.time - self.clock.origin.unwrap_or(self.time), exact, f)
            }
            (TimeStyle::Local, true) => {
                let local = time.with_timezone(&Local);
                date_and_time(local.naive_local(), true, f)?;
                let minutes = local.offset().local_minus_utc() / 60;
                let sign = if minutes < 0 { '-' } else { '+' };
                write!(f, "{sign}{:02}:{:02}", minutes.abs() / 60, minutes.abs() % 60)
            }
            (TimeStyle::Local, false) => date_and_time(time.with_timezone(&Local).naive_local(), false, f),
            (TimeStyle::Utc, exact) => {
                date_and_time(time.naive_utc(), exact, f)?;
                f.write_str("Z")
            }
        }
    }
}

/// Writes date and time to the nanosecond, or to the millisecond.
///
/// A template filled in, for a format string read anew for every row takes longer than decoding it.
fn date_and_time(time: NaiveDateTime, exact: bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let mut text = *b"0000-00-00 00:00:00.000000000";
    let mut put = |at: usize, digits: usize, mut number: u32| {
        for digit in text[at..at + digits].iter_mut().rev() {
            *digit = b'0' + (number % 10) as u8; // below 10
            number /= 10;
        }
    };
    put(0, 4, time.year().unsigned_abs()); // nanoseconds reach from 1677 to 2262
    put(5, 2, time.month());
    put(8, 2, time.day());
    put(11, 2, time.hour());
    put(14, 2, time.minute());
    put(17, 2, time.second());
    put(20, 9, time.nanosecond() % SECOND as u32); // a leap second's are more
    if exact {
        text[10] = b'T';
    }
    let text = if exact { &text[..] } else { &text[..23] };
    f.write_str(str::from_utf8(text).map_err(|_| fmt::Error)?)
}

/// Writes seconds with nine or three decimals; negative before the origin.
fn relative(ns: i64, exact: bool, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let sign = if ns < 0 { "-" } else { "" };
    let (seconds, rest) = (ns.unsigned_abs() / SECOND as u64, ns.unsigned_abs() % SECOND as u64);
    if exact {
        write!(f, "{sign}{seconds}.{rest:09}")
    } else {
        f.pad(&format!("{sign}{seconds}.{:03}", rest / 1_000_000))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_shown_in_each_style() {
        let time = Timestamp::from_ns(1_767_225_600_123_456_789);
        let utc = Clock::new(TimeStyle::Utc);
        assert_eq!(utc.exact(time).to_string(), "2026-01-01T00:00:00.123456789Z");
        assert_eq!(utc.short(time).to_string(), "2026-01-01 00:00:00.123Z");
        let relative = Clock { style: TimeStyle::Relative, origin: Some(time) };
        assert_eq!(relative.exact(time + 1_000_000_001).to_string(), "1.000000001");
        assert_eq!(relative.exact(time - 1).to_string(), "-0.000000001");
        assert_eq!(format!("{:>8}", relative.short(time + 12_345_678_901)), "  12.345");
        let local = Clock::new(TimeStyle::Local).exact(time).to_string();
        let back = DateTime::parse_from_rfc3339(&local).expect("RFC 3339");
        assert_eq!(back.timestamp_nanos_opt(), Some(time.as_ns()));
    }

    #[test]
    fn the_ends_of_time_can_be_shown() {
        for style in [TimeStyle::Local, TimeStyle::Utc, TimeStyle::Relative] {
            for time in [Timestamp::MIN, Timestamp::MAX] {
                assert!(
                    !Clock { style, origin: Some(Timestamp::from_ns(0)) }.exact(time).to_string().is_empty()
                );
            }
        }
    }
}
