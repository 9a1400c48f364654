//! A serial port on macOS or Windows, with what serialport alone offers: no line errors, no counters.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::sync::Arc;
use std::time::Duration;

use serialport::{ClearBuffer, DataBits, SerialPort, SerialPortType, StopBits as Stop};

use super::adapter::{Adapter, Usb};
use super::ports::Port;
use super::{Clock, Received, Reception, Source, SourceError};
use crate::line::{LineSettings, Parity, StopBits};

/// Receives from a serial port.
pub(super) struct Serial {
    name: String,
    line: LineSettings,
    clock: Arc<dyn Clock>,
    port: Option<Box<dyn SerialPort>>,
    buffer: Vec<u8>,
}

impl Serial {
    /// Opens a device for this program alone.
    pub(super) fn open(name: &str, line: LineSettings, clock: Arc<dyn Clock>) -> Result<Self, SourceError> {
        let mut serial = Serial { name: name.to_owned(), line, clock, port: None, buffer: vec![0; 4096] };
        serial.reopen()?;
        Ok(serial)
    }
}

fn parity(line: LineSettings) -> io::Result<serialport::Parity> {
    match line.parity {
        Parity::None => Ok(serialport::Parity::None),
        Parity::Even => Ok(serialport::Parity::Even),
        Parity::Odd => Ok(serialport::Parity::Odd),
        Parity::Mark | Parity::Space => {
            Err(io::Error::new(io::ErrorKind::Unsupported, "mark and space parity are for Linux only"))
        }
    }
}

fn set_line(port: &mut dyn SerialPort, line: LineSettings) -> io::Result<()> {
    port.set_baud_rate(line.baud)?;
    port.set_parity(parity(line)?)?;
    port.set_data_bits(match line.data_bits {
        ..=5 => DataBits::Five,
        6 => DataBits::Six,
        7 => DataBits::Seven,
        8.. => DataBits::Eight,
    })?;
    port.set_stop_bits(if line.stop_bits == StopBits::Two { Stop::Two } else { Stop::One })?;
    Ok(port.clear(ClearBuffer::Input)?)
}

impl Source for Serial {
    fn name(&self) -> &str {
        &self.name
    }

    fn receive(&mut self, timeout: Duration, reception: &mut Reception) -> Result<Received, SourceError> {
        reception.clear();
        let result = match &mut self.port {
            Some(port) => {
                port.set_timeout(timeout.max(Duration::from_millis(1)))
                    .map_err(|error| SourceError::new(&self.name, "read", error.into()))?;
                port.read(&mut self.buffer)
            }
            None => Ok(0),
        };
        reception.stamp(&*self.clock);
        match result {
            Ok(count @ 1..) => {
                reception.bytes.extend_from_slice(self.buffer.get(..count).unwrap_or_default());
                Ok(Received::Bytes)
            }
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                Ok(Received::Silence)
            }
            Ok(0) | Err(_) => {
                self.port = None;
                Ok(Received::Gone)
            }
        }
    }

    fn set_line(&mut self, line: LineSettings) -> Result<(), SourceError> {
        if let Some(port) = &mut self.port {
            set_line(&mut **port, line)
                .map_err(|error| SourceError::new(&self.name, "set the line of", error))?;
        }
        self.line = line;
        Ok(())
    }

    fn reopen(&mut self) -> Result<(), SourceError> {
        let failed = |error: io::Error| {
            SourceError::new(&self.name, "open", error).hinted("'rtutap ports' lists serial ports")
        };
        let opened = serialport::new(&self.name, self.line.baud).dtr_on_open(false).open();
        let mut port = opened.map_err(|error| failed(error.into()))?;
        // An adapter may have no such line.
        let _ = port.write_request_to_send(false);
        set_line(&mut *port, self.line).map_err(failed)?;
        self.port = Some(port);
        Ok(())
    }

    fn facts(&self) -> BTreeMap<String, String> {
        let fact = |key: &str| (key.to_owned(), "not available on this system".to_owned());
        BTreeMap::from([fact("line_errors"), fact("counters")])
    }
}

/// Returns the ports that serialport finds.
pub(super) fn ports() -> Vec<Port> {
    let ports = serialport::available_ports().unwrap_or_default().into_iter();
    ports
        .map(|port| {
            let usb = match port.port_type {
                SerialPortType::UsbPort(usb) => Some(Usb {
                    vendor: usb.vid,
                    product: usb.pid,
                    serial_number: usb.serial_number,
                    manufacturer: usb.manufacturer,
                    model: usb.product,
                    ..Usb::default()
                }),
                _ => None,
            };
            let adapter = Adapter { device: port.port_name.clone(), usb, ..Adapter::default() };
            Port { device: port.port_name, adapter, ..Port::default() }
        })
        .collect()
}
