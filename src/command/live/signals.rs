//! What ends a live session from outside.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::super::failure::Failure;

const SIGNALS: &[i32] = &[
    SIGINT,
    SIGTERM,
    #[cfg(unix)]
    signal_hook::consts::SIGHUP,
];

/// Makes the first of SIGINT, SIGTERM and SIGHUP set the flag that is returned, and one that comes half a second later
/// or more end the program at once.
///
/// # Errors
/// When the system does not let a program handle them.
pub(in crate::command) fn stop_flag() -> Result<Arc<AtomicBool>, Failure> {
    let failed = |error: std::io::Error| Failure::new(format!("cannot handle signals: {error}"));
    let stop = Arc::new(AtomicBool::new(false));
    let is_impatient = patience(&stop).map_err(failed)?;
    for signal in SIGNALS {
        // The shell's way to say that a signal ended a program.
        let status = 128 + signal;
        // The order counts: where the flags are one, the second signal finds it set by the first.
        flag::register_conditional_shutdown(*signal, status, Arc::clone(&is_impatient))
            .and_then(|_| flag::register(*signal, Arc::clone(&stop)))
            .map_err(failed)?;
    }
    Ok(stop)
}

/// Returns a flag that is set half a second after the first signal: timeout(1) and others send theirs to a program and
/// to its group, and mean one.
#[cfg(unix)]
fn patience(_stop: &Arc<AtomicBool>) -> std::io::Result<Arc<AtomicBool>> {
    use std::sync::atomic::Ordering;
    use std::time::Duration;

    let is_over = Arc::new(AtomicBool::new(false));
    let mut signals = signal_hook::iterator::Signals::new(SIGNALS)?;
    let flag = Arc::clone(&is_over);
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        if signals.forever().next().is_some() {
            #[expect(clippy::disallowed_methods, reason = "how long a person takes for a second Ctrl-C")]
            std::thread::sleep(Duration::from_millis(500));
            flag.store(true, Ordering::Relaxed);
        }
    })?;
    Ok(is_over)
}

/// Returns the flag that the first signal sets.
#[cfg(not(unix))]
fn patience(stop: &Arc<AtomicBool>) -> std::io::Result<Arc<AtomicBool>> {
    Ok(Arc::clone(stop))
}
