//! Styles where they carry meaning, and glyphs that carry it without them.

use ratatui::buffer::Buffer;
use ratatui::style::{Color, Modifier};
use rtutap::tui::app::Options;
use rtutap::tui::theme::ThemeKind;

use crate::session::{Session, text};

/// Returns where a text stands on the screen.
fn find(buffer: &Buffer, wanted: &str) -> (u16, u16) {
    let screen = text(buffer);
    let (y, line) = screen
        .lines()
        .enumerate()
        .find(|(_, line)| line.contains(wanted))
        .unwrap_or_else(|| panic!("no '{wanted}' in\n{screen}"));
    let x = line[..line.find(wanted).expect("found")].chars().count();
    (u16::try_from(x).expect("narrow"), u16::try_from(y).expect("low"))
}

fn filtered(theme: ThemeKind, filter: &str) -> Session {
    let mut session = Session::with(Options { theme, ..Options::default() }, 120, 30, 900);
    session.press("/");
    session.type_text(filter);
    session.press("enter");
    session
}

#[test]
fn trouble_is_red_and_has_a_glyph() {
    let session = filtered(ThemeKind::Dark, "outcome == damaged");
    let buffer = session.buffer();
    let (x, y) = find(&buffer, "response damaged");
    assert_eq!(buffer[(x, y)].fg, Color::Red);
    assert_eq!((buffer[(0, y)].symbol(), buffer[(0, y)].fg), ("✗", Color::Red));
}

#[test]
fn what_is_well_has_no_colour_of_trouble() {
    let session = filtered(ThemeKind::Dark, "outcome == answered");
    let buffer = session.buffer();
    let trouble = [Color::Red, Color::Yellow];
    let list = session.app.regions().list.expect("rows");
    assert!(list.positions().all(|at| !trouble.contains(&buffer[at].fg)));
}

#[test]
fn a_filter_is_green_while_it_is_right_and_red_while_it_is_wrong() {
    let mut session = Session::new(100, 24, 100);
    session.press("/");
    session.type_text("addr == 1");
    let buffer = session.buffer();
    let (x, y) = find(&buffer, "addr == 1");
    assert_eq!(buffer[(x, y)].fg, Color::Green);
    session.type_text(" &&& 2");
    let buffer = session.buffer();
    let (x, y) = find(&buffer, "addr == 1");
    assert_eq!(buffer[(x, y)].fg, Color::Red);
    let (x, y) = find(&buffer, "&&& 2");
    assert!(buffer[(x + 2, y)].modifier.contains(Modifier::REVERSED), "the place is marked");
    let (x, y) = find(&buffer, "column 13:");
    assert_eq!((buffer[(x, y)].fg, y), (Color::Red, 2), "the error stands under the line");
}

#[test]
fn the_bytes_of_the_selected_field_are_lit() {
    for theme in [ThemeKind::Dark, ThemeKind::Light, ThemeKind::Plain] {
        let mut session = filtered(theme, "cmd == get-measurement && addr == 1 && outcome == answered");
        session.press("enter down down down");
        let node = session.app.traffic.node;
        let detail = session.app.traffic.detail(session.app.store());
        assert_eq!(detail.nodes[node].label, "start register");
        let buffer = session.buffer();
        let hex = session.app.regions().hex.expect("bytes");
        let style = |byte: u16| buffer[(hex.x + 6 + 3 * byte, hex.y + 1)].style();
        assert_eq!(style(2), style(3));
        assert_ne!(style(1), style(2));
        assert_ne!(style(3), style(4));
    }
}

#[test]
fn a_read_glows_and_fades() {
    let mut session = Session::new(120, 24, 700);
    session.press("2");
    let style = |session: &Session| {
        let buffer = session.buffer();
        let last = session.app.store().devices().iter().max_by_key(|device| device.read).expect("a device");
        let y = 2 + session
            .app
            .devices
            .list(session.app.store())
            .iter()
            .position(|it| it.address == last.address)
            .expect("listed") as u16;
        (buffer[(0, y)].symbol().to_owned(), buffer[(0, y)].fg, buffer[(0, y)].modifier)
    };
    // Until an answer has just come.
    let is_fresh = |session: &Session| {
        let store = session.app.store();
        let last = store.devices().iter().filter_map(|device| device.read).max();
        store.now().zip(last).is_some_and(|(now, last)| now - last < 100_000_000)
    };
    while !is_fresh(&session) {
        session.grow(1);
    }
    let fresh = style(&session);
    assert_eq!((fresh.0.as_str(), fresh.1), ("←", Color::Cyan));
    assert!(fresh.2.contains(Modifier::BOLD));
    let mut pass = |ms: i64| {
        let now = session.source.now + ms * 1_000_000;
        session.source.feed.pass(now);
        session.show();
        style(&session)
    };
    let fading = pass(1000);
    assert_eq!((fading.0.as_str(), fading.1), ("←", Color::Cyan));
    assert_eq!(pass(3000).0, " ");
}

#[test]
fn without_colour_nothing_is_coloured_and_everything_keeps_its_meaning() {
    let options = || Options { theme: ThemeKind::Plain, ..Options::default() };
    let mut session = Session::with(options(), 120, 30, 900);
    session.source.find();
    session.show();
    for keys in ["1", "v", "enter", "tab", "2", "enter", "3", "4", "?", "esc", "/"] {
        session.press(keys);
        let buffer = session.buffer();
        let is_plain = |at| {
            let cell: &ratatui::buffer::Cell = &buffer[at];
            cell.fg == Color::Reset && cell.bg == Color::Reset
        };
        assert!(buffer.area().positions().all(is_plain), "after {keys}");
    }
    let session = filtered(ThemeKind::Plain, "outcome == damaged");
    let buffer = session.buffer();
    let (x, y) = find(&buffer, "response damaged");
    assert_eq!(buffer[(0, y)].symbol(), "✗");
    let selected = session.app.traffic.place(session.app.store()).expect("selected");
    let top = session.app.traffic.top(session.app.store());
    let y_selected = 3 + u16::try_from(selected - top).expect("on the screen");
    assert!(buffer[(x, y_selected)].modifier.contains(Modifier::REVERSED));
}

#[test]
fn a_source_that_is_gone_is_the_first_thing_one_reads() {
    let mut session = Session::new(80, 24, 300);
    let now = session.source.now;
    session.source.feed.set_away("bus0", Some(now - 2_000_000_000));
    session.show();
    let buffer = session.buffer();
    let (x, y) = find(&buffer, "/dev/ttyUSB0 gone for 2.0 s");
    assert_eq!(y, 0);
    assert_eq!(buffer[(x, y)].fg, Color::Red);
    assert!(buffer[(x, y)].modifier.contains(Modifier::REVERSED));
    session.source.feed.set_away("bus0", None);
    session.show();
    assert!(!session.screen().contains("gone"));
}
