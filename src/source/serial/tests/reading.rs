//! What is read: bytes, marks and times, also around the moments a pty closes.

use std::io::Write;
use std::os::fd::OwnedFd;
use std::os::unix::fs::symlink;

use rustix::fs::{Mode, OFlags};
use rustix::termios::{InputModes, LocalModes, tcgetattr};

use super::super::super::Clock;
use super::tree::Tree;
use super::*;
use crate::decode::chunk::LineErrorKind;

/// Opens a pty before the source does, which lets nobody in after it.
fn opened_beside(device: &str) -> OwnedFd {
    rustix::fs::open(device, OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).expect("a pty")
}

/// Waits until so many bytes can be read: the kernel moves what was written when it likes.
fn wait_until_there(pty: &OwnedFd, count: u64) {
    let limit = SystemClock.monotonic_ns() + u64::try_from(LONG.as_nanos()).expect("seconds");
    while rustix::io::ioctl_fionread(pty).expect("a pty") < count {
        assert!(SystemClock.monotonic_ns() < limit, "{count} bytes do not come");
        std::thread::yield_now();
    }
}

#[test]
fn bytes_come_undoubled_with_the_times_of_wait_and_read() {
    let (mut bus, device) = pty();
    let mut serial = open(&device);
    bus.write_all(&[0x01, 0xff, 0x03, 0xff, 0xff, 0x00]).expect("room");
    let (received, reception) = receive(&mut serial);
    assert_eq!(received, Received::Bytes);
    assert_eq!(reception.bytes, [0x01, 0xff, 0x03, 0xff, 0xff, 0x00]);
    assert_eq!((reception.line_errors.len(), reception.is_suspect), (0, false));
    assert!(reception.ready_ns > 0 && reception.ready_ns <= reception.monotonic_ns);
}

#[test]
fn silence_is_said_as_of_the_end_of_the_wait_and_forgets_what_was_received() {
    let (_bus, device) = pty();
    let mut serial = open(&device);
    let mut reception = Reception { bytes: vec![1], is_suspect: true, ..Reception::default() };
    let received = serial.receive(Duration::ZERO, &mut reception).expect("no failure");
    assert_eq!(received, Received::Silence);
    assert!(reception.bytes.is_empty() && !reception.is_suspect && reception.monotonic_ns > 0);
}

#[test]
fn what_lay_there_before_it_was_opened_is_thrown_away_and_nothing_is_ever_echoed() {
    let (mut bus, device) = pty();
    let other = opened_beside(&device);
    drop(open(&device));
    bus.write_all(b"stale").expect("room");
    wait_until_there(&other, 5);
    let mut serial = open(&device);
    bus.write_all(b"fresh").expect("room");
    assert_eq!(receive(&mut serial).1.bytes, b"fresh");
    let echoed = super::super::super::wait::readable(&bus, Duration::ZERO).expect("a wait");
    assert!(!echoed, "the bus would hear it");
}

#[test]
fn reads_that_find_the_kernels_buffer_full_are_suspect_and_lose_none_of_its_bytes() {
    let (mut bus, device) = pty();
    let other = opened_beside(&device);
    let mut serial = open(&device);
    // As on a line that nobody read for four seconds.
    rustix::io::ioctl_fionbio(&bus, true).expect("a pty of ours");
    let mut sent = 0;
    while let Ok(count) = bus.write(&[0x55; 512]) {
        sent += count;
    }
    wait_until_there(&other, 4093); // all that fits
    let (mut read, mut suspects) = (0, Vec::new());
    while read < sent {
        let (received, reception) = receive(&mut serial);
        assert_eq!(received, Received::Bytes, "{read} of {sent} bytes");
        read += reception.bytes.len();
        suspects.push(reception.is_suspect);
    }
    assert_eq!((read, suspects.first()), (sent, Some(&true)), "{suspects:?}");
}

#[test]
fn damaged_bytes_stay_marked_whatever_the_line_becomes() {
    let (bus, device) = pty();
    let mut serial = open(&device);
    for line in ["19200-8E1", "1200-7O2", "115200-8N1", "9600-8M1", "123456-8S1"] {
        serial.set_line(line.parse().expect("a line")).expect("a pty takes any");
        let termios = tcgetattr(&bus).expect("the bus side shows the settings of the other");
        assert_eq!(termios.input_modes, InputModes::INPCK | InputModes::PARMRK, "{line}");
        assert!(!termios.local_modes.intersects(LocalModes::ECHO | LocalModes::ICANON), "{line}");
        assert_eq!(termios.output_speed().to_string(), line.split_once('-').expect("a line").0);
    }
}

