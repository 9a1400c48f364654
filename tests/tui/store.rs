//! What the store keeps of the traffic agrees with what `decode` prints.

use rtutap::tui::store::{List, Row, RowJson};

use crate::session::{Session, Source};

#[test]
fn every_row_copied_as_json_is_the_line_that_decode_prints() {
    let mut source = Source::new();
    source.take(1500);
    let store = source.feed.store();
    let (mut exchanges, mut runs) = (0, 0);
    for (list, count) in [(List::Exchanges, &mut exchanges), (List::Frames, &mut runs)] {
        for row in store.list(list).iter().filter(|row| !matches!(row, Row::Remark(_))) {
            let json = RowJson::new(store, row).to_string();
            let same = json.split_once(",\"bus\"").map_or("", |(id, _)| id);
            let printed = source.json.iter().find(|line| line.starts_with(same));
            assert_eq!(Some(&json), printed);
            *count += 1;
        }
    }
    assert!(exchanges > 50 && runs > 100);
}

#[test]
fn frames_are_found_by_their_id() {
    let mut source = Source::new();
    source.take(1500);
    let store = source.feed.store();
    for row in store.list(List::Frames).iter() {
        let Row::Run(run) = row else { continue };
        let found = store.frame_row(run.id).and_then(|number| store.list(List::Frames).get(number));
        assert!(matches!(found, Some(Row::Run(found)) if found.id == run.id));
    }
    assert_eq!(store.frame_row(u64::MAX), None);
}

#[test]
fn a_damaged_run_is_listed_once_by_itself_or_by_its_transaction() {
    let mut source = Source::new();
    source.take(3000);
    let store = source.feed.store();
    let alone: Vec<u64> = store
        .list(List::Exchanges)
        .iter()
        .filter_map(|row| match row {
            Row::Run(run) => Some(run.id),
            _ => None,
        })
        .collect();
    let told: Vec<u64> = store
        .list(List::Exchanges)
        .iter()
        .flat_map(|row| match row {
            Row::Exchange(exchange) => exchange.ids.into_iter().flatten().collect(),
            _ => Vec::new(),
        })
        .collect();
    let damaged =
        store.list(List::Frames).iter().filter(|row| matches!(row, Row::Run(run) if run.reason().is_some()));
    let mut seen = 0;
    for row in damaged {
        let Row::Run(run) = row else { continue };
        let count = alone.iter().chain(&told).filter(|id| **id == run.id).count();
        assert!(count <= 1, "run {} is listed {count} times", run.id);
        seen += count;
    }
    assert!(seen > 3, "the demo has damaged runs");
}

#[test]
fn a_copy_for_the_screen_stays_as_it_was() {
    let mut session = Session::new(80, 24, 500);
    let before = session.app.store().clone();
    let (rows, revision) = (before.list(List::Frames).total(), before.revision());
    session.grow(500);
    assert_eq!((before.list(List::Frames).total(), before.revision()), (rows, revision));
    assert!(session.app.store().revision() > revision);
}
