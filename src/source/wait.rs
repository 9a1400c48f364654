//! Waiting for bytes without reading them, so that the wait and the read have times of their own.

use std::io;
use std::time::Duration;

/// Waits until a read would return at once: with bytes, or because the other side is gone.
///
/// A signal ends the wait early, so that whoever waits can see what it was about; `false` still means that nothing
/// was there at the end.
#[cfg(unix)]
pub(super) fn readable(file: impl std::os::fd::AsFd, timeout: Duration) -> io::Result<bool> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};

    let mut files = [PollFd::new(&file, PollFlags::IN)];
    // A time too long to be told is no limit.
    let limit = Timespec::try_from(timeout).ok();
    match poll(&mut files, limit.as_ref()) {
        Err(rustix::io::Errno::INTR) => Ok(poll(&mut files, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }))? > 0),
        result => Ok(result? > 0),
    }
}
