//! Sessions of several parts, and stretches of time.

use rtutap::time::SECOND;

use super::*;

/// Reads parts as one stream.
fn read_all(parts: &[PathBuf]) -> Vec<Found> {
    let mut before: Option<Recording> = None;
    let mut found = Vec::new();
    for part in parts {
        let mut recording = open(part);
        if let Some(before) = &before {
            assert!(recording.continue_after(before), "{}", part.display());
        }
        found.extend(rest(&mut recording));
        before = Some(recording);
    }
    found
}

fn without_lines(found: Vec<Found>) -> Vec<Found> {
    found.into_iter().filter(|item| !matches!(item, Found::Line(..))).collect()
}

#[test]
fn parts_are_one_stream_whatever_they_are_split_by() {
    let directory = tempfile::tempdir().expect("a directory");
    let reads = reads("installation", Adapter::Ftdi16, 600);
    let id = || "one".to_owned();
    for (name, options) in [
        ("time", Options { rotate_time_ns: Some(60 * SECOND), session_id: id(), ..Options::default() }),
        ("size", Options { rotate_size: Some(30_000), session_id: id(), ..Options::default() }),
        ("chunks", Options { rotate_chunks: Some(50), session_id: id(), ..Options::default() }),
    ] {
        let parts = record(&directory.path().join(format!("{name}.mcap")), options, &reads);
        assert!(parts.len() > 2, "{name}: {}", parts.len());
        assert!(parts[1].ends_with(format!("{name}-0002.mcap")));
        assert_eq!(without_lines(read_all(&parts)), without_lines(expected(&reads)), "{name}");
        for part in &parts {
            assert!(read(part).1.is_complete(), "each part is whole by itself");
        }
    }
}

#[test]
fn a_last_part_without_a_byte_is_no_error_after_the_others() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let options = Options { rotate_time_ns: Some(SECOND), session_id: "one".into(), ..Options::default() };
    let (mut recorder, id) = recorder(&path, options);
    let reads = reads("clean", Adapter::Uart, 4);
    recorder.write_chunk(id, &chunk(&reads[0]), None).expect("a disk that works");
    let later = reads[0].time + 10 * SECOND;
    recorder.tick(later).expect("a disk that works");
    recorder.write_silence(id, later).expect("a disk that works");
    let parts = recorder.finish("finished").expect("a disk that works");
    let [first, last] = &parts[..] else { panic!("two parts: {parts:?}") };
    let mut first = rtutap::capture::Input::open(first, None).expect("a recording");
    while first.advance().expect("it has bytes") {}
    let mut last = rtutap::capture::Input::open(last, None).expect("a recording");
    assert!(last.continue_after(&first));
    while last.advance().expect("its session has bytes") {}
}

#[test]
fn a_missing_part_is_a_loss_of_known_size() {
    let directory = tempfile::tempdir().expect("a directory");
    let reads = reads("installation", Adapter::Ftdi16, 300);
    let options = Options { rotate_chunks: Some(50), session_id: "one".into(), ..Options::default() };
    let mut parts = record(&directory.path().join("a.mcap"), options, &reads);
    parts.remove(1);
    let found = read_all(&parts);
    let bytes = |found: &[Found]| -> u64 {
        let lengths = found.iter().map(|item| match item {
            Found::Chunk(_, _, bytes, _) => bytes.len() as u64,
            Found::Lost(_, lost) => lost.count,
            Found::Line(..) | Found::Silence(..) | Found::Clock(..) | Found::Note(..) => 0,
        });
        lengths.sum()
    };
    assert_eq!(found.iter().filter(|item| matches!(item, Found::Lost(..))).count(), 1);
    assert_eq!(bytes(&found), bytes(&expected(&reads)));
}

#[test]
fn parts_of_another_session_or_out_of_order_are_not_continued() {
    let directory = tempfile::tempdir().expect("a directory");
    let reads = reads("installation", Adapter::Ftdi16, 300);
    let options =
        |id: &str| Options { rotate_chunks: Some(50), session_id: id.to_owned(), ..Options::default() };
    let a = record(&directory.path().join("a.mcap"), options("a"), &reads);
    let b = record(&directory.path().join("b.mcap"), options("b"), &reads);
    assert!(open(&a[1]).continue_after(&after(&a[0])));
    assert!(!open(&b[1]).continue_after(&after(&a[0])));
    assert!(!open(&a[0]).continue_after(&after(&a[1])));
}

fn after(path: &Path) -> Recording {
    let mut recording = open(path);
    rest(&mut recording);
    recording
}

#[test]
fn a_stretch_of_time_is_read_with_its_settings_and_nothing_else() {
    let directory = tempfile::tempdir().expect("a directory");
    let reads = reads("installation", Adapter::Ftdi16, 400);
    let path = directory.path().join("a.mcap");
    record(&path, Options::default(), &reads);
    let (from, to) = (reads[200].time, reads[300].time);
    let mut recording = open(&path);
    assert!(recording.select(from, to));
    let found = rest(&mut recording);
    assert!(matches!(found[0], Found::Line(..)));
    let wanted = expected(&reads[200..=300]);
    // A read merged into a later one has its log time, and so may lie just before.
    assert_eq!(found[found.len() - 101..], wanted[1..]);
    assert!(found.len() <= 104, "{}", found.len());
}

#[test]
fn a_growing_file_is_read_as_it_grows() {
    let directory = tempfile::tempdir().expect("a directory");
    let reads = reads("installation", Adapter::Ftdi16, 100);
    let path = directory.path().join("a.mcap");
    let (mut recorder, id) = recorder(&path, Options::default());
    let mut recording = open(recorder.current().expect("a file"));
    recording.follow();
    let mut found = Vec::new();
    for read in &reads {
        recorder.write_chunk(id, &chunk(read), None).expect("a disk that works");
        recorder.tick(read.time).expect("a disk that works");
        found.extend(rest(&mut recording));
        assert!(!recording.is_finished());
        let older = reads.iter().take_while(|older| older.time + SECOND < read.time).count();
        assert!(found.len() > older, "no more than a second is held back");
    }
    recorder.finish("finished").expect("a disk that works");
    found.extend(rest(&mut recording));
    assert_eq!(found, expected(&reads));
    assert!(recording.is_finished() && recording.facts().is_complete());
}
