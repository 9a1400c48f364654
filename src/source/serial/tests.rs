//! The serial source against ptys and folders that stand for a host.

mod errors;
mod ports;
mod reading;
mod tree;

use std::fs::File;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use super::super::{Received, Reception, Source, SourceError, SystemClock};
use super::{Host, Serial};
use crate::line::LineSettings;

/// Longer than any machine takes to hand over what is there already.
const LONG: Duration = Duration::from_secs(20);

/// Returns the bus side of a new pty, and the path of the other.
fn pty() -> (File, String) {
    let bus = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pty");
    grantpt(&bus).expect("a pty of ours");
    unlockpt(&bus).expect("a pty of ours");
    let path = ptsname(&bus, Vec::new()).expect("a name").into_string().expect("a plain name");
    (File::from(bus), path)
}

fn open_on(host: Host, device: &str) -> Result<Serial, SourceError> {
    Serial::open(host, device, LineSettings::default(), Arc::new(SystemClock))
}

fn open(device: &str) -> Serial {
    open_on(Host::below(Path::new("/")), device).expect("a pty opens")
}

/// Receives once, and returns what came of it.
fn receive(serial: &mut Serial) -> (Received, Reception) {
    let mut reception = Reception::default();
    let received = serial.receive(LONG, &mut reception).expect("no failure");
    (received, reception)
}
