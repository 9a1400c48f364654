mod cold;

use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::super::super::failure::Failure;
use super::super::super::session::Setup;
use super::super::{Teller, Word};
use super::checkpoints::{Checkpoints, Look, Shared};
use super::decoder::Decoder;
use super::head::{Change, Head};
use super::reel::{Advance, Reel, Tracks};
use super::say;
use super::scan::{look, scan};
use crate::analyze::filter::Filter;
use crate::capture::Item;
use crate::capture::mcap::{BusSettings, Options, Recorder};
use crate::decode::chunk::{Chunk, ReadTime};
use crate::line::LineSettings;
use crate::report::words::Labels;
use crate::simulate::{Adapter, Config, Scenario, Simulation};
use crate::time::{SECOND, Timestamp};
use crate::tui::app::replay::Order;
use crate::tui::sieve::Sieve;
use crate::tui::store::{List, Row, Store, Tone};
use crate::tui::timeline::Sought;

/// Writes a recording of a bus with much wrong, a chunk of the file for each second of it.
fn record(path: &Path, frames: u64, options: Options) -> Vec<PathBuf> {
    let line = LineSettings::default();
    let adapter = Adapter::Ftdi16;
    let scenario = Scenario::named("everything-bad").expect("a scenario");
    let mut recorder = Recorder::create(path, options).expect("a disk that works");
    let adapter_hold_ns = Some(adapter.hold_ns(line));
    let settings = BusSettings { name: "bus0".into(), line, adapter_hold_ns, ..BusSettings::default() };
    let bus = recorder.add_bus(settings).expect("a disk that works");
    for read in Simulation::new(Config { seed: 3, frames, line, adapter, scenario }) {
        let chunk =
            Chunk { time: ReadTime::At(read.time), bytes: &read.bytes, line_errors: &read.line_errors };
        recorder.write_chunk(bus, &chunk, None).expect("a disk that works");
        recorder.tick(read.time).expect("a disk that works");
    }
    recorder.finish("finished").expect("a disk that works")
}

fn one_part() -> (TempDir, Vec<PathBuf>) {
    let directory = tempfile::tempdir().expect("a directory");
    let paths = record(&directory.path().join("a.mcap"), 1200, Options::default());
    (directory, paths)
}

/// Is a recording with all that plays it.
struct Stage {
    setup: Setup,
    tracks: Tracks,
}

impl Stage {
    fn new(paths: Vec<PathBuf>, follows: bool) -> Self {
        let setup = Setup { findings: true, ..Setup::new(crate::device::Profiles::built_in().into()) };
        Stage { setup, tracks: Tracks::new(paths, None, None, follows) }
    }

