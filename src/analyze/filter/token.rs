//! The smallest pieces of a filter's text; each parser skips the white space before it.

use nom::branch::alt;
use nom::bytes::complete::{tag, take_while, take_while1};
use nom::character::complete::{char, multispace0, none_of, one_of, satisfy};
use nom::combinator::{cut, recognize, verify};
use nom::multi::fold_many0;
use nom::sequence::{delimited, preceded};
use nom::{IResult, Parser};

use super::error::Trouble;

/// Is what a parser gives back.
pub(super) type Parsed<'a, T> = IResult<&'a str, T, Trouble>;

/// Tells whether a character may stand in a word without quotes.
pub(super) fn is_word(c: char) -> bool {
    c.is_alphanumeric() || "_-.:/+%".contains(c)
}

/// Skips white space.
pub(super) fn space(input: &str) -> &str {
    input.trim_start_matches([' ', '\t', '\r', '\n'])
}

/// Reads a sign such as `(`.
pub(super) fn sign<'a>(wanted: char) -> impl FnMut(&'a str) -> Parsed<'a, char> {
    move |input| char(wanted)(space(input))
}

/// Reads signs such as `&&`.
pub(super) fn signs<'a>(wanted: &'static str) -> impl FnMut(&'a str) -> Parsed<'a, &'a str> {
    move |input| tag(wanted)(space(input))
}

/// Reads a name: a letter or `_`, then letters, digits and `_`.
pub(super) fn name(input: &str) -> Parsed<'_, &str> {
    let first = satisfy(|c| c.is_ascii_alphabetic() || c == '_');
    let rest = take_while(|c: char| c.is_ascii_alphanumeric() || c == '_');
    preceded(multispace0, recognize((first, rest))).parse(input)
}

/// Reads this name and no longer one.
pub(super) fn keyword<'a>(wanted: &'static str) -> impl FnMut(&'a str) -> Parsed<'a, &'a str> {
    move |input| verify(name, |name: &str| name.eq_ignore_ascii_case(wanted)).parse(input)
}

/// Reads a word without quotes.
pub(super) fn word(input: &str) -> Parsed<'_, &str> {
    preceded(multispace0, take_while1(is_word)).parse(input)
}

/// Reads a text in single or double quotes; a backslash stands before a quote or a backslash that is meant.
pub(super) fn quoted(input: &str) -> Parsed<'_, String> {
    let input = space(input);
    alt((quoted_with('"', "\\\""), quoted_with('\'', "\\'"))).parse(input)
}

/// Reads a text between two of these quotes; `special` holds what needs a backslash.
fn quoted_with<'a>(quote: char, special: &'static str) -> impl FnMut(&'a str) -> Parsed<'a, String> {
    move |input| {
        let escaped = preceded(char('\\'), cut(escape));
        let text = fold_many0(alt((none_of(special), escaped)), String::new, |mut text, c| {
            text.push(c);
            text
        });
        delimited(char(quote), text, cut(char(quote))).parse(input)
    }
}

/// Reads what may stand behind a backslash.
fn escape(input: &str) -> Parsed<'_, char> {
    one_of("\\\"'")(input)
        .map_err(|error: nom::Err<Trouble>| error.map(|_| Trouble::at(input, "a quote or '\\'")))
}
