//! A quantity over time: a line of dots, with its scale at the left and its times beneath.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::text::{put, put_right, width};

/// Dots of a cell by column and row, as Unicode orders them.
const DOTS: [[u32; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];

/// Says how a chart looks.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Of the line.
    pub line: Style,
    /// Of scale and times.
    pub label: Style,
}

/// Draws points, each with its place from 0 to 1 between the edges, and its value.
///
/// `labels` are what stands beneath, at the left and at the right edge.
pub fn chart(buffer: &mut Buffer, area: Rect, points: &[(f64, f64)], labels: [&str; 2], look: Look) {
    let area = area.intersection(*buffer.area());
    let values = points.iter().map(|(_, value)| *value);
    let (least, most) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)));
    if !(least.is_finite() && most.is_finite()) || area.width < 12 || area.height < 3 {
        return;
    }
    // What does not change is a line in the middle.
    let (least, most) = if most - least > 0.0 { (least, most) } else { (least - 1.0, most + 1.0) };
    let scale = [most, least].map(|value| short(value, most - least));
    let margin = scale.iter().map(|text| width(text)).max().unwrap_or(0);
    let margin = u16::try_from(margin).unwrap_or(0).saturating_add(1).min(area.width / 2);
    let plot = Rect { x: area.x + margin, width: area.width - margin, height: area.height - 1, ..area };
    let left = Rect { width: margin - 1, ..area };
    put_right(buffer, left, plot.y, &scale[0], look.label);
    put_right(buffer, left, plot.bottom() - 1, &scale[1], look.label);
    put(buffer, area, plot.x, plot.bottom(), labels[0], look.label);
    put_right(buffer, area, plot.bottom(), labels[1], look.label);
    dots(buffer, plot, points, (least, most), look.line);
}

fn dots(buffer: &mut Buffer, plot: Rect, points: &[(f64, f64)], (least, most): (f64, f64), style: Style) {
    let (columns, rows) = (usize::from(plot.width) * 2, usize::from(plot.height) * 4);
    let mut cells = vec![0_u32; usize::from(plot.width) * usize::from(plot.height)];
    let place = |share: f64, count: usize| (share.clamp(0.0, 1.0) * (count - 1) as f64).round() as usize;
    let mut before: Option<(usize, usize)> = None;
    for (x, value) in points {
        let at = (place(*x, columns), place((most - value) / (most - least), rows));
        // From one point to the next, so that few points make a line, too.
        let from = before.filter(|(column, _)| *column <= at.0).unwrap_or(at);
        let steps = (at.0 - from.0).max(at.1.abs_diff(from.1)).max(1);
        for step in 0..=steps {
            let share = step as f64 / steps as f64;
            let column = from.0 + ((at.0 - from.0) as f64 * share).round() as usize;
            let row = (from.1 as f64 + (at.1 as f64 - from.1 as f64) * share).round() as usize;
            let cell = row / 4 * usize::from(plot.width) + column / 2;
            if let Some(cell) = cells.get_mut(cell) {
                *cell |= DOTS[column % 2][row % 4];
            }
        }
        before = Some(at);
    }
    for (cell, position) in cells.iter().zip(plot.positions()) {
        if let Some(symbol) = char::from_u32(0x2800 + cell).filter(|_| *cell > 0) {
            buffer[position].set_char(symbol).set_style(style);
        }
    }
}

/// Writes a value with as many decimals as its scale needs.
fn short(value: f64, span: f64) -> String {
    let decimals =
        (1.0 - (span.abs().max(f64::MIN_POSITIVE).log10() + 1e-9).floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rise_goes_from_the_lower_left_to_the_upper_right() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 20, 4));
        let area = *buffer.area();
        let look = Look { line: Style::new(), label: Style::new() };
        chart(&mut buffer, area, &[(0.0, 1.0), (1.0, 2.0)], ["then", "now"], look);
        let line = |y: u16| (0..20).map(|x| buffer[(x, y)].symbol().to_owned()).collect::<String>();
        assert!(line(0).starts_with("2.0 ") && line(2).starts_with("1.0 "), "{}", line(0));
        assert!(!line(0).ends_with(' ') && line(2).ends_with(' '));
        assert!(line(3).contains("then") && line(3).ends_with("now"));
    }

    #[test]
    fn what_cannot_be_drawn_leaves_the_area_empty() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 20, 4));
        let area = *buffer.area();
        let look = Look { line: Style::new(), label: Style::new() };
        chart(&mut buffer, area, &[], ["", ""], look);
        chart(&mut buffer, area, &[(0.5, f64::NAN)], ["", ""], look);
        assert_eq!(buffer, Buffer::empty(area));
    }
}