    fn decoder(&self) -> Decoder<'_> {
        Decoder::new(&self.setup, Labels::new(&self.setup.profiles))
    }

    fn line(&self) -> LineSettings {
        Reel::open(&self.tracks).expect("a recording").input().line().unwrap_or_default()
    }

    /// Lets the background go through all of it, with a checkpoint every so many bytes.
    fn scanned<'a>(&'a self, apart: u64) -> Shared<'a> {
        let shared = Shared::default();
        shared.lock().checkpoints = Checkpoints::every(apart);
        scan(&self.tracks, self.decoder(), &shared, self.line()).expect("a recording");
        shared
    }

    fn head<'a>(&'a self, shared: &'a Shared<'a>) -> Head<'a, 'a> {
        let reel = Reel::open(&self.tracks).expect("a recording");
        let mut head = Head::new(reel, self.decoder(), shared, self.line());
        settle(&mut head);
        head
    }

    /// Decodes from the beginning, until something holds or it ends; without a checkpoint.
    fn run(&self, mut is_enough: impl FnMut(&Decoder<'_>, i64) -> bool) -> Decoder<'_> {
        let mut reel = Reel::open(&self.tracks).expect("a recording");
        let mut decoder = self.decoder();
        let line = self.line();
        while reel.advance().expect("a recording") == Advance::Item {
            if is_enough(&decoder, decoder.elapsed_after(&reel.item())) {
                return decoder;
            }
            decoder.take(&reel.item(), line, None).expect("an item");
        }
        decoder.finish().expect("an end");
        decoder
    }
}

const NOW: Timestamp = Timestamp::from_ns(0);

/// Works until there is nothing to do at once.
fn settle(head: &mut Head<'_, '_>) {
    for _ in 0..10_000 {
        head.work(NOW, &mut || true).expect("a recording");
        if !head.is_busy() {
            return;
        }
    }
    panic!("it never arrives");
}

fn go(head: &mut Head<'_, '_>, order: Order) {
    head.order(order);
    settle(head);
}

/// Writes all that is known but for what is long ago: rows from `from` on, the last half minute of series.
fn told(store: &Store, from: [u64; 2]) -> String {
    let mut text = format!("{:?} {:?} {:?}\n", store.begun(), store.now(), store.findings().total());
    for found in store.findings().list() {
        let mut finding = found.finding.clone();
        finding.frames.drain(..finding.frames.len().saturating_sub(16));
        text.push_str(&format!("{finding:?}\n"));
    }
    for bus in store.buses() {
        let mut bus = (**bus).clone();
        let mut health = (*bus.health).clone();
        let until = health.seconds.last().map_or(0, |last| last.at + 1);
        text.push_str(&format!("{:?}\n", health.steps(until - 30, 1, until)));
        health.seconds = Default::default();
        bus.health = health.into();
        text.push_str(&format!("{bus:?}\n"));
    }
    for device in store.devices() {
        let mut device = (**device).clone();
        device.quantities.iter_mut().for_each(|quantity| quantity.history = Default::default());
        text.push_str(&format!("{device:?}\n"));
    }
    for (list, from) in [List::Exchanges, List::Frames].into_iter().zip(from) {
        let rows = store.list(list);
        text.push_str(&format!("{} rows\n", rows.total()));
        rows.range(from..u64::MAX).for_each(|row| text.push_str(&format!("{row:?}\n")));
    }
    text
}

/// Holds the state at the playhead against a run from the beginning.
fn same_as_run(head: &Head<'_, '_>, run: &Decoder<'_>) {
    let from = [List::Exchanges, List::Frames].map(|list| head.decoder.store().list(list).first_kept());
    assert_eq!(told(head.decoder.store(), from), told(run.store(), from));
}

#[test]
fn a_seek_gives_what_a_run_from_the_beginning_gives() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(256);
    assert!(shared.lock().checkpoints.len() > 10);
    let end = shared.lock().timeline.end();
    let mut head = stage.head(&shared);
    let mut have_left = 0;
    for place in [end / 2, end / 3, end - SECOND, 7 * SECOND, end / 2 + 1, 0, end] {
        go(&mut head, Order::Place(place));
        same_as_run(&head, &stage.run(|_, next| next > place));
        assert!(head.state().playhead <= place && place - head.state().playhead < SECOND * 60);
        have_left += u64::from(head.decoder.store().list(List::Frames).first_kept() > 0);
    }
    assert!(have_left > 3, "seeks begin at checkpoints, not at the beginning");
}

