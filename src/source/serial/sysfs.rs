//! The kernel's own account of serial adapters: `/sys/class/tty`.

use std::fs;
use std::path::{Path, PathBuf};

use super::super::adapter::{Adapter, Usb};
use super::host::{Host, text};

/// How many folders up from a tty its USB device is looked for.
const LEVELS: usize = 6;

/// Returns the adapter behind the device of this name, such as `ttyUSB0`; `None` without hardware, as for a pty.
pub(super) fn adapter(host: &Host, device: &str) -> Option<Adapter> {
    let class = host.sys.join("class/tty").join(device);
    let hardware = fs::canonicalize(class.join("device")).ok()?;
    // The 8250 driver makes devices in advance, of type 0 while there is no UART.
    if text(&class.join("type")).as_deref() == Some("0") {
        return None;
    }
    let root = fs::canonicalize(&host.sys).ok()?;
    let above: Vec<&Path> =
        hardware.ancestors().take_while(|folder| folder.starts_with(&root)).take(LEVELS).collect();
    let latency = text(&hardware.join("latency_timer"));
    Some(Adapter {
        device: device.to_owned(),
        driver: above.iter().find_map(|folder| driver(folder)),
        usb: usb(&above),
        latency_timer_ms: latency.and_then(|ms| ms.parse().ok()),
    })
}

/// Returns all adapters, by name; numbers in names count as numbers.
pub(super) fn adapters(host: &Host) -> Vec<Adapter> {
    let entries = fs::read_dir(host.sys.join("class/tty")).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut found: Vec<Adapter> = names.filter_map(|name| adapter(host, &name)).collect();
    found.sort_by_cached_key(|adapter| {
        let letters = adapter.device.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = adapter.device.get(letters.len()..).and_then(|digits| digits.parse::<u32>().ok());
        (adapter.usb.is_none(), letters.to_owned(), number)
    });
    found
}

/// Returns the name of the driver bound to a device, but for those between a UART and its port (Linux 6.6 on).
fn driver(folder: &Path) -> Option<String> {
    let end_of = |link: &str| last_name(&fs::read_link(folder.join(link)).ok()?);
    let driver = end_of("driver")?;
    (end_of("subsystem").as_deref() != Some("serial-base")).then_some(driver)
}

fn usb(above: &[&Path]) -> Option<Usb> {
    let folder = above.iter().find(|folder| folder.join("idVendor").exists())?;
    let hex = |name: &str| u16::from_str_radix(&text(&folder.join(name))?, 16).ok();
    let interface = above.iter().find_map(|folder| text(&folder.join("bInterfaceNumber")));
    Some(Usb {
        vendor: hex("idVendor")?,
        product: hex("idProduct")?,
        serial_number: text(&folder.join("serial")),
        manufacturer: text(&folder.join("manufacturer")),
        model: text(&folder.join("product")),
        interface: interface.and_then(|number| u8::from_str_radix(&number, 16).ok()),
        socket: last_name(folder).unwrap_or_default(),
    })
}

fn last_name(path: &Path) -> Option<String> {
    Some(path.file_name()?.to_str()?.to_owned())
}

/// Returns the kernel's name of the device that a path leads to, such as `ttyUSB0` for `/dev/serial/by-id/…`.
pub(super) fn device_name(host: &Host, path: &Path) -> Option<String> {
    // As written first: it may itself be a link in the folder of devices, as in tests.
    let within = |path: PathBuf| path.strip_prefix(&host.dev).ok()?.to_str().map(str::to_owned);
    let written = within(path.to_owned()).filter(|name| host.sys.join("class/tty").join(name).exists());
    written.or_else(|| within(fs::canonicalize(path).ok()?))
}
