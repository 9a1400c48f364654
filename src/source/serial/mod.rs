//! A serial port on Linux: opened by serialport, read by hand.
//!
//! By hand, because serialport drops damaged bytes, and its `read` leaves no moment between wait and read to look at
//! the clock, and loses the last bytes before an adapter is unplugged.

mod failure;
pub(super) mod host;
mod ioctl;
mod list;
mod port;
mod sysfs;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use rustix::io::Errno;

use super::adapter::{Adapter, LineErrorReports};
use super::marks::Marks;
use super::{Clock, Counters, Received, Reception, Source, SourceError};
use crate::line::LineSettings;
use crate::time::MILLISECOND;
use host::Host;
use ioctl::Counts;
use port::Port;

pub(super) use list::ports;

/// What the kernel keeps of a terminal's input, in bytes (`N_TTY_BUF_SIZE` of drivers/tty/n_tty.c).
const RING: usize = 4096;
/// From how many bytes at once the kernel may have told the driver to stop, so that the adapter lost some.
///
/// It does so with room for fewer than 128 characters (n_tty.c), each counted as the three bytes that a mark takes;
/// with marks a ring holds 4093 plain bytes, as measured on Linux 6.18.
const SUSPECT: usize = RING - 3 * 128;

/// Receives from a serial port.
pub(super) struct Serial {
    host: Host,
    name: String,
    line: LineSettings,
    clock: Arc<dyn Clock>,
    /// Where it was found last; differs from the name when the adapter came back under another.
    device: String,
    /// `None` for a pty.
    adapter: Option<Adapter>,
    /// `None` while it is away.
    port: Option<Port>,
    marks: Marks,
    buffer: Box<[u8; RING]>,
    /// What the driver had counted when it was asked last; `None` when it does not count.
    counts: Option<Counts>,
    counters: Option<Counters>,
}

impl Serial {
    /// Opens a device for this program alone, and throws away what it had received before.
    ///
    /// # Errors
    /// When there is no such device, it is not a serial one, may not be opened, is in use, or refuses the line.
    pub(super) fn open(
        host: Host,
        name: &str,
        line: LineSettings,
        clock: Arc<dyn Clock>,
    ) -> Result<Self, SourceError> {
        let mut serial = Serial {
            host,
            name: name.to_owned(),
            line,
            clock,
            device: name.to_owned(),
            adapter: None,
            port: None,
            marks: Marks::default(),
            buffer: Box::new([0; RING]),
            counts: None,
            counters: None,
        };
        serial.open_device(name)?;
        serial.adapter = serial.look_up(name);
        Ok(serial)
    }

    fn open_device(&mut self, device: &str) -> Result<(), SourceError> {
        failure::check(&self.host, &self.name, device)?;
        let mut port = Port::open(device, self.line.baud)
            .map_err(|error| failure::opening(&self.host, &self.name, device, error))?;
        port.set_line(self.line).map_err(|error| failure::line(&self.name, self.line, error))?;
        self.marks = Marks::default();
        self.counts = port.counts();
        self.counters = self.counts.map(|_| self.counters.unwrap_or_default());
        self.port = Some(port);
        device.clone_into(&mut self.device);
        Ok(())
    }

    fn look_up(&self, device: &str) -> Option<Adapter> {
        sysfs::adapter(&self.host, &sysfs::device_name(&self.host, Path::new(device))?)
    }

    /// Returns the device at which the adapter is now, which may have another name than before.
    fn find(&self) -> Result<String, SourceError> {
        let Some(usb) = self.adapter.as_ref().and_then(|adapter| adapter.usb.as_ref()) else {
            return Ok(self.name.clone());
        };
        let is_it = |adapter: &Adapter| adapter.usb.as_ref().is_some_and(|other| usb.is_same(other));
        if self.look_up(&self.name).as_ref().is_some_and(is_it) {
            return Ok(self.name.clone());
        }
        match sysfs::adapters(&self.host).iter().find(|adapter| is_it(adapter)) {
            Some(adapter) => Ok(self.host.dev.join(&adapter.device).to_string_lossy().into_owned()),
            None => Err(failure::unplugged(&self.name, usb)),
        }
    }
}

impl Source for Serial {
    fn name(&self) -> &str {
        &self.name
    }

