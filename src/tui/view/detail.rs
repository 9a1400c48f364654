//! The fields of the selected row, as a tree.
//!
//! ```text
//! response #13  13 bytes, time ±0.3 ms
//!   0     address           1
//!   3-10  registers         0x0000 0x8d41 …
//!   3-6     temperature     17.625 °C
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::tui::app::App;
use crate::tui::app::detail::{Detail, Node};
use crate::tui::app::traffic::Pane;
use crate::tui::store::Tone;
use crate::tui::widget::text::{put, shade, width};

/// Returns the first line of the tree on the screen, so that the selected one is on it.
pub fn first_node(selected: usize, count: usize, height: u16) -> usize {
    super::first_row(selected, count, usize::from(height))
}

pub(super) fn draw(app: &App, detail: &Detail, area: Rect, buffer: &mut Buffer) {
    let selected = app.traffic.node;
    let top = first_node(selected, detail.nodes.len(), area.height);
    for (y, (at, node)) in (area.y..area.bottom()).zip(detail.nodes.iter().enumerate().skip(top)) {
        line(app, node, area, y, buffer);
        if at == selected {
            let style = match app.traffic.pane {
                Pane::Tree => app.theme.selected,
                Pane::Hex => app.theme.selected_elsewhere,
                Pane::List => continue,
            };
            shade(buffer, area, y, style);
        }
    }
}

fn line(app: &App, node: &Node, area: Rect, y: u16, buffer: &mut Buffer) {
    let theme = &app.theme;
    if node.depth == 0 {
        let style = if node.tone == Tone::Good { theme.strong } else { theme.tone(node.tone) };
        let x = put(buffer, area, area.x + 1, y, &node.label, style);
        put(buffer, area, if x > area.x + 1 { x + 2 } else { x }, y, &node.text, theme.dim);
        return;
    }
    put(buffer, area, area.x + 2, y, &offsets(node), theme.dim);
    let x = area.x + 9 + 2 * u16::try_from(node.depth - 1).unwrap_or(0);
    let style = if node.depth > 1 { theme.accent } else { theme.dim };
    let end = put(buffer, area, x, y, &node.label, style);
    let label_width = if area.width < 48 { 15 } else { 19 };
    let x = (area.x + 9 + label_width).max(end + u16::from(width(&node.label) > 0));
    put(
        buffer,
        area,
        x,
        y,
        &node.text,
        if node.tone == Tone::Good { theme.text } else { theme.tone(node.tone) },
    );
}

/// Writes the first and last offset of a field, counted from the address byte.
fn offsets(node: &Node) -> String {
    match (node.span.start, node.span.end.saturating_sub(1)) {
        _ if node.span.is_empty() => String::new(),
        (start, end) if start == end => start.to_string(),
        (start, end) => format!("{start}-{end}"),
    }
}
