//! Places that are not decoded yet.

use super::*;
use crate::tui::store::PROVISIONAL;

/// Writes a recording large enough that the way to its end is long.
fn large() -> (TempDir, Vec<PathBuf>) {
    let directory = tempfile::tempdir().expect("a directory");
    let options = Options { rotate_chunks: Some(100), session_id: "one".into(), ..Options::default() };
    let paths = record(&directory.path().join("a.mcap"), 13_000, options);
    (directory, paths)
}

/// Returns when frames were, and what they are.
fn frames(store: &Store) -> Vec<(Option<Timestamp>, Box<[u8]>)> {
    let runs = store.list(List::Frames).iter().filter_map(|row| match row {
        Row::Run(run) => Some((run.end, run.bytes.clone())),
        _ => None,
    });
    runs.collect()
}

#[test]
fn what_is_not_decoded_yet_is_shown_provisionally_and_then_as_it_is() {
    let (_directory, paths) = large();
    assert!(paths.len() > 1);
    let stage = Stage::new(paths, false);
    let shared = Shared::default();
    let (begin, last) = Reel::open(&stage.tracks).expect("a recording").times().expect("an index");
    shared.lock().timeline.end_ns = last - begin;
    let mut head = stage.head(&shared);
    let place = (last - begin) * 3 / 4;
    go(&mut head, Order::Place(place));
    let (change, store) = head.take_change().expect("something to show");
    assert!(change == Change::Replaced && store.known_from().is_some() && head.state().playhead == place);
    assert!(store.findings().list().is_empty());
    let truth = stage.run(|_, next| next > place);
    let (told, known) = (frames(&store), frames(truth.store()));
    assert!(told.len() > 50);
    assert!(told == known[known.len() - told.len()..], "what is shown is what will be");
    scan(&stage.tracks, stage.decoder(), &shared, stage.line()).expect("a recording");
    assert!(head.is_busy());
    settle(&mut head);
    let (_, store) = head.take_change().expect("something else to show");
    assert_eq!((store.known_from(), head.state().playhead), (None, place));
    same_as_run(&head, &truth);
}

/// Says from when to when a recording is that nobody has decoded yet.
fn times(stage: &Stage, shared: &Shared<'_>) -> i64 {
    let (begin, last) = Reel::open(&stage.tracks).expect("a recording").times().expect("an index");
    shared.lock().timeline.end_ns = last - begin;
    last - begin
}

#[test]
fn who_searches_while_it_is_played_searches_from_there() {
    let (_directory, paths) = large();
    let stage = Stage::new(paths, false);
    let shared = Shared::default();
    let end = times(&stage, &shared);
    let mut head = stage.head(&shared);
    go(&mut head, Order::Place(end / 2));
    head.order(Order::Play);
    head.work(NOW, &mut || true).expect("a recording");
    head.work(NOW + SECOND, &mut || true).expect("a recording");
    let place = head.state().playhead;
    assert!(head.is_cold() && head.state().is_playing && place > end / 2);
    head.order(Order::Find { what: Sought::Error, is_forward: true, before: None });
    for second in 2..60 {
        head.work(NOW + second * SECOND, &mut || true).expect("a recording");
    }
    assert!(head.is_cold() && !head.state().is_playing && head.state().playhead == place);
    let from = stage.run(|_, next| next > place).reached().items;
    scan(&stage.tracks, stage.decoder(), &shared, stage.line()).expect("a recording");
    settle(&mut head);
    let next = troubles(&stage).into_iter().find(|items| *items > from);
    assert_eq!(Some(head.decoder.reached().items), next, "the next from where it was asked for");
}

