//! What every key does, without a terminal.

use rtutap::report::TimeStyle;
use rtutap::tui::action::{ACTIONS, Action};
use rtutap::tui::app::traffic::Pane;
use rtutap::tui::app::{Dialog, Effect, Message, View};
use rtutap::tui::store::{List, Row, Tone};

use crate::session::Session;

fn session() -> Session {
    Session::new(80, 24, 700)
}

fn place(session: &Session) -> usize {
    session.app.traffic.place(session.app.store()).expect("a row is selected")
}

fn count(session: &Session) -> usize {
    session.app.traffic.order.len(session.app.store())
}

fn row(session: &Session) -> &Row {
    session.app.traffic.row(session.app.store()).expect("a row is selected")
}

/// Applies a filter.
fn filter(session: &mut Session, text: &str) {
    session.press("/ ctrl-u");
    session.type_text(text);
    session.press("enter");
}

#[test]
fn rows_are_gone_through_and_the_newest_is_followed_until_one_goes_up() {
    let mut session = session();
    assert!(session.app.traffic.is_following);
    assert_eq!(place(&session), count(&session) - 1);
    session.press("up k");
    assert_eq!(place(&session), count(&session) - 3);
    assert!(!session.app.traffic.is_following);
    let selected = session.selected();
    session.grow(100);
    assert_eq!(session.selected(), selected, "the selected row stays while rows come");
    assert!(session.screen().contains("new, F follows"), "{}", session.screen());
    session.press("down j");
    assert_eq!(session.selected(), selected + 2);
    session.press("F");
    session.grow(100);
    assert_eq!(place(&session), count(&session) - 1);
    session.press("home");
    assert_eq!(place(&session), 0);
    session.press("pagedown");
    assert!((5..30).contains(&place(&session)));
    session.press("pageup g");
    assert_eq!(place(&session), 0);
    session.press("G");
    assert!(session.app.traffic.is_following);
}

#[test]
fn the_selected_row_is_always_on_the_screen() {
    let mut session = session();
    for keys in ["up", "home", "pagedown", "pagedown", "down", "end", "pageup", "e", "E", "home", "e"] {
        session.press(keys);
        let top = session.app.traffic.top(session.app.store());
        let height = session.app.regions().rows();
        assert!((top..top + height).contains(&place(&session)), "after {keys}");
    }
}

#[test]
fn views_have_numbers_and_neighbours() {
    let mut session = session();
    for (key, view) in ["1", "2", "3", "4"].into_iter().zip(View::ALL) {
        session.press(key);
        assert_eq!(session.app.view, view);
    }
    session.press("]");
    assert_eq!(session.app.view, View::Traffic);
    session.press("[ [");
    assert_eq!(session.app.view, View::Health);
}

#[test]
fn panes_take_turns_and_may_have_the_whole_screen() {
    let mut session = session();
    for pane in [Pane::Tree, Pane::Hex, Pane::List] {
        session.press("tab");
        assert_eq!(session.app.traffic.pane, pane);
    }
    session.press("shift-tab");
    assert_eq!(session.app.traffic.pane, Pane::Hex);
    session.press("z");
    assert!(session.app.regions().list.is_none(), "only the bytes are left");
    session.press("esc");
    assert!(session.app.regions().list.is_some() && session.app.traffic.pane == Pane::List);
    let before = session.app.regions().rows();
    session.press("+");
    assert!(session.app.regions().rows() > before);
    session.press("- -");
    assert!(session.app.regions().rows() < before);
}

#[test]
fn on_a_small_screen_a_row_opens_over_the_list() {
    let mut session = Session::new(40, 12, 300);
    assert!(session.app.regions().tree.is_none());
    session.press("enter");
    assert!(session.app.regions().tree.is_some() && session.app.regions().list.is_none());
    session.press("esc");
    assert!(session.app.regions().list.is_some());
}

#[test]
fn fields_light_their_bytes_and_bytes_their_field() {
    let mut session = session();
    filter(&mut session, "cmd == get-measurement && outcome == answered && addr == 1");
    session.press("enter");
    let detail = session.app.traffic.detail(session.app.store());
    let temperature = detail.nodes.iter().position(|node| node.label == "temperature").expect("a field");
    for _ in 0..temperature {
        session.press("down");
    }
    assert_eq!(session.app.traffic.node, temperature);
    // Request and response stand one after the other: 8 bytes, then the response's.
    assert_eq!(session.app.traffic.byte, 8 + 3);
    session.press("tab right right right right");
    let lit = &detail.nodes[session.app.traffic.node];
    assert_eq!((lit.label.as_str(), lit.span.clone()), ("do_saturation", 7..11));
}

