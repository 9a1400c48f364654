//! How the bus is: load, frames and errors over time, how long things take, who fails, what the adapter can tell.
//!
//! ```text
//! LOAD    62 %   ▁▂▃▅▇▇▅▃▂▁▂▃▅▇▇      LATENCY  median 18 ms, 95 % below 32 ms
//! FRAMES  41 /s  ▃▃▃▃▃▄▃▃▃▃▃▃▃▃▃         ▂█▅▁
//! ERRORS 0.2 /s  ▁      ▁                1 ms    10 ms   100 ms
//! ADDR ANSWERED EXCEPT NONE LATE …    GAPS  …      t1.5 t3.5
//!    1     1204      -    2    -      LINE  9600-8N1 …
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::empty;
use crate::decode::transaction::Outcome;
use crate::time::{MILLISECOND, SECOND};
use crate::tui::app::App;
use crate::tui::store::{Bus, Histogram, Second, Tone};
use crate::tui::widget::bars::bars;
use crate::tui::widget::text::{age, put, put_right, thousands, tick, wrap};

/// From which width on histograms stand beside the series.
const SIDE_BY_SIDE_FROM: u16 = 76;
/// How few lines a histogram gets.
const LEAST_CHART: u16 = 4;
/// How many lines the histograms take where there is little room.
const HISTOGRAMS: u16 = 10;
/// How many lines there are at most.
const MOST_LINES: u16 = 200;
/// Over how many seconds figures of late are taken.
const LATE_S: i64 = 5;

/// Returns how busy the bus is of late, in percent; `None` without times.
pub(super) fn load(app: &App) -> Option<f64> {
    let bus = app.newest().buses().get(app.bus)?;
    of_late(app, bus).map(|(busy, _, _)| busy * 100.0)
}

/// Returns how busy a bus was of late, from 0 to 1, and its frames and errors a second.
fn of_late(app: &App, bus: &Bus) -> Option<(f64, f64, f64)> {
    let store = app.newest();
    // The second under way is not over yet.
    let now = store.now()?.as_ns().div_euclid(SECOND);
    let since = store.counted_since()?.as_ns().div_euclid(SECOND);
    let seconds = (now - since).clamp(1, LATE_S);
    let steps = bus.health.steps(now - seconds, 1, now);
    let sum = |of: fn(&Second) -> f64| steps.iter().map(of).sum::<f64>() / seconds as f64;
    let busy = sum(|second| second.busy_ns as f64) / SECOND as f64;
    Some((busy, sum(|second| f64::from(second.frames)), sum(|second| f64::from(second.errors))))
}

pub(super) fn draw(app: &App, area: Rect, buffer: &mut Buffer) {
    let Some(bus) = app.store().buses().get(app.bus) else {
        return empty(app, area, &["nothing was received yet"], buffer);
    };
    let rest = rest(app, area);
    if rest == 0 {
        return parts(app, bus, area, buffer);
    }
    // What does not fit is drawn beside the screen, and as much of it shown as there is room for.
    let whole = Rect { height: area.height + rest, ..area };
    let mut canvas = Buffer::empty(whole);
    parts(app, bus, whole, &mut canvas);
    let from = app.health_from.min(rest);
    for position in area.intersection(*buffer.area()).positions() {
        buffer[position] = canvas[(position.x, position.y + from)].clone();
    }
}

/// Returns how many lines there are beyond those that fit.
pub(super) fn rest(app: &App, area: Rect) -> u16 {
    let Some(bus) = app.store().buses().get(app.bus) else { return 0 };
    let width = area.width.saturating_sub(2);
    let is_wide = width >= SIDE_BY_SIDE_FROM;
    let room = if is_wide { width - (width / 2 - 1) - 2 } else { width };
    let lines = u16::try_from(lines(app, bus, room).len()).unwrap_or(u16::MAX);
    let above = if is_wide { 2 * LEAST_CHART + 2 } else { 4 + units(app) + 2 + HISTOGRAMS };
    above.saturating_add(lines).min(MOST_LINES).saturating_sub(area.height)
}

/// Returns how many addresses are listed where there is little room.
fn units(app: &App) -> u16 {
    u16::try_from(app.store().devices().len()).unwrap_or(8).min(8)
}

