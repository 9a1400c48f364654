//! Values: numbers, lengths of time, points in time, texts and bytes.

use nom::Parser;
use nom::branch::alt;
use nom::bytes::complete::take_while_m_n;
use nom::character::complete::multispace0;
use nom::combinator::{map, map_opt};
use nom::multi::many1;
use nom::sequence::preceded;

use super::error::Trouble;
use super::keys::{TextKey, nearest};
use super::moment::Moment;
use super::token::{Parsed, quoted, space, word};
use super::tree::{Literal, Operator};
use crate::time::{MILLISECOND, SECOND};

/// The units of a length of time, in nanoseconds; µ is U+00B5 or U+03BC.
const UNITS: [(&str, i64); 6] =
    [("ns", 1), ("us", 1000), ("µs", 1000), ("μs", 1000), ("ms", MILLISECOND), ("s", SECOND)];

/// The longest length of time, in nanoseconds: 11 days, which a 64-bit float still holds exactly.
const LONGEST: f64 = 1e15;

/// Reads a number: decimal, with fraction, exponent and sign, or hexadecimal with `0x`; finite.
pub(super) fn number_of(word: &str) -> Option<f64> {
    let unsigned = word.strip_prefix(['+', '-']).unwrap_or(word);
    let value = match unsigned.strip_prefix("0x").or_else(|| unsigned.strip_prefix("0X")) {
        Some(digits) if digits.starts_with(|c: char| c.is_ascii_hexdigit()) => {
            u64::from_str_radix(digits, 16).ok()? as f64
        }
        Some(_) => return None,
        // Without this, "inf" and "nan" would be numbers.
        None if unsigned.starts_with(|c: char| c.is_ascii_digit() || c == '.') => unsigned.parse().ok()?,
        None => return None,
    };
    let value: f64 = if word.starts_with('-') { -value } else { value };
    value.is_finite().then_some(value)
}

/// Reads a number of a row.
pub(super) fn number(_: Operator, input: &str) -> Parsed<'_, f64> {
    let at = space(input);
    map_opt(word, number_of).parse(input).map_err(|error| wanted(error, at, "a number such as 16 or 0x10"))
}

/// Reads a length of time with its unit, in nanoseconds, rounded to the nearest.
pub(super) fn duration(_: Operator, input: &str) -> Parsed<'_, i64> {
    let at = space(input);
    let wanted = || Trouble::at(at, "a time with its unit such as 100 ms");
    let Ok((rest, first)) = word(input) else { return wanted().fail() };
    let glued = UNITS.iter().find_map(|(unit, ns)| Some((first.strip_suffix(unit)?, *ns)));
    let (rest, digits, unit) = match (number_of(first), glued) {
        (Some(_), _) => {
            let after = space(rest);
            let unit = word(rest).ok().and_then(|(rest, word)| {
                UNITS.iter().find(|(unit, _)| *unit == word).map(|(_, ns)| (rest, *ns))
            });
            match unit {
                Some((rest, ns)) => (rest, first, ns),
                None => {
                    let hint = Some(format!("write '{first} ms' if milliseconds are meant"));
                    return Trouble::at(after, "a unit: ns, us, ms or s").hint(hint).fail();
                }
            }
        }
        (None, Some((digits, ns))) => (rest, digits, ns),
        (None, None) => return wanted().fail(),
    };
    match number_of(digits).map(|number| (number * unit as f64).round()) {
        Some(ns) if ns.abs() <= LONGEST => Ok((rest, ns as i64)),
        Some(_) => Trouble::at(at, "a time of at most 11 days").fail(),
        None => wanted().fail(),
    }
}

/// Reads a point in time.
pub(super) fn moment(_: Operator, input: &str) -> Parsed<'_, Moment> {
    let at = space(input);
    let read = word(input).ok();
    if let Some((rest, moment)) = read.and_then(|(rest, word)| Some((rest, Moment::read(word)?))) {
        return Ok((rest, moment));
    }
    let dated = read.is_some_and(|(_, word)| word.len() > 8 && word.contains('-'));
    let hint = dated.then_some("a date needs its time, with seconds, and Z or an offset such as +02:00");
    Trouble::at(at, "a time such as 13:05, 13:05:30 or 2026-01-01T13:05:00Z").hint(hint).fail()
}

/// Reads a text of a row; one of a fixed set when the key has one and all of the text is given.
pub(super) fn text<'a>(key: TextKey, operator: Operator, input: &'a str) -> Parsed<'a, String> {
    let at = space(input);
    let (rest, mut text) = any_text("a word or a text in quotes", input)?;
    if operator == Operator::Like {
        return Ok((rest, text));
    }
    if let Some(choices) = key.choices().filter(|choices| !choices.contains(&text.as_str())) {
        let hint = nearest(&text, choices.iter().copied()).map(|near| format!("did you mean '{near}'?"));
        return Trouble::at(at, format!("one of {}", choices.join(", "))).hint(hint).fail();
    }
    if key == TextKey::Finding {
        text.make_ascii_uppercase();
        if !matches!(text.as_bytes(), [b'A'..=b'Z', b'0'..=b'9', b'0'..=b'9']) {
            return Trouble::at(at, "the code of a finding such as D06").fail();
        }
    }
    Ok((rest, text))
}

/// Reads a value to compare a decoded field with.
pub(super) fn literal(_: Operator, input: &str) -> Parsed<'_, Literal> {
    let as_word = map(word, |word| Literal { text: word.to_owned(), number: number_of(word) });
    let as_quoted = map(quoted, |text| Literal { text, number: None });
    alt((as_quoted, as_word))
        .parse(input)
        .map_err(|error| wanted(error, input, "a number, a word or a text in quotes"))
}

/// Reads a word, or a text in quotes.
fn any_text<'a>(expected: &'static str, input: &'a str) -> Parsed<'a, String> {
    alt((quoted, map(word, str::to_owned))).parse(input).map_err(|error| wanted(error, input, expected))
}

/// Makes an error final; one that is not yet says what was expected.
fn wanted(error: nom::Err<Trouble>, input: &str, expected: &'static str) -> nom::Err<Trouble> {
    match error {
        nom::Err::Error(_) => nom::Err::Failure(Trouble::at(space(input), expected)),
        other => other,
    }
}

/// Reads bytes in hexadecimal, two digits each, with white space between them or not.
pub(super) fn bytes(input: &str) -> Parsed<'_, Vec<u8>> {
    let digits = take_while_m_n(2, 2, |c: char| c.is_ascii_hexdigit());
    let byte = map_opt(digits, |digits| u8::from_str_radix(digits, 16).ok());
    many1(preceded(multispace0, byte))
        .parse(input)
        .map_err(|error| wanted(error, input, "bytes in hexadecimal such as 26 00"))
}
