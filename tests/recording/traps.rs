//! What bit in the `mcap` crate, each as a test: a change of its version must not bring it back.

use std::fs;

use rtutap::capture::mcap::{Cause, Schema};
use rtutap::time::SECOND;

use super::*;

#[expect(clippy::disallowed_methods, reason = "recordings are files")]
fn bytes_of(path: &Path) -> Vec<u8> {
    fs::read(path).expect("written before")
}

fn summary(path: &Path) -> ::mcap::Summary {
    ::mcap::Summary::read(&bytes_of(path)).expect("readable").expect("there is an index")
}

/// A recording with a decoded channel beside the bytes.
fn recorded(directory: &Path) -> PathBuf {
    let path = directory.join("a.mcap");
    let (mut recorder, id) = recorder(&path, Options::default());
    let schema = Schema { name: "x.Y", descriptors: b"" };
    let channel = recorder.channel("/bus0/extra", schema, [].into());
    for read in &reads("installation", Adapter::Ftdi16, 100) {
        recorder.write_chunk(id, &chunk(read), None).expect("a disk that works");
        recorder.write_message(channel, None, b"").expect("a disk that works");
        recorder.tick(read.time).expect("a disk that works");
    }
    recorder.finish("finished").expect("a disk that works").remove(0)
}

#[test]
fn a_file_is_a_valid_prefix_at_every_moment_and_no_more_than_a_second_behind() {
    let directory = tempfile::tempdir().expect("a directory");
    let reads = reads("installation", Adapter::Ftdi16, 100);
    let (mut recorder, id) = recorder(&directory.path().join("a.mcap"), Options::default());
    let copy = directory.path().join("copy.mcap");
    for read in &reads {
        recorder.write_chunk(id, &chunk(read), None).expect("a disk that works");
        recorder.tick(read.time).expect("a disk that works");
        fs::copy(recorder.current().expect("a file"), &copy).expect("a disk that works");
        let (found, facts) = super::read(&copy);
        let older = reads.iter().take_while(|older| older.time + SECOND < read.time).count();
        assert!(found.len() > older && found == expected(&reads)[..found.len()]);
        assert_eq!(
            (facts.damage_count, facts.end),
            (0, None),
            "cut at the end of a record, and so not closed"
        );
    }
}

#[test]
fn a_file_has_its_name_only_when_it_is_finished() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let (recorder, _) = recorder(&path, Options::default());
    assert!(recorder.current().expect("a file").ends_with("a.mcap.unfinished"));
    assert!(!path.exists());
    recorder.finish("finished").expect("a disk that works");
    assert!(path.exists() && !directory.path().join("a.mcap.unfinished").exists());
}

#[test]
fn what_is_left_of_a_recording_is_not_overwritten_by_a_live_one() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let live = || Options { is_durable: true, ..Options::default() };
    drop(recorder(&path, live()));
    assert!(Recorder::create(&path, live()).is_err_and(|error| error.path == path));
}

#[test]
fn no_chunk_begins_in_1970_and_every_one_has_message_indexes() {
    let directory = tempfile::tempdir().expect("a directory");
    let summary = summary(&recorded(directory.path()));
    assert!(summary.chunk_indexes.len() > 10);
    for chunk in &summary.chunk_indexes {
        assert!(chunk.message_start_time > 946_684_800_000_000_000);
        assert!(!chunk.message_index_offsets.is_empty());
    }
}

#[test]
fn publish_times_are_neither_zero_nor_after_log_times_and_messages_are_numbered_from_1() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = bytes_of(&recorded(directory.path()));
    let mut numbers = std::collections::HashMap::new();
    let mut first = None;
    for message in ::mcap::MessageStream::new(&file).expect("MCAP").map(|message| message.expect("whole")) {
        first.get_or_insert(message.channel.topic.clone());
        assert!(message.publish_time > 0 && message.publish_time <= message.log_time);
        let number = numbers.entry(message.channel.id).or_insert(0);
        *number += 1;
        assert_eq!(message.sequence, *number);
    }
    assert_eq!(first.as_deref(), Some("/clock"));
}

#[test]
fn a_session_without_a_byte_can_be_finished() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    recorder(&path, Options::default()).0.finish("finished").expect("a disk that works");
    let (found, facts) = super::read(&path);
    assert!(found.len() == 1 && facts.is_complete());
}

#[test]
fn attachments_stand_before_the_first_bytes_and_break_no_chunk() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let profile = ("profiles/x.toml".to_owned(), "application/toml".to_owned(), b"id = \"x\"".to_vec());
    let options = Options { attachments: vec![profile], ..Options::default() };
    record(&path, options, &reads("installation", Adapter::Ftdi16, 20));
    let profiles = |name: &str| name == "profiles/x.toml";
    let indexes = summary(&path).attachment_indexes;
    assert_eq!(indexes.iter().filter(|index| profiles(&index.name)).count(), 1);
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    let file = File::open(&path).expect("written above");
    let preface = rtutap::capture::mcap::Preface::read(file).expect("a disk that works");
    let attached = preface.attachments.into_iter().filter(|(name, _)| profiles(name));
    assert_eq!(attached.collect::<Vec<_>>(), [("profiles/x.toml".to_owned(), b"id = \"x\"".to_vec())]);
}

