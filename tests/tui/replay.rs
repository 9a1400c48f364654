//! A recording in the UI: the timeline, and what keys and mouse ask of the player.

use std::sync::Arc;

use crossterm::event::{KeyModifiers, MouseButton, MouseEvent, MouseEventKind};
use ratatui::style::{Color, Modifier};
use rtutap::analyze::filter::Filter;
use rtutap::time::{SECOND, Timestamp};
use rtutap::tui::app::replay::{Order, Replay, Way};
use rtutap::tui::app::{Effect, Message, Options};
use rtutap::tui::sieve::Sieve;
use rtutap::tui::store::{List, Row, Store, Tone};
use rtutap::tui::timeline::{Bucket, Series, Sought, Timeline};

use crate::session::{Session, Source};

/// How long the recording is, in nanoseconds.
const END: i64 = 600 * SECOND;

/// Is a recording of ten minutes, decoded up to the seventh, with trouble in the second and fifth.
fn timeline() -> Timeline {
    let mut events = Series::default();
    for second in 0..420 {
        let busy_ns = SECOND / 10 * (1 + second / 20 % 5);
        let errors = u64::from(second == 90 || second == 275);
        let findings = u64::from(second == 330);
        events.add(second * SECOND, &Bucket { busy_ns, rows: 20, errors, findings, ..Bucket::default() });
    }
    Timeline { events, decoded_ns: 420 * SECOND, end_ns: END, share: 0.7, ..Timeline::default() }
}

pub(super) fn replay(session: &Session) -> Replay {
    let store = session.app.store();
    let timeline = Timeline { origin: store.begun(), ..timeline() };
    Replay { timeline: Arc::new(timeline), playhead: 200 * SECOND, speed: 1.0, ..Replay::default() }
}

/// Shows a recording, with what a test changes of it.
pub(super) fn session(columns: u16, lines: u16, change: impl Fn(&mut Replay)) -> Session {
    let options = Options { is_live: false, ..Options::default() };
    let mut session = Session::with(options, columns, lines, 700);
    let mut replay = replay(&session);
    change(&mut replay);
    session.app.update(Message::Replay(replay));
    session
}

pub(super) fn order(effect: Option<Effect>) -> Order {
    match effect {
        Some(Effect::Replay(order)) => order,
        other => panic!("no order: {other:?}"),
    }
}

fn check(name: &str, change: impl Fn(&mut Replay)) {
    for (columns, lines) in [(40, 12), (80, 24), (140, 45)] {
        let session = session(columns, lines, &change);
        insta::assert_snapshot!(format!("{name}_{columns}x{lines}"), session.screen());
    }
}

#[test]
fn a_recording_that_is_being_decoded() {
    check("replay", |_| {});
}

#[test]
fn a_recording_that_is_played_with_a_filter() {
    check("replay_filtered", |replay| {
        let mut hits = Series::default();
        for second in [20, 21, 150, 410] {
            hits.add(second * SECOND, &Bucket { matches: 3, ..Bucket::default() });
        }
        (replay.is_playing, replay.speed) = (true, 10.0);
        let timeline = Arc::make_mut(&mut replay.timeline);
        (timeline.decoded_ns, timeline.is_complete, timeline.hits) = (END, true, Some((hits, 450 * SECOND)));
    });
}

/// Returns the traffic from some moment on, of which nobody knows what came before.
pub(super) fn provisional() -> Store {
    let mut source = Source::new();
    source.feed = source.feed.provisional(Timestamp::from_ns(0));
    source.take(200);
    source.feed = source.feed.begun_here(u64::MAX);
    source.take(300);
    source.feed.store().clone()
}

#[test]
fn a_place_of_which_is_not_known_what_came_before() {
    for (columns, lines) in [(40, 12), (80, 24), (140, 45)] {
        let mut session = session(columns, lines, |_| {});
        session.app.update(Message::Replaced(provisional()));
        insta::assert_snapshot!(format!("replay_provisional_{columns}x{lines}"), session.screen());
        let list = session.app.regions().list.expect("rows");
        let row = &session.buffer()[(list.x + 4, list.y + 1)];
        assert!(row.modifier.contains(Modifier::ITALIC));
    }
}

