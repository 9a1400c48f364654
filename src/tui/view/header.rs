//! The first line: tabs, and how the capture goes.
//!
//! ```text
//!  1 Traffic  2 Devices  3 Health  4 Findings 3      FROZEN +120  ● REC 0:12:31  bus0 9600-8N1  62 %
//! ```

use ratatui::buffer::Buffer;
use ratatui::style::Style;

use crate::analyze::verify::Severity;
use crate::time::SECOND;
use crate::tui::app::{App, View};
use crate::tui::layout::Regions;
use crate::tui::store::List;
use crate::tui::widget::text::{age, put, put_right, thousands, width};

pub(super) fn draw(app: &App, regions: &Regions, buffer: &mut Buffer) {
    let area = regions.header;
    let theme = &app.theme;
    let mut end = area.x;
    for (at, (view, tab)) in regions.tabs.iter().enumerate() {
        let is_current = *view == app.view;
        let style = if is_current { theme.selected } else { theme.dim };
        let title = match tab.width {
            1 => format!("{}", at + 1),
            _ => format!("{} {}", at + 1, view.title()),
        };
        end = put(buffer, area, tab.x, area.y, &title, style);
    }
    let found = app.newest().findings().list();
    if let Some(worst) = found.iter().map(|found| found.finding.severity).max() {
        let style = match worst {
            Severity::Error => theme.bad,
            Severity::Warning => theme.warn,
            Severity::Note => theme.dim,
        };
        end = put(buffer, area, end + 1, area.y, &found.len().to_string(), style);
    }
    let mut room = usize::from(area.right().saturating_sub(end + 2));
    let mut rest = area;
    // What matters most is at the right edge, and stays when there is little room.
    for (text, style) in state(app) {
        if width(&text) + 2 > room {
            continue;
        }
        put_right(buffer, rest, area.y, &text, style);
        let taken = width(&text) + 2;
        room -= taken;
        rest.width = rest.width.saturating_sub(u16::try_from(taken).unwrap_or(rest.width));
    }
}

/// Says how the capture goes, what matters most first.
fn state(app: &App) -> Vec<(String, Style)> {
    let theme = &app.theme;
    let store = app.newest();
    let mut state = Vec::new();
    if store.known_from().is_some() {
        state.push(("PROVISIONAL".to_owned(), theme.warn));
    }
    for bus in store.buses() {
        if let Some(since) = bus.away_since {
            let for_ns = store.now().or(app.now()).map_or(0, |now| now - since);
            let name = bus.source.as_deref().unwrap_or(&bus.name);
            state.push((format!("✗ {name} gone for {}", age(for_ns)), theme.alarm));
        }
    }
    if app.is_frozen() {
        let list = if app.view == View::Traffic { app.traffic.list } else { List::Exchanges };
        let new = store.list(list).total() - app.store().list(list).total().min(store.list(list).total());
        state.push((format!("FROZEN +{}", thousands(new)), theme.strong));
    } else if app.breaks_on.is_some() {
        let waits = if app.replay().is_some() { "waits to pause" } else { "waits to freeze" };
        state.push((waits.to_owned(), theme.accent));
    }
    match &app.recording {
        Some(recording) if recording.trouble.is_some() => state.push(("✗ REC".to_owned(), theme.alarm)),
        Some(recording) => {
            let elapsed = app.now().zip(recording.since).map_or(0, |(now, since)| (now - since) / SECOND);
            let (hours, minutes, seconds) = (elapsed / 3600, elapsed / 60 % 60, elapsed % 60);
            state.push((format!("● REC {hours}:{minutes:02}:{seconds:02}"), theme.accent));
        }
        None if app.is_live && app.must_record => state.push(("not recorded".to_owned(), theme.warn)),
        None => {}
    }
    if let Some(load) = super::health::load(app) {
        state.push((format!("{load:3.0} %"), theme.text));
    }
    let bus = match store.buses() {
        [bus] => format!("{} {}", bus.name, bus.line),
        buses => format!("{} buses", buses.len()),
    };
    state.push((bus, theme.dim));
    state.push((app.source.clone(), theme.dim));
    state
}
