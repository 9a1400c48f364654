//! What is said when a device cannot be opened, and what to try.

use super::super::failure::permission;
use super::tree::Tree;
use super::*;

/// Returns the message and the hint, the folder of the test host left out.
fn said(tree: &Tree, device: &str) -> (String, String) {
    let path = tree.path(device).to_string_lossy().into_owned();
    let Err(error) = open_on(tree.host(), &path) else { panic!("{path} opens") };
    let root = tree.path("").to_string_lossy().into_owned();
    let plain = |text: &str| text.replace(&root, "/");
    (plain(&error.to_string()), plain(&error.hint.unwrap_or_default()))
}

#[test]
fn a_device_that_is_not_there_names_those_that_are() {
    let tree = Tree::new();
    let (message, hint) = said(&tree, "dev/ttyUSB0");
    assert_eq!(message, "cannot open '/dev/ttyUSB0': no such device");
    assert_eq!(hint, "there is no serial port: is the adapter plugged in? 'rtutap ports' says what to check");
    tree.usb("ttyUSB1", "1-1", &["0403", "6001", "A1"], "ftdi_sio");
    assert_eq!(said(&tree, "dev/ttyUSB0").1, "there is /dev/ttyUSB1");
    tree.usb("ttyACM0", "1-2", &["2341", "0043", "B1"], "cdc_acm");
    assert_eq!(
        said(&tree, "dev/ttyUSB0").1,
        "did you mean /dev/ttyUSB1? There are /dev/ttyACM0, /dev/ttyUSB1"
    );
}

#[test]
fn what_is_no_serial_device_is_said_to_be_none() {
    let tree = Tree::new();
    tree.device("ttyUSB0", "/dev/null");
    let (message, hint) = said(&tree, "dev/ttyUSB0");
    assert_eq!(message, "cannot open '/dev/ttyUSB0': it is not a serial device");
    assert_eq!(hint, "'rtutap ports' lists serial devices");
    let (message, hint) = said(&tree, "etc/group");
    assert_eq!(message, "cannot open '/etc/group': it is a file, not a serial device");
    assert_eq!(hint, "'rtutap decode' reads recordings; 'rtutap ports' lists serial devices");
    assert_eq!(said(&tree, "dev").0, "cannot open '/dev': it is a directory");
}

#[test]
fn an_adapter_that_another_program_reads_is_left_alone_and_the_program_named() {
    let tree = Tree::new();
    let (_bus, device) = pty();
    tree.usb("ttyUSB0", "1-1", &["0403", "6001", "A1"], "ftdi_sio");
    tree.device("ttyUSB0", &device);
    tree.process("4711", "minicom", &device);
    let (message, hint) = said(&tree, "dev/ttyUSB0");
    assert_eq!(message, "cannot open '/dev/ttyUSB0': minicom (process 4711) is using it");
    assert_eq!(hint, "two readers would each get half of the bytes: end it first");
    tree.process("812", "cat", &device);
    tree.process("90", "screen", &device);
    let (message, hint) = said(&tree, "dev/ttyUSB0");
    let holders = "screen (process 90), cat (process 812) and minicom (process 4711)";
    assert_eq!(message, format!("cannot open '/dev/ttyUSB0': {holders} are using it"));
    assert_eq!(hint, "each reader would get a part of the bytes: end them first");
}

#[test]
fn a_modem_manager_at_the_adapter_is_shown_the_way_out() {
    let tree = Tree::new();
    let (_bus, device) = pty();
    tree.usb("ttyACM0", "1-1", &["2341", "0043", "A1"], "cdc_acm");
    tree.device("ttyACM0", &device);
    tree.process("99", "ModemManager", &device);
    assert!(said(&tree, "dev/ttyACM0").1.contains("udev rule"));
}

#[test]
fn a_pty_open_here_already_is_in_use() {
    let (_bus, device) = pty();
    let _first = open(&device);
    let Err(error) = open_on(Host::below(Path::new("/")), &device) else { panic!("opened twice") };
    assert_eq!(error.to_string(), format!("cannot open '{device}': it is in use"));
}

#[test]
fn who_may_not_open_a_device_is_told_which_group_may() {
    let host = Tree::new();
    let host = host.host();
    let hint = permission(&host, 986, 0o660);
    assert!(hint.starts_with("it belongs to the group 'uucp': 'sudo usermod -aG uucp "), "{hint}");
    assert!(permission(&host, 77, 0o660).starts_with("it belongs to the group '77'"));
    let only_root = "only root may open it: a udev rule gives it to a group, see README.md";
    assert_eq!(permission(&host, 0, 0o660), only_root);
    assert_eq!(permission(&host, 20, 0o600), only_root);
    assert_eq!(permission(&host, 20, 0o640), only_root);
}

#[test]
fn an_adapter_without_serial_number_says_which_socket_it_is_awaited_in() {
    let tree = Tree::new();
    let (bus, device) = pty();
    tree.usb("ttyUSB0", "1-1.4", &["1a86", "7523"], "ch341-uart");
    tree.device("ttyUSB0", &device);
    let named = tree.path("dev/ttyUSB0").to_string_lossy().into_owned();
    let mut serial = open_on(tree.host(), &named).expect("it opens");
    assert_eq!(serial.facts().get("line_errors").map(String::as_str), Some("not available on this adapter"));
    drop(bus);
    assert_eq!(receive(&mut serial).0, Received::Gone);
    tree.unplug("ttyUSB0");
    tree.usb("ttyUSB0", "1-1.3", &["1a86", "7523"], "ch341-uart");
    tree.device("ttyUSB0", &pty().1);
    let error = serial.reopen().expect_err("it may be another one");
    assert!(
        error.to_string().ends_with("USB adapter, 1a86:7523, no serial number is not plugged in"),
        "{error}"
    );
    assert_eq!(
        error.hint.as_deref(),
        Some("plug it into the same socket (1-1.4): only that tells it from others")
    );
}
