//! The serial ports of this host.

use super::adapter::Adapter;

/// Describes a serial port that could be listened on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Port {
    /// What to open, such as `/dev/ttyUSB0`.
    pub device: String,
    /// A name that stays the same, such as `/dev/serial/by-id/…`.
    pub stable_name: Option<String>,
    /// What is behind it.
    pub adapter: Adapter,
    /// The group it belongs to.
    pub group: Option<String>,
    /// Its permissions, as chmod(1) counts them.
    pub mode: Option<u32>,
    /// Which other programs have it open, as far as we may know, with commas between.
    pub in_use_by: Option<String>,
    /// Why this user may not open it, and what to do; `None` when nothing is in the way.
    pub obstacle: Option<String>,
}

/// Returns the serial ports of this host that have hardware behind them, USB adapters first.
#[cfg(target_os = "linux")]
pub fn ports() -> Vec<Port> {
    super::serial::ports(&super::serial::host::Host::below(std::path::Path::new("/")))
}

/// Returns the serial ports of this host, as serialport finds them.
#[cfg(not(target_os = "linux"))]
pub fn ports() -> Vec<Port> {
    super::serial::ports()
}
