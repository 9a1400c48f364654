//! The page of a device: all it says, over time.
//!
//! ```text
//! address 1  yosemitech-do  YL0114010022  hardware 1.2, software 2.0
//! recognised by serial number …                       clock 2 s behind the host
//! VALUES                                 │ temperature
//!  temperature   17.625 °C    ▁▂▄▅▇      │ 17.70 ⠤⠒⠉
//! SETTINGS AND CALIBRATION               │ 17.60
//!  k             1.0          written …  │       13:00:00          13:05:00
//! REGISTERS
//!  FC03 0x2600 ×4   41 8d 00 00 …
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::devices::{identity, latest, short_value};
use crate::decode::transaction::Outcome;
use crate::report::TimeStyle;
use crate::time::{SECOND, Timestamp};
use crate::tui::app::{App, DevicesState, PageItem};
use crate::tui::store::{Device, Quantity, Register, Setting, Tone};
use crate::tui::widget::bars::sparkline;
use crate::tui::widget::chart::{Look, chart};
use crate::tui::widget::text::{age, put, put_right, shade, thousands, width};

/// From which width on the chart stands beside the list.
const SIDE_BY_SIDE_FROM: u16 = 76;
/// How many lines a chart has at least.
const CHART_LEAST: u16 = 6;

/// Is a line of the list.
enum Line {
    Title(&'static str),
    Item(usize, PageItem),
}

pub(super) fn draw(app: &App, area: Rect, buffer: &mut Buffer) {
    let Some(device) = app.devices.device(app.store()) else { return };
    let top = head(app, device, area, buffer);
    let body = Rect { y: top, height: area.bottom().saturating_sub(top), ..area };
    let (list, side) = if body.width >= SIDE_BY_SIDE_FROM {
        let width = (body.width / 2).clamp(38, 60);
        let rest = Rect { x: body.x + width + 1, width: body.width - width - 1, ..body };
        for y in body.y..body.bottom() {
            put(buffer, body, body.x + width, y, "│", app.theme.rule);
        }
        (Rect { width, ..body }, Some(rest))
    } else if body.height >= CHART_LEAST + 8 {
        let height = body.height - CHART_LEAST - 1;
        let rest = Rect { y: body.y + height, height: CHART_LEAST + 1, ..body };
        (Rect { height, ..body }, Some(rest))
    } else {
        (body, None)
    };
    let items = DevicesState::items(device);
    let selected = app.devices.page.unwrap_or(0);
    self::list(app, device, &items, selected, list, buffer);
    if let Some(area) = side {
        right(app, device, items.get(selected).copied(), area, buffer);
    }
}

/// Writes what the device is and how it does; returns the line below.
fn head(app: &App, device: &Device, area: Rect, buffer: &mut Buffer) -> u16 {
    let theme = &app.theme;
    let mut x = put(buffer, area, area.x + 1, area.y, &format!("address {}  ", device.address), theme.strong);
    let serial = device.serial.as_deref().unwrap_or("serial number not read");
    x = put(
        buffer,
        area,
        x,
        area.y,
        &format!("{}  ", device.id.as_deref().unwrap_or(&device.label)),
        theme.accent,
    );
    x = put(buffer, area, x, area.y, serial, theme.text);
    let versions = [("hardware", &device.hardware), ("software", &device.firmware)];
    for (name, version) in versions {
        if let Some(version) = version {
            x = put(buffer, area, x, area.y, &format!("  {name} {version}"), theme.dim);
        }
    }
    if let Some(flag) = device.error_flag.as_deref().filter(|flag| *flag != "none") {
        put(buffer, area, x + 2, area.y, &format!("✗ {flag}"), theme.bad);
    }
    put(buffer, area, area.x + 1, area.y + 1, &identity(device), theme.dim);
    let mut parts = vec![(format!("{} transactions", thousands(device.transactions())), theme.text)];
    for outcome in Outcome::ALL.into_iter().filter(|outcome| *outcome != Outcome::Answered) {
        let count = device.count(outcome);
        if count > 0 {
            let style = theme.tone(Tone::of(outcome));
            parts.push((format!("{} {}", thousands(count), outcome.name()), style));
        }
    }
    if device.latency.is_some() {
        parts.push((format!("latency {}", super::short_span(device.latency)), theme.text));
    }
    if let Some((text, tone)) = clock(app, device) {
        parts.push((text, theme.tone(tone)));
    }
    let mut x = area.x + 1;
    for (text, style) in parts {
        x = put(buffer, area, x, area.y + 2, &text, style) + 2;
    }
    area.y + 4
}

/// Compares the device's clock with the host's, in the zone in which times are shown: the device's has none.
fn clock(app: &App, device: &Device) -> Option<(String, Tone)> {
    let clock = device.clock?;
    let host = chrono::DateTime::from_timestamp_nanos(clock.at.as_ns());
    let host = match app.time {
        TimeStyle::Local => host.with_timezone(&chrono::Local).naive_local(),
        TimeStyle::Utc | TimeStyle::Relative => host.naive_utc(),
    };
    let host_ns = host.and_utc().timestamp_nanos_opt()?;
    let ahead = clock.shown.as_ns().saturating_sub(host_ns);
    let text = match ahead.saturating_abs() {
        // It shows whole seconds.
        ..2_000_000_000 => "clock as the host's".to_owned(),
        by if ahead < 0 => format!("clock {} behind the host's", age(by)),
        by => format!("clock {} before the host's", age(by)),
    };
    Some((text, if ahead.saturating_abs() > 60 * SECOND { Tone::Warn } else { Tone::Good }))
}

fn list(app: &App, device: &Device, items: &[PageItem], selected: usize, area: Rect, buffer: &mut Buffer) {
    let mut lines = Vec::new();
    let mut title = "";
    for (at, item) in items.iter().enumerate() {
        let of = match item {
            PageItem::Quantity(_) => "VALUES",
            PageItem::Setting(_) => "SETTINGS AND CALIBRATION",
            PageItem::Register(_) => "REGISTERS",
        };
        if of != title {
            lines.push(Line::Title(of));
            title = of;
        }
        lines.push(Line::Item(at, *item));
    }
    let at = lines.iter().position(|line| matches!(line, Line::Item(at, _) if *at == selected)).unwrap_or(0);
    let top = super::first_row(at, lines.len(), usize::from(area.height));
    for (y, line) in (area.y..area.bottom()).zip(lines.iter().skip(top)) {
        match line {
            Line::Title(title) => drop(put(buffer, area, area.x + 1, y, title, app.theme.dim)),
            Line::Item(at, item) => {
                match item {
                    PageItem::Quantity(at) => {
                        device.quantities.get(*at).iter().for_each(|it| quantity(app, it, area, y, buffer));
                    }
                    PageItem::Setting(at) => {
                        device.settings.get(*at).iter().for_each(|it| setting(app, it, area, y, buffer));
                    }
                    PageItem::Register(at) => {
                        device.registers.get(*at).iter().for_each(|it| register(app, it, area, y, buffer));
                    }
                }
                if *at == selected {
                    shade(buffer, area, y, app.theme.selected);
                }
            }
        }
    }
}

fn quantity(app: &App, quantity: &Quantity, area: Rect, y: u16, buffer: &mut Buffer) {
    let theme = &app.theme;
    put(buffer, area, area.x + 2, y, &quantity.name, theme.accent);
    let style = if quantity.is_implausible { theme.warn } else { theme.strong };
    let x = put(buffer, area, area.x + 18, y, &short_value(quantity), style);
    if quantity.is_derived {
        put(buffer, area, x + 1, y, "derived", theme.dim);
    } else if area.right() > x + 8 {
        let columns = usize::from(area.right() - x - 2).min(20);
        put_right(buffer, area, y, &sparkline(&latest(quantity, columns), columns), theme.dim);
    }
}

fn setting(app: &App, setting: &Setting, area: Rect, y: u16, buffer: &mut Buffer) {
    let theme = &app.theme;
    let Some(last) = setting.changes.back() else { return };
    put(buffer, area, area.x + 2, y, &setting.name, theme.text);
    let x = put(buffer, area, area.x + 18, y, &last.text, theme.strong);
    let changed = setting.changes.len() > 1;
    let what = if last.is_written { "written" } else { "read" };
    let style = if changed { theme.warn } else { theme.dim };
    let text = match (changed, last.time) {
        (true, Some(time)) => format!("{what} anew {}", app.clock().of_day(time)),
        _ => what.to_owned(),
    };
    if usize::from(area.right().saturating_sub(x)) > width(&text) {
        put_right(buffer, area, y, &text, style);
    }
}

fn register(app: &App, register: &Register, area: Rect, y: u16, buffer: &mut Buffer) {
    let theme = &app.theme;
    let quantity = register.quantity.map(|quantity| format!(" ×{quantity}")).unwrap_or_default();
    let key = format!("FC{:02} 0x{:04x}{quantity}", register.function, register.start);
    let x = put(buffer, area, area.x + 2, y, &key, theme.text).max(area.x + 20);
    let style = theme.tone(Tone::of(register.outcome));
    let style = if style == theme.text { theme.accent } else { style };
    let x = put(buffer, area, x, y, &register.title, style).max(area.x + 37);
    put(buffer, area, x + 1, y, &words(register), theme.dim);
}

/// Writes raw words, high byte first.
fn words(register: &Register) -> String {
    let words = register.words.chunks(2).take(16);
    words
        .map(|word| word.iter().map(|byte| format!("{byte:02x}")).collect::<String>())
        .collect::<Vec<_>>()
        .join(" ")
}

/// Draws what there is to see of the selected line, and below it the other quantities where there is room.
fn right(app: &App, device: &Device, item: Option<PageItem>, area: Rect, buffer: &mut Buffer) {
    match item {
        Some(PageItem::Setting(at)) => {
            device.settings.get(at).iter().for_each(|setting| history(app, setting, area, buffer));
        }
        Some(PageItem::Register(at)) => {
            device.registers.get(at).iter().for_each(|register| raw(app, register, area, buffer));
        }
        Some(PageItem::Quantity(first)) => {
            let count = device.quantities.len();
            let room = usize::from(area.height / (CHART_LEAST + 1)).clamp(1, count.max(1));
            let height = area.height / u16::try_from(room).unwrap_or(1);
            let shown = (0..room).filter_map(|at| device.quantities.get((first + at) % count));
            for (index, quantity) in shown.enumerate() {
                let y = area.y + height * u16::try_from(index).unwrap_or(0);
                over_time(app, quantity, Rect { y, height, ..area }, buffer);
            }
        }
        None => {}
    }
}

/// Returns over which times quantities are drawn, the same for all: what was chosen, but not before the first byte.
fn span(app: &App) -> Option<(Timestamp, Timestamp)> {
    let store = app.store();
    let (begun, now) = (store.counted_since()?, store.now()?);
    let from = if app.span_s > 0 { now - app.span_s.saturating_mul(SECOND) } else { begun };
    Some((from.max(begun), now))
}

/// Returns the unit of a chart, and what values are multiplied by: shares are shown in percent, likely ones as well.
fn scale<'a>(value: &str, unit: Option<&'a str>) -> (Option<&'a str>, f64) {
    let is_percent = value.trim_end_matches('?').ends_with('%');
    (unit.or(is_percent.then_some("%")), if is_percent { 100.0 } else { 1.0 })
}