#[test]
fn request_and_response_jump_to_each_other() {
    let mut session = session();
    filter(&mut session, "outcome == answered");
    session.press("v");
    let Row::Run(run) = row(&session) else { panic!("frames are listed") };
    let (id, role) = (run.id, run.role);
    session.press("p");
    let Row::Run(partner) = row(&session) else { panic!("frames are listed") };
    assert_ne!(partner.role, role);
    session.press("p");
    assert!(matches!(row(&session), Row::Run(run) if run.id == id));
    session.press("v enter down p");
    let detail = session.app.traffic.detail(session.app.store());
    assert!(detail.nodes[session.app.traffic.node].label.starts_with("response"));
}

#[test]
fn frames_and_transactions_stay_at_the_same_place() {
    let mut session = session();
    filter(&mut session, "outcome == answered");
    session.press("up up up");
    let Row::Exchange(exchange) = row(&session) else { panic!("transactions are listed") };
    let (id, request) = (exchange.id, exchange.ids[0]);
    session.press("v");
    assert_eq!(session.app.traffic.list, List::Frames);
    assert!(matches!(row(&session), Row::Run(run) if Some(run.id) == request));
    session.press("v");
    assert!(matches!(row(&session), Row::Exchange(exchange) if exchange.id == id));
}

#[test]
fn a_filter_is_typed_judged_completed_and_taken_away() {
    let mut session = session();
    let all = count(&session);
    session.press("/");
    session.type_text("outcome = late");
    assert!(session.screen().contains("write '==' to compare"), "{}", session.screen());
    session.press("enter");
    assert!(session.app.prompt.is_some(), "a filter that is wrong is not applied");
    session.press("ctrl-u");
    session.type_text("addr == 1 && outc");
    session.press("tab");
    assert_eq!(session.app.prompt.as_ref().expect("still typed").text(), "addr == 1 && outcome");
    session.type_text(" != answ");
    session.press("tab enter");
    assert_eq!(
        session.app.filter.as_ref().expect("applied").to_string(),
        "addr == 1 and outcome != answered"
    );
    assert!((1..all).contains(&count(&session)));
    for place in 0..count(&session) {
        let number = session.app.traffic.order.number(session.app.store(), place).expect("listed");
        let row = session.app.store().list(List::Exchanges).get(number).expect("kept");
        assert!(matches!(row, Row::Exchange(row) if row.address == 1 && row.outcome.name() != "answered"));
    }
    let before = count(&session);
    session.grow(2000);
    assert!(count(&session) > before, "what comes is filtered, too");
    session.press("/ esc");
    assert!(session.app.filter.is_some(), "what was given up changes nothing");
    session.press("x");
    assert!(count(&session) > all);
    session.press("/ up");
    assert_eq!(session.app.prompt.as_ref().expect("typed").text(), "addr == 1 && outcome != answered");
}

#[test]
fn frames_pass_a_filter_as_their_transaction_does() {
    let mut session = session();
    session.press("v");
    filter(&mut session, "cmd == get-measurement && addr == 2");
    assert!(count(&session) > 2);
    for place in 0..count(&session) {
        let number = session.app.traffic.order.number(session.app.store(), place).expect("listed");
        assert_eq!(session.app.store().list(List::Frames).get(number).expect("kept").address(), Some(2));
    }
}

#[test]
fn what_is_selected_becomes_a_filter() {
    let mut session = session();
    filter(&mut session, "cmd == get-measurement && addr == 2 && outcome == answered");
    session.press("x f");
    let made = session.app.filter.as_ref().expect("made").to_string();
    assert!(made.starts_with("addr == "), "{made}");
    session.press("x");
    filter(&mut session, "cmd == get-measurement && addr == 2 && outcome == answered");
    session.press("enter");
    let detail = session.app.traffic.detail(session.app.store());
    let at = detail.nodes.iter().position(|node| node.label == "temperature").expect("a field");
    (0..at).for_each(|_| drop(session.press("down")));
    session.press("f");
    let made = session.app.filter.as_ref().expect("made").to_string();
    assert!(made.ends_with(" and temperature == 13.15"), "{made}");
    assert!(count(&session) > 0, "the row itself passes");
    session.press("2 f");
    assert_eq!(session.app.filter.as_ref().expect("made").to_string(), "addr == 1");
    assert_eq!(session.app.view, View::Traffic);
}

