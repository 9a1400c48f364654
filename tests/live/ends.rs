//! How a session ends, and what does not end it.

use std::os::unix::fs::symlink;
use std::path::Path;

use rtutap::simulate::Adapter;
use rustix::process::Signal;

use crate::bus::{Bus, LAST, Tap, bytes_in, info, printed, reads, wait_until};

fn record<'a>(source: &'a str, output: &'a str) -> Vec<&'a str> {
    vec!["record", source, "-o", output, "--min-free", "0"]
}

/// Waits until the disk holds so many bytes of the bus.
fn wait_for_bytes(part: &Path, count: usize) {
    wait_until("the disk has the bytes", || bytes_in(&[part]) >= count as u64);
}

#[test]
fn each_signal_finishes_the_file_and_prints_its_path() {
    for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
        let directory = tempfile::tempdir().expect("a directory");
        let mut bus = Bus::new();
        let output = directory.path().to_str().expect("UTF-8");
        let mut tap = Tap::start(&record(&bus.path, output));
        bus.wait_for_listener();
        bus.say(&LAST);
        let part = || {
            let entry = directory.path().read_dir().expect("a directory").next()?;
            Some(entry.expect("a file").path())
        };
        wait_until("there is a file", || part().is_some());
        wait_for_bytes(&part().expect("a file"), LAST.len());
        tap.signal(signal);
        let (status, said) = tap.wait();
        assert!(status.success(), "{said}");
        let path = Path::new(tap.printed.trim());
        assert!(path.extension().is_some_and(|extension| extension == "mcap"), "{path:?}");
        assert_eq!(info(&[path])["complete"], true);
        assert_eq!(info(&[path])["bytes"], LAST.len());
    }
}

#[test]
fn a_signal_that_comes_twice_at_once_as_timeout_sends_it_finishes_the_file_too() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let name = path.to_str().expect("UTF-8");
    let mut bus = Bus::new();
    let mut tap = Tap::start(&record(&bus.path, name));
    bus.wait_for_listener();
    bus.say(&LAST);
    wait_for_bytes(&directory.path().join("a.mcap.part"), LAST.len());
    for signal in [Signal::TERM, Signal::INT, Signal::TERM] {
        tap.signal(signal);
    }
    let (status, said) = tap.wait();
    assert!(status.success(), "{status}: {said}");
    assert_eq!(info(&[&path])["complete"], true);
}

#[test]
fn the_end_of_standard_input_ends_a_session() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let name = path.to_str().expect("UTF-8");
    let bytes: Vec<u8> =
        reads("installation", Adapter::Uart, 1, 5000).into_iter().flat_map(|read| read.bytes).collect();
    let mut program = assert_cmd::cargo::cargo_bin_cmd!("rtutap");
    program.args(record("-", name)).write_stdin(bytes.clone()).assert().success();
    assert_eq!(info(&[&path])["bytes"], bytes.len(), "a pipe at full speed loses nothing");
}

#[test]
fn an_adapter_that_is_unplugged_leaves_a_hole_and_the_session_goes_on() {
    let directory = tempfile::tempdir().expect("a directory");
    let (device, path) = (directory.path().join("adapter"), directory.path().join("a.mcap"));
    let mut bus = Bus::new();
    symlink(&bus.path, &device).expect("a link");
    let (device, name) = (device.to_str().expect("UTF-8"), path.to_str().expect("UTF-8"));
    let mut tap = Tap::start(&["listen", device, "--show", "frames", "--format", "json", "--record", name]);
    bus.wait_for_listener();
    bus.say(&LAST);
    tap.wait_for("f70312340001d42a");
    drop(bus);
    tap.wait_for("\"kind\":\"source-gone\"");
    let mut bus = Bus::new();
    std::fs::remove_file(device).expect("a link");
    symlink(&bus.path, device).expect("a link");
    bus.wait_for_listener();
    bus.say(&LAST);
    tap.wait_for("f70312340001d42a");
    let said = tap.interrupt();
    assert!(said.contains("is gone") && said.contains("is back"), "{said}");
    assert_eq!(tap.printed, printed(&["decode", name, "--show", "frames", "--format", "json"]));
}

#[test]
fn what_was_left_unfinished_is_named_with_what_mends_it() {
    let directory = tempfile::tempdir().expect("a directory");
    let left = directory.path().join("old.mcap.part");
    std::fs::write(&left, b"").expect("a disk that works");
    let bus = Bus::new();
    let output = directory.path().to_str().expect("UTF-8");
    let mut first = Tap::start(&record(&bus.path, output));
    bus.wait_for_listener();
    let other = Bus::new();
    let mut second = Tap::start(&record(&other.path, output));
    other.wait_for_listener();
    let said = second.interrupt();
    assert!(said.contains(&format!("rtutap recover {}", left.display())), "{said}");
    assert_eq!(
        said.matches(".part' was never finished").count(),
        1,
        "that of the first is being written: {said}"
    );
    first.interrupt();
}

#[test]
fn a_program_that_was_stopped_says_where_bytes_may_be_missing() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let name = path.to_str().expect("UTF-8");
    let mut bus = Bus::new();
    let mut tap =
        Tap::start(&["listen", &bus.path, "--show", "frames", "--format", "json", "--record", name]);
    bus.wait_for_listener();
    bus.say(&LAST);
    tap.wait_for("f70312340001d42a");
    tap.signal(Signal::STOP);
    let mut said = LAST.len();
    let much = LAST.repeat(1000);
    let mut rest: &[u8] = &[];
    // The kernel takes what it has room for, and no more; how soon the program stops is its own affair.
    wait_until("the kernel is full", || {
        rest = if rest.is_empty() { &much } else { rest };
        let count = bus.say_some(rest);
        said += count;
        rest = &rest[count..];
        count == 0 && bus.is_full()
    });
    tap.signal(Signal::CONT);
    tap.wait_for("\"kind\":\"overrun\",\"count\":0");
    wait_for_bytes(&directory.path().join("a.mcap.part"), said);
    tap.interrupt();
    assert_eq!(info(&[&path])["bytes"], said);
}