fn over_time(app: &App, quantity: &Quantity, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    let (unit, factor) = scale(&short_value(quantity), quantity.unit.as_deref());
    let unit = unit.map(|unit| format!(" in {unit}")).unwrap_or_default();
    let x = put(buffer, area, area.x + 1, area.y, &quantity.name, theme.accent);
    put(buffer, area, x, area.y, &unit, theme.dim);
    let Some((from, now)) = span(app) else {
        put(buffer, area, area.x + 1, area.y + 1, "the input has no times", theme.dim);
        return;
    };
    let length = (now - from).max(1) as f64;
    let points = quantity.history.iter().filter(|point| (from..=now).contains(&point.time));
    let placed: Vec<(f64, f64)> =
        points.map(|point| ((point.time - from) as f64 / length, point.value * factor)).collect();
    if placed.is_empty() {
        let text = "nothing was measured in this span";
        put(buffer, area, area.x + 1, area.y + 1, text, theme.dim);
        return;
    }
    let labels = [from, now].map(|time| app.clock().of_day(time));
    let look = Look { line: theme.accent, label: theme.dim };
    let chart_area = Rect {
        x: area.x + 1,
        y: area.y + 1,
        width: area.width.saturating_sub(1),
        height: area.height.saturating_sub(1),
    };
    chart(buffer, chart_area, &placed, [labels[0].trim(), labels[1].trim()], look);
}

