//! The last line: what was just said or the five most useful keys, and where one is in the rows.
//!
//! ```text
//!  / filter  ⏎ open  e next error  space freeze  ? help                  8,191 rows · following
//! ```

use ratatui::buffer::Buffer;

use crate::tui::action::Action;
use crate::tui::app::traffic::Pane;
use crate::tui::app::{App, Dialog, View};
use crate::tui::layout::Regions;
use crate::tui::store::Tone;
use crate::tui::theme::glyph;
use crate::tui::widget::text::{put, put_right, thousands, width};

pub(super) fn draw(app: &App, regions: &Regions, buffer: &mut Buffer) {
    let area = regions.footer;
    let place = place(app);
    let mut room = area;
    if app.said().is_none() || usize::from(area.width) > width(&place) + 40 {
        let x = put_right(buffer, area, area.y, &format!("{place} "), app.theme.dim);
        room.width = x.saturating_sub(area.x + 1);
    }
    if let Some((tone, text)) = app.said() {
        let style = app.theme.tone(tone);
        let mark = if tone == Tone::Good { "" } else { glyph(tone) };
        put(buffer, room, area.x + 1, area.y, &format!("{mark} {text}"), style);
        return;
    }
    let mut x = area.x + 1;
    for action in keys(app) {
        let Some(entry) = action.entry() else { continue };
        let key = app.shown_key(action);
        let short = match (action, app.is_frozen()) {
            (Action::Freeze, _) if app.replay().is_some() => {
                if app.replay().is_some_and(|replay| replay.is_playing) { "pause" } else { "play" }
            }
            (Action::Freeze, true) => "go on",
            _ => entry.short,
        };
        let wide = u16::try_from(width(&key) + width(short) + 1).unwrap_or(u16::MAX);
        if key.is_empty() || x.saturating_add(wide) > room.right() {
            continue;
        }
        x = put(buffer, room, x, area.y, &key, app.theme.strong);
        x = put(buffer, room, x + 1, area.y, short, app.theme.dim) + 2;
    }
}

/// Returns the five most useful keys where one is.
fn keys(app: &App) -> [Action; 5] {
    match (app.dialog, app.view) {
        (Some(Dialog::Columns(_)), _) => [Action::Open, Action::Sort, Action::Back, Action::Up, Action::Down],
        (Some(_), _) => [Action::Back, Action::Up, Action::Down, Action::PageDown, Action::Bottom],
        (None, View::Traffic) if app.traffic.pane != Pane::List => {
            [Action::Help, Action::FilterSelected, Action::NextPane, Action::Partner, Action::Back]
        }
        (None, View::Traffic) => {
            [Action::Help, Action::Filter, Action::Open, Action::Freeze, Action::NextError]
        }
        (None, View::Devices) if app.devices.page.is_some() => {
            [Action::Help, Action::Back, Action::FilterSelected, Action::Zoom, Action::Right]
        }
        (None, View::Devices) => {
            [Action::Help, Action::Open, Action::FilterSelected, Action::Sort, Action::Freeze]
        }
        (None, View::Health) => [Action::Help, Action::Zoom, Action::Freeze, Action::Right, Action::Quit],
        (None, View::Findings) => {
            [Action::Help, Action::Open, Action::FilterSelected, Action::CopyRow, Action::Freeze]
        }
    }
}

/// Says where one is in what is listed.
fn place(app: &App) -> String {
    let store = app.store();
    match app.view {
        View::Traffic => {
            let count = app.traffic.order.len(store);
            let rows = store.list(app.traffic.list);
            let at = app.traffic.place(store).map_or(0, |place| place + 1);
            let count_text = thousands(count as u64);
            let of = match &app.filter {
                Some(_) => format!("{count_text} of {}", thousands(rows.total() - rows.first_kept())),
                None => count_text,
            };
            let older = if rows.first_kept() > 0 { " kept" } else { "" };
            if app.traffic.is_following {
                return format!("{of} rows{older} · following");
            }
            let new = rows.total().saturating_sub(app.traffic.left_at);
            let new = if new > 0 && app.is_live && !app.is_frozen() && !app.traffic.order.is_sorted() {
                format!(" · {} new, {} follows", thousands(new), app.shown_key(Action::Follow))
            } else {
                String::new()
            };
            format!("{} of {of} rows{older}{new}", thousands(at as u64))
        }
        View::Devices => match store.devices().len() {
            1 => "1 address".to_owned(),
            count => format!("{count} addresses"),
        },
        View::Health => {
            let span = match app.span_s {
                60 => "last minute",
                600 => "last 10 minutes",
                3600 => "last hour",
                0 => "all of it",
                _ => "last day",
            };
            let below = super::health::rest(app, app.regions().body).saturating_sub(app.health_from);
            match below {
                0 => span.to_owned(),

                _ => format!("{span} · {below} below"),
            }
        }
        View::Findings => format!("{} in all", thousands(store.findings().total())),
    }
}
