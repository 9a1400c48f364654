//! Why a source cannot be opened or read.

use std::io;

use thiserror::Error;

/// Says what is wrong with a source, and what may mend it.
#[derive(Debug, Error)]
#[error("cannot {action} '{name}': {error}")]
pub struct SourceError {
    /// What the user calls the source.
    pub name: String,
    /// What was tried, such as `open`.
    pub action: &'static str,
    /// What the system said.
    pub error: io::Error,
    /// What to try.
    pub hint: Option<String>,
}

impl SourceError {
    /// Makes an error without a hint.
    pub fn new(name: &str, action: &'static str, error: io::Error) -> Self {
        SourceError { name: name.to_owned(), action, error, hint: None }
    }

    /// Adds what to try.
    #[must_use]
    pub fn hinted(self, hint: impl Into<String>) -> Self {
        SourceError { hint: Some(hint.into()), ..self }
    }
}