fn parts(app: &App, bus: &Bus, area: Rect, buffer: &mut Buffer) {
    let area = Rect { x: area.x + 1, width: area.width.saturating_sub(2), ..area };
    if area.width >= SIDE_BY_SIDE_FROM {
        let width = area.width / 2 - 1;
        let left = Rect { width, ..area };
        let right = Rect { x: area.x + width + 2, width: area.width - width - 2, ..area };
        let series_height = (area.height / 2).clamp(3, 18);
        series(app, bus, Rect { height: series_height, ..left }, buffer);
        let y = left.y + series_height + 1;
        shares(app, Rect { y, height: left.bottom().saturating_sub(y), ..left }, buffer);
        let rest = u16::try_from(lines(app, bus, right.width).len()).unwrap_or(u16::MAX);
        let room = area.height.saturating_sub(rest.saturating_add(2)) / 2;
        let chart = (area.height / 3).clamp(LEAST_CHART, 13).min(room.max(LEAST_CHART));
        histogram(app, bus, Kind::Latency, Rect { height: chart, ..right }, buffer);
        histogram(app, bus, Kind::Gap, Rect { y: right.y + chart + 1, height: chart, ..right }, buffer);
        let y = right.y + 2 * chart + 2;
        line(app, bus, Rect { y, height: right.bottom().saturating_sub(y), ..right }, buffer);
        return;
    }
    // One below the other, as many as there is room for.
    let mut y = area.y;
    let mut part = |height: u16| {
        let part = Rect { y, height: height.min(area.bottom().saturating_sub(y)), ..area };
        y = y.saturating_add(height + 1);
        part
    };
    series(app, bus, part(3), buffer);
    shares(app, part(units(app) + 1), buffer);
    histogram(app, bus, Kind::Latency, part(4), buffer);
    histogram(app, bus, Kind::Gap, part(4), buffer);
    line(app, bus, part(area.height), buffer);
}

/// Draws load, frames and errors over time.
fn series(app: &App, bus: &Bus, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    let store = app.store();
    let (Some(now), Some(begun)) = (store.now(), store.counted_since()) else {
        put(buffer, area, area.x, area.y, "the input has no times: nothing can be said over time", theme.dim);
        return;
    };
    let columns = i64::from(area.width.saturating_sub(16).max(1));
    let until = now.as_ns().div_euclid(SECOND);
    let since = begun.as_ns().div_euclid(SECOND);
    let span = if app.span_s > 0 { app.span_s } else { (until - since).max(1) };
    let step = (span + columns - 1) / columns;
    let shown = (span / step.max(1)).max(1);
    let steps = bus.health.steps(until - shown * step, step, until);
    let late = of_late(app, bus).unwrap_or_default();
    let height = (area.height / 3).max(1);
    let busy_of = |second: &Second| second.busy_ns as f64;
    let values = |of: &dyn Fn(&Second) -> f64| steps.iter().map(of).collect::<Vec<f64>>();
    let lines = [
        ("LOAD", format!("{:.0} %", late.0 * 100.0), values(&busy_of), Some((step * SECOND) as f64)),
        ("FRAMES", format!("{:.1} /s", late.1), values(&|second| f64::from(second.frames)), None),
        ("ERRORS", format!("{:.1} /s", late.2), values(&|second| f64::from(second.errors)), None),
    ];
    for (index, (name, value, values, most)) in lines.into_iter().enumerate() {
        let y = area.y + height * u16::try_from(index).unwrap_or(0);
        let part = Rect { y, height, ..area }.intersection(area);
        put(buffer, part, part.x, y, name, theme.dim);
        let label = Rect { x: part.x + 7, width: 8, height: 1, y };
        put_right(buffer, label.intersection(part), y, &value, theme.strong);
        let style = if name == "ERRORS" { theme.bad } else { theme.accent };
        let plot = Rect { x: part.x + 16, width: part.width.saturating_sub(16), ..part };
        bars(buffer, plot, &values, most, |_| style);
    }
}

/// Names what a histogram is of.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Latency,
    Gap,
}

