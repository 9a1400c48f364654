//! What is found of the ports of a host.

use super::super::list::ports;
use super::super::sysfs::device_name;
use super::tree::Tree;
use super::*;

#[test]
fn usb_adapters_come_first_and_uarts_without_hardware_not_at_all() {
    let tree = Tree::new();
    tree.uart("ttyS0", "4");
    tree.uart("ttyS1", "0");
    tree.usb("ttyUSB10", "1-3", &["0403", "6001", "A3"], "ftdi_sio");
    tree.usb("ttyUSB2", "1-2", &["0403", "6001", "A2"], "ftdi_sio");
    tree.usb("ttyACM0", "1-1", &["2341", "0043", "A1"], "cdc_acm");
    let ports = ports(&tree.host());
    let found: Vec<_> =
        ports.iter().map(|port| (port.adapter.device.as_str(), port.adapter.driver.as_deref())).collect();
    let expected = [
        ("ttyACM0", Some("cdc_acm")),
        ("ttyUSB2", Some("ftdi_sio")),
        ("ttyUSB10", Some("ftdi_sio")),
        ("ttyS0", Some("serial")),
    ];
    assert_eq!(found, expected);
}

#[test]
fn a_port_has_its_identity_its_latency_timer_and_a_name_that_stays() {
    let tree = Tree::new();
    let (_bus, device) = pty();
    tree.usb("ttyUSB0", "1-1.4", &["0403", "6001", "A50285BI"], "ftdi_sio");
    tree.latency_timer("ttyUSB0", "16");
    tree.device("ttyUSB0", &device);
    tree.stable_name("usb-FTDI_FT232R_A50285BI-if00-port0", "ttyUSB0");
    tree.process("4711", "minicom", &device);
    tree.process("812", "ModemManager", &device);
    let ports = ports(&tree.host());
    let [port] = ports.as_slice() else { panic!("{ports:?}") };
    let usb = port.adapter.usb.as_ref().expect("an identity");
    assert_eq!(usb.to_string(), "FT232R by FTDI, 0403:6001, serial number A50285BI");
    assert_eq!((usb.interface, usb.socket.as_str()), (Some(0), "1-1.4"));
    assert_eq!(port.adapter.latency_timer_ms, Some(16));
    let stable = tree.path("dev/serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0");
    assert_eq!(port.stable_name.as_deref(), stable.to_str());
    assert_eq!(port.in_use_by.as_deref(), Some("ModemManager (process 812), minicom (process 4711)"));
    let through = device_name(&tree.host(), &tree.path("dev/ttyUSB0"));
    assert_eq!(through.as_deref(), Some("ttyUSB0"));
}

#[test]
fn a_port_without_its_device_file_says_so() {
    let tree = Tree::new();
    tree.usb("ttyUSB0", "1-1", &["0403", "6001", "A1"], "ftdi_sio");
    let ports = ports(&tree.host());
    let obstacle = ports.first().and_then(|port| port.obstacle.as_deref()).expect("an obstacle");
    assert!(obstacle.contains("a container must be given the device"), "{obstacle}");
}

#[test]
fn attributes_that_make_no_sense_are_left_out() {
    let tree = Tree::new();
    tree.usb("ttyUSB0", "1-1", &["vendor", "6001"], "ftdi_sio");
    tree.latency_timer("ttyUSB0", "70000");
    let ports = ports(&tree.host());
    let adapter = &ports.first().expect("a port").adapter;
    assert_eq!((adapter.usb.as_ref(), adapter.latency_timer_ms), (None, None));
}
