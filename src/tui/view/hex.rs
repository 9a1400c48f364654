//! The bytes of the selected row; those of the selected field are lit.
//!
//! ```text
//! request #12
//! 0000  01 03 26 00 00 04 4f 41   ..&...OA
//! ```

use std::ops::Range;

use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};

use crate::tui::app::App;
use crate::tui::app::detail::Detail;
use crate::tui::app::traffic::Pane;
use crate::tui::widget::text::put;

/// Where the bytes begin in a line.
const BYTES: u16 = 6;

/// From which width on sixteen bytes stand in a line: with their letters they take four columns each.
const WIDE_FROM: u16 = BYTES + 16 * 4 + 1;

/// Is a line of the pane.
enum Line {
    /// The title of a frame.
    Title(usize),
    /// Bytes of a frame.
    Bytes(usize, Range<usize>),
}

/// Returns the lines of the pane for so many bytes a line.
fn lines(detail: &Detail, in_line: usize) -> Vec<Line> {
    let mut lines = Vec::new();
    for (side, of) in detail.sides.iter().enumerate() {
        lines.push(Line::Title(side));
        let length = of.bytes.len();
        for start in (0..length).step_by(in_line) {
            lines.push(Line::Bytes(side, start..(start + in_line).min(length)));
        }
    }
    lines
}

/// Returns how many bytes stand in a line.
pub fn in_line(area: Rect) -> usize {
    if area.width >= WIDE_FROM { 16 } else { 8 }
}

/// Returns the first line on the screen, so that the selected byte is on it.
fn top(lines: &[Line], detail: &Detail, byte: usize, height: u16) -> usize {
    let at = detail.bytes().nth(byte);
    let has = |line: &Line| match (line, at) {
        (Line::Bytes(side, span), Some((of, offset))) => *side == of && span.contains(&offset),
        _ => false,
    };
    super::first_row(lines.iter().position(has).unwrap_or(0), lines.len(), usize::from(height))
}

/// Returns the byte at a place of the screen, counted over all frames.
pub fn byte_at(detail: &Detail, selected: usize, area: Rect, at: Position) -> Option<usize> {
    let lines = lines(detail, in_line(area));
    let line = usize::from(at.y.checked_sub(area.y)?) + top(&lines, detail, selected, area.height);
    let Line::Bytes(side, span) = lines.get(line)? else { return None };
    let column = usize::from(at.x.checked_sub(area.x + BYTES)?) / 3;
    let offset = span.start.checked_add(column).filter(|offset| span.contains(offset))?;
    detail.bytes().position(|byte| byte == (*side, offset))
}

pub(super) fn draw(app: &App, detail: &Detail, area: Rect, buffer: &mut Buffer) {
    let theme = &app.theme;
    let lines = lines(detail, in_line(area));
    let top = top(&lines, detail, app.traffic.byte, area.height);
    let cursor = detail.bytes().nth(app.traffic.byte).filter(|_| app.traffic.pane == Pane::Hex);
    let lit = detail.nodes.get(app.traffic.node).filter(|_| app.traffic.pane != Pane::List);
    for (y, line) in (area.y..area.bottom()).zip(lines.iter().skip(top)) {
        let (side, span) = match line {
            Line::Title(side) => {
                let title = detail.sides.get(*side).map_or("", |side| &*side.title);
                put(buffer, area, area.x + 1, y, title, theme.dim);
                continue;
            }
            Line::Bytes(side, span) => (*side, span.clone()),
        };
        let Some(of) = detail.sides.get(side) else { continue };
        put(buffer, area, area.x + 1, y, &format!("{:04}", span.start), theme.dim);
        let text_at = area.x + BYTES + 3 * u16::try_from(in_line(area)).unwrap_or(8) + 1;
        for (index, offset) in span.enumerate() {
            let Some(byte) = of.bytes.get(offset) else { continue };
            let index = u16::try_from(index).unwrap_or(0); // at most 16 in a line
            let is_lit = lit.is_some_and(|node| node.side == side && node.span.contains(&offset));
            let style = match (cursor == Some((side, offset)), is_lit, of.marked.contains(&offset)) {
                (true, _, _) => theme.selected.add_modifier(ratatui::style::Modifier::REVERSED),
                (false, true, _) => theme.lit,
                (false, false, true) => theme.bad,
                (false, false, false) => theme.text,
            };
            put(buffer, area, area.x + BYTES + 3 * index, y, &format!("{byte:02x}"), style);
            let letter = if (0x20..0x7f).contains(byte) { char::from(*byte) } else { '.' };
            let style = if is_lit { theme.lit } else { theme.dim };
            put(buffer, area, text_at + index, y, &letter.to_string(), style);
        }
    }
}
