//! What ends a live session from outside.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::super::failure::Failure;

/// Makes the first of SIGINT, SIGTERM and SIGHUP set the flag that is returned, and the second end the program at once.
///
/// # Errors
/// When the system does not let a program handle them.
pub(in crate::command) fn stop_flag() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let signals = [
        SIGINT,
        SIGTERM,
        #[cfg(unix)]
        signal_hook::consts::SIGHUP,
    ];
    for signal in signals {
        // The shell's way to say that a signal ended a program.
        let status = 128 + signal;
        // The order counts: the second signal finds the flag set by the first.
        flag::register_conditional_shutdown(signal, status, Arc::clone(&stop))
            .and_then(|_| flag::register(signal, Arc::clone(&stop)))
            .map_err(|error| Failure::new(format!("cannot handle signals: {error}")))?;
    }
    Ok(stop)
}
