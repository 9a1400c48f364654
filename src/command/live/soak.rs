//! A month of polling at full speed: memory and disk stay small.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel, sync_channel};

use super::super::journal::Journal;
use super::super::session::Setup;
use super::capture::{Captured, Read};
use super::disk::{Disk, Floor};
use super::engine::{Engine, Tapped};
use super::entry::Entry;
use super::script::ScriptClock;
use super::stage::Stage;
use super::tape::{BATCHES, Tape};
use super::target::Target;
use super::writer::{Outcome, Told, Writer};
use crate::capture::mcap::{BusSettings, Options};
use crate::device::Profiles;
use crate::time::SECOND;

const HOUR: u64 = 3600;

/// A disk of which a directory may take so many bytes.
struct Quota {
    target: Target,
    most: u64,
}

impl Disk for Quota {
    fn free(&self, file: &Path) -> io::Result<u64> {
        let entries = super::target::directory(file).read_dir()?;
        let used: u64 = entries.filter_map(|entry| Some(entry.ok()?.metadata().ok()?.len())).sum();
        Ok(self.most.saturating_sub(used))
    }

    fn oldest(&self) -> Vec<PathBuf> {
        self.target.finished()
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        std::fs::remove_file(path)
    }
}

/// Appends the CRC of Modbus.
fn with_crc(bytes: &[u8]) -> Vec<u8> {
    let crc = bytes.iter().fold(0xFFFF_u16, |crc, byte| {
        (0..8)
            .fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xA001 } else { crc >> 1 })
    });
    [bytes, &crc.to_le_bytes()].concat()
}

/// Takes a poll of a sensor and its answer into a session, each second for so many seconds.
fn poll(engine: &mut Engine<'_>, clock: &ScriptClock, seconds: u64, mut write: impl FnMut()) {
    let request = with_crc(&[1, 3, 0x26, 0, 0, 4]);
    for second in 0..seconds {
        let at = |ms: u64| (HOUR + second) * SECOND as u64 + ms * 1_000_000;
        let temperature = (17.0 + (second % 997) as f32 / 100.0).to_le_bytes();
        let saturation = 0.9_f32.to_le_bytes();
        let response = with_crc(&[&[1, 3, 8][..], &temperature, &saturation].concat());
        for (ms, bytes) in [(10, &request), (60, &response)] {
            clock.go_to(at(ms));
            let bytes = bytes.as_slice().into();
            let read = Read { ready_ns: at(ms), monotonic_ns: at(ms), bytes, line_errors: Vec::new() };
            engine.take(0, Captured::Read(read)).expect("nobody reads rows");
        }
        clock.go_to(at(300));
        engine.take(0, Captured::Silence(at(300))).expect("nobody reads rows");
        engine.pause().expect("nobody reads rows");
        write();
    }
}

/// Records so many hours in a directory of at most `most` bytes; returns what became of it, and what was said.
fn record(directory: &Path, hours: u64, most: u64) -> (Outcome, Receiver<Told>) {
    let setup = Setup::new(Arc::new(Profiles::built_in()));
    let clock = ScriptClock::new();
    let anchor = super::anchor(&*clock);
    let target = Target::new(directory, anchor.realtime).expect("a directory");
    let options = Options {
        anchor: Some(anchor),
        rotate_time_ns: Some(HOUR as i64 * SECOND),
        rotate_size: Some(256_000_000),
        rotate_chunks: Some(10_000),
        ..Options::default()
    };
    let journal = Journal::create(&target.path, options).expect("a disk that works");
    let floor = Floor { min_free: most / 5, drop_oldest: true };
    let (teller, told) = channel();
    let mut writer = Writer::new(journal, floor, Box::new(Quota { target, most }), teller);
    let (queue, batches) = sync_channel(BATCHES);
    let stage = Stage { tape: Some(Tape::new(queue, false, false, None)), ..Stage::default() };
    let settings = BusSettings { name: "bus0".to_owned(), ..BusSettings::default() };
    let tapped = vec![Tapped::new("script".to_owned(), settings, channel().0)];
    let mut engine = Engine::new(&setup, stage, tapped, anchor, clock.clone()).expect("nobody reads rows");
    let mut write = || batches.try_iter().flatten().for_each(|entry: Entry| writer.take(&entry));
    poll(&mut engine, &clock, hours * HOUR, &mut write);
    let (mut stage, _) = engine.finish();
    stage.tape.take().expect("a tape").finish();
    (writer.run(&batches), told)
}

/// Returns the most memory this process has had, in bytes.
fn most_memory() -> Option<u64> {
    #[expect(clippy::disallowed_methods, reason = "the kernel tells by a file")]
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<u64>().ok()? * 1024)
}

/// Records so many hours where there is room for five; holds what is left against that.
fn held(hours: u64) {
    let directory = tempfile::tempdir().expect("a directory");
    let (hour, _) = record(directory.path(), 1, u64::MAX);
    let most = 5 * hour.files[0].metadata().expect("a file").len();
    let directory = tempfile::tempdir().expect("a directory");
    let (outcome, told) = record(directory.path(), hours, most);
    assert!(outcome.error.is_none() && !outcome.is_short && outcome.lost == 0, "{outcome:?}");
    assert_eq!(outcome.files.len() as u64, hours);
    let there = outcome.files.iter().filter(|file| file.exists()).count();
    assert!(there > 1 && (there as u64) < hours, "{there} of {hours} files are left");
    assert!(outcome.files[hours as usize - there..].iter().all(|file| file.exists()), "the latest are left");
    let removed = told.try_iter().filter(|told| matches!(told, Told::Notice(_))).count();
    assert_eq!(removed + there, hours as usize, "every removal is said");
}

#[test]
fn the_oldest_files_go_and_the_latest_stay() {
    held(8);
}

#[test]
#[ignore = "takes minutes; alone in its process it measures memory"]
fn a_month_of_polling_takes_little_memory() {
    held(30 * 24);
    let memory = most_memory().expect("Linux");
    println!("{} MB at most", memory / 1_000_000);
    assert!(memory < 32_000_000, "{memory} bytes");
}
