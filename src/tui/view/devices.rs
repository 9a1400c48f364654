//! The devices: a row an address, updated in place.
//!
//! ```text
//!   ADDR DEVICE   SERIAL        FW   VALUES                       AGE   POLLS  ERR  LATENCY TREND
//! ←    1 do       YL0114010022  2.0  17.6 °C · 95.2 % · 9.1 mg/L  0.4 s 0.5/s    0  18.4 ms ▁▂▄▅▇
//! ✗    9 -                                                        2.1 s 0.2/s  120
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::short_span;
use crate::decode::transaction::Outcome;
use crate::time::MILLISECOND;
use crate::tui::app::App;
use crate::tui::store::{Device, Quantity};
use crate::tui::widget::bars::sparkline;
use crate::tui::widget::columns::{Placed, Spec, fit};
use crate::tui::widget::text::{age, put, put_right, shade, thousands};

/// How long a read or write glows, and how long it fades, in nanoseconds.
const FRESH: i64 = 600 * MILLISECOND;
const FADING: i64 = 1800 * MILLISECOND;

const TITLES: [&str; 11] =
    ["BUS", "ADDR", "DEVICE", "SERIAL", "FW", "VALUES", "AGE", "POLLS", "ERR", "LATENCY", "TREND"];

pub(super) fn draw(app: &App, area: Rect, buffer: &mut Buffer) {
    let devices = app.devices.list(app.store());
    if devices.is_empty() {
        let lines = ["no device was heard yet", "", "one is listed as soon as a master asks it"];
        return super::empty(app, area, &lines, buffer);
    }
    let columns = columns(app, area.width);
    let inner = Rect { x: area.x + 2, width: area.width.saturating_sub(2), ..area };
    for column in &columns {
        put_cell(buffer, inner, area.y, column, TITLES[column.at], app.theme.dim); // placed from `TITLES`
    }
    let foot = if area.height >= 10 { 2 } else { 0 };
    let height = usize::from(area.height.saturating_sub(1 + foot));
    let selected = devices.iter().position(|device| Some(device.key()) == app.devices.selected).unwrap_or(0);
    let top = super::first_row(selected, devices.len(), height);
    for ((index, device), y) in devices.iter().enumerate().skip(top).take(height).zip(area.y + 1..) {
        line(app, device, area, inner, y, &columns, buffer);
        if index == selected {
            shade(buffer, area, y, app.theme.selected);
        }
    }
    if foot > 0
        && let Some(device) = devices.get(selected)
    {
        let y = area.bottom() - 1;
        put(buffer, area, area.x, y - 1, &"─".repeat(usize::from(area.width)), app.theme.rule);
        put(buffer, area, area.x + 1, y, &identity(device), app.theme.dim);
    }
}

/// Says what a device is, and what shows it.
pub(super) fn identity(device: &Device) -> String {
    match (&device.id, &device.evidence) {
        (Some(id), Some(evidence)) => format!("{id}, recognised by {evidence}"),
        (Some(id), None) => format!("{id}, as assigned"),
        (None, _) if device.transactions() == device.count(Outcome::NoResponse) => {
            "never answered".to_owned()
        }
        (None, _) if device.label.ends_with('?') => {
            format!(
                "likely {}, not proven; --device {}=… settles it",
                device.label.trim_end_matches('?'),
                device.address
            )
        }
        (None, _) => "not recognised: no profile fits".to_owned(),
    }
}

fn columns(app: &App, width: u16) -> Vec<Placed> {
    let has_buses = app.store().buses().len() > 1;
    let spec = |width, extra, leaves| Spec { width, extra, leaves };
    let specs = [
        spec(if has_buses { 6 } else { 0 }, 0, 4),
        spec(4, 0, 0),
        spec(13, 0, 1),
        spec(14, 0, 8),
        spec(4, 0, 9),
        spec(24, u16::MAX, 0),
        spec(6, 0, 2),
        spec(6, 0, 7),
        spec(5, 0, 3),
        spec(10, 0, 6),
        spec(if width >= 140 { 20 } else { 10 }, 0, 5),
    ];
    fit(&specs, width.saturating_sub(2))
}

fn is_number(at: usize) -> bool {
    matches!(at, 1 | 6 | 7 | 8 | 9)
}

