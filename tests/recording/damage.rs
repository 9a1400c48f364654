//! Files cut and changed at random: what is left is right, what is gone is said, and `recover` keeps all of it.

use std::fs;
use std::ops::Range;

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

/// A message as viewers see it: topic, log time, content.
type Seen = (String, u64, Vec<u8>);

/// A whole recording, with the bytes that were received.
struct Original {
    directory: tempfile::TempDir,
    file: Vec<u8>,
    stream: Vec<u8>,
    /// The chunks: where each lies in the file, and its messages, as the crate has them.
    chunks: Vec<(Range<usize>, Vec<Seen>)>,
    /// Bytes of the bus that a chunk holds at most, with their overhead.
    longest_chunk: u64,
}

fn seen(message: ::mcap::McapResult<::mcap::Message<'_>>) -> Seen {
    let message = message.expect("whole");
    (message.channel.topic.clone(), message.log_time, message.data.to_vec())
}

#[expect(clippy::disallowed_methods, reason = "recordings are files")]
fn original() -> Original {
    let directory = tempfile::tempdir().expect("a directory");
    let reads = reads("installation", Adapter::Ftdi16, 400);
    let path = directory.path().join("a.mcap");
    record(&path, Options { session_id: "s".into(), ..Options::default() }, &reads);
    let original = Original::of(fs::read(&path).expect("written above"));
    let stream: Vec<u8> = reads.iter().flat_map(|read| read.bytes.clone()).collect();
    assert_eq!(original.stream, stream);
    original
}

impl Original {
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    fn of(file: Vec<u8>) -> Original {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("a.mcap");
        fs::write(&path, &file).expect("a disk that works");
        let (found, facts) = read(&path);
        assert!(facts.is_complete(), "{facts:?}");
        let bytes = |item: &Found| match item {
            Found::Chunk(_, _, bytes, _) => bytes.clone(),
            _ => Vec::new(),
        };
        let stream = found.iter().flat_map(bytes).collect();
        let summary = ::mcap::Summary::read(&file).expect("MCAP").expect("an index");
        let chunks = summary.chunk_indexes.iter().map(|chunk| {
            let start = chunk.chunk_start_offset as usize;
            let messages = summary.stream_chunk(&file, chunk).expect("a chunk").map(seen).collect();
            (start..start + chunk.chunk_length as usize, messages)
        });
        let chunks: Vec<(Range<usize>, Vec<Seen>)> = chunks.collect();
        let raw = |(topic, _, data): &Seen| if topic == "/bus0/raw" { data.len() as u64 } else { 0 };
        let longest = chunks.iter().map(|(_, messages)| messages.iter().map(raw).sum()).max();
        Original { directory, file, stream, chunks, longest_chunk: longest.expect("a chunk") }
    }

    /// Returns where the chunk lies that has the first bytes, and defines their channel.
    fn first_with_bytes(&self) -> Range<usize> {
        let has_bytes = |messages: &[Seen]| messages.iter().any(|(topic, ..)| topic == "/bus0/raw");
        let first = self.chunks.iter().find(|(_, messages)| has_bytes(messages));
        first.expect("a chunk with bytes").0.clone()
    }

    /// Returns the messages of the chunks that damage at these places of the file leaves whole.
    fn intact(&self, damage: &[Range<usize>]) -> impl Iterator<Item = &Seen> {
        let apart = |place: &Range<usize>| {
            damage.iter().all(|damage| place.end <= damage.start || damage.end <= place.start)
        };
        self.chunks.iter().filter(move |(place, _)| apart(place)).flat_map(|(_, messages)| messages)
    }