fn history(app: &App, setting: &Setting, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    put(buffer, area, area.x + 1, area.y, &format!("{}, newest first", setting.name), theme.dim);
    for (y, change) in (area.y + 1..area.bottom()).zip(setting.changes.iter().rev()) {
        let time = change.time.map_or_else(String::new, |time| app.clock().of_day(time));
        put(buffer, area, area.x + 1, y, &time, theme.dim);
        let x =
            put(buffer, area, area.x + 15, y, if change.is_written { "written" } else { "read" }, theme.text);
        put(buffer, area, x.max(area.x + 23), y, &change.text, theme.strong);
    }
}

fn raw(app: &App, register: &Register, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    let title =
        format!("{}: {} times, last {}", register.title, thousands(register.count), register.outcome.name());
    put(buffer, area, area.x + 1, area.y, &title, theme.dim);
    if register.words.is_empty() {
        put(buffer, area, area.x + 1, area.y + 1, "no data was read or written", theme.dim);
    }
    for (y, (at, word)) in (area.y + 1..area.bottom()).zip(register.words.chunks(2).enumerate()) {
        let number = usize::from(register.start).saturating_add(at);
        put(buffer, area, area.x + 1, y, &format!("0x{number:04x}"), theme.dim);
        let text = word.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        let x = put(buffer, area, area.x + 9, y, &text, theme.text);
        if let [high, low] = word {
            put(buffer, area, x + 2, y, &format!("{:>6}", u16::from_be_bytes([*high, *low])), theme.dim);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_drawn_in_percent_whether_it_is_proven_or_likely() {
        assert_eq!(scale("85.34 %", None), (Some("%"), 100.0));
        assert_eq!(scale("85.34 %?", None), (Some("%"), 100.0));
        assert_eq!(scale("17.6 °C?", Some("°C")), (Some("°C"), 1.0));
    }
}