#[test]
fn words_and_bytes_are_searched_forward_and_back() {
    let mut session = session();
    session.press("home s");
    session.type_text("Error-Flag");
    session.press("enter");
    let first = place(&session);
    assert!(matches!(row(&session), Row::Exchange(row) if &*row.title == "get-error-flag"));
    session.press("n");
    let second = place(&session);
    assert!(second > first);
    session.press("N");
    assert_eq!(place(&session), first);
    session.press("s ctrl-u");
    session.type_text("26 00 00");
    session.press("enter");
    assert!(matches!(row(&session), Row::Exchange(row) if row.register == Some(0x2600)));
    session.press("s ctrl-u");
    session.type_text("nothing has this");
    session.press("enter");
    assert!(session.app.said().is_some_and(|(_, text)| text.contains("there is no other")));
}

#[test]
fn trouble_findings_and_marks_are_gone_to() {
    let mut session = session();
    session.source.find();
    session.show();
    session.press("home e");
    assert!(row(&session).tone() >= Tone::Warn);
    let first = place(&session);
    session.press("e E");
    assert_eq!(place(&session), first);
    session.press("home d");
    let found = session.app.store().findings().of_row(row(&session)).count();
    assert_eq!(found, 1);
    session.press("m d m home '");
    assert_eq!(session.app.store().findings().of_row(row(&session)).count(), 1);
    let marked = session.selected();
    assert!(session.app.traffic.is_marked(marked) && session.screen().contains('◆'));
    session.press("\" m");
    assert_ne!(session.selected(), marked);
    assert!(!session.app.traffic.is_marked(session.selected()));
    session.press("D");
}

#[test]
fn a_time_is_gone_to() {
    let mut session = session();
    let begun = session.app.store().begun().expect("times");
    session.press(":");
    session.type_text("3.5");
    session.press("enter");
    let time = row(&session).time().expect("times");
    assert!(time - begun >= 3_500_000_000, "{}", time - begun);
    session.press("up");
    assert!(row(&session).time().expect("times") - begun < 4_000_000_000);
    session.press(":");
    session.type_text("25:00");
    assert!(session.app.prompt.as_ref().is_some_and(|prompt| prompt.error.is_some()));
}

#[test]
fn the_screen_freezes_while_traffic_goes_on() {
    let mut session = session();
    let before = session.screen();
    let rows = session.app.store().list(List::Exchanges).total();
    session.press("space");
    session.grow(300);
    assert_eq!(session.app.store().list(List::Exchanges).total(), rows);
    assert!(session.app.newest().list(List::Exchanges).total() > rows);
    let frozen = session.screen();
    assert!(frozen.contains("FROZEN +"), "{frozen}");
    assert_eq!(frozen.lines().nth(5), before.lines().nth(5));
    session.press("space");
    assert!(session.app.store().list(List::Exchanges).total() > rows && session.app.traffic.is_following);
}

#[test]
fn a_row_that_is_waited_for_freezes_the_screen() {
    let mut session = session();
    session.press("b");
    session.type_text("outcome == damaged && addr == 1");
    session.press("enter 2");
    assert!(session.screen().contains("waits to freeze"));
    for _ in 0..2000 {
        if session.app.is_frozen() {
            break;
        }
        session.grow(10);
    }
    assert!(session.app.is_frozen() && session.app.view == View::Traffic);
    assert!(
        matches!(row(&session), Row::Exchange(row) if row.address == 1 && row.outcome.name() == "damaged")
    );
    let stopped = session.selected();
    session.grow(10);
    assert_eq!(session.selected(), stopped);
    session.press("space");
    assert!(!session.app.is_frozen());
    session.press("b ctrl-u enter");
    assert!(session.app.breaks_on.is_none());
}

#[test]
fn notes_go_to_the_recording_with_the_time_of_the_row() {
    let mut session = session();
    session.press("up up a");
    session.type_text("cable moved");
    let time = row(&session).time();
    assert_eq!(session.press("enter"), Some(Effect::Note(time, "cable moved".to_owned())));
    session.press("a");
    assert_eq!(session.press("enter"), None, "nothing noted is no note");
}