#[test]
fn a_seek_over_damage_and_over_parts_gives_the_same_too() {
    let (directory, paths) = one_part();
    let mut bytes = std::fs::read(&paths[0]).expect("a file of this test");
    let middle = bytes.len() / 2;
    bytes[middle..middle + 3000].fill(0xa5);
    let damaged = directory.path().join("damaged.mcap");
    std::fs::write(&damaged, bytes).expect("a disk that works");
    let unfinished = directory.path().join("unfinished.mcap");
    // Its channels are told after the first place to come back to.
    let whole = Path::new(env!("CARGO_MANIFEST_DIR")).join("captures/troubled.mcap");
    let whole = std::fs::read(whole).expect("a sample");
    std::fs::write(&unfinished, &whole[..whole.len() * 3 / 4]).expect("a disk that works");
    let options = Options { rotate_chunks: Some(8), session_id: "one".into(), ..Options::default() };
    let parts = record(&directory.path().join("parts.mcap"), 1200, options);
    assert!(parts.len() > 3);
    for paths in [vec![damaged], vec![unfinished], parts] {
        let stage = Stage::new(paths, false);
        let shared = stage.scanned(256);
        let end = shared.lock().timeline.end();
        let mut head = stage.head(&shared);
        for place in [end, 0, end * 3 / 4, end / 4, end / 2, end] {
            go(&mut head, Order::Place(place));
            same_as_run(&head, &stage.run(|_, next| next > place));
        }
    }
}

#[test]
fn text_without_an_index_is_gone_about_in_as_well() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.hex");
    let lines = "01 03 26 00 00 04 4f 41\n01 03 08 00 00 8d 41 00 00 8d 41 55 0b\n".repeat(400);
    std::fs::write(&path, lines).expect("a disk that works");
    let stage = Stage::new(vec![path], false);
    let shared = stage.scanned(256);
    let end = shared.lock().timeline.end();
    assert!(end > SECOND && shared.lock().timeline.origin.is_none());
    let mut head = stage.head(&shared);
    for place in [end / 2, end / 5, end] {
        go(&mut head, Order::Place(place));
        same_as_run(&head, &stage.run(|_, next| next > place));
    }
}

#[test]
fn the_end_decides_what_a_place_leaves_open() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(512);
    let mut head = stage.head(&shared);
    go(&mut head, Order::End);
    same_as_run(&head, &stage.run(|_, _| false));
    go(&mut head, Order::Rows(List::Frames, u64::MAX));
    same_as_run(&head, &stage.run(|_, _| false));
    assert!(head.take_said().is_some_and(|said| said.contains("ends here")));
    go(&mut head, Order::Rows(List::Frames, 50));
    assert!(head.decoder.rows(List::Frames) <= 50, "the way back is open from the end");
}

#[test]
fn a_step_is_a_frame_either_way() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(256);
    let mut head = stage.head(&shared);
    go(&mut head, Order::Rows(List::Frames, 500));
    let begun = head.decoder.rows(List::Frames);
    for _ in 0..40 {
        let before = head.decoder.rows(List::Frames);
        go(&mut head, Order::Rows(List::Frames, before + 1));
        let after = head.decoder.rows(List::Frames);
        assert!((before + 1..before + 8).contains(&after), "a read may end several frames: {before} {after}");
    }
    for _ in 0..40 {
        let before = head.decoder.rows(List::Frames);
        go(&mut head, Order::Rows(List::Frames, before - 1));
        assert!(head.decoder.rows(List::Frames) < before);
    }
    assert!(head.decoder.rows(List::Frames) <= begun);
    let items = head.decoder.reached().items;
    same_as_run(&head, &stage.run(|decoder, _| decoder.reached().items == items));
}

#[test]
fn playing_keeps_its_speed_and_stops_at_the_end() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(1024);
    let end = shared.lock().timeline.end();
    let mut head = stage.head(&shared);
    go(&mut head, Order::Place(5 * SECOND));
    head.order(Order::Speed(10.0));
    head.order(Order::Play);
    let at = |ns: i64| Timestamp::from_ns(ns);
    head.work(at(SECOND), &mut || true).expect("a recording");
    head.work(at(3 * SECOND), &mut || true).expect("a recording");
    assert_eq!((head.state().playhead, head.state().is_playing), (25 * SECOND, true));
    same_as_run(&head, &stage.run(|_, next| next > 25 * SECOND));
    head.order(Order::Play);
    head.work(at(9 * SECOND), &mut || true).expect("a recording");
    assert_eq!(head.state().playhead, 25 * SECOND, "a pause is one");
    head.order(Order::Play);
    head.order(Order::Speed(5000.0));
    assert_eq!(head.state().speed, 1000.0);
    head.work(at(10 * SECOND), &mut || true).expect("a recording");
    head.work(at(10_000 * SECOND), &mut || true).expect("a recording");
    assert_eq!((head.state().playhead, head.state().is_playing), (end, false));
}

