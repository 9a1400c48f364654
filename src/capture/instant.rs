//! Times at the head of a line of hex text, read exactly: decimals never pass through a float.

use crate::decode::stamp::{EARLIEST, LATEST};
use crate::time::{SECOND, Timestamp};

/// Says what is wrong with a time, and at which offset of the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Wrong {
    pub(super) offset: usize,
    pub(super) what: &'static str,
}

/// Reads a time at the start of `text`; returns it and its length, or `None` when there is none.
///
/// RFC 3339 with `Z` or offset (a space may stand for the `T`, section 5.6), or seconds since the
/// epoch with a decimal point; what is finer than a nanosecond is cut off.
pub(super) fn read(text: &[u8]) -> Option<Result<(Timestamp, usize), Wrong>> {
    let digits = text.iter().take_while(|c| c.is_ascii_digit()).count();
    match text.get(digits) {
        Some(b'.') if digits > 0 => Some(epoch(text, digits)),
        Some(b'-') if digits == 4 => Some(rfc3339(text)),
        _ => None,
    }
}

fn wrong<T>(offset: usize, what: &'static str) -> Result<T, Wrong> {
    Err(Wrong { offset, what })
}

/// What is said of times before `EARLIEST` and after `LATEST`, which would all be taken for one and the same.
pub(super) const OUT_OF_RANGE: &str = "the time is not between the years 1896 and 2116";

/// Makes a time of nanoseconds since the epoch, where it can be reckoned with.
pub(super) fn from_ns(ns: i128) -> Option<Timestamp> {
    let time = i64::try_from(ns).ok().map(Timestamp::from_ns)?;
    (EARLIEST..=LATEST).contains(&time).then_some(time)
}

fn timestamp(seconds: i64, nanoseconds: i64) -> Result<Timestamp, Wrong> {
    let ns = i128::from(seconds) * i128::from(SECOND) + i128::from(nanoseconds);
    from_ns(ns).ok_or(Wrong { offset: 0, what: OUT_OF_RANGE })
}

/// Reads seconds and fraction; `point` is the offset of the decimal point.
fn epoch(text: &[u8], point: usize) -> Result<(Timestamp, usize), Wrong> {
    let mut seconds: i64 = 0;
    for digit in &text[..point] {
        seconds = seconds.saturating_mul(10).saturating_add(i64::from(digit - b'0'));
    }
    let (nanoseconds, end) = fraction(text, point)?;
    Ok((timestamp(seconds, nanoseconds)?, end))
}

/// Reads the decimals after the point at `point`; returns nanoseconds and where they end.
fn fraction(text: &[u8], point: usize) -> Result<(i64, usize), Wrong> {
    let mut nanoseconds = 0;
    let mut worth = SECOND / 10;
    let mut at = point + 1;
    while let Some(digit) = text.get(at).filter(|c| c.is_ascii_digit()) {
        nanoseconds += i64::from(digit - b'0') * worth;
        worth /= 10;
        at += 1;
    }
    if at == point + 1 { wrong(at, "no digit after the decimal point") } else { Ok((nanoseconds, at)) }
}

/// Reads a number of exactly `length` digits.
fn number(text: &[u8], at: usize, length: usize, what: &'static str) -> Result<i64, Wrong> {
    let mut value = 0;
    for offset in at..at + length {
        match text.get(offset) {
            Some(digit) if digit.is_ascii_digit() => value = value * 10 + i64::from(digit - b'0'),
            _ => return wrong(offset, what),
        }
    }
    Ok(value)
}

/// Reads a number of two digits within bounds.
fn part(text: &[u8], at: usize, low: i64, high: i64, what: &'static str) -> Result<i64, Wrong> {
    let value = number(text, at, 2, what)?;
    if (low..=high).contains(&value) { Ok(value) } else { wrong(at, what) }
}

fn separator(text: &[u8], at: usize, any_of: &[u8], what: &'static str) -> Result<(), Wrong> {
    match text.get(at) {
        Some(c) if any_of.contains(c) => Ok(()),
        _ => wrong(at, what),
    }
}

fn rfc3339(text: &[u8]) -> Result<(Timestamp, usize), Wrong> {
    let year = number(text, 0, 4, "the year has not four digits")?;
    let month = part(text, 5, 1, 12, "the month is not 01 to 12")?;
    separator(text, 7, b"-", "no '-' between month and day")?;
    let day = part(text, 8, 1, days_of(year, month), "the month has no such day")?;
    separator(text, 10, b"Tt ", "no 'T' between date and time of day")?;
    let hour = part(text, 11, 0, 23, "the hour is not 00 to 23")?;
    separator(text, 13, b":", "no ':' between hour and minute")?;
    let minute = part(text, 14, 0, 59, "the minute is not 00 to 59")?;
    separator(text, 16, b":", "no ':' between minute and second")?;
    // 60 is a leap second, which Unix time counts as the first of the next minute.
    let second = part(text, 17, 0, 60, "the second is not 00 to 60")?;
    let (nanoseconds, at) = if text.get(19) == Some(&b'.') { fraction(text, 19)? } else { (0, 19) };
    let (offset_minutes, end) = zone(text, at)?;
    let days = days_from_civil(year, month, day);
    let seconds = days * 86_400 + hour * 3600 + minute * 60 + second - offset_minutes * 60;
    Ok((timestamp(seconds, nanoseconds)?, end))
}

