//! Why a serial device cannot be used, and what may mend it.

use std::fs;
use std::io;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::Path;

use rustix::fs::{Access, access};

use super::super::SourceError;
use super::super::adapter::Usb;
use super::host::Host;
use super::{list, sysfs};
use crate::line::LineSettings;

const BUSY: &str = "two readers would each get half of the bytes: end it first";
const BUSY_WITH_MANY: &str = "each reader would get a part of the bytes: end them first";

/// Checks what can be known of a device without opening it, which would disturb whoever uses it.
///
/// # Errors
/// When there is no such device, it is not one, may not be opened, or is in use.
pub(super) fn check(host: &Host, name: &str, device: &str) -> Result<(), SourceError> {
    let path = Path::new(device);
    let failed = |error| SourceError::new(name, "open", error);
    let metadata = match fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(failed(said(error.kind(), "no such device")).hinted(what_is_there(host, device)));
        }
        Err(error) => return Err(failed(error)),
    };
    if !metadata.file_type().is_char_device() {
        let what = if metadata.is_dir() { "it is a directory" } else { "it is a file, not a serial device" };
        let hint = "'rtutap decode' reads recordings; 'rtutap ports' lists serial devices";
        return Err(failed(said(io::ErrorKind::InvalidInput, what)).hinted(hint));
    }
    if access(path, Access::READ_OK | Access::WRITE_OK).is_err() {
        let error = said(io::ErrorKind::PermissionDenied, "permission denied");
        return Err(failed(error).hinted(permission(host, metadata.gid(), metadata.mode())));
    }
    // Of ptys both ends may well be open in another program.
    let is_hardware = sysfs::device_name(host, path).is_some_and(|tty| sysfs::adapter(host, &tty).is_some());
    let holders = host.holders(path);
    if is_hardware && !holders.is_empty() { Err(busy(name, &holders)) } else { Ok(()) }
}

/// Says why a device could not be opened.
pub(super) fn opening(host: &Host, name: &str, device: &str, error: serialport::Error) -> SourceError {
    let failed = |kind, text: &str| SourceError::new(name, "open", said(kind, text));
    match error.kind() {
        serialport::ErrorKind::NoDevice => busy(name, &host.holders(Path::new(device))),
        // The words of nix for ENOTTY; serialport keeps no number.
        serialport::ErrorKind::Unknown if error.description == "Not a typewriter" => {
            failed(io::ErrorKind::InvalidInput, "it is not a serial device")
                .hinted("'rtutap ports' lists serial devices")
        }
        // ENXIO, ENODEV and EIO: the name is there, what it stands for is not.
        serialport::ErrorKind::Unknown => {
            let text = format!("nothing answers behind it ({})", error.description);
            failed(io::ErrorKind::NotFound, &text).hinted(what_is_there(host, device))
        }
        _ => SourceError::new(name, "open", error.into()),
    }
}

/// Says that line settings were refused.
pub(super) fn line(name: &str, line: LineSettings, error: io::Error) -> SourceError {
    let error = io::Error::new(error.kind(), format!("{error}, asked for {line}"));
    SourceError::new(name, "set the line of", error).hinted("choose another speed, or another adapter")
}

/// Says that an adapter is away.
pub(super) fn unplugged(name: &str, usb: &Usb) -> SourceError {
    let error = said(io::ErrorKind::NotFound, &format!("{usb} is not plugged in"));
    let hint = match usb.serial_number {
        Some(_) => "plug it in again, into any socket".to_owned(),
        None => format!("plug it into the same socket ({}): only that tells it from others", usb.socket),
    };
    SourceError::new(name, "open", error).hinted(hint)
}

fn busy(name: &str, holders: &[String]) -> SourceError {
    let text = match holders {
        [] => "it is in use".to_owned(),
        [one] => format!("{one} is using it"),
        [others @ .., last] => format!("{} and {last} are using it", others.join(", ")),
    };
    let hint = match holders {
        _ if holders.iter().any(|holder| holder.starts_with("ModemManager")) => {
            "ModemManager looks for modems on it, by sending: see the udev rule in README.md"
        }
        [_, _, ..] => BUSY_WITH_MANY,
        _ => BUSY,
    };
    SourceError::new(name, "open", said(io::ErrorKind::ResourceBusy, &text)).hinted(hint)
}

/// Says who may open a device, and what to do to be one of them.
pub(super) fn permission(host: &Host, group: u32, mode: u32) -> String {
    const GROUP_READ_WRITE: u32 = 0o060;
    let (name, members) = host.group(group).unwrap_or_else(|| (group.to_string(), Vec::new()));
    if mode & GROUP_READ_WRITE != GROUP_READ_WRITE || group == 0 {
        return "only root may open it: a udev rule gives it to a group, see README.md".to_owned();
    }
    let user = std::env::var("USER").unwrap_or_else(|_| "$USER".to_owned());
    match members.contains(&user) {
        true => format!("you are in its group '{name}', but this session began before: log out and in again"),
        false => {
            format!("it belongs to the group '{name}': 'sudo usermod -aG {name} {user}', then log in again")
        }
    }
}

/// Says what devices there are, and which of them may have been meant.
fn what_is_there(host: &Host, device: &str) -> String {
    let ports = list::ports(host);
    if ports.is_empty() {
        return "there is no serial port: is the adapter plugged in? 'rtutap ports' says what to check"
            .to_owned();
    }
    let meant = ports.iter().map(|port| (strsim::jaro(&port.device, device), port));
    let nearest = meant.max_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, port)| &port.device);
    let all: Vec<&str> = ports.iter().map(|port| port.device.as_str()).collect();
    match nearest {
        Some(nearest) if ports.len() > 1 => format!("did you mean {nearest}? There are {}", all.join(", ")),
        _ => format!("there is {}", all.join(", ")),
    }
}

fn said(kind: io::ErrorKind, text: &str) -> io::Error {
    io::Error::new(kind, text)
}
