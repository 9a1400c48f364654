//! A window over the view: the keys, the columns, what was said.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use crate::tui::action::{ACTIONS, Action, Context, Entry};
use crate::tui::app::columns::Column;
use crate::tui::app::{App, Dialog};
use crate::tui::store::List;
use crate::tui::theme::glyph;
use crate::tui::widget::text::{put, shade, wrap};

pub(super) fn draw(app: &App, dialog: Dialog, body: Rect, buffer: &mut Buffer) {
    match dialog {
        Dialog::Help(from) => help(app, from, body, buffer),
        Dialog::Columns(selected) => columns(app, selected, body, buffer),
        Dialog::Messages(back) => messages(app, back, body, buffer),
    }
}

/// Clears a window in the middle of an area, with a title and a frame; returns what is inside.
fn window(app: &App, title: &str, width: u16, height: u16, body: Rect, buffer: &mut Buffer) -> Rect {
    let (width, height) = (width.min(body.width), height.min(body.height));
    let area =
        Rect { x: body.x + (body.width - width) / 2, y: body.y + (body.height - height) / 2, width, height }
            .intersection(*buffer.area());
    for position in area.positions() {
        buffer[position].reset();
    }
    let rule = app.theme.rule;
    let line = "─".repeat(usize::from(area.width.saturating_sub(2)));
    put(buffer, area, area.x, area.y, &format!("╭{line}╮"), rule);
    put(buffer, area, area.x, area.bottom().saturating_sub(1), &format!("╰{line}╯"), rule);
    for y in area.y + 1..area.bottom().saturating_sub(1) {
        put(buffer, area, area.x, y, "│", rule);
        put(buffer, area, area.right() - 1, y, "│", rule);
    }
    put(buffer, area, area.x + 2, area.y, &format!(" {title} "), app.theme.strong);
    Rect {
        x: area.x + 2,
        y: area.y + 1,
        width: area.width.saturating_sub(4),
        height: area.height.saturating_sub(2),
    }
}

/// Lists the keys that work here, from the keymap itself, then all others.
fn help(app: &App, from: usize, body: Rect, buffer: &mut Buffer) {
    let mut lines: Vec<(String, &str, bool)> = Vec::new();
    let here = |context: Context| app.works(context) && context != Context::Everywhere;
    let (special, rest): (Vec<&Entry>, Vec<&Entry>) = ACTIONS.iter().partition(|entry| here(entry.context));
    let general = rest.into_iter().filter(|entry| app.works(entry.context));
    let keys = |action: Action| {
        let keys: Vec<String> = app.keymap.keys(action).iter().map(|key| key.shown()).collect();
        keys.join(" ")
    };
    let title = format!("In {}", app.view.title().to_lowercase());
    if !special.is_empty() {
        lines.push((title, "", true));
    }
    lines.extend(special.into_iter().map(|entry| (keys(entry.action), entry.help, false)));
    lines.push(("Everywhere".to_owned(), "", true));
    lines.extend(general.map(|entry| (keys(entry.action), entry.help, false)));
    let height = u16::try_from(lines.len() + 2).unwrap_or(u16::MAX);
    let inner = window(app, "keys", 76, height, body, buffer);
    let from = from.min(lines.len().saturating_sub(usize::from(inner.height)));
    for (y, (keys, help, is_title)) in (inner.y..inner.bottom()).zip(lines.into_iter().skip(from)) {
        let style = if is_title { app.theme.accent } else { app.theme.strong };
        put(buffer, inner, inner.x, y, &keys, style);
        put(buffer, inner, inner.x + 14, y, help, app.theme.text);
    }
}

fn columns(app: &App, selected: usize, body: Rect, buffer: &mut Buffer) {
    let is_frames = app.traffic.list == List::Frames;
    let height = u16::try_from(Column::ALL.len() + 2).unwrap_or(u16::MAX);
    let inner = window(app, "columns", 34, height, body, buffer);
    for (y, (at, column)) in (inner.y..inner.bottom()).zip(Column::ALL.iter().enumerate()) {
        let is_shown = app.traffic.columns.is_shown(*column);
        let sorted = match app.traffic.sorted_by {
            Some((by, true)) if by == *column => " ▼ sorted",
            Some((by, false)) if by == *column => " ▲ sorted",
            _ => "",
        };
        let text = format!("{} {}{sorted}", if is_shown { "[x]" } else { "[ ]" }, column.title(is_frames));
        put(buffer, inner, inner.x, y, &text, app.theme.text);
        if at == selected {
            shade(buffer, inner, y, app.theme.selected);
        }
    }
}

fn messages(app: &App, back: usize, body: Rect, buffer: &mut Buffer) {
    let width = body.width.saturating_sub(4);
    let columns = usize::from(width.saturating_sub(6));
    let mut lines: Vec<(String, Style)> = Vec::new();
    let count = app.messages.len().saturating_sub(back);
    for (_, tone, text) in app.messages.iter().take(count) {
        for (at, line) in wrap(text, columns).into_iter().enumerate() {
            let mark = if at == 0 { glyph(*tone) } else { " " };
            lines.push((format!("{mark} {line}"), app.theme.tone(*tone)));
        }
    }
    let height = u16::try_from(lines.len().max(1) + 2).unwrap_or(u16::MAX);
    let inner = window(app, "messages", width, height, body, buffer);
    if lines.is_empty() {
        put(buffer, inner, inner.x, inner.y, "nothing was said so far", app.theme.dim);
    }
    let from = lines.len().saturating_sub(usize::from(inner.height));
    for (y, (line, style)) in (inner.y..inner.bottom()).zip(lines.into_iter().skip(from)) {
        put(buffer, inner, inner.x, y, &line, style);
    }
}
