//! Disks that fill up, go away, or are full.

use std::fs;
use std::path::{Path, PathBuf};

use rtutap::simulate::Adapter;
use rustix::process::Signal;

use crate::bus::{Bus, LAST, Tap, bytes_in, info, pace, reads, wait_until};

fn files(directory: &Path) -> Vec<PathBuf> {
    let entries = directory.read_dir().expect("a directory");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    files
}

#[test]
fn nothing_is_lost_where_one_file_ends_and_the_next_begins() {
    let directory = tempfile::tempdir().expect("a directory");
    let output = directory.path().join("a.mcap");
    let mut bus = Bus::new();
    let output = output.to_str().expect("UTF-8");
    let mut tap = Tap::start(&["record", &bus.path, "-o", output, "--min-free", "0", "--rotate-time", "1s"]);
    bus.wait_for_listener();
    let reads = reads("tight", Adapter::Uart, 1, 300);
    pace(&reads, |read| bus.say(&read.bytes));
    bus.say(&LAST);
    let all = || files(directory.path());
    let count = reads.iter().map(|read| read.bytes.len()).sum::<usize>() + LAST.len();
    let in_files = || all().iter().map(|file| bytes_in(&[file])).sum::<u64>();
    wait_until("all is on the disk", || in_files() == count as u64);
    tap.interrupt();
    let all = all();
    assert!(all.len() > 3, "{all:?}");
    let info = info(&all.iter().map(PathBuf::as_path).collect::<Vec<_>>());
    assert_eq!((&info["bytes"], &info["damaged"]), (&count.into(), &0.into()));
}

#[test]
fn a_disk_with_too_little_room_ends_the_recording_in_order() {
    let directory = tempfile::tempdir().expect("a directory");
    let output = directory.path().join("a.mcap");
    let mut bus = Bus::new();
    let name = output.to_str().expect("UTF-8");
    // More than is free, and less than the disk has.
    let disk = rustix::fs::statvfs(directory.path()).expect("a disk");
    let floor = format!("{}B", (disk.f_bavail + disk.f_blocks) / 2 * disk.f_frsize);
    let mut tap = Tap::start(&["record", &bus.path, "-o", name, "--min-free", &floor]);
    bus.wait_for_listener();
    // It may end before it hears all.
    bus.say_some(&LAST);
    let (status, said) = tap.wait();
    assert_eq!(status.code(), Some(2), "{said}");
    assert!(said.contains("--drop-oldest makes room"), "{said}");
    assert!(!output.with_extension("mcap.part").exists());
}

#[test]
fn a_floor_that_no_disk_could_meet_is_refused_before_anything_is_recorded() {
    let directory = tempfile::tempdir().expect("a directory");
    let output = directory.path().join("a.mcap");
    let bus = Bus::new();
    let name = output.to_str().expect("UTF-8");
    let (status, said) = Tap::start(&["record", &bus.path, "-o", name, "--min-free", "1000000TB"]).wait();
    assert_eq!((status.code(), files(directory.path()).len()), (Some(2), 0), "{said}");
    assert!(said.contains("can never be met: the whole disk has"), "{said}");
}

#[test]
fn a_directory_that_is_removed_is_said_and_waited_for() {
    let parent = tempfile::tempdir().expect("a directory");
    let directory = parent.path().join("recordings");
    fs::create_dir(&directory).expect("a directory");
    let mut bus = Bus::new();
    let output = directory.join("a.mcap");
    let name = output.to_str().expect("UTF-8");
    let mut tap = Tap::start(&["listen", &bus.path, "--record", name, "--show", "frames"]);
    bus.wait_for_listener();
    bus.say(&LAST);
    tap.wait_for("f7 03");
    let first = output.with_extension("mcap.part");
    wait_until("the disk has the bytes", || bytes_in(&[&first]) == LAST.len() as u64);
    fs::remove_dir_all(&directory).expect("a directory");
    let second = directory.join("a-0002.mcap.part");
    let mut said = 1;
    wait_until("the recording goes on in another file", || {
        bus.say(&LAST);
        said += 1;
        // It goes on only once there is a directory again, and it was missed.
        if said == 1500 {
            fs::create_dir(&directory).expect("a directory");
        }
        said > 1500 && bytes_in(&[&second]) > 0
    });
    tap.signal(Signal::INT);
    let (status, stderr) = tap.wait();
    assert!(status.success(), "{stderr}");
    assert!(stderr.contains("the file was removed") && stderr.contains("recording goes on in"), "{stderr}");
    let info = info(&[&directory.join("a-0002.mcap")]);
    assert_eq!(info["complete"], true);
    let lost = stderr.lines().find_map(|line| {
        line.strip_prefix("warning: ")?.strip_suffix(" bytes could not be written")?.parse::<u64>().ok()
    });
    let all = info["bytes"].as_u64().expect("a count") + lost.expect("some were lost");
    assert_eq!(all, said * LAST.len() as u64, "{stderr}");
}

/// Needs user namespaces.
#[test]
#[ignore = "mounts a small disk of its own"]
fn a_full_disk_loses_what_it_must_and_says_how_much() {
    let mut bus = Bus::new();
    let directory = tempfile::tempdir().expect("a directory");
    let result = tempfile::tempdir().expect("a directory");
    let script = format!(
        "mount -t tmpfs -o size=64k none {small} && {{ {program} record {bus} -o {small}/a.mcap --min-free 0; \
         cp {small}/* {result}; }}",
        small = directory.path().display(),
        program = env!("CARGO_BIN_EXE_rtutap"),
        bus = bus.path,
        result = result.path().display(),
    );
    let mut child = std::process::Command::new("unshare")
        .args(["--user", "--map-root-user", "--mount", "sh", "-c", &script])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("unshare");
    bus.wait_for_listener();
    let reads = reads("installation", Adapter::Ftdi16, 1, 3000);
    let bytes: Vec<u8> = reads.into_iter().flat_map(|read| read.bytes).collect();
    for part in bytes.chunks(1000) {
        bus.say(part);
        std::thread::sleep(std::time::Duration::from_millis(200));
    }
    let pid = std::fs::read_to_string(format!("/proc/{0}/task/{0}/children", child.id())).expect("a list");
    let pid = pid.split_whitespace().next().expect("the program").parse().expect("a number");
    rustix::process::kill_process(rustix::process::Pid::from_raw(pid).expect("a process"), Signal::INT)
        .expect("a program that runs");
    let mut said = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().expect("a pipe"), &mut said).expect("UTF-8");
    child.wait().expect("a process");
    assert!(said.contains("No space left"), "{said}");
    let files = files(result.path());
    let there: u64 = files.iter().map(|file| bytes_in(&[file])).sum();
    assert!(there > 0 && there < bytes.len() as u64, "{there} of {}", bytes.len());
}
