//! `rtutap ports`: the serial ports of this host, and who may open them.

use std::fmt::{self, Write};

use serde::Serialize;

use super::failure::Failure;
use super::message;
use super::output::Output;
use crate::cli::{self, InfoFormat};
use crate::source::{self, LineErrorReports, Port};

/// What to check, from the likeliest on, when an adapter does not show.
const CHECKS: [&str; 4] = [
    "is the adapter plugged in? 'lsusb' shows it, and 'dmesg' whether a driver took it",
    "a kernel updated since the last start has lost its drivers: start the machine again",
    "brltty, where it is installed, takes CH340 adapters (1a86:7523) for Braille displays: remove it",
    "a container or virtual machine must be given the device",
];

/// Runs the command.
pub(super) fn run(args: &cli::Ports) -> Result<(), Failure> {
    let ports = source::ports();
    if ports.is_empty() {
        message::note("there is no serial port");
        CHECKS.iter().for_each(message::hint);
    }
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = ports.iter().try_for_each(|port| match args.format {
        InfoFormat::Text => paragraph(port, &mut text),
        InfoFormat::Json => writeln!(text, "{}", json(port)),
    });
    let mut output = Output::stdout();
    output.buffer.extend_from_slice(text.as_bytes());
    output.flush()
}

fn paragraph(port: &Port, out: &mut String) -> fmt::Result {
    let adapter = &port.adapter;
    match &adapter.usb {
        Some(usb) => writeln!(out, "{}  {usb}", port.device)?,
        None => writeln!(out, "{}  not on USB", port.device)?,
    }
    let mut line = |key: &str, value: &str| writeln!(out, "    {key:<14} {value}");
    if let Some(name) = &port.stable_name {
        line("stable name", name)?;
    }
    let driver = adapter.driver.as_deref();
    line("driver", driver.unwrap_or("not known"))?;
    match adapter.latency_timer_ms {
        Some(1) => line("latency timer", "1 ms")?,
        Some(ms) => line("latency timer", &format!("{ms} ms; set to 1 ms while it is listened on"))?,
        None => {}
    }
    line("line errors", LineErrorReports::of(driver).meaning())?;
    if let Some(program) = &port.in_use_by {
        line("in use", &format!("by {program}"))?;
    }
    let owner = match (&port.group, port.mode) {
        (Some(group), Some(mode)) => format!(" (group {group}, mode {mode:03o})"),
        _ => String::new(),
    };
    match &port.obstacle {
        Some(obstacle) => line("access", &format!("none{owner}: {obstacle}")),
        None => line("access", &format!("you may open it{owner}")),
    }
}

/// Is a port as one JSON object.
#[derive(Serialize)]
struct Row<'a> {
    r#type: &'static str,
    device: &'a str,
    stable_name: Option<&'a str>,
    driver: Option<&'a str>,
    usb_vid_pid: Option<String>,
    usb_serial: Option<&'a str>,
    usb_manufacturer: Option<&'a str>,
    usb_model: Option<&'a str>,
    usb_interface: Option<u8>,
    usb_socket: Option<&'a str>,
    latency_timer_ms: Option<u8>,
    line_errors: &'static str,
    group: Option<&'a str>,
    mode: Option<String>,
    in_use_by: Option<&'a str>,
    obstacle: Option<&'a str>,
}

fn json(port: &Port) -> String {
    let adapter = &port.adapter;
    let usb = adapter.usb.as_ref();
    let row = Row {
        r#type: "port",
        device: &port.device,
        stable_name: port.stable_name.as_deref(),
        driver: adapter.driver.as_deref(),
        usb_vid_pid: usb.map(source::Usb::vid_pid),
        usb_serial: usb.and_then(|usb| usb.serial_number.as_deref()),
        usb_manufacturer: usb.and_then(|usb| usb.manufacturer.as_deref()),
        usb_model: usb.and_then(|usb| usb.model.as_deref()),
        usb_interface: usb.and_then(|usb| usb.interface),
        usb_socket: usb.map(|usb| usb.socket.as_str()).filter(|socket| !socket.is_empty()),
        latency_timer_ms: adapter.latency_timer_ms,
        line_errors: LineErrorReports::of(adapter.driver.as_deref()).name(),
        group: port.group.as_deref(),
        mode: port.mode.map(|mode| format!("{mode:03o}")),
        in_use_by: port.in_use_by.as_deref(),
        obstacle: port.obstacle.as_deref(),
    };
    serde_json::to_string(&row).unwrap_or_default() // plain data: cannot fail
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Adapter, Usb};

    fn ftdi() -> Port {
        let text = |text: &str| Some(text.to_owned());
        let usb = Usb {
            vendor: 0x0403,
            product: 0x6001,
            serial_number: text("A50285BI"),
            manufacturer: text("FTDI"),
            model: text("FT232R USB UART"),
            interface: Some(0),
            socket: "1-1.4".to_owned(),
        };
        let adapter = Adapter {
            device: "ttyUSB0".to_owned(),
            driver: text("ftdi_sio"),
            usb: Some(usb),
            latency_timer_ms: Some(16),
        };
        Port {
            device: "/dev/ttyUSB0".to_owned(),
            stable_name: text("/dev/serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0"),
            adapter,
            group: text("dialout"),
            mode: Some(0o660),
            in_use_by: text("minicom (process 4711)"),
            obstacle: None,
        }
    }

    #[test]
    fn a_paragraph_has_all_that_matters_before_a_port_is_opened() {
        let mut text = String::new();
        paragraph(&ftdi(), &mut text).expect("a string");
        let uart = Adapter { driver: Some("serial".to_owned()), ..Adapter::default() };
        let obstacle = Some("only root may open it".to_owned());
        let uart = Port { device: "/dev/ttyS0".to_owned(), adapter: uart, mode: Some(0), obstacle, ..ftdi() };
        let uart = Port { group: Some("root".to_owned()), stable_name: None, in_use_by: None, ..uart };
        paragraph(&uart, &mut text).expect("a string");
        assert_eq!(
            text,
            "\
/dev/ttyUSB0  FT232R USB UART by FTDI, 0403:6001, serial number A50285BI
    stable name    /dev/serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0
    driver         ftdi_sio
    latency timer  16 ms; set to 1 ms while it is listened on
    line errors    reported for a packet of up to 62 bytes
    in use         by minicom (process 4711)
    access         you may open it (group dialout, mode 660)
/dev/ttyS0  not on USB
    driver         serial
    line errors    reported for each byte
    access         none (group root, mode 000): only root may open it
"
        );
    }

    #[test]
    fn a_json_line_has_every_key_whatever_is_known() {
        let full: serde_json::Value = serde_json::from_str(&json(&ftdi())).expect("JSON");
        let bare: serde_json::Value = serde_json::from_str(&json(&Port::default())).expect("JSON");
        let keys = |value: &serde_json::Value| {
            value.as_object().expect("an object").keys().cloned().collect::<Vec<_>>()
        };
        assert_eq!(keys(&full), keys(&bare));
        assert_eq!((&full["usb_vid_pid"], &full["mode"]), (&"0403:6001".into(), &"660".into()));
        assert_eq!((&full["latency_timer_ms"], &full["line_errors"]), (&16.into(), &"packet".into()));
        assert!(bare["usb_serial"].is_null() && bare["usb_socket"].is_null() && bare["driver"].is_null());
    }
}
