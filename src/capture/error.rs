//! Why an input cannot be read, and what could be done about it.

use std::io;

use thiserror::Error;

use super::mcap::Damage;
use super::{HexError, Malformed};

/// Says why an input could not be read; `hint` says what to do about it.
#[derive(Debug, Error)]
pub enum InputError {
    /// The system refused to open or to read it.
    #[error("cannot read '{name}': {error}")]
    Io {
        /// The input's name.
        name: String,
        /// What the system said.
        error: io::Error,
    },
    /// It is a directory.
    #[error("cannot read '{0}': it is a directory")]
    Directory(String),
    /// It is an MCAP file of something else; with its topics and their schemas.
    #[error(
        "'{name}' is an MCAP file, but no recording of a bus: it has no channel /<bus>/raw of rtutap.RawChunk"
    )]
    Foreign {
        /// The input's name.
        name: String,
        /// What it has instead.
        has: String,
    },
    /// It was to be read as MCAP, and is none.
    #[error("'{0}' is no MCAP file, as which it was to be read")]
    NotMcap(String),
    /// It is a recording in MCAP that ends before its first byte of a bus.
    #[error("'{0}' is an unfinished recording that ends before the first byte of a bus")]
    CutShort(String),
    /// It holds no byte of a bus.
    #[error("'{0}' is empty: there is not a byte in it")]
    Empty(String),
    /// It is a recording in MCAP that can be read from end to end, but has no byte of a bus.
    #[error("'{0}' is a recording, but there is not a byte of a bus in it")]
    Silent(String),
    /// It is a recording in MCAP of which no byte of a bus can be read.
    #[error("no byte of a bus can be read from '{name}': at byte {} {}", .damage.offset, .damage.cause)]
    Lost {
        /// The input's name.
        name: String,
        /// The first place that cannot be read.
        damage: Damage,
    },
    /// It is a recording in MCAP whose messages can be read, but not what they are.
    #[error(
        "'{name}' has {messages} messages of channels whose definition is lost, and no byte of a bus besides"
    )]
    Undefined {
        /// The input's name.
        name: String,
        /// How many there are.
        messages: u64,
    },
    /// It is hex text with something in it that is not.
    #[error("'{name}', {error}")]
    Hex {
        /// The input's name.
        name: String,
        /// Where and what.
        error: HexError,
    },
    /// It is an import with something in it that cannot be understood.
    #[error("'{name}', {error}")]
    Malformed {
        /// The input's name.
        name: String,
        /// Where and what.
        error: Malformed,
    },
}

impl InputError {
    /// Returns what could be done about it.
    pub fn hint(&self) -> String {
        match self {
            InputError::Io { error, .. } => match error.kind() {
                io::ErrorKind::NotFound => "check the path; '-' reads standard input",
                io::ErrorKind::PermissionDenied => "check who may read the file",
                _ => "check that the file can be read to its end",
            },
            InputError::Directory(_) => "name the recordings in it, such as DIRECTORY/*",
            InputError::Foreign { has, .. } => return format!("it has {has}"),
            InputError::NotMcap(_) => "leave out --input-format: formats are told apart by content",
            InputError::CutShort(_) => "nothing was received before it ended, or what was is lost",
            InputError::Empty(_) => "check that the recording was written; comments and times alone are none",
            InputError::Silent(_) => "nothing was received while it was made, or what was is lost",
            InputError::Lost { .. } | InputError::Undefined { .. } => {
                "look for another copy; 'rtutap recover' finds no more than this"
            }
            InputError::Hex { error, .. } => error.hint(),
            InputError::Malformed { error, .. } => error.hint,
        }
        .to_owned()
    }
}
