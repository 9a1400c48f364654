//! The whole recording in a line: load, what went wrong, marks, the playhead; what is decoded, and what not yet.
//!
//! ```text
//! ▂▃▃▂▁  ▂▃▃▃▂▂▃▇▃▂▂▃▃▃▂▂▃▃┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄
//!    ✗      ◆    ┃ ▲   ✗
//! ▶ ×10  13:05:12.345  0:05:12 of 1:12:30                2 errors · decoded 46 %
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use crate::time::SECOND;
use crate::tui::app::App;
use crate::tui::app::replay::{Replay, Way};
use crate::tui::layout::Regions;
use crate::tui::store::Tone;
use crate::tui::theme::glyph;
use crate::tui::timeline::{Bucket, Sought, Timeline};
use crate::tui::widget::bars::bars;
use crate::tui::widget::text::{put, put_right, thousands, width};

/// What stands where the recording is not decoded yet.
const UNKNOWN: &str = "┄";
/// From what share of rows that went wrong on it is called often.
const OFTEN: f64 = 0.1;
/// From what share on nearly all of it did.
const MOSTLY: f64 = 0.5;
/// A place that was marked.
const MARK: &str = "◆";
/// What somebody noted.
const NOTE: &str = "✎";
/// Rows that pass the filter.
const HIT: &str = "▪";
/// The playhead.
const HEAD: &str = "┃";

pub(super) fn draw(app: &App, regions: &Regions, buffer: &mut Buffer) {
    let (Some(area), Some(replay)) = (regions.timeline, app.replay()) else { return };
    let area = area.intersection(*buffer.area());
    if area.is_empty() {
        return;
    }
    let line = |index: u16| Rect { y: area.y + index, height: 1, ..area };
    let columns = Columns::of(app, replay, usize::from(area.width));
    load(app, &columns, line(0), buffer);
    match area.height {
        1 => marks(app, &columns, line(0), false, buffer),
        2 => {
            marks(app, &columns, line(0), false, buffer);
            status(app, replay, line(1), buffer);
        }
        _ => {
            marks(app, &columns, line(1), true, buffer);
            status(app, replay, line(2), buffer);
        }
    }
}

/// Is the timeline as so many columns of the screen.
struct Columns {
    events: Vec<Bucket>,
    hits: Vec<Bucket>,
    marks: Vec<bool>,
    notes: Vec<bool>,
    /// How many are decoded.
    decoded: usize,
    head: usize,
}

impl Columns {
    fn of(app: &App, replay: &Replay, count: usize) -> Columns {
        let timeline = &*replay.timeline;
        let end = timeline.end().max(1);
        let column = |at: i64| {
            let share = i128::from(at.clamp(0, end)) * count.saturating_sub(1) as i128 / i128::from(end);
            usize::try_from(share).unwrap_or(0)
        };
        let (mut marks, mut notes) = (vec![false; count], vec![false; count]);
        for at in app.noted_places() {
            notes[column(at)] = true; // below the count
        }
        for at in app.marked_places() {
            marks[column(*at)] = true; // below the count
        }
        Columns {
            events: timeline.events.columns(end, count),
            hits: timeline.hits.as_ref().map(|(hits, _)| hits.columns(end, count)).unwrap_or_default(),
            marks,
            notes,
            decoded: if timeline.is_complete { count } else { column(timeline.decoded_ns) },
            head: column(replay.playhead),
        }
    }

    /// Returns what is to be seen at a column: glyph and style, what matters most first.
    fn mark(&self, app: &App, at: usize) -> Option<(&'static str, Style)> {
        let theme = &app.theme;
        let event = self.events.get(at)?;
        if self.marks.get(at) == Some(&true) {
            return Some((MARK, theme.accent));
        }
        if event.notes > 0 || self.notes.get(at) == Some(&true) {
            return Some((NOTE, theme.strong));
        }
        if self.hits.get(at).is_some_and(|hit| hit.matches > 0) {
            return Some((HIT, theme.accent));
        }
        if event.errors > 0 {
            return Some((trouble(event), theme.bad));
        }
        (event.findings > 0).then_some((glyph(Tone::Warn), theme.warn))
    }
}

/// Returns what stands for the share of rows that went wrong: the more, the darker.
fn trouble(event: &Bucket) -> &'static str {
    match event.errors as f64 / event.rows.max(1) as f64 {
        share if share >= MOSTLY => "█",
        share if share >= OFTEN => "▓",
        _ => glyph(Tone::Bad),
    }
}

/// Draws how busy the bus was, the busiest column in full height, and what is not decoded yet.
fn load(app: &App, columns: &Columns, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    let values: Vec<f64> = columns.events.iter().map(|bucket| bucket.busy_ns as f64).collect();
    let has_error = |at: usize| columns.events.get(at).is_some_and(|bucket| bucket.errors > 0);
    bars(buffer, area, &values, None, |at| if has_error(at) { theme.bad } else { theme.dim });
    for x in (area.x..area.right()).skip(columns.decoded) {
        put(buffer, area, x, area.y, UNKNOWN, theme.rule);
    }
    head(app, columns, area, buffer);
}

