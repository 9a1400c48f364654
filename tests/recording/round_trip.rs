//! What was received comes back read for read, with its times.

use rtutap::capture::mcap::Anchor;
use rtutap::decode::chunk::{LineErrorKind, LostKind};
use rtutap::time::MILLISECOND;

use super::*;

/// 2026-01-01.
const NOW: i64 = 1_767_225_600_000_000_000;

#[test]
fn every_read_comes_back_with_its_time_and_line_errors_behind_every_adapter() {
    let directory = tempfile::tempdir().expect("a directory");
    for adapter in Adapter::ALL {
        let reads = reads("everything-bad", adapter, 400);
        let path = directory.path().join("a.mcap");
        assert_eq!(record(&path, Options::default(), &reads), std::slice::from_ref(&path));
        let (found, facts) = read(&path);
        assert!(found == expected(&reads), "{adapter}");
        assert!(facts.is_complete(), "{facts:?}");
    }
}

/// Writes chunks of one bus and reads them back.
fn there_and_back(options: Options, chunks: &[(ReadTime, &[u8], &[LineError])]) -> Vec<Found> {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let (mut recorder, id) = recorder(&path, options);
    for &(time, bytes, line_errors) in chunks {
        recorder.write_chunk(id, &Chunk { time, bytes, line_errors }, None).expect("a disk that works");
    }
    recorder.finish("finished").expect("a disk that works");
    let (found, facts) = read(&path);
    assert!(facts.is_complete(), "{facts:?}");
    found.into_iter().skip(1).collect()
}

fn found(chunks: &[(ReadTime, &[u8], &[LineError])]) -> Vec<Found> {
    let found =
        chunks.iter().map(|(time, bytes, e)| Found::Chunk("bus0".into(), *time, bytes.to_vec(), e.to_vec()));
    found.collect()
}

#[test]
fn input_without_times_stays_without_times() {
    let chunks: [(ReadTime, &[u8], &[LineError]); 4] = [
        (ReadTime::Unknown, b"\x01\x03", &[]),
        (ReadTime::UnknownAfterSilence, b"\x26", &[]),
        (at(NOW), b"\x00\x00", &[]),
        (ReadTime::Unknown, b"\x04", &[]),
    ];
    assert_eq!(there_and_back(Options::default(), &chunks), found(&chunks));
}

#[test]
fn times_of_any_epoch_come_back_to_the_nanosecond() {
    for first in [i64::MIN, -7, 0, 20 * MILLISECOND, NOW, i64::MAX - 100 * MILLISECOND] {
        let chunks: [(ReadTime, &[u8], &[LineError]); 3] = [
            (at(first), b"\x01", &[]),
            (at(first.saturating_add(MILLISECOND)), b"\x02", &[]),
            (at(first.saturating_add(99 * MILLISECOND)), b"\x03", &[]),
        ];
        assert_eq!(there_and_back(Options::default(), &chunks), found(&chunks), "{first}");
    }
}

#[test]
fn times_come_from_the_monotonic_clock_of_the_session() {
    let anchor = Anchor { monotonic_ns: 5_000, realtime: Timestamp::from_ns(NOW) };
    let chunks: [(ReadTime, &[u8], &[LineError]); 2] =
        [(at(NOW + 1), b"\x01", &[]), (at(NOW + 10_000_000_000), b"\x02", &[])];
    let options = Options { anchor: Some(anchor), ..Options::default() };
    assert_eq!(there_and_back(options, &chunks), found(&chunks));
}

#[test]
fn a_line_error_stays_with_the_read_it_came_in() {
    let error = |offset, kind| LineError { offset, kind };
    let after = [error(1, LineErrorKind::Break)];
    let both = [error(0, LineErrorKind::Overrun), error(1, LineErrorKind::ParityOrFraming)];
    let chunks: [(ReadTime, &[u8], &[LineError]); 4] = [
        (at(NOW), b"\x01", &after),
        (at(NOW + 1), b"\x02\x03", &both),
        (at(NOW + 2), b"", &[error(0, LineErrorKind::Break)]),
        (at(NOW + 3), b"\x04", &[]),
    ];
    assert_eq!(there_and_back(Options::default(), &chunks), found(&chunks));
}