/// Returns the items after which there were new rows with trouble.
fn troubles(stage: &Stage) -> Vec<u64> {
    let mut hits = Vec::new();
    let mut seen = 0;
    let mut note = |decoder: &Decoder<'_>| {
        let rows = decoder.store().list(List::Exchanges);
        if rows.range(seen..u64::MAX).any(|row| row.tone() >= Tone::Warn) {
            hits.push(decoder.reached().items);
        }
        seen = rows.total();
    };
    let end = stage.run(|decoder, _| {
        note(decoder);
        false
    });
    note(&end);
    hits.dedup();
    hits
}

#[test]
fn the_next_and_the_last_error_are_found_from_anywhere() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(256);
    let hits = troubles(&stage);
    assert!(hits.len() > 20);
    let mut head = stage.head(&shared);
    let find = |is_forward| Order::Find { what: Sought::Error, is_forward, before: None };
    go(&mut head, Order::Rows(List::Exchanges, 0));
    for hit in &hits {
        go(&mut head, find(true));
        assert_eq!(head.decoder.reached().items, *hit);
    }
    go(&mut head, find(true));
    assert!(head.take_said().is_some_and(|said| said.contains("no error after")));
    for hit in hits.iter().rev().skip(1) {
        go(&mut head, find(false));
        assert_eq!(head.decoder.reached().items, *hit);
    }
    go(&mut head, find(false));
    assert!(head.take_said().is_some_and(|said| said.contains("no error before")));
    assert_eq!(head.decoder.reached().items, hits[0], "it stays where it was");
}

#[test]
fn a_filter_is_looked_for_in_all_of_the_recording() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(256);
    let filter = Filter::parse("outcome == damaged").expect("a filter");
    let number = shared.lock().begin_look(Look::Filter, true);
    let mut decoder = stage.decoder();
    decoder.watched.filter = Some(Sieve::Filter(filter.clone()).into());
    look(&stage.tracks, decoder, &shared, stage.line(), (Look::Filter, number)).expect("a recording");
    let all = stage.run(|_, _| false);
    let passing = all
        .store()
        .list(List::Exchanges)
        .iter()
        .filter(|row| filter.matches(&crate::tui::store::RowSubject::new(all.store(), row)));
    let hits = shared.lock().timeline.hits.clone().expect("hits").0;
    let count = passing.count() as u64;
    assert!(count > 3);
    assert_eq!(hits.total(Sought::Match), count);
    let mut head = stage.head(&shared);
    go(&mut head, Order::Look(Some(filter.clone())));
    go(&mut head, Order::Rows(List::Exchanges, 0));
    go(&mut head, Order::Find { what: Sought::Match, is_forward: true, before: None });
    let last = head.decoder.store().list(List::Exchanges).last().cloned().expect("a row");
    assert!(filter.matches(&crate::tui::store::RowSubject::new(head.decoder.store(), &last)));
}

#[test]
fn who_looks_for_another_filter_stops_the_one_before() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(1024);
    let first = shared.lock().begin_look(Look::Filter, true);
    shared.lock().begin_look(Look::Filter, true);
    let mut decoder = stage.decoder();
    decoder.watched.filter = Some(Sieve::Filter(Filter::parse("addr == 1").expect("a filter")).into());
    look(&stage.tracks, decoder, &shared, stage.line(), (Look::Filter, first)).expect("a recording");
    assert_eq!(shared.lock().timeline.hits.clone().expect("begun").0.total(Sought::Match), 0);
}