/// Reads `Z` or an offset; returns minutes east of Greenwich and where it ends.
fn zone(text: &[u8], at: usize) -> Result<(i64, usize), Wrong> {
    let sign = match text.get(at) {
        Some(b'Z' | b'z') => return Ok((0, at + 1)),
        Some(b'+') => 1,
        Some(b'-') => -1,
        _ => return wrong(at, "the time has neither 'Z' nor an offset such as '+02:00'"),
    };
    let hours = part(text, at + 1, 0, 23, "the offset's hour is not 00 to 23")?;
    separator(text, at + 3, b":", "no ':' in the offset")?;
    let minutes = part(text, at + 4, 0, 59, "the offset's minute is not 00 to 59")?;
    Ok((sign * (hours * 60 + minutes), at + 6))
}

fn days_of(year: i64, month: i64) -> i64 {
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    match month {
        2 => 28 + i64::from(leap),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

/// Counts days from 1970-01-01 in the proleptic Gregorian calendar, by counting from March on.
fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ns(text: &str) -> i64 {
        let (time, length) = read(text.as_bytes()).expect("a time").expect("a good time");
        assert_eq!(length, text.len(), "{text}");
        time.as_ns()
    }

    #[test]
    fn every_nanosecond_is_kept() {
        assert_eq!(ns("1600000000.123456789"), 1_600_000_000_123_456_789);
        assert_eq!(ns("1767225600.000000001"), 1_767_225_600_000_000_001);
        assert_eq!(ns("0.5"), 500_000_000);
        assert_eq!(ns("1.1234567899"), 1_123_456_789, "finer is cut off");
        assert_eq!(ns("2026-01-01T00:00:00.123456789Z"), 1_767_225_600_123_456_789);
    }

    #[test]
    fn dates_agree_with_the_calendar() {
        assert_eq!(ns("1970-01-01T00:00:00Z"), 0);
        assert_eq!(ns("2000-02-29T12:00:00Z"), 951_825_600 * SECOND);
        assert_eq!(ns("2026-03-01T00:00:00Z"), 1_772_323_200 * SECOND);
        assert_eq!(ns("1969-12-31T23:59:59Z"), -SECOND);
        assert_eq!(ns("2016-12-31T23:59:60Z"), ns("2017-01-01T00:00:00Z"), "leap second");
    }

    #[test]
    fn every_time_that_is_believed_can_be_written() {
        assert_eq!(ns("4611686018.427387903"), LATEST.as_ns());
        assert_eq!(ns("2116-02-20T23:53:38.427387903Z"), LATEST.as_ns());
        assert_eq!(ns("1896-12-06T00:03:10.786306048Z"), EARLIEST.as_ns());
    }

    #[test]
    fn offsets_lead_to_the_same_instant() {
        let instant = ns("2026-06-01T12:00:00Z");
        for text in ["2026-06-01T14:00:00+02:00", "2026-06-01 06:30:00-05:30", "2026-06-01t12:00:00z"] {
            assert_eq!(ns(text), instant, "{text}");
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        for (text, offset, part) in [
            ("2026-13-01T00:00:00Z", 5, "month"),
            ("2026-02-29T00:00:00Z", 8, "no such day"),
            ("2026-01-01", 10, "'T'"),
            ("2026-01-01T24:00:00Z", 11, "hour"),
            ("2026-01-01T00:00Z", 16, "':'"),
            ("2026-01-01T00:00:61Z", 17, "second"),
            ("2026-01-01T00:00:00", 19, "neither"),
            ("2026-01-01T00:00:00.Z", 20, "decimal"),
            ("2026-01-01T00:00:00+2:00", 21, "offset"),
            ("9999-01-01T00:00:00Z", 0, "years"),
            ("2116-02-21T00:00:00Z", 0, "1896 and 2116"),
            ("1896-12-05T00:00:00Z", 0, "1896 and 2116"),
            ("4611686018.427387904", 0, "1896 and 2116"),
            ("99999999999.5", 0, "years"),
            ("99999999999999999999999.5", 0, "years"),
            ("1600000000.", 11, "decimal"),
        ] {
            let wrong = read(text.as_bytes()).expect("a time").expect_err(text);
            assert_eq!(wrong.offset, offset, "{text}: {}", wrong.what);
            assert!(wrong.what.contains(part), "{text}: {}", wrong.what);
        }
    }

    #[test]
    fn bytes_are_no_time() {
        for text in ["1600000000", "01 03", "", ".5", "ff.5", "0x01", "20260101T000000Z"] {
            assert_eq!(read(text.as_bytes()), None, "{text}");
        }
    }
}
