//! What people should know while a bus is tapped.

use super::super::message;

/// Is something to be said on standard error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::command) enum Notice {
    /// Something is wrong.
    Warning(String),
    /// Something is as it is.
    Note(String),
    /// Something could be done.
    Hint(String),
}

impl Notice {
    /// Says it.
    pub(in crate::command) fn say(&self) {
        match self {
            Notice::Warning(text) => message::warning(text),
            Notice::Note(text) => message::note(text),
            Notice::Hint(text) => message::hint(text),
        }
    }
}
