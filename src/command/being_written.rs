//! Whether a recording is being written by somebody.

#[cfg(unix)]
use std::fs;
use std::path::Path;

#[cfg(unix)]
use rustix::fs::{FlockOperation, flock};

/// Tells whether a recorder holds the lock on its file.
#[cfg(unix)]
pub(super) fn is_being_written(path: &Path) -> bool {
    #[expect(clippy::disallowed_methods, reason = "only the lock is looked at")]
    let file = fs::File::open(path);
    file.is_ok_and(|file| {
        flock(&file, FlockOperation::NonBlockingLockShared) == Err(rustix::io::Errno::WOULDBLOCK)
    })
}

#[cfg(not(unix))]
pub(super) fn is_being_written(_path: &Path) -> bool {
    false
}
