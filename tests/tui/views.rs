//! What every view shows, on a small, a usual and a large screen.

use crate::session::Session;

const SIZES: [(u16, u16); 3] = [(40, 12), (80, 24), (140, 45)];

/// Holds what a view shows against its snapshot, at every size.
fn check(name: &str, prepare: impl Fn(&mut Session)) {
    for (columns, lines) in SIZES {
        let mut session = Session::new(columns, lines, 700);
        session.source.find();
        session.show();
        prepare(&mut session);
        insta::assert_snapshot!(format!("{name}_{columns}x{lines}"), session.screen());
    }
}

#[test]
fn traffic() {
    check("traffic", |_| {});
}

#[test]
fn frames() {
    check("frames", |session| drop(session.press("v")));
}

#[test]
fn detail_of_a_measurement() {
    check("detail", |session| {
        session.press("/");
        session.type_text("cmd == get-measurement && addr == 1 && outcome == answered");
        session.press("enter enter down down down down down down down down down down down down");
    });
}

#[test]
fn bytes_of_a_damaged_run() {
    check("damaged", |session| {
        session.press("v /");
        session.type_text("damaged");
        session.press("enter tab tab right");
    });
}

#[test]
fn devices() {
    check("devices", |session| drop(session.press("2")));
}

#[test]
fn a_device() {
    check("device", |session| drop(session.press("2 enter")));
}

#[test]
fn a_setting_of_a_device() {
    check("setting", |session| drop(session.press("2 down down enter end")));
}

#[test]
fn health() {
    check("health", |session| drop(session.press("3")));
}

#[test]
fn findings() {
    check("findings", |session| drop(session.press("4")));
}

#[test]
fn help() {
    check("help", |session| drop(session.press("?")));
}

#[test]
fn a_filter_that_is_typed() {
    check("typing", |session| {
        session.press("/");
        session.type_text("addr == 1 && outcome == lat");
    });
}

#[test]
fn nothing_yet() {
    for (columns, lines) in SIZES {
        for view in ["1", "2", "3", "4"] {
            let mut session = Session::new(columns, lines, 0);
            session.press(view);
            insta::assert_snapshot!(format!("nothing_{view}_{columns}x{lines}"), session.screen());
        }
    }
}

#[test]
fn every_size_down_to_nothing_can_be_drawn() {
    let mut session = Session::new(80, 24, 300);
    session.source.find();
    session.show();
    for columns in (0..100).step_by(7).chain([23, 24, 25, 300]) {
        for lines in (0..50).step_by(3).chain([4, 5, 100]) {
            session.app.update(rtutap::tui::app::Message::Resize(columns, lines));
            for keys in
                ["1", "v", "tab", "tab", "z", "2", "enter", "3", "4", "?", "esc", "c", "esc", "/", "esc"]
            {
                session.press(keys);
                session.buffer();
            }
        }
    }
}
