//! The traffic: rows above, and below them the fields and bytes of the selected one.
//!
//! ```text
//!   TIME         ADDR DEVICE    COMMAND               LATENCY VALUES
//! · 12:00:07.512    1 do        get-measurement       18.4 ms temperature 17.625 °C · …
//! ✗ 12:00:08.031    9 -         FC03 0x0010 ×2                no response
//! ─────────────────────────────────────────────────────────────────────────
//! request #12  8 bytes              │ 0000  01 03 26 00 00 04 4f 41
//!   0    address   1                │
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::{detail, hex, short_span};
use crate::report::words;
use crate::tui::app::App;
use crate::tui::app::columns::Column;
use crate::tui::app::traffic::Pane;
use crate::tui::layout::Regions;
use crate::tui::store::{Exchange, Field, List, RemarkKind, Row, Run, Tone};
use crate::tui::theme::glyph;
use crate::tui::timeline::Sought;
use crate::tui::widget::columns::{Placed, Spec, fit};
use crate::tui::widget::text::{put, put_right, shade, thousands, width};

/// From how many columns on values have their names.
const WORDS_FROM: u16 = 50;
/// The columns for mark and tone, before all others.
const MARKS: u16 = 2;

pub(super) fn draw(app: &App, regions: &Regions, buffer: &mut Buffer) {
    if let Some(area) = regions.list {
        list(app, area, buffer);
    }
    if let Some(area) = regions.rule {
        rule(app, area, regions.bar, buffer);
    }
    let detail = app.traffic.detail(app.store());
    if let Some(area) = regions.tree {
        detail::draw(app, &detail, area, buffer);
    }
    if let Some(area) = regions.bar {
        for y in area.y..area.bottom() {
            put(buffer, area, area.x, y, "│", app.theme.rule);
        }
    }
    if let Some(area) = regions.hex {
        hex::draw(app, &detail, area, buffer);
    }
}

fn rule(app: &App, area: Rect, bar: Option<Rect>, buffer: &mut Buffer) {
    put(buffer, area, area.x, area.y, &"─".repeat(usize::from(area.width)), app.theme.rule);
    if let Some(bar) = bar {
        put(buffer, area, bar.x, area.y, "┬", app.theme.rule);
    }
}

fn list(app: &App, area: Rect, buffer: &mut Buffer) {
    let (store, traffic) = (app.store(), &app.traffic);
    let is_frames = traffic.list == List::Frames;
    let columns = columns(app, area.width);
    let inner = Rect { x: area.x + MARKS, width: area.width.saturating_sub(MARKS), ..area };
    for column in &columns {
        let kind = Column::ALL[column.at]; // placed from `ALL`
        let mut title = kind.title(is_frames).to_owned();
        if let Some((sorted, is_descending)) = traffic.sorted_by
            && sorted == kind
        {
            title += if is_descending { "▼" } else { "▲" };
        }
        cell(buffer, inner, area.y, column, &title, app.theme.dim, is_number(kind));
    }
    let count = traffic.order.len(store);
    if count == 0 {
        let hits = app.replay().and_then(|replay| replay.timeline.hits.as_ref().zip(Some(&replay.timeline)));
        let passing = hits.map(|((hits, until), timeline)| {
            (hits.total(Sought::Match), timeline.is_complete && *until >= timeline.decoded_ns)
        });
        let lines: &[&str] = match (&app.filter, app.is_live) {
            (Some(_), false) if passing == Some((0, true)) => &["no row of the recording passes the filter"],
            (Some(filter), false) if filter.asks_for_findings() && store.known_from().is_some() => {
                &["not known here yet: findings need all before"]
            }
            (Some(_), false) => &["no row here passes the filter"],
            (Some(_), true) => &["no row passes the filter yet"],
            (None, true) => &["nothing was received yet", "", "rtutap only listens: a master has to ask"],
            (None, false) if app.replay().is_some_and(|replay| replay.timeline.is_broken) => {
                &["nothing of it can be read"]
            }
            (None, false) => &["nothing is decoded yet"],
        };
        return super::empty(app, area, lines, buffer);
    }
    let top = traffic.top(store);
    let rows = store.list(traffic.list);
    for (index, y) in (area.y + 1..area.bottom()).enumerate() {
        let Some(number) = traffic.order.number(store, top + index) else { break };
        let Some(row) = rows.get(number) else { continue };
        line(app, area, inner, y, number, row, &columns, buffer);
        if store.known_from().is_some() {
            shade(buffer, area, y, app.theme.provisional);
        }
        if Some(number) == traffic.selected {
            let has_focus = traffic.pane == Pane::List;
            let style = if has_focus { app.theme.selected } else { app.theme.selected_elsewhere };
            shade(buffer, area, y, style);
        }
    }
}