/// Draws a histogram; that of gaps with t1.5 and t3.5, and how far the adapter blurs it.
fn histogram(app: &App, bus: &Bus, kind: Kind, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    let (title, histogram) = match kind {
        Kind::Latency => ("LATENCY", &bus.health.latency),
        Kind::Gap => ("GAPS", &bus.health.gaps),
    };
    let x = put(buffer, area, area.x, area.y, title, theme.dim);
    if histogram.total() == 0 || area.height < 3 {
        put(buffer, area, x + 2, area.y, "none measured", theme.dim);
        return;
    }
    let quantile = |share: f64| histogram.quantile(share).unwrap_or(0);
    let summary = format!("half below {}, 95 % below {}", age_ms(quantile(0.5)), age_ms(quantile(0.95)),);
    put(buffer, area, x + 2, area.y, &summary, theme.text);
    // From 100 µs on: nothing of interest is faster; as many columns a class as there is room for.
    let first = Histogram::class(100_000);
    let classes = Histogram::CLASSES - first;
    let each = (usize::from(area.width) / classes).max(1);
    let values: Vec<f64> = histogram.counts()[first..]
        .iter()
        .flat_map(|count| std::iter::repeat_n(*count as f64, each))
        .collect();
    let plot = Rect { y: area.y + 1, height: area.height - 2, ..area };
    let blur = bus.health.blur_ns();
    let style = |at: usize| {
        let begins = Histogram::begin(first + at / each);
        // What is shorter than the blur cannot be told from nothing.
        if kind == Kind::Gap && begins < blur { theme.dim } else { theme.accent }
    };
    bars(buffer, plot, &values, None, style);
    let column = |ns: i64| {
        let class = Histogram::class(ns).saturating_sub(first) * each;
        u16::try_from(class).map_or(area.right(), |class| area.x.saturating_add(class))
    };
    let y = area.bottom() - 1;
    for ns in [100_000, MILLISECOND, 10 * MILLISECOND, 100 * MILLISECOND, SECOND, 10 * SECOND] {
        put(buffer, area, column(ns), y, &tick(ns), theme.dim);
    }
    if kind == Kind::Gap {
        for ns in [bus.line.t1_5_ns(), bus.line.t3_5_ns()] {
            let x = column(ns);
            for y in plot.y..plot.bottom() {
                if buffer.cell((x, y)).is_some_and(|cell| cell.symbol() == " ") {
                    put(buffer, area, x, y, "┊", theme.strong);
                }
            }
        }
        // Beside the lines, where the bars of such short gaps rarely are.
        let left = Rect { width: column(bus.line.t1_5_ns()).saturating_sub(area.x), ..area };
        put_right(buffer, left, plot.y, "t1.5", theme.strong);
        put(buffer, area, column(bus.line.t3_5_ns()) + 1, plot.y, "t3.5", theme.strong);
    }
}

/// Writes a length of time in milliseconds or seconds.
fn age_ms(ns: i64) -> String {
    let ms = ns as f64 / MILLISECOND as f64;
    match ms {
        ms if ms < 10.0 => format!("{ms:.1} ms"),
        ms if ms < 10_000.0 => format!("{ms:.0} ms"),
        _ => age(ns),
    }
}

/// Lists who answers how often, and who does not.
fn shares(app: &App, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    let kinds = [Outcome::Answered, Outcome::NoResponse, Outcome::Exception, Outcome::Damaged, Outcome::Late];
    let (wide, titles) = if area.width < 50 {
        (7, ["OK", "NONE", "EXC", "DAMAGE", "LATE"])
    } else {
        (9, ["ANSWERED", "NONE", "EXCEPT", "DAMAGED", "LATE"])
    };
    let cell = |index: usize, y: u16| Rect {
        x: area.x + 4 + wide * u16::try_from(index).unwrap_or(0),
        width: wide,
        y,
        height: 1,
    };
    put(buffer, area, area.x, area.y, "ADDR", theme.dim);
    for (index, title) in titles.iter().enumerate() {
        put_right(buffer, cell(index, area.y).intersection(area), area.y, title, theme.dim);
    }
    let devices = app.store().devices().iter().filter(|device| device.bus == app.bus);
    for (y, device) in (area.y + 1..area.bottom()).zip(devices) {
        let address = Rect { width: 4, y, height: 1, ..area };
        put_right(buffer, address.intersection(area), y, &device.address.to_string(), theme.strong);
        let all = device.transactions().max(1);
        for (index, outcome) in kinds.into_iter().enumerate() {
            let count = device.count(outcome);
            let text = match (count, outcome) {
                (0, _) => "-".to_owned(),
                (count, Outcome::Answered) => thousands(count),
                (count, _) => {
                    let percent = count as f64 / all as f64 * 100.0;
                    if percent < 10.0 { format!("{percent:.1} %") } else { format!("{percent:.0} %") }
                }
            };
            let style = match (count, outcome) {
                (0, _) => theme.dim,
                (_, Outcome::Answered) => theme.text,
                (_, outcome) => theme.tone(Tone::of(outcome)),
            };
            put_right(buffer, cell(index, y).intersection(area), y, &text, style);
        }
    }
}