#[test]
fn what_is_not_known_of_provisional_rows_is_not_shown() {
    let mut session = session(140, 45, |_| {});
    session.press("v");
    let frame = |session: &mut Session| {
        let Some(Effect::Copy(json)) = session.press("J") else { panic!("nothing is copied") };
        serde_json::from_str::<serde_json::Value>(&json).expect("JSON")
    };
    assert!(session.screen().contains("of the stream") && frame(&mut session)["id"].is_u64());
    session.app.update(Message::Replaced(provisional()));
    let json = frame(&mut session);
    assert!(json["id"].is_null() && json["stream_offset"].is_null() && json["bytes"].is_string());
    assert!(!session.screen().contains("of the stream") && !session.screen().contains('#'));
    session.press("v");
    let json = frame(&mut session);
    assert!(json["id"].is_null() && json["request"].is_null() && json["response"].is_null());
    session.press("4");
    assert!(session.screen().contains("not known yet"), "{}", session.screen());
}

#[test]
fn the_worse_a_bus_was_the_darker_its_trouble_is_drawn() {
    let session = session(100, 30, |replay| {
        let mut events = Series::default();
        for second in 0..600 {
            let errors = [1, 30, 90][usize::try_from(second / 200).expect("three")];
            events.add(second * SECOND, &Bucket { rows: 100, errors, ..Bucket::default() });
        }
        Arc::make_mut(&mut replay.timeline).events = events;
    });
    let area = session.app.regions().timeline.expect("a timeline");
    let glyph = |x: u16| session.buffer()[(area.x + x, area.y + 1)].symbol().to_owned();
    assert_eq!([10, 50, 90].map(glyph), ["✗", "▓", "█"]);
}

#[test]
fn what_is_noted_in_a_replay_is_kept_by_an_export() {
    let mut session = session(80, 24, |_| {});
    session.press("home m");
    let time = session.row().time().expect("a time");
    session.press("a");
    session.type_text("cable moved");
    assert_eq!(session.press("enter"), None);
    assert!(session.screen().contains("an export (w) to .mcap keeps it"), "{}", session.screen());
    session.press("w");
    session.type_text("part.mcap");
    let effect = session.press("enter");
    let notes = vec![(time, "mark".to_owned()), (time, "cable moved".to_owned())];
    assert_eq!(effect, Some(Effect::Export { filter: None, path: "part.mcap".to_owned(), notes }));
    assert_eq!(session.app.noted_places().count(), 1);
}

#[test]
fn who_waits_for_a_row_in_a_replay_reads_that_it_pauses() {
    let mut session = session(80, 24, |_| {});
    session.press("b");
    session.type_text("addr == 1");
    assert!(matches!(order(session.press("enter")), Order::Break(Some(_))));
    assert!(session.screen().contains("waits to pause"));
}

#[test]
fn what_was_said_leaves_the_footer_with_the_next_key() {
    let mut session = session(80, 24, |_| {});
    session.app.update(Message::Said(Tone::Info, "there is no error after this".to_owned()));
    assert!(session.screen().contains("no error after"));
    session.press("home");
    assert!(!session.screen().contains("no error after"));
    session.app.update(Message::Said(Tone::Bad, "the disk is full".to_owned()));
    session.press("home");
    assert!(session.screen().contains("the disk is full"), "a warning stays its time");
}

#[test]
fn an_empty_list_says_whether_any_row_of_the_recording_passes() {
    for (is_complete, said) in [(false, "no row here passes"), (true, "no row of the recording passes")] {
        let mut session = session(80, 24, |replay| {
            let timeline = Arc::make_mut(&mut replay.timeline);
            (timeline.is_complete, timeline.hits) = (is_complete, Some((Series::default(), END)));
        });
        session.press("/");
        session.type_text("addr == 200");
        session.press("enter");
        assert!(session.screen().contains(said), "{}", session.screen());
    }
}

