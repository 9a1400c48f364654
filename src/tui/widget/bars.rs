//! Numbers as bars: in a line, or over several.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

/// Eighths of a cell.
const EIGHTHS: [&str; 9] = [" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"];

/// Draws numbers as bars that stand on the last line of an area, a column each; the largest fills it unless `most` says
/// what does. Anything above zero is seen.
pub fn bars(
    buffer: &mut Buffer,
    area: Rect,
    values: &[f64],
    most: Option<f64>,
    style: impl Fn(usize) -> Style,
) {
    let area = area.intersection(*buffer.area());
    let largest = values.iter().copied().fold(0.0, f64::max);
    let most = most.unwrap_or(largest).max(f64::MIN_POSITIVE);
    let full = u32::from(area.height) * 8;
    for (at, (x, value)) in (area.x..area.right()).zip(values).enumerate() {
        let share = (value / most).clamp(0.0, 1.0);
        let mut eighths = (share * f64::from(full)).round() as u32; // within 0 and `full`
        if *value > 0.0 {
            eighths = eighths.max(1);
        }
        for y in (area.y..area.bottom()).rev() {
            let part = eighths.min(8);
            eighths -= part;
            let symbol = EIGHTHS[part as usize]; // at most 8
            if part > 0 {
                buffer[(x, y)].set_symbol(symbol).set_style(style(at));
            }
        }
    }
}

/// Returns numbers as a line of bars, from the smallest to the largest, so many columns wide; the latest are kept.
pub fn sparkline(values: &[f64], columns: usize) -> String {
    let kept = &values[values.len().saturating_sub(columns)..];
    let least = kept.iter().copied().fold(f64::INFINITY, f64::min);
    let most = kept.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let span = most - least;
    let bar = |value: &f64| {
        // What does not change is a line in the middle.
        let share = if span > 0.0 { (value - least) / span } else { 0.4 };
        EIGHTHS[1 + (share * 7.0).round().clamp(0.0, 7.0) as usize] // from 1 to 8
    };
    kept.iter().map(bar).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_is_as_high_as_its_share_and_never_hidden() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 4, 2));
        let area = *buffer.area();
        bars(&mut buffer, area, &[0.0, 16.0, 8.0, 0.01], None, |_| Style::new());
        let line = |y: u16| (0..4).map(|x| buffer[(x, y)].symbol().to_owned()).collect::<String>();
        assert_eq!((line(0).as_str(), line(1).as_str()), (" █  ", " ██▁"));
    }

    #[test]
    fn a_sparkline_keeps_the_latest_and_shows_what_is_steady_in_the_middle() {
        assert_eq!(sparkline(&[9.0, 0.0, 1.0], 2), "▁█");
        assert_eq!(sparkline(&[5.0, 5.0], 9), "▄▄");
    }
}