#[test]
fn what_grows_is_followed_to_its_end() {
    let (directory, paths) = one_part();
    let bytes = std::fs::read(&paths[0]).expect("a file of this test");
    let growing = directory.path().join("growing.mcap");
    let half = bytes.len() / 2;
    std::fs::write(&growing, &bytes[..half]).expect("a disk that works");
    let stage = Stage::new(vec![growing.clone()], true);
    let shared = Shared::default();
    let mut head = stage.head(&shared);
    go(&mut head, Order::End);
    assert!(head.state().is_at_end && head.is_moving());
    let before = head.decoder.rows(List::Frames);
    std::fs::write(&growing, &bytes).expect("a disk that works");
    head.work(NOW, &mut || true).expect("a recording");
    assert!(before > 50 && head.decoder.rows(List::Frames) > before);
    assert!(head.take_said().is_some_and(|said| said.contains("has ended")));
    same_as_run(&head, &Stage::new(paths, false).run(|_, _| false));
}

#[test]
fn what_is_empty_or_no_recording_is_an_error() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("empty.mcap");
    std::fs::write(&path, b"").expect("a disk that works");
    assert!(Reel::open(&Tracks::new(vec![path], None, None, false)).is_err());
}

#[test]
fn what_cannot_be_read_on_is_said_on_the_screen() {
    let (teller, heard) = Teller::new();
    say(&Failure::hinted("'a' ends early\nin a chunk", "copy it again"), &teller);
    let Ok(Word::Said(tone, text)) = heard.try_recv() else { panic!("nothing is said") };
    assert_eq!((tone, &*text), (Tone::Bad, "'a' ends early; in a chunk; copy it again"));
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = Shared::default();
    let mut head = stage.head(&shared);
    head.take_state();
    shared.break_off();
    assert!(head.take_state().is_some_and(|state| state.timeline.is_broken));
}

#[test]
fn on_the_way_nothing_is_shown_and_it_can_be_given_up() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = Shared::default();
    let mut head = stage.head(&shared);
    assert!(matches!(head.take_change(), Some((Change::Grown, _))));
    head.order(Order::End);
    let mut items = 0;
    head.work(NOW, &mut || {
        items += 1;
        items < 50
    })
    .expect("a recording");
    assert!(head.is_busy() && head.take_change().is_none() && head.state().way.is_some());
    head.order(Order::Stay);
    assert!(!head.is_busy() && head.take_change().is_some());
}

#[test]
fn checkpoints_fit_in_the_memory_for_them_and_are_evenly_apart() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let most = 1 << 20;
    let shared = Shared::default();
    shared.lock().checkpoints = Checkpoints::within(most);
    scan(&stage.tracks, stage.decoder(), &shared, stage.line()).expect("a recording");
    let known = shared.lock();
    let (places, size) = known.checkpoints.spread();
    assert!(size <= most && size > most / 2, "{size}");
    let gaps: Vec<u64> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (mean, widest) = (places[places.len() - 1] / gaps.len() as u64, gaps.iter().max().expect("some"));
    assert!(*widest < mean * 3, "{mean} {widest}");
    let last = known.checkpoints.last(|_| true).expect("the last one");
    assert!(last.decoder.store().list(List::Frames).kept().count() < 64, "rows are decoded again");
    let (end, rest) = (known.timeline.end(), known.timeline.end() - last.decoder.reached().elapsed_ns);
    assert!(rest < end / gaps.len() as i64 * 3, "{rest} of {end}");
}