#[test]
fn a_recording_that_cannot_be_read_on_says_so_where_progress_is_said() {
    let mut session = session(80, 24, |replay| Arc::make_mut(&mut replay.timeline).is_broken = true);
    let screen = session.screen();
    assert!(screen.contains("cannot be read on") && !screen.contains("decoded 70 %"), "{screen}");
    session.app.update(Message::Replaced(Store::default()));
    assert!(session.screen().contains("nothing of it can be read"), "{}", session.screen());
}

#[test]
fn a_playhead_on_its_way() {
    check("replay_way", |replay| replay.way = Some((Way::Place(500 * SECOND), 0.42)));
}

#[test]
fn the_timeline_says_the_same_with_and_without_colour() {
    let session = session(100, 30, |_| {});
    let buffer = session.buffer();
    let area = session.app.regions().timeline.expect("a timeline");
    let column = |second: i64| area.x + u16::try_from(second * i64::from(area.width) / 600).expect("narrow");
    let (load, marks) = (area.y, area.y + 1);
    let error = &buffer[(column(90), marks)];
    assert_eq!((error.symbol(), error.fg), ("✗", Color::Red));
    let finding = &buffer[(column(330), marks)];
    assert_eq!((finding.symbol(), finding.fg), ("▲", Color::Yellow));
    assert_eq!(buffer[(column(500), load)].symbol(), "┄", "not decoded yet");
    let head = &buffer[(column(200), marks)];
    assert_eq!(head.symbol(), "┃");
    assert!(head.modifier.contains(Modifier::BOLD));
}

#[test]
fn every_key_of_a_replay_is_an_order() {
    let mut session = session(80, 24, |_| {});
    let frames = session.app.store().list(List::Frames).total();
    let part = END / 50;
    for (keys, expected) in [
        ("space", Order::Play),
        ("P", Order::Play),
        (">", Order::Speed(2.0)),
        ("<", Order::Speed(1.0)),
        (".", Order::Rows(List::Frames, frames + 1)),
        (",", Order::Rows(List::Frames, frames - 1)),
        ("}", Order::Place(200 * SECOND + part)),
        ("{", Order::Place(200 * SECOND)),
        (")", Order::End),
        ("d", Order::Find { what: Sought::Finding, is_forward: true, before: None }),
        ("2 .", Order::Rows(List::Frames, frames + 1)),
    ] {
        assert_eq!(order(session.press(keys)), expected, "{keys}");
    }
    assert!(matches!(order(session.press("(")), Order::Rows(List::Exchanges, 1..)));
}

#[test]
fn speeds_go_from_a_tenth_to_a_thousand() {
    let mut session = session(80, 24, |_| {});
    let mut speeds = Vec::new();
    for (key, count) in [("<", 5), (">", 14)] {
        for _ in 0..count {
            let Order::Speed(speed) = order(session.press(key)) else { panic!("no speed") };
            speeds.push(speed);
        }
    }
    assert_eq!(speeds[..5], [0.5, 0.2, 0.1, 0.1, 0.1]);
    assert_eq!(speeds.last(), Some(&1000.0));
}

#[test]
fn live_traffic_has_no_playhead() {
    let mut session = Session::new(80, 24, 700);
    for keys in [".", ",", "P", ">", "{"] {
        assert_eq!(session.press(keys), None, "{keys}");
    }
    session.press("space");
    assert!(session.app.is_frozen());
    assert_eq!(session.app.regions().timeline, None);
}

#[test]
fn going_beyond_the_rows_moves_the_playhead() {
    let mut session = session(80, 24, |_| {});
    let total = session.app.store().list(List::Exchanges).total();
    assert_eq!(order(session.press("down")), Order::Rows(List::Exchanges, total + 1));
    assert!(matches!(order(session.press("pagedown")), Order::Rows(_, count) if count > total + 3));
    assert_eq!(order(session.press("G")), Order::End);
    assert_eq!(session.press("up"), None, "there are rows above");
    assert_eq!(session.press("home up"), None, "before the first row there is nothing");
    session.source.flood(150_000);
    session.show();
    session.press("v home");
    let first = session.app.store().list(List::Frames).first_kept();
    assert!(first > 0);
    assert_eq!(order(session.press("up")), Order::Rows(List::Frames, first));
    assert!(session.screen().contains("kept"), "that rows have left memory is said");
}

