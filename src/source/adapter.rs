//! What this host knows of the adapter behind a serial device.

use std::fmt;

/// Describes the adapter behind a serial device; what the host does not say is `None`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Adapter {
    /// What the kernel calls the device, such as `ttyUSB0`.
    pub device: String,
    /// The driver, such as `ftdi_sio`.
    pub driver: Option<String>,
    /// What it says of itself on USB.
    pub usb: Option<Usb>,
    /// How long an FTDI chip keeps bytes back at most, in milliseconds, 1 to 255; 16 from the factory.
    pub latency_timer_ms: Option<u8>,
}

/// Describes a USB device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Usb {
    /// Vendor number.
    pub vendor: u16,
    /// Product number.
    pub product: u16,
    /// Serial number; cheap adapters have none.
    pub serial_number: Option<String>,
    /// Who made it.
    pub manufacturer: Option<String>,
    /// What it is.
    pub model: Option<String>,
    /// Which interface of the device, from 0: adapters with several ports have several.
    pub interface: Option<u8>,
    /// The socket it is in, such as `1-1.4`; empty where the system does not say.
    pub socket: String,
}

impl Usb {
    /// Returns vendor and product number in hexadecimal, such as `0403:6001`.
    pub fn vid_pid(&self) -> String {
        format!("{:04x}:{:04x}", self.vendor, self.product)
    }

    /// Tells whether both are the same adapter.
    ///
    /// Without a serial number only the socket tells adapters of one kind apart.
    pub fn is_same(&self, other: &Usb) -> bool {
        let kind = |usb: &Usb| (usb.vendor, usb.product, usb.interface);
        let is_known = match &self.serial_number {
            Some(_) => self.serial_number == other.serial_number,
            None => other.serial_number.is_none() && self.socket == other.socket,
        };
        kind(self) == kind(other) && is_known
    }
}

impl fmt::Display for Usb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let model = self.model.as_deref().unwrap_or("USB adapter");
        write!(f, "{model}")?;
        if let Some(manufacturer) = &self.manufacturer {
            write!(f, " by {manufacturer}")?;
        }
        write!(f, ", {}", self.vid_pid())?;
        match &self.serial_number {
            Some(number) => write!(f, ", serial number {number}"),
            None => f.write_str(", no serial number"),
        }
    }
}

/// Names what a driver tells of damaged bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineErrorReports {
    /// Which byte it was.
    Byte,
    /// Which packet of bytes it was in.
    Packet,
    /// How many there were.
    Count,
    /// Nothing.
    None,
    /// It is not known what it tells.
    Unknown,
}

impl LineErrorReports {
    /// Returns what the Linux driver of this name tells (sources of Linux 6.12).
    pub fn of(driver: Option<&str>) -> Self {
        match driver {
            Some("serial" | "serial8250" | "dw-apb-uart" | "of_serial" | "uart-pl011" | "cp210x") => {
                LineErrorReports::Byte
            }
            Some("ftdi_sio" | "pl2303") => LineErrorReports::Packet,
            Some("cdc_acm") => LineErrorReports::Count,
            Some("ch341" | "ch341-uart") => LineErrorReports::None,
            _ => LineErrorReports::Unknown,
        }
    }

    /// Returns a short name, as in JSON.
    pub fn name(self) -> &'static str {
        match self {
            LineErrorReports::Byte => "byte",
            LineErrorReports::Packet => "packet",
            LineErrorReports::Count => "count",
            LineErrorReports::None => "none",
            LineErrorReports::Unknown => "unknown",
        }
    }

    /// Returns what that means for a person.
    pub fn meaning(self) -> &'static str {
        match self {
            LineErrorReports::Byte => "reported for each byte",
            LineErrorReports::Packet => "reported for a packet of up to 62 bytes",
            LineErrorReports::Count => "only counted",
            LineErrorReports::None => "not available on this adapter",
            LineErrorReports::Unknown => "not known for this driver",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adapters_without_serial_number_are_told_apart_by_their_socket() {
        let usb = |serial_number: Option<&str>, socket: &str| Usb {
            vendor: 0x1a86,
            product: 0x7523,
            serial_number: serial_number.map(str::to_owned),
            socket: socket.to_owned(),
            ..Usb::default()
        };
        assert!(usb(Some("A1"), "1-1").is_same(&usb(Some("A1"), "1-2")), "moved to another socket");
        assert!(!usb(Some("A1"), "1-1").is_same(&usb(Some("A2"), "1-1")), "another one of the kind");
        assert!(usb(None, "1-1").is_same(&usb(None, "1-1")));
        assert!(!usb(None, "1-1").is_same(&usb(None, "1-2")), "nobody can know");
        let second = Usb { interface: Some(1), ..usb(Some("A1"), "1-1") };
        assert!(!second.is_same(&usb(Some("A1"), "1-1")), "another port of one adapter");
    }
}
