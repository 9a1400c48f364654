//! Notes and marks in a recording: going to them, and what keeps them.

use rtutap::tui::app::replay::Order;
use rtutap::tui::app::{Effect, Message};
use rtutap::tui::timeline::Sought;

use crate::replay::{order, session};
use crate::session::Session;

/// Notes something about what is selected.
fn note(session: &mut Session, text: &str) {
    session.press("a");
    session.type_text(text);
    session.press("enter");
}

#[test]
fn a_note_of_one_s_own_is_gone_to_and_read() {
    let mut session = session(80, 24, |_| {});
    session.press("up up up");
    let row = session.row().time();
    note(&mut session, "cable moved");
    assert_eq!(session.press("'"), None, "it is here");
    assert!(session.screen().contains("noted: cable moved"), "{}", session.screen());
    let find = |is_forward, before| Order::Find { what: Sought::Note, is_forward, before };
    assert_eq!(order(session.press("'")), find(true, None), "there may be others in the recording");
    session.press("down down");
    assert_eq!(session.press("\""), None);
    assert_eq!(session.row().time(), row);
    assert!(session.screen().contains("noted: cable moved"));
    session.press("home");
    assert_eq!(session.press("'"), None);
    assert_eq!(session.row().time(), row);
}

#[test]
fn a_note_that_is_not_in_memory_is_gone_to_and_read() {
    let mut session = session(80, 24, |_| {});
    session.press("home down down");
    let (store, time) = (session.app.store().clone(), session.row().time().expect("a time"));
    note(&mut session, "cable moved");
    let place = time - session.app.replay().and_then(|replay| replay.timeline.origin).expect("an origin");
    session.app.update(Message::Replaced(crate::replay::provisional()));
    let to = order(session.press("\""));
    assert!(matches!(to, Order::Place(at) if at > place), "{to:?}");
    session.app.update(Message::Replaced(store));
    assert_eq!(session.row().time(), Some(time));
    assert!(session.screen().contains("noted: cable moved"), "{}", session.screen());
}

#[test]
fn who_quits_with_notes_that_nothing_keeps_is_told_once() {
    let mut session = session(40, 12, |_| {});
    note(&mut session, "cable moved");
    let export = |session: &mut Session, path: &str| {
        session.press("w");
        session.type_text(path);
        let Some(Effect::Export { notes, .. }) = session.press("enter") else { panic!("an export") };
        notes
    };
    export(&mut session, "part.csv");
    assert_eq!(session.press("q"), None);
    assert!(session.screen().contains("w to .mcap, q quits"), "{}", session.screen());
    assert_eq!(session.press("q"), Some(Effect::Quit));
    note(&mut session, "cable moved again");
    let notes = export(&mut session, "part.mcap");
    assert_eq!(session.press("q"), None, "they are in no file before it is whole");
    note(&mut session, "cable moved back");
    session.app.update(Message::Kept(notes));
    assert_eq!(session.press("q"), None, "one was made since");
    let notes = export(&mut session, "part.mcap");
    session.app.update(Message::Kept(notes));
    note(&mut session, "done");
    session.press("q");
    assert!(session.screen().contains("1 note unkept"), "{}", session.screen());
    let notes = export(&mut session, "part.mcap");
    session.app.update(Message::Kept(notes));
    assert_eq!(session.press("q"), Some(Effect::Quit), "all is kept");
}