#[test]
fn columns_are_hidden_and_sorted_by() {
    let mut session = session();
    assert!(session.screen().contains("DEVICE"));
    session.press("c down down down down space esc");
    assert!(!session.screen().contains("DEVICE"), "{}", session.screen());
    session.press("c down down down down enter esc");
    assert!(session.screen().contains("DEVICE"));
    session.press("o");
    let latency = |session: &Session, place: usize| {
        let number = session.app.traffic.order.number(session.app.store(), place).expect("listed");
        session
            .app
            .store()
            .list(List::Exchanges)
            .get(number)
            .and_then(|row| row.span())
            .map(|span| span.midpoint())
    };
    let rising: Vec<_> = (0..count(&session)).map(|place| latency(&session, place)).collect();
    assert!(rising.is_sorted() && rising.last() > rising.first());
    session.press("o");
    let falling: Vec<_> = (0..count(&session)).map(|place| latency(&session, place)).collect();
    assert!(falling.iter().rev().is_sorted());
    session.press("F");
    assert!(session.app.traffic.is_following && !session.app.traffic.order.is_sorted());
}

#[test]
fn rows_are_copied_as_text_bytes_and_json() {
    let mut session = session();
    filter(&mut session, "cmd == get-measurement && addr == 1 && outcome == answered");
    let copied = |session: &mut Session, key: &str| match session.press(key) {
        Some(Effect::Copy(text)) => text,
        other => panic!("{other:?}"),
    };
    let text = copied(&mut session, "y");
    assert!(text.contains("get-measurement") && text.contains("temperature 13."), "{text}");
    let hex = copied(&mut session, "Y");
    assert!(hex.starts_with("01 03 26 00 00 04 ") && hex.lines().count() == 2, "{hex}");
    let json = copied(&mut session, "J");
    assert!(session.source.json.contains(&json), "{json}");
    session.press("v");
    let json = copied(&mut session, "J");
    assert!(session.source.json.contains(&json), "{json}");
    session.press("2");
    assert!(copied(&mut session, "y").contains("yosemitech-do"));
}

#[test]
fn what_is_done_outside_is_asked_for() {
    let mut session = session();
    assert_eq!(session.press("r"), Some(Effect::Record(true)));
    session.app.update(Message::Recording(Some(Default::default())));
    assert_eq!(session.press("r"), Some(Effect::Record(false)));
    filter(&mut session, "addr == 1");
    session.press("home m");
    let notes = vec![(session.row().time().expect("a time"), "mark".to_owned())];
    session.press("w");
    session.type_text("part.mcap");
    let effect = session.press("enter");
    let (filter, path) = (Some("addr == 1".to_owned()), "part.mcap".to_owned());
    assert_eq!(effect, Some(Effect::Export { filter, path, notes }));
    assert_eq!(session.press("M"), Some(Effect::Mouse(false)));
    assert_eq!(session.press("ctrl-l"), Some(Effect::Redraw));
    assert_eq!(session.press("ctrl-z"), Some(Effect::Suspend));
    assert_eq!(session.press("q"), Some(Effect::Quit));
    assert_eq!(session.press("ctrl-c"), Some(Effect::Quit));
}

#[test]
fn times_are_shown_in_three_ways() {
    let mut session = session();
    for style in [TimeStyle::Relative, TimeStyle::Local, TimeStyle::Utc] {
        session.press("t");
        assert_eq!(session.app.time, style);
    }
}

#[test]
fn windows_open_scroll_and_close() {
    let mut session = session();
    session.press("?");
    let help = session.screen();
    session.press("pagedown");
    assert_ne!(session.screen(), help);
    session.press("esc");
    assert_eq!(session.app.dialog, None);
    session.app.update(Message::Said(Tone::Warn, "the disk is nearly full".to_owned()));
    assert!(session.screen().contains("the disk is nearly full"));
    session.press("L");
    assert_eq!(session.app.dialog, Some(Dialog::Messages(0)));
    session.press("q");
    assert_eq!(session.app.dialog, None, "the key to quit closes a window first");
}

#[test]
fn a_device_is_opened_and_left() {
    let mut session = session();
    session.press("2 down enter");
    assert_eq!(session.app.devices.page, Some(0));
    assert!(session.screen().contains("address 2"));
    session.press("right");
    assert!(session.screen().contains("address 3"));
    session.press("left left");
    assert!(session.screen().contains("address 1"));
    session.press("down down esc");
    assert_eq!(session.app.devices.page, None);
    session.press("o");
    let errors: Vec<u64> =
        session.app.devices.list(session.app.store()).iter().map(|device| device.errors()).collect();
    assert!(errors.iter().rev().is_sorted());
}

