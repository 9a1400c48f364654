//! What is wrong with a filter, and where.

use std::borrow::Cow;
use std::fmt;

use nom::error::{ErrorKind, ParseError};

use super::token::is_word;

/// Says what a filter lacks, where, and what may have been meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilterError {
    offset: usize,
    column: usize,
    found: String,
    expected: Cow<'static, str>,
    hint: Option<Cow<'static, str>>,
}

impl FilterError {
    /// Returns where it went wrong, in bytes from the start of the filter.
    pub fn offset(&self) -> usize {
        self.offset
    }

    /// Returns where it went wrong, in characters, from 1.
    pub fn column(&self) -> usize {
        self.column
    }

    /// Returns what should stand there.
    pub fn expected(&self) -> &str {
        &self.expected
    }

    /// Returns what may have been meant.
    pub fn hint(&self) -> Option<&str> {
        self.hint.as_deref()
    }

    /// Sets a parser's trouble into the text it had to read.
    pub(super) fn new(text: &str, trouble: Trouble) -> Self {
        let offset = text.len().saturating_sub(trouble.left);
        let rest = text.get(offset..).unwrap_or_default();
        let word = rest.split(|c| !is_word(c)).next().unwrap_or_default();
        let found = match rest.chars().next() {
            None => "the end".to_owned(),
            Some(_) if !word.is_empty() => format!("'{}'", shortened(word)),
            Some(other) => format!("'{}'", other.escape_debug()),
        };
        let column = text.get(..offset).unwrap_or_default().chars().count() + 1;
        FilterError { offset, column, found, expected: trouble.expected, hint: trouble.hint }
    }
}

/// Cuts a word that is too long to be shown.
fn shortened(word: &str) -> String {
    match word.char_indices().nth(40) {
        Some((end, _)) => format!("{}…", &word[..end]), // `end` is a character boundary
        None => word.to_owned(),
    }
}

impl fmt::Display for FilterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "column {}: expected {}, found {}", self.column, self.expected, self.found)?;
        match &self.hint {
            Some(hint) => write!(f, "; {hint}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for FilterError {}

/// Is a parser's error: how much was left to read when it failed, and what it wanted.
#[derive(Debug)]
pub(super) struct Trouble {
    left: usize,
    expected: Cow<'static, str>,
    hint: Option<Cow<'static, str>>,
}

impl Trouble {
    /// Makes an error at the start of what is left to read.
    pub(super) fn at(input: &str, expected: impl Into<Cow<'static, str>>) -> Self {
        Trouble { left: input.len(), expected: expected.into(), hint: None }
    }

    /// Adds what may have been meant.
    pub(super) fn hint(mut self, hint: Option<impl Into<Cow<'static, str>>>) -> Self {
        self.hint = hint.map(Into::into);
        self
    }

    /// Makes it final: no other reading is tried.
    pub(super) fn fail<T>(self) -> Result<T, nom::Err<Trouble>> {
        Err(nom::Err::Failure(self))
    }
}

impl<'a> ParseError<&'a str> for Trouble {
    fn from_error_kind(input: &'a str, _: ErrorKind) -> Self {
        Trouble::at(input, "something else")
    }

    fn append(_: &'a str, _: ErrorKind, other: Self) -> Self {
        other
    }

    fn from_char(input: &'a str, wanted: char) -> Self {
        Trouble::at(input, format!("'{wanted}'"))
    }
}
