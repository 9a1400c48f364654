//! A place of a recording that was shown before all before it was known, and what becomes of the screen when it is.

use rtutap::time::Timestamp;
use rtutap::tui::app::Message;
use rtutap::tui::store::{Row, Store};

use crate::replay::{provisional, session};
use crate::session::{Session, Source};

/// Returns the traffic of [`provisional`], with all that came before.
fn settled() -> Store {
    let mut source = Source::new();
    source.take(500);
    source.feed.store().clone()
}

/// Shows a place of which is not known what came before.
fn unsettled(columns: u16, lines: u16) -> Session {
    let mut session = session(columns, lines, |_| {});
    session.app.update(Message::Replaced(provisional()));
    session
}

/// Returns the times of the rows that are drawn as marked.
fn marked(session: &Session) -> Vec<Option<Timestamp>> {
    let (app, store) = (&session.app, session.app.store());
    let rows = store.list(app.traffic.list);
    let of = |number: u64| rows.get(number).filter(|row| app.is_marked(number, row)).map(Row::time);
    rows.kept().filter_map(of).collect()
}

#[test]
fn a_mark_stays_on_its_row_when_rows_are_numbered_anew() {
    let mut session = unsettled(80, 24);
    session.press("up up up up up up m");
    let row = session.row().time();
    assert_eq!(marked(&session), [row]);
    assert!(session.screen().lines().any(|line| line.starts_with('◆')), "{}", session.screen());
    session.app.update(Message::Replaced(settled()));
    assert_eq!(marked(&session), [row]);
    // Another place is numbered from the same number on.
    let mut source = Source::new();
    source.feed = source.feed.provisional(Timestamp::from_ns(0));
    source.take(600);
    source.feed = source.feed.begun_here(u64::MAX);
    source.take(300);
    session.app.update(Message::Replaced(source.feed.store().clone()));
    assert_eq!(marked(&session), []);
    session.press("m m");
    assert_eq!(session.app.marked_places().len(), 1);
}
