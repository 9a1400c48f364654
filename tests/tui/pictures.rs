//! The pictures of the README, drawn from the screen's cells. `UPDATE_GOLDEN=1 cargo test --test tui` draws them anew.

use std::fmt::Write;
use std::path::Path;

use ratatui::buffer::{Buffer, Cell};
use ratatui::style::{Color, Modifier};

use crate::session::Session;

/// Width and height of a cell, in pixels, and how far below its top the text stands.
const CELL: (f64, f64, f64) = (8.4, 18.0, 13.5);

/// Returns a colour as a dark terminal shows it.
fn colour(colour: Color, usual: &str) -> String {
    match colour {
        Color::Cyan => "#56b6c2".to_owned(),
        Color::Red => "#e06c75".to_owned(),
        Color::Yellow => "#e5c07b".to_owned(),
        Color::Green => "#98c379".to_owned(),
        Color::Indexed(24) => "#005f87".to_owned(),
        Color::Indexed(grey @ 232..) => {
            let level = 8 + 10 * (u32::from(grey) - 232);
            format!("#{level:02x}{level:02x}{level:02x}")
        }
        _ => usual.to_owned(),
    }
}

/// Writes text, so that no XML reader takes it for anything else.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Draws a buffer.
fn svg(buffer: &Buffer) -> String {
    let area = buffer.area();
    let (width, height) = (f64::from(area.width) * CELL.0, f64::from(area.height) * CELL.1);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
         font-family=\"ui-monospace,Menlo,Consolas,'DejaVu Sans Mono',monospace\" font-size=\"14\">\n\
         <rect width=\"100%\" height=\"100%\" rx=\"6\" fill=\"#1c1f24\"/>\n"
    );
    for y in 0..area.height {
        let style = |x: u16| {
            let cell: &Cell = &buffer[(x, y)];
            (cell.fg, cell.bg, cell.modifier)
        };
        let mut x = 0;
        while x < area.width {
            let from = x;
            let mut text = String::new();
            while x < area.width && style(x) == style(from) {
                text.push_str(buffer[(x, y)].symbol());
                x += 1;
            }
            let (left, top) = (f64::from(from) * CELL.0, f64::from(y) * CELL.1);
            let wide = f64::from(x - from) * CELL.0;
            let (fg, bg, modifier) = style(from);
            let (mut ink, mut paper) = (colour(fg, "#d7dae0"), colour(bg, "none"));
            if modifier.contains(Modifier::REVERSED) {
                (ink, paper) = ("#1c1f24".to_owned(), ink);
            }
            if paper != "none" {
                let high = CELL.1;
                writeln!(svg, "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{wide:.1}\" height=\"{high}\" fill=\"{paper}\"/>").expect("a string");
            }
            if !text.trim().is_empty() {
                let bold = if modifier.contains(Modifier::BOLD) { " font-weight=\"bold\"" } else { "" };
                let base = top + CELL.2;
                let text = escaped(text.trim_end());
                writeln!(svg, "<text x=\"{left:.1}\" y=\"{base:.1}\" fill=\"{ink}\"{bold} xml:space=\"preserve\">{text}</text>").expect("a string");
            }
        }
    }
    svg + "</svg>\n"
}

#[test]
fn the_pictures_of_the_readme_show_the_screen_as_it_is() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let mut session = Session::new(100, 28, 700);
    session.source.find();
    session.show();
    let mut changed = Vec::new();
    for (name, keys) in [
        ("traffic", "up up up up tab down down down"),
        ("devices", "2"),
        ("device", "enter"),
        ("health", "3"),
    ] {
        session.press(keys);
        let (path, drawn) = (folder.join(name).with_extension("svg"), svg(&session.buffer()));
        #[expect(clippy::disallowed_methods, reason = "pictures are files")]
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            std::fs::create_dir_all(&folder).expect("a folder");
            std::fs::write(&path, &drawn).expect("a file");
        } else if std::fs::read_to_string(&path).ok() != Some(drawn) {
            changed.push(name);
        }
    }
    assert!(changed.is_empty(), "draw anew with UPDATE_GOLDEN=1: {changed:?}");
}
