//! Drawing: a file a region. Nothing here changes state.
//!
//! ```text
//! ┌ header  ──────────────────────────────────────────────────┐
//! │ line    (a filter, or what is typed)                      │
//! │                                                           │
//! │ traffic, devices, device, health or findings              │
//! │                                                           │
//! └ footer  ──────────────────────────────────────────────────┘
//! ```

mod detail;
mod device;
mod devices;
mod dialog;
mod findings;
mod footer;
mod header;
mod health;
mod hex;
mod line;
mod timeline;
mod traffic;

use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};

use super::app::{App, View};
use super::widget::text::put;
use crate::time::{MILLISECOND, Span};
pub use detail::first_node;
pub use findings::heights as finding_heights;
pub use hex::{byte_at, in_line};

/// From how many columns and lines on there is something to see.
const LEAST: (u16, u16) = (24, 5);

/// Returns how many lines of the health view do not fit into an area.
pub fn health_rest(app: &App, area: Rect) -> u16 {
    health::rest(app, area)
}

/// Draws the UI; returns where the cursor is, while something is typed.
pub fn draw(app: &App, buffer: &mut Buffer) -> Option<Position> {
    let regions = app.regions();
    let area = *buffer.area();
    if area.width < LEAST.0 || area.height < LEAST.1 {
        put(buffer, area, 0, 0, "rtutap needs a larger window", app.theme.text);
        return None;
    }
    header::draw(app, &regions, buffer);
    match app.view {
        View::Traffic => traffic::draw(app, &regions, buffer),
        View::Devices if app.devices.page.is_some() => device::draw(app, regions.body, buffer),
        View::Devices => devices::draw(app, regions.body, buffer),
        View::Health => health::draw(app, regions.body, buffer),
        View::Findings => findings::draw(app, regions.body, buffer),
    }
    timeline::draw(app, &regions, buffer);
    footer::draw(app, &regions, buffer);
    if let Some(dialog) = app.dialog {
        dialog::draw(app, dialog, regions.body, buffer);
    }
    line::draw(app, &regions, buffer)
}

/// Returns the first row on the screen, so that the selected one is on it.
pub fn first_row(selected: usize, count: usize, height: usize) -> usize {
    selected.saturating_sub(height / 2).min(count.saturating_sub(height))
}

/// Writes a latency or gap in little room; what is uncertain by a millisecond or more says by how much.
fn short_span(span: Option<Span>) -> String {
    let ms = |ns: i64| ns as f64 / MILLISECOND as f64;
    match span.map(|span| (ms(span.midpoint()), ms(span.half_width()))) {
        None => String::new(),
        Some((middle, error)) if middle >= 10_000.0 && error < 1000.0 => format!("{:.1} s", middle / 1000.0),
        Some((middle, error)) if middle >= 10_000.0 => {
            format!("{:.0} ±{:.0} s", middle / 1000.0, error / 1000.0)
        }
        // An error below a tenth of what is shown is not worth the room.
        Some((middle, error)) if error >= 0.5 && error * 10.0 >= middle => {
            format!("{middle:.0} ±{error:.0} ms")
        }
        Some((middle, error)) if error >= 0.5 => format!("{middle:.0} ms"),
        Some((middle, _)) => format!("{middle:.1} ms"),
    }
}

/// Writes a text in the middle of an area, for a view with nothing to show.
fn empty(app: &App, area: Rect, lines: &[&str], buffer: &mut Buffer) {
    let top = area.y + area.height.saturating_sub(u16::try_from(lines.len()).unwrap_or(0)) / 2;
    for (y, text) in (top..area.bottom()).zip(lines) {
        let wide = u16::try_from(super::widget::text::width(text)).unwrap_or(u16::MAX);
        let x = area.x + area.width.saturating_sub(wide) / 2;
        put(buffer, area, x, y, text, app.theme.dim);
    }
}
