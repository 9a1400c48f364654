//! What rows are looked for: those that pass a filter, or those with words or bytes.

use super::store::{Row, RowSubject, Store};
use crate::analyze::filter::{Filter, Subject as _};

/// Tells rows that are looked for from others.
#[derive(Clone, Debug, PartialEq)]
pub enum Sieve {
    /// Those that pass.
    Filter(Filter),
    /// Those that show a text, in whatever case, or hold bytes.
    Words {
        /// The text in lower case.
        words: String,
        /// The bytes, where the text is some in hexadecimal.
        bytes: Option<Vec<u8>>,
    },
}

impl Sieve {
    /// Looks for a text, and for bytes where it is some in hexadecimal, two digits each.
    pub fn words(text: &str) -> Self {
        Sieve::Words { words: text.to_lowercase(), bytes: hex_bytes(text) }
    }

    /// Tells whether a row is looked for.
    pub fn passes(&self, store: &Store, row: &Row) -> bool {
        match self {
            Sieve::Filter(filter) => filter.matches(&RowSubject::new(store, row)),
            Sieve::Words { words, bytes } => {
                let has = |bytes: &[u8]| {
                    let subject = RowSubject::new(store, row);
                    subject.any_bytes(&mut |all| all.windows(bytes.len()).any(|window| window == bytes))
                };
                has_words(row, words) || bytes.as_deref().is_some_and(has)
            }
        }
    }
}

fn has_words(row: &Row, words: &str) -> bool {
    let contains = |text: &str| text.to_lowercase().contains(words);
    match row {
        Row::Exchange(row) => [&*row.title, &*row.label, &*row.said].into_iter().any(contains),
        Row::Run(row) => {
            contains(row.role.name()) || row.reason().is_some_and(|reason| contains(reason.name()))
        }
        Row::Remark(row) => contains(&row.text),
    }
}

/// Reads bytes in hexadecimal, two digits each; `None` for anything else.
fn hex_bytes(text: &str) -> Option<Vec<u8>> {
    let digits: String = text.split_whitespace().collect();
    if digits.len() < 2 || digits.len() % 2 == 1 || !digits.is_ascii() {
        return None;
    }
    let pairs = (0..digits.len()).step_by(2);
    pairs.map(|at| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok()).collect()
}