#[test]
fn a_finding_opens_at_its_frames() {
    let mut session = session();
    session.source.find();
    session.show();
    session.press("4 down enter");
    assert_eq!(session.app.view, View::Traffic);
    assert!(matches!(row(&session), Row::Run(run) if run.id == 40));
    session.press("4 up enter");
    assert!(matches!(row(&session), Row::Run(run) if run.id == 30), "the latest of several");
}

#[test]
fn series_have_other_spans() {
    let mut session = session();
    session.press("3 z");
    assert!(session.screen().contains("last 10 minutes"));
    session.press("left right");
}

#[test]
fn the_mouse_selects_scrolls_and_moves_splitters() {
    use crossterm::event::{KeyModifiers, MouseButton, MouseEvent, MouseEventKind};
    let mut session = session();
    let mouse = |session: &mut Session, kind, column, row| {
        session.app.update(Message::Mouse(MouseEvent { kind, column, row, modifiers: KeyModifiers::NONE }));
    };
    let down = MouseEventKind::Down(MouseButton::Left);
    let top = session.app.traffic.top(session.app.store());
    mouse(&mut session, down, 10, 4);
    assert_eq!(place(&session), top + 2, "the third line of the screen's rows");
    mouse(&mut session, MouseEventKind::ScrollUp, 10, 5);
    assert_eq!(place(&session), top.saturating_sub(1));
    let regions = session.app.regions();
    let rule = regions.rule.expect("a line between").y;
    mouse(&mut session, down, 10, rule);
    mouse(&mut session, MouseEventKind::Drag(MouseButton::Left), 10, rule - 4);
    mouse(&mut session, MouseEventKind::Up(MouseButton::Left), 10, rule - 4);
    let moved = session.app.regions().rule.expect("a line between").y;
    assert!((rule - 5..=rule - 3).contains(&moved), "{moved} after {rule}");
    let hex = session.app.regions().hex.expect("bytes");
    mouse(&mut session, down, hex.x + 6 + 3 * 2, hex.y + 1);
    assert_eq!((session.app.traffic.pane, session.app.traffic.byte), (Pane::Hex, 2));
    let (_, tab) = session.app.regions().tabs[2];
    mouse(&mut session, down, tab.x, 0);
    assert_eq!(session.app.view, View::Health);
    session.press("M 1");
    let before = place(&session);
    mouse(&mut session, down, 10, 3);
    assert_eq!(place(&session), before, "without the mouse a click does nothing");
}

#[test]
fn old_rows_leave_memory_and_the_screen_says_so() {
    let mut session = Session::new(80, 24, 0);
    session.source.flood(130_000);
    session.show();
    let rows = session.app.store().list(List::Frames);
    assert!(rows.first_kept() > 0 && rows.total() == 130_000);
    assert!((90_000..=100_256).contains(&(rows.total() - rows.first_kept())));
    session.press("v home");
    assert!(session.screen().contains("kept"), "{}", session.screen());
    assert!(session.app.said().is_some_and(|(_, text)| text.contains("left memory")));
}

/// Every action is in the tests above by one of its keys: this fails when a new one is not.
#[test]
fn every_action_has_its_test() {
    let source = concat!(include_str!("keys.rs"), include_str!("replay.rs"));
    let words: Vec<&str> = source.split(['"', ' ', '(', ')']).collect();
    for entry in ACTIONS {
        let is_pressed = entry.keys.iter().any(|key| {
            words.contains(key)
                || [format!("\"\\{key}"), format!("\"{key}\"")].iter().any(|key| source.contains(key))
        });
        assert!(is_pressed, "no test presses a key of '{}'", entry.name);
    }
    assert_eq!(Action::named("quit"), Some(Action::Quit));
}

#[test]
fn a_field_that_no_profile_has_is_told_with_the_nearest() {
    let mut session = session();
    filter(&mut session, "temperatur > 20");
    let said = session.app.said().map(|(_, text)| text.to_owned()).unwrap_or_default();
    assert!(said.contains("no profile has a field 'temperatur'; did you mean 'temperature'?"), "{said}");
}