/// Writes a recording with notes after two of its reads, as a live session does.
fn with_notes() -> (TempDir, Vec<PathBuf>) {
    let directory = tempfile::tempdir().expect("a directory");
    let mut journal =
        crate::command::journal::Journal::create(&directory.path().join("a.mcap"), Options::default())
            .expect("a disk that works");
    let (line, scenario) = (LineSettings::default(), Scenario::named("clean").expect("a scenario"));
    let settings = BusSettings { name: "bus0".into(), line, ..BusSettings::default() };
    journal.begin(settings).expect("a disk that works");
    let config = Config { seed: 3, frames: 400, line, adapter: Adapter::Ftdi16, scenario };
    for (at, read) in Simulation::new(config).enumerate() {
        let chunk =
            Chunk { time: ReadTime::At(read.time), bytes: &read.bytes, line_errors: &read.line_errors };
        journal.item(&Item::Chunk { bus: "bus0", chunk, ready: None }).expect("a disk that works");
        journal.recorder().tick(read.time).expect("a disk that works");
        if at == 100 || at == 300 {
            let text = format!("after read {at}");
            journal.item(&Item::Note { time: Some(read.time), text: &text }).expect("a disk that works");
        }
    }
    let paths = journal.finish("finished").expect("a disk that works");
    (directory, paths)
}

#[test]
fn what_was_noted_is_a_row_on_the_timeline_and_to_be_gone_to() {
    let (_directory, paths) = with_notes();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(256);
    assert_eq!(shared.lock().timeline.events.total(Sought::Note), 2);
    let mut head = stage.head(&shared);
    go(&mut head, Order::Place(0));
    for at in [100, 300] {
        go(&mut head, Order::Find { what: Sought::Note, is_forward: true, before: None });
        let last = head.decoder.store().list(List::Frames).last().cloned().expect("a row");
        let Row::Remark(remark) = last else { panic!("{last:?}") };
        assert_eq!(&*remark.text, format!("after read {at}"));
    }
    go(&mut head, Order::Find { what: Sought::Note, is_forward: true, before: None });
    assert_eq!(head.take_said().as_deref(), Some("there is no note after this"));
}

#[test]
fn words_are_looked_for_beyond_the_rows_in_memory() {
    let (_directory, paths) = with_notes();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(256);
    let sieve = Sieve::words("After READ 300");
    let number = shared.lock().begin_look(Look::Words, true);
    let mut decoder = stage.decoder();
    decoder.watched.words = Some(sieve.clone().into());
    look(&stage.tracks, decoder, &shared, stage.line(), (Look::Words, number)).expect("a recording");
    assert_eq!(shared.lock().timeline.words.as_ref().map(|(words, _)| words.total(Sought::Words)), Some(1));
    let mut head = stage.head(&shared);
    go(&mut head, Order::Place(0));
    go(&mut head, Order::Words { sieve: sieve.clone(), is_forward: true, before: None });
    let found = head.decoder.reached().items;
    go(&mut head, Order::End);
    go(&mut head, Order::Words { sieve, is_forward: false, before: None });
    assert_eq!(head.decoder.reached().items, found);
}

#[test]
fn playing_pauses_at_the_row_that_passes() {
    let (_directory, paths) = one_part();
    let stage = Stage::new(paths, false);
    let shared = stage.scanned(256);
    let filter = Filter::parse("outcome == damaged").expect("a filter");
    let mut head = stage.head(&shared);
    go(&mut head, Order::Place(0));
    let before = head.decoder.reached().items;
    let first = stage.run(|decoder, _| {
        let rows = decoder.store().list(List::Exchanges);
        let passes = |row: &Row| filter.matches(&crate::tui::store::RowSubject::new(decoder.store(), row));
        decoder.reached().items > before && rows.last().is_some_and(passes)
    });
    head.order(Order::Break(Some(filter.clone())));
    head.order(Order::Speed(1000.0));
    head.order(Order::Play);
    for second in 0..100 {
        head.work(NOW + second * SECOND, &mut || true).expect("a recording");
    }
    assert_eq!(head.decoder.reached().items, first.reached().items);
    assert!(!head.state().is_playing);
    head.order(Order::Play);
    head.work(NOW, &mut || true).expect("a recording");
    head.work(NOW + SECOND, &mut || true).expect("a recording");
    assert!(head.decoder.reached().items > first.reached().items, "it can be played on from there");
}