#[test]
fn what_is_known_is_shown_before_what_waited_for_it_is_looked_for() {
    let (_directory, paths) = large();
    let stage = Stage::new(paths, false);
    let shared = Shared::default();
    let place = times(&stage, &shared) / 2;
    let mut head = stage.head(&shared);
    go(&mut head, Order::Place(place));
    go(&mut head, Order::Find { what: Sought::Note, is_forward: true, before: None });
    assert!(head.take_change().is_some_and(|(_, store)| store.known_from().is_some()));
    scan(&stage.tracks, stage.decoder(), &shared, stage.line()).expect("a recording");
    let shown = std::iter::repeat_with(|| {
        head.work(NOW, &mut || true).expect("a recording");
        (head.take_change(), head.state().way.is_some(), head.is_busy())
    });
    let (change, is_on_the_way, is_busy) =
        shown.take(1000).find(|(change, ..)| change.is_some()).expect("something to show");
    assert!(change.is_some_and(|(_, store)| store.known_from().is_none()));
    assert!(is_on_the_way && is_busy, "it is looked for next");
    settle(&mut head);
    assert_eq!(head.take_said().as_deref(), Some("there is no note after this"));
    assert_eq!(head.state().playhead, stage.run(|_, next| next > place).reached().elapsed_ns);
}

#[test]
fn provisional_rows_are_gone_about_in_and_what_needs_all_of_them_waits() {
    let (_directory, paths) = large();
    let stage = Stage::new(paths, false);
    let shared = Shared::default();
    let (begin, last) = Reel::open(&stage.tracks).expect("a recording").times().expect("an index");
    shared.lock().timeline.end_ns = last - begin;
    let mut head = stage.head(&shared);
    let place = (last - begin) * 3 / 4;
    go(&mut head, Order::Place(place));
    let rows = head.decoder.store().list(List::Exchanges).kept();
    go(&mut head, Order::Rows(List::Exchanges, rows.end + 20));
    assert!(head.is_cold() && head.state().playhead > place);
    assert_eq!(head.decoder.store().list(List::Exchanges).kept(), rows.start..rows.end + 20);
    let first = head.decoder.store().list(List::Exchanges).iter().next().and_then(Row::time).expect("a time");
    go(&mut head, Order::Rows(List::Exchanges, rows.start));
    let before = head.decoder.store().list(List::Exchanges).last().and_then(Row::time).expect("a time");
    assert!(head.is_cold() && before < first, "a page back is before what was there");
    go(&mut head, Order::End);
    assert!(head.is_cold() && head.is_over);
    go(&mut head, Order::Find { what: Sought::Error, is_forward: false, before: None });
    assert!(head.is_cold() && head.state().way.is_some(), "it is looked for when all before is known");
    scan(&stage.tracks, stage.decoder(), &shared, stage.line()).expect("a recording");
    settle(&mut head);
    assert!(!head.is_cold() && head.decoder.last().errors > 0 && head.state().way.is_none());
    let items = head.decoder.reached().items;
    assert!(troubles(&stage).contains(&items));
    go(&mut head, Order::Rows(List::Exchanges, PROVISIONAL + 7));
    assert_eq!(head.decoder.reached().items, items, "a number that came too late is none");
}

#[test]
fn from_when_on_it_is_known_is_said_however_few_bytes_are_before_a_place() {
    let (_directory, parts) = large();
    let stage = Stage::new(parts.clone(), false);
    let shared = Shared::default();
    let end = times(&stage, &shared);
    let mut head = stage.head(&shared);
    for path in &parts[1..] {
        let origin = head.decoder.reached().origin.expect("times");
        let part = Tracks::new(vec![path.clone()], None, None, false);
        let (begin, _) = Reel::open(&part).expect("a recording").times().expect("an index");
        let place = begin - origin;
        assert!(place < end);
        for after in [0, 1, SECOND / 100, SECOND / 10] {
            go(&mut head, Order::Place(place + after));
            let store = head.decoder.store();
            assert!(!head.is_cold() || store.known_from().is_some(), "{place} {after}");
        }
    }
}

#[test]
fn what_is_about_to_be_known_is_not_given_up() {
    let (_directory, paths) = large();
    let stage = Stage::new(paths, false);
    let shared = Shared::default();
    let place = times(&stage, &shared) / 2;
    let mut head = stage.head(&shared);
    go(&mut head, Order::Place(place));
    scan(&stage.tracks, stage.decoder(), &shared, stage.line()).expect("a recording");
    head.take_change();
    head.work(NOW, &mut || false).expect("a recording");
    assert!(head.is_settling && head.is_busy());
    head.order(Order::Stay);
    assert!(head.take_change().is_none(), "what is half known is not shown");
    settle(&mut head);
    assert!(!head.is_settling && head.state().playhead == place);
    same_as_run(&head, &stage.run(|_, next| next > place));
}
