//! The program as a job of a shell: stopped by Ctrl-Z or from outside, and brought back.

use std::io;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use rustix::process::{Signal, getpgrp, getsid, kill_current_process_group};
use signal_hook::consts::SIGTSTP;
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

use super::{Teller, Word};

/// How long to wait for the program to hear what it has asked of its own job.
const OWN_VOICE: Duration = Duration::from_millis(500);

/// Tells the screen whenever the program is asked to stop, so that the terminal is given back first; what is returned
/// is told after that.
///
/// # Errors
/// When the system does not let a program handle that.
pub(super) fn hear_stops(teller: Teller) -> io::Result<Receiver<()>> {
    let mut signals = Signals::new([SIGTSTP])?;
    let (sender, told) = channel();
    let hear = move || {
        for _ in signals.forever() {
            teller.tell(Word::Suspend);
            // Nobody may wait for it.
            let _ = sender.send(());
        }
    };
    std::thread::Builder::new().name("stops".to_owned()).spawn(hear)?;
    Ok(told)
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
pub(super) fn stop_all(told: &Receiver<()>) -> io::Result<()> {
    while told.try_recv().is_ok() {}
    kill_current_process_group(Signal::TSTP)?;
    // Heard now, it cannot be taken for what somebody else asks later.
    let _ = told.recv_timeout(OWN_VOICE);
    stop()
}

/// Stops until somebody says to go on.
///
/// # Errors
/// When the system refuses.
pub(super) fn stop() -> io::Result<()> {
    emulate_default_handler(SIGTSTP)
}