    fn receive(&mut self, timeout: Duration, reception: &mut Reception) -> Result<Received, SourceError> {
        reception.clear();
        let Some(port) = &self.port else {
            reception.stamp(&*self.clock);
            return Ok(Received::Gone);
        };
        let failed = |error| SourceError::new(&self.name, "read", error);
        // Goes round again only when all that a read brought was half a mark.
        while reception.bytes.is_empty() {
            let is_ready = port.wait(timeout).map_err(failed)?;
            reception.stamp(&*self.clock);
            if !is_ready {
                return Ok(Received::Silence);
            }
            let count = match port.read(&mut *self.buffer) {
                Ok(count) => count,
                Err(error) if is_nothing(&error) => return Ok(Received::Silence),
                Err(error) if is_gone(&error) => 0,
                Err(error) => return Err(failed(error)),
            };
            reception.monotonic_ns = self.clock.monotonic_ns();
            if count == 0 {
                self.port = None; // closed at once, or the adapter's name stays taken
                return Ok(Received::Gone);
            }
            reception.is_suspect |= count >= SUSPECT;
            let raw = self.buffer.get(..count).unwrap_or_default();
            self.marks.undo(raw, &mut reception.bytes, &mut reception.line_errors);
        }
        Ok(Received::Bytes)
    }

    fn set_line(&mut self, line: LineSettings) -> Result<(), SourceError> {
        if let Some(port) = &mut self.port {
            port.set_line(line).map_err(|error| failure::line(&self.name, line, error))?;
        }
        self.line = line;
        self.marks = Marks::default();
        Ok(())
    }

    fn reopen(&mut self) -> Result<(), SourceError> {
        if self.port.is_some() {
            return Ok(());
        }
        let device = self.find()?;
        self.open_device(&device)?;
        self.adapter = self.look_up(&device).or_else(|| self.adapter.take());
        Ok(())
    }

    fn adapter_hold_ns(&self) -> Option<i64> {
        let ms = self.adapter.as_ref()?.latency_timer_ms?;
        Some(i64::from(ms).saturating_mul(MILLISECOND))
    }

    fn facts(&self) -> BTreeMap<String, String> {
        let mut facts = BTreeMap::new();
        let mut say = |key: &str, value: Option<String>| {
            facts.extend(value.map(|value| (key.to_owned(), value)));
        };
        say("device", (self.device != self.name).then(|| self.device.clone()));
        if let Some(adapter) = &self.adapter {
            let driver = adapter.driver.as_deref();
            say("driver", driver.map(str::to_owned));
            say("line_errors", Some(LineErrorReports::of(driver).meaning().to_owned()));
            say("latency_timer_ms", adapter.latency_timer_ms.map(|ms| ms.to_string()));
        }
        if let Some(usb) = self.adapter.as_ref().and_then(|adapter| adapter.usb.as_ref()) {
            say("usb_vid_pid", Some(usb.vid_pid()));
            say("usb_serial", usb.serial_number.clone());
            say("usb_model", usb.model.clone());
            say("usb_manufacturer", usb.manufacturer.clone());
        }
        if let Some(port) = &self.port {
            let yes_or = |is_so: bool, no: &str| Some(if is_so { "yes" } else { no }.to_owned());
            say("low_latency", yes_or(port.is_low_latency, "not available on this adapter"));
            say("dtr_rts_low", yes_or(port.is_quiet, "not available on this adapter"));
        }
        let counted = self.counters.is_none().then(|| "not available on this adapter".to_owned());
        say("counters", Some(counted.unwrap_or_else(|| "yes".to_owned())));
        facts
    }

    fn counters(&mut self) -> Option<Counters> {
        let counters = self.counters.as_mut()?;
        if let Some(now) = self.port.as_ref().and_then(Port::counts) {
            counters.add(self.counts.replace(now).unwrap_or(now), now);
        }
        Some(*counters)
    }
}

impl Counters {
    /// Adds what a driver counted from `before` to `now`; its counts wrap.
    fn add(&mut self, before: Counts, now: Counts) {
        let grow = |total: &mut u64, before: i32, now: i32| {
            let more = now.wrapping_sub(before).cast_unsigned();
            *total = total.saturating_add(u64::from(more));
        };
        grow(&mut self.received, before.rx, now.rx);
        grow(&mut self.framing, before.frame, now.frame);
        grow(&mut self.parity, before.parity, now.parity);
        grow(&mut self.breaks, before.brk, now.brk);
        grow(&mut self.overruns, before.overrun, now.overrun);
        grow(&mut self.buffer_overruns, before.buf_overrun, now.buf_overrun);
    }
}

/// Tells whether a read found nothing after all.
fn is_nothing(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}

/// Tells whether the adapter is gone: what the kernel says differs by driver, and by how far it got.
fn is_gone(error: &io::Error) -> bool {
    let gone =
        [Errno::IO, Errno::NXIO, Errno::NODEV, Errno::NOTTY, Errno::PIPE, Errno::PROTO, Errno::SHUTDOWN];
    error.raw_os_error().is_some_and(|code| gone.iter().any(|errno| errno.raw_os_error() == code))
}
