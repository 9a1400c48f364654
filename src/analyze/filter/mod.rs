//! The display filter: which rows to show, such as `addr == 1 && temperature > 20`.
//!
//! ```text
//! expression  and, or, not, also &&, ||, !, and parentheses; `and` binds closer than `or`
//! numbers     addr fn reg quantity exception        == != < <= > >= in (…)
//! texts       outcome role reason device serial cmd bus finding      == != ~ in (…)
//! latency     == != < <= > >= in (…)   a number with its unit: ns, us, ms, s
//! time        the same                 13:05[:30] local, or 2026-01-01T13:05:00Z
//! flags       echo, damaged, crc good, crc bad
//! bytes       bytes contains 26 00
//! fields      any other name: a decoded field, such as temperature; field.NAME where NAME is taken
//! ```
//!
//! - A comparison with something the row does not have is false, and so is one with `!=`; `!(addr == 1)`
//!   is true for a row without an address.
//! - Where a row has several fields, findings or byte strings of that name, one that satisfies is enough.
//! - `~` finds a part of a text, without regard to the case of ASCII letters. The other operators on texts
//!   do regard it, except for the codes of findings.
//! - A field compares as a number when both sides are one, else as text. A number from a 32-bit float is
//!   compared as one, so `do_mg_l == 7.9` means what was printed.
//! - A time stands for its first instant, but with `==`, `!=` and `in` for all of the minute, second or
//!   fraction it names.

mod error;
mod keys;
mod matching;
mod moment;
mod parse;
mod print;
mod subject;
#[cfg(test)]
mod tests;
mod token;
mod tree;
mod value;

use std::str::FromStr;

pub use error::FilterError;
pub use subject::{Field, FieldValue, Subject};

use tree::Expression;

/// Decides which rows to show; prints as text that parses to the same filter.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    root: Expression,
}

impl Filter {
    /// Reads a filter; the error says where it went wrong, and what was expected there.
    pub fn parse(text: &str) -> Result<Filter, FilterError> {
        parse::filter(text).map(|root| Filter { root })
    }

    /// Tells whether a row passes; allocates nothing.
    pub fn matches(&self, subject: &dyn Subject) -> bool {
        matching::holds(&self.root, subject)
    }

    /// Returns the names that mean something whatever the profiles.
    pub fn known_names() -> impl Iterator<Item = &'static str> {
        keys::NAMES.iter().map(|(name, _)| *name)
    }

    /// Tells whether the filter asks for findings, so that they have to be looked for.
    pub fn asks_for_findings(&self) -> bool {
        self.root.asks_for_findings()
    }

    /// Returns the names of decoded fields that the filter asks for, in its order, for a warning about those
    /// that no profile has.
    pub fn field_names(&self) -> Vec<&str> {
        let mut names = Vec::new();
        self.root.each_field(&mut |name| names.push(name));
        names
    }
}

impl FromStr for Filter {
    type Err = FilterError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Filter::parse(text)
    }
}
