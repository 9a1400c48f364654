//! What a recording still has when its program is killed.

use std::path::Path;
use std::time::{Duration, Instant};

use rustix::process::Signal;

use rtutap::simulate::Adapter;

use crate::bus::{Bus, Tap, bytes_in, info, printed, reads};

/// What may be lost: what was read in the last second and a half.
const MAY_BE_LOST: Duration = Duration::from_millis(1500);

/// Returns all bytes of a recording.
fn bytes(path: &Path) -> String {
    let rows = printed(&["decode", path.to_str().expect("UTF-8"), "--show", "frames", "--format", "json"]);
    let bytes = rows.lines().filter_map(|row| {
        let row: serde_json::Value = serde_json::from_str(row).expect("JSON");
        row["bytes"].as_str().map(str::to_owned)
    });
    bytes.collect()
}

/// Kills a recording after so long; holds what it has against what was said.
fn kill_after(moment: Duration, keep: Option<&Path>) {
    let directory = tempfile::tempdir().expect("a directory");
    let output = directory.path().join("a.mcap");
    let mut bus = Bus::new();
    let name = output.to_str().expect("UTF-8");
    let mut tap = Tap::start(&["record", &bus.path, "-o", name, "--min-free", "0", "--rotate-time", "7s"]);
    bus.wait_for_listener();
    let said: Vec<u8> =
        reads("installation", Adapter::Uart, 1, 4000).into_iter().flat_map(|read| read.bytes).collect();
    let (begun, mut safe, mut at) = (Instant::now(), 0, 0);
    while begun.elapsed() < moment {
        // Ten bytes every ten milliseconds are 9600 baud.
        std::thread::sleep(Duration::from_millis(10));
        bus.say(&said[at..at + 10]);
        at += 10;
        if begun.elapsed() + MAY_BE_LOST < moment {
            safe = at;
        }
    }
    tap.signal(Signal::KILL);
    tap.wait();
    let mut parts: Vec<_> = directory
        .path()
        .read_dir()
        .expect("a directory")
        .map(|entry| entry.expect("a file").path())
        .collect();
    parts.sort_by_key(|path| path.to_string_lossy().replace("a.mcap", "a-0001.mcap"));
    let mut found = String::new();
    for part in &parts {
        // What cannot be read shows in the count.
        if bytes_in(&[part]) > 0 {
            found += &bytes(part);
        }
    }
    let there = found.len() / 2;
    assert!(there >= safe, "{there} of {safe} bytes that had to be safe after {moment:?}");
    let hex: String = said.iter().take(there).map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(found, hex, "what is there is what was said");
    let last = parts.iter().find(|path| path.extension().is_some_and(|extension| extension == "part"));
    let last = last.expect("it was killed");
    let whole = directory.path().join("whole.mcap");
    if bytes_in(&[last]) > 0 {
        printed(&["recover", last.to_str().expect("UTF-8"), "-o", whole.to_str().expect("UTF-8")]);
        assert_eq!(info(&[&whole])["complete"], false, "what comes after is not known");
        assert_eq!(bytes(&whole), bytes(last));
        if let Some(keep) = keep {
            std::fs::copy(&whole, keep.join(format!("{}.mcap", moment.as_millis())))
                .expect("a disk that works");
        }
    }
}

#[test]
fn what_was_read_a_second_and_a_half_before_a_kill_is_there() {
    std::thread::scope(|scope| {
        for ms in [300, 2100, 4700] {
            scope.spawn(move || kill_after(Duration::from_millis(ms), None));
        }
    });
}

/// With `RTUTAP_KEEP`, the recovered files are kept in that directory, for another validator.
#[test]
#[ignore = "takes minutes"]
fn so_it_is_at_fifty_moments() {
    let keep = std::env::var_os("RTUTAP_KEEP");
    let keep = keep.as_deref().map(Path::new);
    for round in 0..10_u64 {
        std::thread::scope(|scope| {
            for n in 0..5_u64 {
                // Spread over ten seconds, no two alike, none on a boundary of anything.
                let ms = 200 + (round * 5 + n) * 7919 % 9973;
                scope.spawn(move || kill_after(Duration::from_millis(ms), keep));
            }
        });
    }
}