#[cfg(target_os = "linux")]
#[test]
fn after_a_full_disk_a_new_part_begins_and_what_was_lost_is_counted() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    std::os::unix::fs::symlink("/dev/full", directory.path().join("a-0002.mcap.unfinished")).expect("a link");
    let reads = reads("installation", Adapter::Ftdi16, 300);
    let options = Options { session_id: "s".into(), rotate_chunks: Some(60), ..Options::default() };
    let (mut recorder, id) = recorder(&path, options);
    let mut failures = 0;
    for read in &reads {
        failures += u32::from(recorder.write_chunk(id, &chunk(read), None).is_err());
        failures += u32::from(recorder.tick(read.time).is_err());
    }
    let parts = recorder.finish("finished").expect("the third part is on a disk that works");
    assert_eq!(failures, 1);
    assert!(parts.len() > 1 && parts[1].ends_with("a-0003.mcap"), "{parts:?}");
    let mut first = open(&parts[0]);
    rest(&mut first);
    let mut second = open(&parts[1]);
    assert!(second.continue_after(&first));
    let found = rest(&mut second);
    let lost =
        found.iter().filter_map(|item| if let Found::Lost(_, lost) = item { Some(lost.count) } else { None });
    assert!(lost.sum::<u64>() > 0, "what came between the parts is missing, and said");
    let total: usize = reads.iter().map(|read| read.bytes.len()).sum();
    let there: usize = parts.iter().flat_map(|part| super::read(part).0).map(|item| item.length()).sum();
    assert!(there < total && there + 200 > total, "{there} of {total}");
}

#[test]
fn a_garbage_tail_is_damage_and_asks_for_no_memory() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = recorded(directory.path());
    let mut file = bytes_of(&path);
    let chunk = summary(&path).chunk_indexes[5].clone();
    file.truncate((chunk.chunk_start_offset + chunk.chunk_length) as usize);
    file.extend(std::iter::repeat_n(0xFF, 100_000));
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    fs::write(&path, file).expect("a disk that works");
    let (found, facts) = super::read(&path);
    assert!(found.len() > 10);
    assert_eq!(facts.damage.first().map(|damage| damage.cause), Some(Cause::NoRecord));
}

#[test]
fn one_bad_chunk_is_found_by_its_checksum_and_costs_no_other() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = recorded(directory.path());
    let whole = super::read(&path).0;
    let chunk = &summary(&path).chunk_indexes[5];
    let mut file = bytes_of(&path);
    file[chunk.chunk_start_offset as usize + 9 + 24] ^= 1; // the checksum itself
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    fs::write(&path, file).expect("a disk that works");
    let (found, facts) = super::read(&path);
    assert_eq!(facts.damage.iter().map(|damage| damage.cause).collect::<Vec<_>>(), [Cause::Checksum]);
    assert_eq!(facts.damage[0].offset, chunk.chunk_start_offset);
    assert!(found.iter().any(|item| matches!(item, Found::Lost(..))));
    assert_eq!(found.last(), whole.last());
}

#[test]
fn other_peoples_files_are_named_by_what_they_hold() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("robot.mcap");
    let mut writer =
        ::mcap::Writer::new(std::io::BufWriter::new(File::create_new(&path).expect("a file"))).expect("MCAP");
    let schema = writer.add_schema("Pose", "jsonschema", b"{}").expect("written");
    let channel = writer.add_channel(schema, "/pose", "json", &[].into()).expect("written");
    let header =
        ::mcap::records::MessageHeader { channel_id: channel, sequence: 1, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, b"{}").expect("written");
    writer.finish().expect("written");
    drop(writer);
    let topics = open(&path).foreign_topics();
    assert_eq!(topics, Some(vec![("/pose".to_owned(), "Pose".to_owned())]));
    let error = rtutap::capture::Input::open(&path, None).err().expect("no recording of a bus");
    assert!(error.hint().contains("/pose (Pose)"), "{}", error.hint());
}

#[test]
fn one_wrong_byte_never_costs_more_than_32_kb_or_half_a_minute() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    // Polled slowly, time ends a chunk; with a flood of bytes their number does.
    for (scenario, adapter, least) in [("installation", Adapter::Ftdi16, 20), ("tight", Adapter::Usb1, 2)] {
        let reads = reads(scenario, adapter, 1500);
        record(&path, Options::default(), &reads);
        let summary = summary(&path);
        assert!(summary.chunk_indexes.len() >= least, "{scenario}: {}", summary.chunk_indexes.len());
        for chunk in &summary.chunk_indexes {
            assert!(chunk.message_end_time - chunk.message_start_time < 30 * SECOND as u64, "{scenario}");
            assert!(chunk.uncompressed_size < 40_000, "{scenario}: {}", chunk.uncompressed_size);
        }
    }
}