#[test]
fn losses_come_back_by_their_kind() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let (mut recorder, id) = recorder(&path, Options::default());
    let chunk = |ns| Chunk { time: at(ns), bytes: b"\x01\x02", line_errors: &[] };
    let lost =
        |stream_offset, kind, count| Lost { time: Some(Timestamp::from_ns(NOW)), stream_offset, kind, count };
    let losses = [
        lost(2, LostKind::Queue, 5),
        lost(9, LostKind::Overrun, 1),
        lost(12, LostKind::SourceGone, 0),
        lost(14, LostKind::Overrun, 0),
        lost(16, LostKind::Disk, 100),
    ];
    recorder.write_chunk(id, &chunk(NOW), None).expect("a disk that works");
    for loss in &losses {
        recorder.write_lost(id, loss).expect("a disk that works");
        recorder.write_chunk(id, &chunk(NOW), None).expect("a disk that works");
    }
    recorder.finish("finished").expect("a disk that works");
    let (found, facts) = read(&path);
    let found: Vec<_> = found.into_iter().filter(|item| matches!(item, Found::Lost(..))).collect();
    assert_eq!(found, losses.map(|lost| Found::Lost("bus0".into(), lost)));
    assert_eq!(facts.lost_bytes, 100, "only what the disk lost is missing in the file");
}

#[test]
fn reads_of_several_buses_and_silences_between_them_come_back_in_their_order() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let mut recorder = Recorder::create(&path, Options::default()).expect("a file");
    let ids = ["pump", "tank"].map(|name| recorder.add_bus(bus(name)).expect("a disk that works"));
    let mut expected = Vec::new();
    for (index, which) in [0, 0, 1, 0, 1, 1].into_iter().enumerate() {
        let (name, ns) = (["pump", "tank"][which], NOW + index as i64 * MILLISECOND);
        let chunk = Chunk { time: at(ns), bytes: b"\x01", line_errors: &[] };
        recorder.write_chunk(ids[which], &chunk, None).expect("a disk that works");
        expected.push(Found::Chunk(name.into(), at(ns), b"\x01".to_vec(), Vec::new()));
        if index == 3 {
            let until = Timestamp::from_ns(ns + 1);
            recorder.write_silence(ids[1], until).expect("a disk that works");
            expected.push(Found::Silence("tank".into(), until));
        }
    }
    recorder.finish("finished").expect("a disk that works");
    let (found, _) = read(&path);
    let found: Vec<_> = found.into_iter().filter(|item| !matches!(item, Found::Line(..))).collect();
    assert_eq!(found, expected);
}

#[test]
fn two_buses_keep_their_times_though_log_times_never_go_back() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let mut recorder = Recorder::create(&path, Options::default()).expect("a file");
    let ids = ["pump", "tank"].map(|name| recorder.add_bus(bus(name)).expect("a disk that works"));
    let mut of_bus = [Vec::new(), Vec::new()];
    for i in 0..200_i64 {
        let which = (i % 3 != 0) as usize;
        let late = if which == 1 { 3 * MILLISECOND } else { 0 };
        let bytes = [i as u8];
        let time = at(NOW + i * MILLISECOND - late);
        recorder.write_chunk(ids[which], &Chunk { time, bytes: &bytes, line_errors: &[] }, None).expect("ok");
        of_bus[which].push((time, bytes.to_vec()));
    }
    recorder.finish("finished").expect("a disk that works");
    let (found, _) = read(&path);
    for (name, expected) in ["pump", "tank"].into_iter().zip(of_bus) {
        let chunks = found.iter().filter_map(|item| match item {
            Found::Chunk(bus, time, bytes, _) if bus == name => Some((*time, bytes.clone())),
            _ => None,
        });
        assert_eq!(chunks.collect::<Vec<_>>(), expected, "{name}");
    }
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    let file = std::fs::read(&path).expect("written above");
    let times: Vec<u64> =
        ::mcap::MessageStream::new(&file).expect("MCAP").map(|m| m.expect("whole").log_time).collect();
    assert!(times.is_sorted() && times[0] > 946_684_800_000_000_000);
}

#[test]
fn other_settings_are_said_where_they_begin() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let (mut recorder, id) = recorder(&path, Options::default());
    let chunk = |ns| Chunk { time: at(ns), bytes: b"\x01", line_errors: &[] };
    recorder.write_chunk(id, &chunk(NOW), None).expect("a disk that works");
    let line = "19200-8E1".parse().expect("a line setting");
    recorder.set_line(id, BusSettings { line, ..bus("bus0") }).expect("a disk that works");
    recorder.write_chunk(id, &chunk(NOW + 1), None).expect("a disk that works");
    recorder.finish("finished").expect("a disk that works");
    let (found, _) = read(&path);
    assert_eq!(found[2], Found::Line("bus0".into(), line, Some(17_000_000)));
    assert_eq!(found.len(), 4);
}
