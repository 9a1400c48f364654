//! Files cut and changed at random: what is left is right, what is gone is said, and `recover` keeps all of it.

use std::fs;

use rtutap::capture::mcap::{RecoverError, recover};
use rtutap::decode::chunk::LostKind;

use super::*;

/// Chooses places, the same in every run (SplitMix64).
struct Places(u64);

impl Places {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) as usize % end
    }
}

/// A recording of a few minutes, with the bytes that were received.
struct Original {
    directory: tempfile::TempDir,
    file: Vec<u8>,
    stream: Vec<u8>,
    longest_chunk: u64,
}

#[expect(clippy::disallowed_methods, reason = "recordings are files")]
fn original() -> Original {
    let directory = tempfile::tempdir().expect("a directory");
    let reads = reads("installation", Adapter::Ftdi16, 400);
    let path = directory.path().join("a.mcap");
    record(&path, Options { session_id: "s".into(), ..Options::default() }, &reads);
    let file = fs::read(&path).expect("written above");
    let stream = reads.iter().flat_map(|read| read.bytes.clone()).collect();
    Original { directory, file, stream, longest_chunk: 600 }
}

impl Original {
    /// Reads a damaged copy, and what `recover` makes of it.
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    fn check(&self, damaged: &[u8], what: &str) -> u64 {
        let path = self.directory.path().join("damaged.mcap");
        let output = self.directory.path().join("recovered.mcap");
        fs::write(&path, damaged).expect("a disk that works");
        let (found, facts) = read(&path);
        let lost = self.holds(&found, what);
        match recover(File::open(&path).expect("written above"), &output) {
            Ok(recovered) => {
                let (again, whole) = read(&output);
                assert!(whole.is_indexed && whole.damage_count == 0, "{what}: {whole:?}");
                assert_eq!(chunks(&again), chunks(&found), "{what}");
                assert_eq!(recovered.facts.damage_count, facts.damage_count, "{what}");
                assert!(
                    ::mcap::Summary::read(&fs::read(&output).expect("written")).is_ok_and(|s| s.is_some())
                );
            }
            Err(RecoverError::Nothing) => assert!(chunks(&found).is_empty(), "{what}"),
            Err(error) => panic!("{what}: {error}"),
        }
        assert_eq!(fs::read(&path).expect("written above"), damaged, "the damaged file is only read");
        lost
    }

    /// Holds what was found against the stream; returns how many of its bytes are not there.
    fn holds(&self, found: &[Found], what: &str) -> u64 {
        let (mut position, mut there) = (0, 0);
        for item in found {
            match item {
                Found::Line(..) | Found::Silence(..) => {}
                Found::Lost(_, lost) => {
                    assert_eq!(lost.kind, LostKind::Disk, "{what}");
                    position += lost.count as usize;
                }
                Found::Chunk(_, _, bytes, _) => {
                    let original = &self.stream[position..position + bytes.len()];
                    assert_eq!(bytes, original, "{what}: at {position}");
                    position += bytes.len();
                    there += bytes.len();
                }
            }
        }
        (self.stream.len() - there) as u64
    }
}

fn chunks(found: &[Found]) -> Vec<&Found> {
    found.iter().filter(|item| matches!(item, Found::Chunk(..))).collect()
}

fn cuts(times: usize) {
    let original = original();
    let mut random = Places(1);
    let mut places: Vec<usize> = (0..times).map(|_| random.below(original.file.len())).collect();
    places.sort_unstable();
    let mut lost_before = u64::MAX;
    for place in places {
        let lost = original.check(&original.file[..place], &format!("cut at {place}"));
        assert!(lost <= lost_before, "a longer file holds more: cut at {place}");
        lost_before = lost;
    }
}

fn changes(times: usize) {
    let original = original();
    let mut random = Places(2);
    for _ in 0..times {
        let place = random.below(original.file.len());
        let change = random.below(255) as u8 + 1;
        let mut damaged = original.file.clone();
        damaged[place] ^= change;
        let what = format!("byte {place} changed by {change:02x}");
        let lost = original.check(&damaged, &what);
        assert!(lost <= original.longest_chunk, "{what}: {lost} bytes lost, more than a chunk holds");
    }
}

#[test]
fn a_cut_recording_gives_all_that_is_whole() {
    cuts(40);
}

#[test]
fn a_changed_byte_costs_one_chunk_at_most() {
    changes(60);
}

#[test]
#[ignore = "takes a while; run in release"]
fn cut_and_changed_at_200_places_each() {
    cuts(200);
    changes(200);
}

#[test]
fn the_loss_of_the_first_chunk_costs_neither_times_nor_settings() {
    let original = original();
    // The first chunk has channels, anchor and settings: found by its opcode and length after the metadata.
    let at = (8..).find(|at| {
        original.file[*at] == 6 && original.file[*at + 3..*at + 9] == [0; 6] && original.file[*at + 37] == 4
    });
    let mut damaged = original.file.clone();
    damaged[at.expect("a chunk") + 60] ^= 1;
    let path = original.directory.path().join("damaged.mcap");
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    fs::write(&path, &damaged).expect("a disk that works");
    let (found, facts) = read(&path);
    assert_eq!(facts.damage_count, 1);
    let whole = original.directory.path().join("a.mcap");
    assert_eq!(found, read(&whole).0, "times by the log, settings by the metadata");
}