/// Shows the column of the playhead.
fn head(app: &App, columns: &Columns, area: Rect, buffer: &mut Buffer) {
    let x = area.x.saturating_add(u16::try_from(columns.head).unwrap_or(u16::MAX));
    if x < area.right() {
        let cell = &mut buffer[(x, area.y)];
        if matches!(cell.symbol(), " " | UNKNOWN) {
            cell.set_symbol(HEAD);
        }
        cell.set_style(app.theme.selected);
    }
}

/// Draws what is marked; on a line of its own the playhead, too.
fn marks(app: &App, columns: &Columns, area: Rect, is_own_line: bool, buffer: &mut Buffer) {
    for (at, x) in (area.x..area.right()).enumerate() {
        if let Some((glyph, style)) = columns.mark(app, at) {
            put(buffer, area, x, area.y, glyph, style);
        }
    }
    if is_own_line || columns.mark(app, columns.head).is_some() {
        head(app, columns, area, buffer);
    }
}

/// Says where the playhead is, how it goes, and how far the recording is known.
fn status(app: &App, replay: &Replay, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    let timeline = &*replay.timeline;
    let state = match (replay.is_playing, replay.is_at_end && timeline.is_growing) {
        (_, true) => "● at the end".to_owned(),
        (true, _) => format!("▶ ×{}", replay.speed),
        (false, _) => format!("‖ ×{}", replay.speed),
    };
    let mut x = put(buffer, area, area.x + 1, area.y, &state, theme.accent) + 2;
    if let Some(time) = replay.time() {
        x = put(buffer, area, x, area.y, &app.clock().of_day(time), theme.strong) + 2;
    }
    let of = format!("{} of {}", duration(replay.playhead), duration(timeline.end()));
    let rest = Rect { width: area.width.saturating_sub(1), ..area };
    if let Some(way) = way(replay) {
        // Where both do not fit, what it is on the way to matters more than how far it is.
        if usize::from(rest.right().saturating_sub(x)) > width(&of) + width(&way) + 2 {
            put(buffer, area, x, area.y, &of, theme.dim);
        }
        put_right(buffer, rest, area.y, &way, theme.accent);
        return;
    }
    x = put(buffer, area, x, area.y, &of, theme.dim) + 2;
    let mut parts = known(timeline);
    if let Some(from) = app.store().known_from() {
        // How long that lasts matters more: it comes first, and stays where there is little room.
        let from = app.clock().of_day(from);
        let minutes = from.rsplit_once(':').map_or(from.split('.').next(), |(minutes, _)| Some(minutes));
        parts.insert(parts.len().min(1), format!("since {}", minutes.unwrap_or(&from).trim()));
    }
    while parts.iter().map(|part| width(part) + 3).sum::<usize>()
        > usize::from(rest.right().saturating_sub(x))
    {
        parts.pop();
    }
    put_right(buffer, rest, area.y, &parts.join(" · "), theme.dim);
}

fn percent(share: f64) -> String {
    format!("{:.0} %", (share * 100.0).clamp(0.0, 100.0).floor())
}

/// Says what the player is on the way to.
fn way(replay: &Replay) -> Option<String> {
    let (way, share) = replay.way.as_ref()?;
    Some(match way {
        Way::Place(place) => format!("→ {} {}", duration(*place), percent(*share)),
        Way::Rows => "→ …".to_owned(),
        Way::End => format!("→ the end {}", percent(*share)),
        Way::Find(what, true) => format!("→ next {}, looked through {}", what.name(), percent(*share)),
        Way::Find(what, false) => format!("→ last {}", what.name()),
    })
}

/// Says how far the recording is known, and what is in it, what matters most first.
fn known(timeline: &Timeline) -> Vec<String> {
    let mut parts = Vec::new();
    match (timeline.is_growing, timeline.is_complete) {
        _ if timeline.is_broken => parts.push("cannot be read on".to_owned()),
        (true, _) => parts.push("still written".to_owned()),
        (false, false) => parts.push(format!("decoded {}", percent(timeline.share))),
        (false, true) => {}
    }
    if let Some((hits, until)) = &timeline.hits {
        let share = *until as f64 / timeline.end().max(1) as f64;
        let far = if share < 1.0 { format!(" in {}", percent(share)) } else { String::new() };
        parts.push(format!("{} pass{far}", thousands(hits.total(Sought::Match))));
    }
    if let Some((words, until)) = timeline.words.as_ref().filter(|(_, until)| *until < timeline.decoded_ns) {
        let share = *until as f64 / timeline.end().max(1) as f64;
        parts.push(format!("{} found in {}", thousands(words.total(Sought::Words)), percent(share)));
    }
    let count = |what: Sought, one: &str| match timeline.events.total(what) {
        0 => None,
        1 => Some(format!("1 {one}")),
        many => Some(format!("{} {one}s", thousands(many))),
    };
    parts.extend(count(Sought::Error, "error"));
    parts.extend(count(Sought::Finding, "finding"));
    parts.extend(count(Sought::Note, "note"));
    parts
}

/// Writes a length of time as `0:05:12`, with days where there are.
fn duration(ns: i64) -> String {
    let seconds = ns.max(0) / SECOND;
    let (days, hours, minutes) = (seconds / 86_400, seconds / 3600 % 24, seconds / 60 % 60);
    match days {
        0 => format!("{hours}:{minutes:02}:{:02}", seconds % 60),
        _ => format!("{days} d {hours}:{minutes:02}:{:02}", seconds % 60),
    }
}
