//! What an export keeps beside the bytes.

use super::*;
use crate::capture::Input;
use crate::capture::mcap::BusSettings;
use crate::command::journal::Journal;
use crate::decode::chunk::{Chunk, ReadTime};

#[test]
fn notes_of_the_recording_and_marks_of_the_screen_are_kept() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = |name: &str| directory.path().join(name);
    let time = |second: i64| Timestamp::from_ns((1_700_000_000 + second) * crate::time::SECOND);
    let mut journal = Journal::create(&path("a.mcap"), Options::default()).expect("a disk that works");
    journal.begin(BusSettings { name: "bus0".to_owned(), ..BusSettings::default() }).expect("a bus");
    let bytes = [1, 3, 0x26, 0, 0, 4, 0x4f, 0x41];
    for second in 0..3 {
        let chunk = Chunk { time: ReadTime::At(time(second)), bytes: &bytes, line_errors: &[] };
        journal.item(&Item::Chunk { bus: "bus0", chunk, ready: None }).expect("a disk that works");
    }
    journal.item(&Item::Note { time: Some(time(1)), text: "cable moved" }).expect("a disk that works");
    let inputs = journal.finish("finished").expect("a disk that works");
    let equipment = cli::Equipment::default();
    let filter = Some("addr == 1".to_owned());
    run(&of(inputs, filter, path("b.mcap"), equipment, vec![(time(2), "mark".to_owned())]))
        .expect("an export");
    let mut input = Input::open(&path("b.mcap"), None).expect("a recording");
    let mut notes = Vec::new();
    while let Some(item) = input.next_item().expect("a disk that works") {
        if let Item::Note { time, text } = item {
            notes.push((time, text.to_owned()));
        }
    }
    assert_eq!(notes, [(Some(time(1)), "cable moved".to_owned()), (Some(time(2)), "mark".to_owned())]);
}
