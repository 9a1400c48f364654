//! Live bytes: from a serial port, a serial server or standard input.
//!
//! One trait, and nothing in it can write to a bus. Knows bytes and times, no Modbus.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use crate::decode::chunk::LineError;
use crate::line::LineSettings;

mod adapter;
mod backoff;
mod clock;
mod error;
#[cfg(target_os = "linux")]
mod marks;
mod ports;
#[cfg(target_os = "linux")]
mod serial;
#[cfg(not(target_os = "linux"))]
#[path = "serial_elsewhere.rs"]
mod serial;
mod spec;
mod standard_input;
mod tcp;
#[cfg(unix)]
mod wait;

pub use adapter::{Adapter, LineErrorReports, Usb};
pub use backoff::backoff;
pub use clock::{Clock, SystemClock};
pub use error::SourceError;
pub use ports::{Port, ports};
pub use spec::{Place, Spec, SpecError};

/// Opens a source; one with line settings of its own receives with `line`.
///
/// A serial port is opened for this program alone, and what it had received before is thrown away.
///
/// # Errors
/// When it is not there, may not be opened, is in use, or refuses the line settings.
pub fn open(spec: &Spec, line: LineSettings, clock: Arc<dyn Clock>) -> Result<Box<dyn Source>, SourceError> {
    let name = spec.place.to_string();
    Ok(match &spec.place {
        #[cfg(target_os = "linux")]
        Place::Serial(device) => {
            let host = serial::host::Host::below(std::path::Path::new("/"));
            Box::new(serial::Serial::open(host, device, line, clock)?)
        }
        #[cfg(not(target_os = "linux"))]
        Place::Serial(device) => Box::new(serial::Serial::open(device, line, clock)?),
        Place::Tcp { host, port } => Box::new(tcp::Tcp::open(host, *port, name, clock)?),
        Place::StandardInput => Box::new(standard_input::StandardInput::open(clock)?),
    })
}

/// Receives the bytes of a bus.
pub trait Source: Send {
    /// Returns what the user calls it: a device, `tcp://host:port` or `-`.
    fn name(&self) -> &str;

    /// Waits for bytes, at most `timeout`, and puts what came into `reception`, whose old content goes.
    ///
    /// # Errors
    /// When the source fails in a way that waiting does not mend.
    fn receive(&mut self, timeout: Duration, reception: &mut Reception) -> Result<Received, SourceError>;

    /// Receives with other line settings from now on; what is queued unread is thrown away.
    ///
    /// # Errors
    /// When the source refuses them; one without line settings of its own accepts all.
    fn set_line(&mut self, _line: LineSettings) -> Result<(), SourceError> {
        Ok(())
    }

    /// Tries once, without waiting, to get back a source that was [`Received::Gone`].
    ///
    /// # Errors
    /// When it is still away.
    fn reopen(&mut self) -> Result<(), SourceError> {
        Ok(()) // never gone
    }

    /// Returns the longest time that the adapter keeps a byte back, in nanoseconds, where it is known.
    fn adapter_hold_ns(&self) -> Option<i64> {
        None
    }

    /// Returns facts for people and for the recording, such as `usb_vid_pid` and `latency_timer_ms`.
    fn facts(&self) -> BTreeMap<String, String> {
        BTreeMap::new()
    }

    /// Returns what the adapter has counted since it was opened; `None` when it cannot count.
    fn counters(&mut self) -> Option<Counters> {
        None
    }
}

/// Tells what came of waiting for bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// Bytes or line errors are in the reception.
    Bytes,
    /// Nothing came, as of the reception's time.
    Silence,
    /// The adapter was unplugged or the server went away.
    Gone,
    /// The source has ended for good, as a pipe does.
    Ended,
}

/// Holds the bytes of one read, with its times and line errors.
#[derive(Clone, Debug, Default)]
pub struct Reception {
    /// When poll said that bytes are there, on the clock of [`Clock::monotonic_ns`].
    pub ready_ns: u64,
    /// When the read was done, or the wait was over, on the same clock.
    pub monotonic_ns: u64,
    /// What was received, with marks for errors undone.
    pub bytes: Vec<u8>,
    /// Line errors, in order of their offsets in `bytes`.
    pub line_errors: Vec<LineError>,
    /// Whether the read took all that was there and the buffer before it may have been full, so that bytes may be
    /// missing that nobody counted.
    pub is_suspect: bool,
}

impl Reception {
    /// Forgets what was received; what it allocated stays.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.line_errors.clear();
        self.is_suspect = false;
    }

    /// Takes this moment for both times.
    fn stamp(&mut self, clock: &dyn Clock) {
        self.ready_ns = clock.monotonic_ns();
        self.monotonic_ns = self.ready_ns;
    }
}

/// Counts what an adapter has seen and lost since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Bytes received.
    pub received: u64,
    /// Bytes with a wrong stop bit.
    pub framing: u64,
    /// Bytes with a wrong parity bit.
    pub parity: u64,
    /// Breaks.
    pub breaks: u64,
    /// Bytes the UART had no room for.
    pub overruns: u64,
    /// Bytes the kernel had no room for.
    pub buffer_overruns: u64,
}