/// Says what the line is, what was wrong on it, and what the adapter can and cannot tell.
fn line(app: &App, bus: &Bus, area: Rect, buffer: &mut Buffer) {
    let lines = lines(app, bus, area.width);
    for (y, (text, style)) in (area.y..area.bottom()).zip(lines) {
        put(buffer, area, area.x, y, &text, style);
    }
}

fn lines(app: &App, bus: &Bus, width: u16) -> Vec<(String, Style)> {
    let theme = &app.theme;
    let health = &bus.health;
    let mut lines: Vec<(String, Style)> = Vec::new();
    let source = bus.source.as_deref().map(|source| format!(" on {source}")).unwrap_or_default();
    lines.push((format!("{} {}{source}", bus.name, bus.line), theme.strong));
    if bus.away_since.is_some() {
        lines.push(("its source is gone, and tried again until it is back".to_owned(), theme.bad));
    }
    lines.push((counts(app, bus), theme.text));
    if health.damaged() > 0 {
        let [crc, truncated, stray, noise] = health.reasons;
        let text = format!("damaged: {crc} crc, {truncated} truncated, {stray} stray, {noise} noise");
        let bytes = format!(
            ", {} bytes, {} of them stray",
            thousands(health.damaged_bytes),
            thousands(health.stray_bytes)
        );
        lines.push((text + &bytes, theme.bad));
    }
    let [parity, breaks, overruns] = health.line_errors;
    let errors = parity.saturating_add(breaks).saturating_add(overruns);
    let reports = bus.error_reports.unwrap_or("not known for this source");
    if errors > 0 {
        let text = format!("line errors: {parity} parity or framing, {breaks} breaks, {overruns} overruns");
        lines.push((text, theme.bad));
    }
    if health.losses > 0 {
        let [overrun, queue, disk, gone] = health.lost;
        let text = format!(
            "lost: {overrun} bytes by overrun, {queue} by the queue, {disk} by the disk, {gone} while it was gone; {} times",
            health.losses
        );
        lines.push((text, theme.bad));
    }
    if errors == 0 || bus.error_reports.is_some() {
        lines.push((format!("line errors are {reports}"), theme.dim));
    }
    lines.push((blur(bus), theme.dim));
    let facts: Vec<String> = bus.facts.iter().map(|(key, value)| format!("{key} {value}")).collect();
    if !facts.is_empty() {
        lines.push((facts.join(", "), theme.dim));
    }
    let wrapped = lines
        .into_iter()
        .flat_map(|(text, style)| wrap(&text, usize::from(width)).into_iter().map(move |line| (line, style)));
    wrapped.collect()
}

fn counts(app: &App, bus: &Bus) -> String {
    let health = &bus.health;
    let mut text = format!(
        "{} bytes, {} frames, {} transactions",
        thousands(health.bytes),
        thousands(health.frames),
        thousands(health.transactions())
    );
    if let (Some(now), Some(begun)) = (app.store().now(), app.store().counted_since()) {
        text += &format!(" in {}", age(now - begun));
    }
    text
}

/// Says how well times are known.
fn blur(bus: &Bus) -> String {
    let ms = |ns: i64| ns as f64 / MILLISECOND as f64;
    let hold = match bus.hold_ns {
        Some(ns) => format!("the adapter keeps bytes back up to {:.1} ms", ms(ns)),
        None => "how long the adapter keeps bytes back is estimated".to_owned(),
    };
    let blur = bus.health.blur_ns();
    let gaps = if blur * 2 > bus.line.t3_5_ns() {
        "gaps of t3.5 cannot be told for sure"
    } else if blur * 2 > bus.line.t1_5_ns() {
        "gaps of t1.5 cannot be told for sure"
    } else {
        "gaps can be told"
    };
    let worst = ms(bus.health.worst_blur_ns);
    format!("{hold}: 95 % of times are within ±{:.1} ms, the worst within ±{worst:.1} ms; {gaps}", ms(blur))
}