    /// Reads a copy damaged at these places, and what `recover` makes of it.
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    fn check(&self, damaged: &[u8], places: &[Range<usize>], what: &str) -> u64 {
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
                let file = fs::read(&output).expect("written above");
                let mut there = ::mcap::MessageStream::new(&file).expect("MCAP").map(seen);
                let holds = self.intact(places).all(|wanted| there.any(|message| message == *wanted));
                assert!(holds, "{what}: a message of an intact chunk is not there, or not in its place");
            }
            Err(RecoverError::Nothing | RecoverError::Silent) => {
                let is_raw = |(topic, ..): &&Seen| topic == "/bus0/raw";
                assert!(
                    chunks(&found).is_empty() && !self.intact(places).any(|seen| is_raw(&seen)),
                    "{what}"
                );
            }
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
                Found::Line(..) | Found::Silence(..) | Found::Clock(..) | Found::Note(..) => {}
                Found::Lost(_, lost) => {
                    assert_eq!(lost.kind, LostKind::Disk, "{what}");
                    position += lost.count as usize;
                }
                Found::Chunk(bus, _, bytes, _) => {
                    assert_eq!(bus, "bus0", "{what}");
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

fn cuts(original: &Original, times: usize) {
    let mut random = Places(1);
    let mut places: Vec<usize> = (0..times).map(|_| random.below(original.file.len())).collect();
    places.sort_unstable();
    let mut lost_before = u64::MAX;
    for place in places {
        let cut = place..original.file.len();
        let lost = original.check(&original.file[..place], &[cut], &format!("cut at {place}"));
        assert!(lost <= lost_before, "a longer file holds more: cut at {place}");
        lost_before = lost;
    }
}

fn changes(original: &Original, times: usize) {
    let mut random = Places(2);
    for _ in 0..times {
        let place = random.below(original.file.len());
        let change = random.below(255) as u8 + 1;
        let mut damaged = original.file.clone();
        damaged[place] ^= change;
        let what = format!("byte {place} changed by {change:02x}");
        let lost = original.check(&damaged, std::slice::from_ref(&(place..place + 1)), &what);
        assert!(lost <= original.longest_chunk, "{what}: {lost} bytes lost, more than a chunk holds");
    }
}

/// Changes two bytes at a time: one in the chunk that defines the bytes, or in the index; the other anywhere.
fn pairs(original: &Original, times: usize) {
    let mut random = Places(3);
    let first = original.first_with_bytes();
    let index = original.chunks.last().expect("a chunk").0.end..original.file.len();
    for at in 0..times {
        let range = if at % 2 == 0 { &first } else { &index };
        let other = if at % 4 < 2 { 0..original.file.len() } else { index.clone() };
        let places = [range, &other].map(|range| range.start + random.below(range.len()));
        let mut damaged = original.file.clone();
        for place in places {
            damaged[place] ^= random.below(255) as u8 + 1;
        }
        let what = format!("bytes {places:?} changed");
        let lost = original.check(&damaged, &places.map(|place| place..place + 1), &what);
        assert!(lost <= 2 * original.longest_chunk, "{what}: {lost} bytes lost, more than two chunks hold");
    }
}

#[test]
fn a_cut_recording_gives_all_that_is_whole() {
    cuts(&original(), 40);
}

#[test]
fn a_changed_byte_costs_one_chunk_at_most() {
    changes(&original(), 60);
}

#[test]
fn two_changed_bytes_cost_two_chunks_at_most() {
    pairs(&original(), 60);
}

#[test]
fn bytes_are_found_though_all_that_defines_their_channel_is_lost() {
    let original = original();
    let first = original.first_with_bytes();
    let repeated = (first.end..).find(|at| original.file[*at..].starts_with(b"rtutap/channels.mcap"));
    let repeated = repeated.expect("what the chunk defines is said again behind it");
    let end = original.chunks.last().expect("a chunk").0.end;
    let mut damaged = original.file[..end].to_vec();
    damaged[first.start + 60] ^= 1;
    let places = [first.clone(), end..original.file.len()];
    original.check(&damaged, &places, "first chunk and index");
    damaged[repeated] ^= 1;
    let path = original.directory.path().join("damaged.mcap");
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    fs::write(&path, &damaged).expect("a disk that works");
    let (found, facts) = read(&path);
    assert_eq!(facts.guessed_buses, ["bus0"]);
    assert!(original.holds(&found, "guessed") <= original.longest_chunk);
    original.check(&damaged, &places, "first chunk, index and what is said again");
}

#[test]
#[ignore = "takes a while"]
fn samples_cut_and_changed_at_200_places_each() {
    for name in ["installation.mcap", "troubled.mcap", "good-master.mcap", "mistaken-master.mcap"] {
        let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "captures", name].iter().collect();
        #[expect(clippy::disallowed_methods, reason = "recordings are files")]
        let original = Original::of(fs::read(path).expect("a sample"));
        cuts(&original, 200);
        changes(&original, 200);
        pairs(&original, 200);
    }
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

#[test]
fn a_whole_recording_without_a_byte_is_not_called_damaged() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let (recorder, _) = recorder(&path, Options::default());
    recorder.finish("finished").expect("a disk that works");
    let mut input = rtutap::capture::Input::open(&path, None).expect("a recording");
    let error = loop {
        if let Err(error) = input.next_item() {
            break error;
        }
    };
    assert!(error.to_string().ends_with("is a recording, but there is not a byte of a bus in it"), "{error}");
}

#[test]
fn a_recording_cut_before_its_first_bytes_says_so() {
    let original = original();
    let cut = original.first_with_bytes().start + 20;
    let path = original.directory.path().join("cut.mcap");
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    fs::write(&path, &original.file[..cut]).expect("a disk that works");
    let mut input = rtutap::capture::Input::open(&path, None).expect("an MCAP file");
    let error = loop {
        match input.next_item() {
            Ok(item) => assert!(matches!(item, Some(Item::Line(_) | Item::Lost { .. }))),
            Err(error) => break error.to_string(),
        }
    };
    assert!(
        error.ends_with("is an unfinished recording that ends before the first byte of a bus"),
        "{error}"
    );
}
