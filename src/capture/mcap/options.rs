//! How a recording is written, how that fails, and what its files are called.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::time::Anchor;

/// Says how to write a recording.
#[derive(Clone, Debug)]
pub struct Options {
    /// The same in all parts; no other session may have it.
    pub session_id: String,
    /// Ties times to a monotonic clock; without one the first time given is the anchor.
    pub anchor: Option<Anchor>,
    /// Begins a new part after so many nanoseconds.
    pub rotate_time_ns: Option<i64>,
    /// Begins a new part after so many bytes.
    pub rotate_size: Option<u64>,
    /// Begins a new part after so many chunks; each costs about 2 kB of memory.
    pub rotate_chunks: Option<u64>,
    /// Waits for the disk every five seconds and at the end, and refuses to replace an unfinished file.
    pub is_durable: bool,
    /// Files to keep within the recording: name, media type and content.
    pub attachments: Vec<(String, String, Vec<u8>)>,
}

impl Default for Options {
    /// Returns what suits a file made from another: one part, and no waiting for the disk.
    fn default() -> Self {
        Options {
            session_id: String::new(),
            anchor: None,
            rotate_time_ns: None,
            rotate_size: None,
            rotate_chunks: None,
            is_durable: false,
            attachments: Vec::new(),
        }
    }
}

/// Says that a recording cannot be written, and where.
#[derive(Debug, Error)]
#[error("cannot write '{}': {error}", .path.display())]
pub struct RecordError {
    /// The file.
    pub path: PathBuf,
    /// What the system said.
    pub error: io::Error,
}

/// Returns what the part of a recording is called: NAME.mcap, NAME-0002.mcap and so on.
pub fn part_path(path: &Path, part_index: u64) -> PathBuf {
    if part_index <= 1 {
        return path.into();
    }
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{part_index:04}"));
    let mut named = path.with_file_name(name);
    if let Some(extension) = path.extension() {
        let mut name = named.into_os_string();
        name.push(".");
        name.push(extension);
        named = name.into();
    }
    named
}