#[test]
fn with_a_filter_one_goes_on_by_what_passes_in_all_of_the_recording() {
    let mut session = session(80, 24, |_| {});
    session.press("/");
    session.type_text("addr == 1");
    let filter = Filter::parse("addr == 1").expect("a filter");
    assert_eq!(order(session.press("enter")), Order::Look(Some(filter)));
    session.press("G");
    let find = Order::Find { what: Sought::Match, is_forward: true, before: None };
    assert_eq!(order(session.press("down")), find);
    assert_eq!(order(session.press("x")), Order::Look(None));
}

#[test]
fn errors_in_memory_are_gone_to_without_the_player() {
    let mut session = session(80, 24, |_| {});
    session.press("home");
    assert_eq!(session.press("e"), None);
    let place = session.app.traffic.place(session.app.store());
    assert!(place.is_some_and(|place| place > 0));
    session.press("G");
    let next = Order::Find { what: Sought::Error, is_forward: true, before: None };
    assert_eq!(order(session.press("e")), next);
    session.press("home");
    let first = session.app.store().list(List::Exchanges).first_kept();
    let last = Order::Find { what: Sought::Error, is_forward: false, before: Some((List::Exchanges, first)) };
    let mut orders = std::iter::repeat_with(|| session.press("E")).take(40).flatten();
    assert_eq!(order(orders.next()), last);
}

#[test]
fn a_time_that_is_typed_is_a_place() {
    let mut session = session(80, 24, |_| {});
    let mut go = |text: &str| {
        session.press(":");
        session.type_text(text);
        session.press("enter")
    };
    assert_eq!(order(go("12.5")), Order::Place(SECOND / 2 * 25));
    assert_eq!(order(go("1999-01-01T00:00:00Z")), Order::Place(0));
    assert_eq!(order(go("2100-01-01T00:00:00Z")), Order::Place(END));
}

#[test]
fn the_mouse_seeks_on_the_timeline_and_drags_the_playhead() {
    let mut session = session(101, 30, |_| {});
    let area = session.app.regions().timeline.expect("a timeline");
    let mut mouse = |kind, column, row| {
        let event = MouseEvent { kind, column, row, modifiers: KeyModifiers::NONE };
        session.app.update(Message::Mouse(event))
    };
    let press = MouseEventKind::Down(MouseButton::Left);
    let drag = MouseEventKind::Drag(MouseButton::Left);
    assert_eq!(order(mouse(press, 50, area.y)), Order::Place(END / 2));
    assert_eq!(order(mouse(drag, 100, 0)), Order::Place(END));
    mouse(MouseEventKind::Up(MouseButton::Left), 100, 0);
    assert_eq!(mouse(drag, 20, area.y), None, "what was let go is not dragged");
}

#[test]
fn another_store_is_shown_from_its_newest_row() {
    let mut session = session(80, 24, |_| {});
    session.press("home");
    session.app.update(Message::Replaced(session.source.feed.store().clone()));
    assert!(session.app.traffic.is_following);
}

#[test]
fn a_mark_is_on_the_timeline() {
    let mut session = session(101, 30, |_| {});
    session.press("home m");
    assert_eq!(session.app.marked_places().len(), 1);
    assert!(session.screen().contains('◆'));
    session.press("m");
    assert!(session.app.marked_places().is_empty());
}

/// Hands over what the player shows when it has arrived.
fn arrive(session: &mut Session, change: Message) {
    let arrived = replay(session);
    session.app.update(Message::Replay(arrived));
    session.app.update(change);
}

