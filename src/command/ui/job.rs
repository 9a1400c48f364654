//! The program as a job of a shell: stopped by Ctrl-Z or from outside, and brought back.

use std::io;

use rustix::process::{Signal, getpgrp, getsid, kill_current_process_group};
use signal_hook::consts::SIGTSTP;
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

use super::{Teller, Word};

/// Tells the screen whenever the program is asked to stop, so that the terminal is given back first.
///
/// # Errors
/// When the system does not let a program handle that.
pub(super) fn hear_stops(teller: Teller) -> io::Result<()> {
    let mut signals = Signals::new([SIGTSTP])?;
    let hear = move || signals.forever().for_each(|_| teller.tell(Word::Suspend));
    std::thread::Builder::new().name("stops".to_owned()).spawn(hear).map(drop)
}

/// Tells whether a shell is there to bring a stopped program back: one gives each of its jobs a group of its own.
pub(super) fn has_shell() -> bool {
    getsid(None).is_ok_and(|session| session != getpgrp())
}

/// Stops with all programs of the job, those too that started this one, until somebody says to go on: the shell waits
/// for all of them.
///
/// # Errors
/// When the system refuses.
pub(super) fn stop_all() -> io::Result<()> {
    kill_current_process_group(Signal::TSTP)?;
    stop()
}

/// Stops until somebody says to go on.
///
/// # Errors
/// When the system refuses.
pub(super) fn stop() -> io::Result<()> {
    emulate_default_handler(SIGTSTP)
}