fn is_number(column: Column) -> bool {
    matches!(column, Column::Address | Column::Latency | Column::Number)
}

/// Puts a text into a column; numbers stand at its right edge.
fn cell(buffer: &mut Buffer, area: Rect, y: u16, column: &Placed, text: &str, style: Style, is_right: bool) {
    let at = Rect { x: area.x + column.x, y, width: column.width, height: 1 };
    if is_right && width(text) <= usize::from(column.width) {
        put_right(buffer, at, y, text, style);
    } else {
        put(buffer, at, at.x, y, text, style);
    }
}

/// Chooses the columns; their widths depend on the terminal only.
fn columns(app: &App, width: u16) -> Vec<Placed> {
    let is_frames = app.traffic.list == List::Frames;
    let is_wide = width >= 100;
    let has_buses = app.store().buses().len() > 1;
    let spec = |column: &Column| {
        let (width, extra, leaves) = match column {
            Column::Number => (8, 0, 10),
            Column::Time if width < 60 => (8, 0, 2),
            Column::Time => (12, 0, 2),
            Column::Bus if has_buses => (8, 0, 6),
            Column::Bus => (0, 0, 0),
            Column::Address => (4, 0, 1),
            Column::Device => (if is_frames { 10 } else { 13 }, 0, 7),
            Column::Command => (if is_frames { 9 } else { 16 }, if is_wide { 7 } else { 0 }, 4),
            Column::Latency => (10, 0, 8),
            Column::Said => (18, u16::MAX, 0),
        };
        let width = if app.traffic.columns.is_shown(*column) { width } else { 0 };
        Spec { width, extra, leaves }
    };
    let specs: Vec<Spec> = Column::ALL.iter().map(spec).collect();
    fit(&specs, width.saturating_sub(MARKS))
}

#[expect(clippy::too_many_arguments, reason = "a line is where it is, with all it shows")]
fn line(
    app: &App,
    area: Rect,
    inner: Rect,
    y: u16,
    number: u64,
    row: &Row,
    columns: &[Placed],
    buffer: &mut Buffer,
) {
    let theme = &app.theme;
    let tone = row.tone();
    let has_finding = app.store().findings().of_row(row).next().is_some();
    let mark = match (app.is_marked(number, row), has_finding && tone < Tone::Warn) {
        (true, _) => "◆",
        (false, true) => "!",
        (false, false) => glyph(tone),
    };
    let style = if tone == Tone::Good && !has_finding { theme.dim } else { theme.tone(tone.max(Tone::Info)) };
    put(buffer, area, area.x, y, mark, style);
    let has_command = columns.iter().any(|column| Column::ALL[column.at] == Column::Command);
    for column in columns {
        let kind = Column::ALL[column.at]; // placed from `ALL`
        if kind == Column::Said {
            let at = Rect { x: inner.x + column.x, y, width: column.width, height: 1 };
            said(app, at, row, has_command, buffer);
            continue;
        }
        let (text, style) = match kind {
            Column::Number => (thousands(number), theme.dim),
            Column::Time => {
                let text = row.time().map_or_else(|| id(row), |time| app.clock().of_day(time));
                let is_short = column.width < 12 && text.len() == 12 && row.time().is_some();
                (if is_short { text.get(..8).unwrap_or(&text).to_owned() } else { text }, theme.dim)
            }
            Column::Bus => {
                let bus = app.store().buses().get(row.bus());
                (bus.map_or_else(String::new, |bus| bus.name.to_string()), theme.dim)
            }
            Column::Address => (row.address().map_or_else(String::new, |at| at.to_string()), theme.strong),
            Column::Device => device(app, row),
            Column::Command => command(app, row),
            Column::Latency => (short_span(row.span()), theme.dim),
            Column::Said => continue,
        };
        cell(buffer, inner, y, column, &text, style, is_number(kind));
    }
}

/// Returns what stands for the time of a row without one.
fn id(row: &Row) -> String {
    match row {
        Row::Exchange(row) => format!("#{}", row.id),
        Row::Run(run) => format!("#{}", run.id),
        Row::Remark(_) => String::new(),
    }
}