#[test]
fn a_mark_cut_by_two_reads_is_one_byte_with_its_time_of_reading() {
    // ptys make no marks; what the kernel would deliver is handed to the decoder in their stead.
    let mut serial = open(&pty().1);
    let (mut bytes, mut errors) = (Vec::new(), Vec::new());
    serial.marks.undo(&[0x01, 0xff], &mut bytes, &mut errors);
    serial.marks.undo(&[0x00, 0x26], &mut bytes, &mut errors);
    assert_eq!(
        (bytes, errors.first().map(|error| error.kind)),
        (vec![1, 0x26], Some(LineErrorKind::ParityOrFraming))
    );
}

#[test]
fn a_closed_pty_is_gone_until_it_is_opened_again_at_the_same_path() {
    let tree = Tree::new();
    let link = tree.path("link").to_string_lossy().into_owned();
    let (bus, device) = pty();
    symlink(&device, &link).expect("a link");
    let mut serial = open(&link);
    // The link first: another pty may get the number of this one.
    std::fs::remove_file(&link).expect("a link");
    drop(bus);
    assert_eq!(receive(&mut serial).0, Received::Gone);
    assert_eq!(receive(&mut serial).0, Received::Gone, "and stays so");
    let error = serial.reopen().expect_err("still away").to_string();
    assert_eq!(error, format!("cannot open '{link}': no such device"));

    let (mut bus, device) = pty();
    symlink(&device, &link).expect("a link");
    serial.reopen().expect("it is back");
    serial.reopen().expect("nothing to do");
    bus.write_all(&[1, 2, 3]).expect("room");
    assert_eq!(receive(&mut serial).1.bytes, [1, 2, 3]);
}

#[test]
fn an_adapter_that_comes_back_under_another_name_is_found_by_its_serial_number() {
    let tree = Tree::new();
    let (bus, device) = pty();
    tree.usb("ttyUSB0", "1-1", &["0403", "6001", "A50285BI"], "ftdi_sio");
    tree.latency_timer("ttyUSB0", "16");
    tree.device("ttyUSB0", &device);
    let named = tree.path("dev/ttyUSB0").to_string_lossy().into_owned();
    let mut serial = open_on(tree.host(), &named).expect("it opens");
    assert_eq!(serial.adapter_hold_ns(), Some(16_000_000));

    drop(bus);
    assert_eq!(receive(&mut serial).0, Received::Gone);
    tree.unplug("ttyUSB0");
    let error = serial.reopen().expect_err("unplugged");
    let said = "FT232R by FTDI, 0403:6001, serial number A50285BI is not plugged in";
    assert_eq!(error.to_string(), format!("cannot open '{named}': {said}"));

    // Another of its kind takes the old name; this one is plugged into another socket.
    let ((_other, other_device), (mut bus, device)) = (pty(), pty());
    tree.usb("ttyUSB0", "1-1", &["0403", "6001", "OTHER"], "ftdi_sio");
    tree.device("ttyUSB0", &other_device);
    tree.usb("ttyUSB1", "1-2", &["0403", "6001", "A50285BI"], "ftdi_sio");
    tree.device("ttyUSB1", &device);
    serial.reopen().expect("it is back");
    bus.write_all(&[7]).expect("room");
    assert_eq!(receive(&mut serial).1.bytes, [7]);
    assert_eq!(serial.name(), named, "the user's name for it stays");
    assert_eq!(serial.facts().get("device").map(String::as_str), tree.path("dev/ttyUSB1").to_str());
}

#[test]
fn a_pty_says_that_it_counts_nothing_rather_than_nothing_lost() {
    let mut serial = open(&pty().1);
    assert_eq!(serial.counters(), None);
    assert_eq!(serial.adapter_hold_ns(), None);
    let facts = serial.facts();
    for key in ["counters", "low_latency", "dtr_rts_low"] {
        assert_eq!(facts.get(key).map(String::as_str), Some("not available on this adapter"), "{key}");
    }
}

#[test]
fn counts_go_on_when_those_of_the_driver_wrap_or_start_afresh() {
    use super::super::super::Counters;
    use super::super::ioctl::Counts;

    let mut counters = Counters::default();
    let counts = |rx, frame| {
        let mut counts = Counts::default();
        (counts.rx, counts.frame) = (rx, frame);
        counts
    };
    counters.add(counts(i32::MAX, 3), counts(i32::MIN, 5));
    counters.add(counts(0, 0), counts(4, 1));
    assert_eq!((counters.received, counters.framing, counters.overruns), (5, 3, 0));
}
