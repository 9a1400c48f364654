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
