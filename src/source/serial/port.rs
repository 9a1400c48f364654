//! An open serial port that can only be read.

use std::io;
use std::time::Duration;

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcsetattr,
};
use serialport::{SerialPort, TTYPort};

use super::ioctl::{self, Counts, descriptor};
use crate::line::{LineSettings, Parity, StopBits};

/// How far the speed of an adapter may be off, in per cent: with 3 the last bit of a character is still hit.
const SPEED_TOLERANCE: u64 = 3;

/// Is an open serial port. What it wraps could write; nothing here does, and nothing else gets hold of it.
#[derive(Debug)]
pub(super) struct Port {
    tty: TTYPort,
    /// Whether DTR and RTS could be lowered.
    pub(super) is_quiet: bool,
    /// Whether the driver was willing to hand bytes over soon.
    pub(super) is_low_latency: bool,
}

impl Port {
    /// Opens a port for this program alone.
    ///
    /// From the kernel's open to the raw mode that serialport sets, the kernel may echo what it receives when this
    /// is the first open since the adapter was plugged in: README.md, hardware notes.
    pub(super) fn open(path: &str, baud: u32) -> Result<Self, serialport::Error> {
        let mut tty = serialport::new(path, baud).dtr_on_open(false).open_native()?;
        // On an adapter that enables its driver by RTS, a raised RTS holds the bus. A pty has no such lines.
        let is_rts_low = tty.write_request_to_send(false).is_ok();
        let is_quiet = is_rts_low && tty.write_data_terminal_ready(false).is_ok();
        let is_low_latency = ioctl::ask_for_low_latency(descriptor(&tty)).is_ok();
        // Should somebody else read what poll announced, the read is not to wait for ever.
        let flags = fcntl_getfl(descriptor(&tty)).map_err(io::Error::from)?;
        fcntl_setfl(descriptor(&tty), flags | OFlags::NONBLOCK).map_err(io::Error::from)?;
        Ok(Port { tty, is_quiet, is_low_latency })
    }

    /// Sets speed and format, and throws away what was received before.
    ///
    /// All in one call: serialport's `set_parity` turns on `IGNPAR`, which drops damaged bytes.
    pub(super) fn set_line(&mut self, line: LineSettings) -> io::Result<()> {
        let tty = descriptor(&self.tty);
        let mut termios = tcgetattr(tty)?;
        termios.input_modes = InputModes::INPCK | InputModes::PARMRK;
        termios.control_modes = control_modes(termios.control_modes, line);
        termios.special_codes[SpecialCodeIndex::VMIN] = 1; // more would keep bytes from poll
        termios.special_codes[SpecialCodeIndex::VTIME] = 0;
        termios.set_speed(line.baud)?;
        tcsetattr(tty, OptionalActions::Flush, &termios)?;
        check(&tcgetattr(tty)?, line)
    }

    /// Waits until there is something to read; not at all when `timeout` is zero.
    pub(super) fn wait(&self, timeout: Duration) -> io::Result<bool> {
        super::super::wait::readable(descriptor(&self.tty), timeout)
    }

    /// Reads what is there.
    pub(super) fn read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(rustix::io::read(descriptor(&self.tty), buffer)?)
    }

    /// Returns what the driver has counted, if it counts.
    pub(super) fn counts(&self) -> Option<Counts> {
        ioctl::counts(descriptor(&self.tty)).ok()
    }
}

fn control_modes(old: ControlModes, line: LineSettings) -> ControlModes {
    let format = ControlModes::CSIZE
        | ControlModes::CSTOPB
        | ControlModes::PARENB
        | ControlModes::PARODD
        | ControlModes::CMSPAR
        | ControlModes::CRTSCTS
        | ControlModes::HUPCL;
    let size = match line.data_bits {
        ..=5 => ControlModes::CS5,
        6 => ControlModes::CS6,
        7 => ControlModes::CS7,
        8.. => ControlModes::CS8,
    };
    let parity = match line.parity {
        Parity::None => ControlModes::empty(),
        Parity::Even => ControlModes::PARENB,
        Parity::Odd => ControlModes::PARENB | ControlModes::PARODD,
        Parity::Mark => ControlModes::PARENB | ControlModes::CMSPAR | ControlModes::PARODD,
        Parity::Space => ControlModes::PARENB | ControlModes::CMSPAR,
    };
    let stop = match line.stop_bits {
        // A receiver looks at the first stop bit only.
        StopBits::One | StopBits::OneAndHalf => ControlModes::empty(),
        StopBits::Two => ControlModes::CSTOPB,
    };
    (old - format) | ControlModes::CREAD | ControlModes::CLOCAL | ControlModes::HUPCL | size | parity | stop
}

/// Checks that the driver took what it was given: it changes silently what its hardware cannot do.
fn check(termios: &Termios, line: LineSettings) -> io::Result<()> {
    let (asked, set) = (u64::from(line.baud), u64::from(termios.output_speed()));
    if asked.abs_diff(set).saturating_mul(100) > asked.saturating_mul(SPEED_TOLERANCE) {
        let problem = format!("the adapter offers {set} baud");
        return Err(io::Error::new(io::ErrorKind::Unsupported, problem));
    }
    if !termios.input_modes.contains(InputModes::INPCK | InputModes::PARMRK) {
        return Err(io::Error::new(io::ErrorKind::Unsupported, "the driver marks no damaged bytes"));
    }
    Ok(())
}
