//! The simulation behind a pty: read as any serial port is.

use std::fs::File;
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::Builder;

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use super::super::failure::Failure;
use super::played::Pace;
use crate::line::LineSettings;
use crate::simulate::Simulation;
use crate::source::{self, Clock, Place, Source, Spec};

/// Keeps the simulation going; dropped, it ends.
pub(super) struct Wire {
    _stop: Sender<()>,
}

/// Lets a simulation speak into a pty, and opens the other side of it.
///
/// # Errors
/// When the system has no ptys, or they cannot be used.
pub(super) fn connect(
    simulation: Simulation,
    line: LineSettings,
    clock: &Arc<dyn Clock>,
) -> Result<(Box<dyn Source>, Wire), Failure> {
    let failed = |error: io::Error| Failure::new(format!("cannot make a pty: {error}"));
    let open = || {
        let bus = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&bus)?;
        unlockpt(&bus)?;
        let name = ptsname(&bus, Vec::new())?;
        Ok::<_, rustix::io::Errno>((File::from(bus), name.to_string_lossy().into_owned()))
    };
    let (bus, name) = open().map_err(|error| failed(error.into()))?;
    // Before anything is said: a pty says back what it hears until it is opened as a bus is.
    let source = source::open(&Spec { name: None, place: Place::Serial(name) }, line, Arc::clone(clock))?;
    let (stop, stopped) = channel();
    let clock = Arc::clone(clock);
    let thread = Builder::new().name("simulation".to_owned());
    thread.spawn(move || speak(simulation, bus, &*clock, &stopped)).map_err(failed)?;
    Ok((source, Wire { _stop: stop }))
}

/// Speaks until told to stop, or until nobody listens any more.
fn speak(simulation: Simulation, mut bus: File, clock: &dyn Clock, stopped: &Receiver<()>) {
    let mut pace = Pace::new();
    for read in simulation {
        let wait = pace.until(&read, clock.monotonic_ns());
        if stopped.recv_timeout(wait) != Err(RecvTimeoutError::Timeout) || bus.write_all(&read.bytes).is_err()
        {
            return;
        }
    }
}