fn device(app: &App, row: &Row) -> (String, Style) {
    match row {
        Row::Exchange(row) => (row.label.to_string(), app.theme.text),
        Row::Run(run) => {
            let name = if run.is_echo() { "echo" } else { run.role.name() };
            (format!("{} {name}", words::arrow(run.role)), app.theme.text)
        }
        Row::Remark(_) => (String::new(), app.theme.text),
    }
}

fn command(app: &App, row: &Row) -> (String, Style) {
    match row {
        Row::Exchange(row) => (row.title.to_string(), app.theme.accent),
        Row::Run(run) => match run.reason() {
            Some(reason) => (reason.name().to_owned(), app.theme.bad),
            None => (run.function.map(words::function).unwrap_or_default(), app.theme.accent),
        },
        Row::Remark(row) => {
            let name = match row.kind {
                RemarkKind::Lost => "lost",
                RemarkKind::Identified => "identified",
                RemarkKind::Note => "note",
            };
            (name.to_owned(), app.theme.tone(Tone::Info))
        }
    }
}

/// Writes what a row says: values, or bytes.
fn said(app: &App, area: Rect, row: &Row, has_command: bool, buffer: &mut Buffer) {
    let theme = &app.theme;
    match row {
        Row::Exchange(exchange) => {
            let mut x = area.x;
            if !has_command {
                x = put(buffer, area, x, area.y, &format!("{} ", exchange.title), theme.accent);
            }
            let (outcome, rest) = match exchange.said.split_once(" · ") {
                Some((outcome, rest)) if row.tone() >= Tone::Warn && is_outcome(exchange, outcome) => {
                    (outcome, format!(" · {rest}"))
                }
                _ if is_outcome(exchange, &exchange.said) => (&*exchange.said, String::new()),
                _ => ("", exchange.said.to_string()),
            };
            x = put(buffer, area, x, area.y, outcome, theme.tone(Tone::of(exchange.outcome)));
            let is_odd = exchange.fields.iter().any(|field| field.is_implausible && !field.is_guess);
            let style = match (is_odd, &*rest) {
                (true, _) => theme.warn,
                (false, "done") => theme.dim,
                (false, _) => theme.text,
            };
            let rest = values(exchange, &rest, area.width >= WORDS_FROM);
            put(buffer, area, x, area.y, &rest, style);
        }
        Row::Run(run) => {
            let mut x = area.x;
            if !has_command && let Some(reason) = run.reason() {
                x = put(buffer, area, x, area.y, &format!("{} ", reason.name()), theme.bad);
            }
            put(buffer, area, x, area.y, &bytes(run), theme.text);
        }
        Row::Remark(remark) => {
            let tone = if remark.kind == RemarkKind::Lost { Tone::Bad } else { Tone::Info };
            let style = if remark.kind == RemarkKind::Note { theme.strong } else { theme.tone(tone) };
            put(buffer, area, area.x, area.y, &remark.text, style);
        }
    }
}

/// Writes what an exchange said, without notes that are due for every value; with little room without names where the
/// unit says what it is.
fn values(exchange: &Exchange, in_words: &str, has_names: bool) -> String {
    let fields = exchange.fields.iter().filter(|field| field.span.1 > 0);
    let value = |field: &Field| {
        let is_noted = field.is_implausible && !field.is_guess;
        let short = field.text.split_once(" (").filter(|_| !is_noted).map(|(value, _)| value);
        let (text, mark) = (short.unwrap_or(&field.text), if field.is_guess { "?" } else { "" });
        match &field.unit {
            Some(_) if !has_names => format!("{text}{mark}"),
            _ => format!("{}{mark} {text}", field.name),
        }
    };
    let values: Vec<String> = fields.map(value).collect();
    if values.is_empty() {
        return in_words.to_owned();
    }
    let separator = if in_words.starts_with(" · ") { " · " } else { "" };
    format!("{separator}{}", values.join(" · "))
}

/// Tells whether a text is how an exchange ended, not what it said.
fn is_outcome(exchange: &Exchange, text: &str) -> bool {
    use crate::decode::transaction::Outcome;
    match exchange.outcome {
        Outcome::Answered | Outcome::Broadcast => false,
        Outcome::NoResponse => text == "no response",
        Outcome::Exception => text.starts_with("exception"),
        Outcome::Late => text == "late",
        Outcome::Unsolicited => text == "unsolicited",
        Outcome::Damaged => text.ends_with(" damaged"),
    }
}

fn bytes(run: &Run) -> String {
    let bytes: Vec<String> = run.bytes.iter().take(128).map(|byte| format!("{byte:02x}")).collect();
    bytes.join(" ")
}
