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

#[test]
fn who_reads_a_row_goes_on_reading_it_when_all_before_it_is_known() {
    let mut session = unsettled(80, 24);
    session.press("up up up up up up up up up up tab down down");
    let look = |session: &Session| {
        let (traffic, store) = (&session.app.traffic, session.app.store());
        let below = traffic.place(store).zip(Some(traffic.top(store))).map(|(place, top)| place - top);
        (session.row().time(), traffic.is_following, traffic.pane, traffic.node, traffic.byte, below)
    };
    let before = look(&session);
    assert!(!before.1 && before.3 > 0);
    session.app.update(Message::Replaced(settled()));
    assert_eq!(session.app.store().known_from(), None);
    assert_eq!(look(&session), before);
}

#[test]
fn who_follows_goes_on_following_when_all_before_is_known() {
    let mut session = unsettled(140, 45);
    session.press("tab down down");
    session.app.update(Message::Replaced(settled()));
    assert!(session.app.traffic.is_following && session.app.traffic.node > 0);
    let last = session.app.store().list(session.app.traffic.list).last().and_then(Row::time);
    assert_eq!(session.row().time(), last);
}

#[test]
fn findings_that_are_not_known_yet_are_not_said_to_be_none() {
    let mut session = unsettled(80, 24);
    for (key, said) in [("/", "not known here yet"), ("b", "no pause till then")] {
        session.press(key);
        session.press("ctrl-u");
        session.type_text("finding == D06");
        session.press("enter");
        assert!(session.screen().contains(said), "{}", session.screen());
        assert!(!session.screen().contains("no row here passes"));
    }
    session.app.update(Message::Replaced(settled()));
    assert!(session.screen().contains("no row here passes"), "now it is known");
}