#[test]
fn words_that_are_not_in_memory_are_looked_for_in_all_of_the_recording() {
    let mut session = session(80, 24, |_| {});
    session.press("home s");
    session.type_text("serial");
    session.press("enter");
    let near = session.app.traffic.selected;
    assert!(near > Some(0), "what is in memory is gone to at once");
    session.press("s");
    session.type_text("Nowhere");
    let is_words = |order: &Order, way: bool| match order {
        Order::Words { sieve, is_forward, .. } => *sieve == Sieve::words("nowhere") && *is_forward == way,
        _ => false,
    };
    assert!(is_words(&order(session.press("enter")), true));
    assert!(is_words(&order(session.press("N")), false));
}

#[test]
fn what_was_found_is_selected_when_it_has_come() {
    let mut session = session(80, 24, |_| {});
    session.press("home s");
    session.type_text("the cable");
    assert!(matches!(order(session.press("enter")), Order::Words { is_forward: true, .. }));
    let now = session.source.now;
    session.source.feed.note(Some(now), "moved the cable");
    session.source.take(300);
    let store = session.source.feed.store().clone();
    let noted = store.list(List::Exchanges).total();
    arrive(&mut session, Message::Grown(store));
    assert!(session.selected() < noted - 1, "it is not the last");
    assert!(matches!(session.row(), Row::Remark(remark) if &*remark.text == "moved the cable"));
}

#[test]
fn going_down_at_the_last_row_goes_to_the_next_when_it_has_come() {
    let mut session = session(80, 24, |_| {});
    session.press("end up down");
    let last = session.app.traffic.selected.expect("a row");
    assert!(matches!(order(session.press("down")), Order::Rows(List::Exchanges, _)));
    session.source.take(200);
    let store = session.source.feed.store().clone();
    arrive(&mut session, Message::Grown(store));
    assert_eq!(session.app.traffic.selected, Some(last + 1));
}

#[test]
fn a_break_is_the_player_s() {
    let mut session = session(80, 24, |_| {});
    session.press("b");
    session.type_text("addr == 3");
    let breaks = Filter::parse("addr == 3").expect("a filter");
    assert_eq!(order(session.press("enter")), Order::Break(Some(breaks)));
    assert!(session.screen().contains("pauses when a row passes addr == 3"));
    session.source.take(2000);
    let store = session.source.feed.store().clone();
    arrive(&mut session, Message::Grown(store));
    assert_eq!(session.row().address(), Some(3), "the row that passed is selected");
    assert!(!session.app.is_frozen(), "what is paused is not frozen, too");
}

#[test]
fn notes_are_on_the_timeline_and_to_be_gone_to() {
    let mut session = session(101, 30, |replay| {
        let mut timeline = timeline();
        timeline.events.add(400 * SECOND, &Bucket { notes: 1, ..Bucket::default() });
        timeline.origin = replay.timeline.origin;
        replay.timeline = Arc::new(timeline);
    });
    assert!(session.screen().contains('✎') && session.screen().contains("1 note"));
    let find = |is_forward, before| Order::Find { what: Sought::Note, is_forward, before };
    assert_eq!(order(session.press("'")), find(true, None));
}

#[test]
fn who_moves_the_playhead_sees_the_row_at_it() {
    for key in [".", ",", "}", "{", ")", "("] {
        let mut session = session(80, 24, |_| {});
        session.press("home");
        assert!(!session.app.traffic.is_following);
        session.press(key);
        assert!(session.app.traffic.is_following, "{key}");
    }
}

#[test]
fn what_does_not_fit_into_health_is_scrolled_to() {
    let mut session = session(40, 12, |_| {});
    session.press("3");
    let first = session.screen();
    assert!(first.contains(" below") && !first.contains("adapter keeps"), "{first}");
    session.press("end");
    let last = session.screen();
    assert!(last.contains("adapter keeps") && !last.contains(" below"), "{last}");
    session.press("up");
    assert!(session.screen().contains("1 below"));
    session.press("home");
    assert_eq!(session.screen(), first);
}