fn put_cell(buffer: &mut Buffer, area: Rect, y: u16, column: &Placed, text: &str, style: Style) {
    let at = Rect { x: area.x + column.x, y, width: column.width, height: 1 };
    if is_number(column.at) {
        put_right(buffer, at, y, text, style);
    } else {
        put(buffer, at, at.x, y, text, style);
    }
}

/// Returns how fresh the last read or write of a device is, with its glyph.
fn glow(app: &App, device: &Device) -> (&'static str, Style) {
    let theme = &app.theme;
    let (Some(now), Some(last)) = (app.store().now(), device.read.max(device.written)) else {
        return (" ", theme.text);
    };
    let glyph = if device.written > device.read { "→" } else { "←" };
    match now - last {
        ns if ns < FRESH => (glyph, theme.fresh),
        ns if ns < FADING => (glyph, theme.fading),
        _ => (" ", theme.text),
    }
}

fn line(
    app: &App,
    device: &Device,
    area: Rect,
    inner: Rect,
    y: u16,
    columns: &[Placed],
    buffer: &mut Buffer,
) {
    let theme = &app.theme;
    let (glyph, glow) = glow(app, device);
    // What answers nothing, or reports an error of its own, is marked until it does better.
    let never = device.transactions() > 0 && device.transactions() == device.count(Outcome::NoResponse);
    let has_flag = device.error_flag.as_deref().is_some_and(|flag| flag != "none");
    match never || has_flag {
        true => put(buffer, area, area.x, y, "✗", theme.bad),
        false => put(buffer, area, area.x, y, glyph, glow),
    };
    for column in columns {
        let (text, style) = match column.at {
            0 => (app.store().buses().get(device.bus).map_or("", |bus| &*bus.name).to_owned(), theme.dim),
            1 => (device.address.to_string(), theme.strong),
            2 => (device.label.to_string(), if device.id.is_some() { theme.accent } else { theme.text }),
            3 => (device.serial.as_deref().unwrap_or_default().to_owned(), theme.dim),
            4 => (device.firmware.as_deref().unwrap_or_default().to_owned(), theme.dim),
            5 => {
                values(
                    app,
                    device,
                    glow,
                    Rect { x: inner.x + column.x, y, width: column.width, height: 1 },
                    buffer,
                );
                continue;
            }
            6 => {
                let since = app.store().now().zip(device.seen).map(|(now, seen)| age(now - seen));
                (since.unwrap_or_default(), theme.dim)
            }
            7 => {
                let polls = device.polls_per_second(app.store().now()).map(|polls| format!("{polls:.1}/s"));
                (polls.unwrap_or_default(), theme.dim)
            }
            8 => {
                let errors = device.errors();
                (thousands(errors), if errors > 0 { theme.bad } else { theme.dim })
            }
            9 => (short_span(device.latency), theme.dim),
            _ => (trend(device, usize::from(column.width)), theme.accent),
        };
        put_cell(buffer, inner, y, column, &text, style);
    }
}

/// Returns the first quantity over time.
fn trend(device: &Device, columns: usize) -> String {
    let quantity = device.quantities.iter().find(|quantity| quantity.history.total() > 1);
    quantity.map_or_else(String::new, |quantity| sparkline(&latest(quantity, columns), columns))
}

/// Returns the latest values of a quantity.
pub(super) fn latest(quantity: &Quantity, count: usize) -> Vec<f64> {
    let total = quantity.history.total();
    let from = total.saturating_sub(count as u64);
    quantity.history.range(from..total).map(|point| point.value).collect()
}

/// Returns the value of a quantity in little room, without its notes.
pub(super) fn short_value(quantity: &Quantity) -> String {
    let text = quantity.text.split_once(" (").map_or(&*quantity.text, |(value, _)| value);
    if quantity.is_guess { format!("{text}?") } else { text.to_owned() }
}

fn values(app: &App, device: &Device, glow: Style, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    if device.quantities.is_empty() {
        if device.transactions() > 0 && device.transactions() == device.count(Outcome::NoResponse) {
            put(buffer, area, area.x, area.y, "no response", theme.bad);
        }
        return;
    }
    let mut x = area.x;
    for (index, quantity) in device.quantities.iter().enumerate() {
        if index > 0 {
            x = put(buffer, area, x, area.y, " · ", theme.dim);
        }
        let style = if quantity.is_implausible { theme.warn } else { glow };
        let mark = if quantity.is_implausible { "▲" } else { "" };
        x = put(buffer, area, x, area.y, &format!("{mark}{}", short_value(quantity)), style);
    }
}
