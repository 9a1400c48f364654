//! Why a command could not be done.

use std::fmt::Display;
use std::io;
use std::path::Path;

use crate::capture::InputError;
use crate::capture::mcap::RecordError;
use crate::config::ConfigError;

/// Is why a command ended early.
#[derive(Debug)]
pub(super) enum Failure {
    /// Nobody reads the output any more.
    ClosedPipe,
    /// It was done, and what was found is grave enough to fail.
    Findings,
    /// It could not be done.
    Problem {
        /// What was wrong, and where.
        message: String,
        /// How to mend it.
        hint: Option<String>,
    },
}

impl Failure {
    pub(super) fn new(message: impl Display) -> Self {
        Failure::Problem { message: message.to_string(), hint: None }
    }

    pub(super) fn hinted(message: impl Display, hint: impl Display) -> Self {
        Failure::Problem { message: message.to_string(), hint: Some(hint.to_string()) }
    }

    /// Makes a failure of what the system said about a file that was to be read.
    pub(super) fn reading(path: &Path, error: &io::Error) -> Self {
        Failure::new(format!("cannot read '{}': {error}", path.display()))
    }

    /// Makes a failure of what the system said about an output.
    pub(super) fn writing(name: impl Display, error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Failure::ClosedPipe,
            io::ErrorKind::NotFound => {
                Failure::hinted(format!("cannot write '{name}': {error}"), "create the directory first")
            }
            _ => Failure::new(format!("cannot write '{name}': {error}")),
        }
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Failure::hinted(&error, error.hint())
    }
}

impl From<RecordError> for Failure {
    fn from(error: RecordError) -> Self {
        match error.error.kind() {
            io::ErrorKind::AlreadyExists => Failure::hinted(
                format!(
                    "cannot write '{}': an unfinished recording of that name is there",
                    error.path.display()
                ),
                "'rtutap recover' makes it whole; or remove it, or choose another name",
            ),
            _ => Failure::writing(error.path.display(), &error.error),
        }
    }
}

impl From<ConfigError> for Failure {
    fn from(error: ConfigError) -> Self {
        Failure::hinted(&error, error.hint())
    }
}
