//! Text on a line: put, cut, aligned, counted.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// Returns how many columns a text takes.
pub fn width(text: &str) -> usize {
    UnicodeWidthStr::width(text)
}

/// Cuts a text to so many columns; one that is cut ends in an ellipsis.
pub fn cut(text: &str, columns: usize) -> String {
    if width(text) <= columns {
        return text.to_owned();
    }
    let mut kept = String::new();
    let mut used = 0;
    for letter in text.chars() {
        let wide = UnicodeWidthChar::width(letter).unwrap_or(0);
        if used + wide + 1 > columns {
            break;
        }
        used += wide;
        kept.push(letter);
    }
    if columns > 0 {
        kept.push('…');
    }
    kept
}

/// Puts a text on a line of an area, from a column on, cut to what fits; returns the column after it.
pub fn put(buffer: &mut Buffer, area: Rect, x: u16, y: u16, text: &str, style: Style) -> u16 {
    let area = area.intersection(*buffer.area());
    if y < area.y || y >= area.bottom() || x >= area.right() {
        return x;
    }
    let columns = usize::from(area.right() - x);
    let text = cut(text, columns);
    let (x, _) = buffer.set_stringn(x, y, &text, columns, style);
    x
}

/// Puts a text so that it ends at the right edge of an area; returns the column it begins at.
pub fn put_right(buffer: &mut Buffer, area: Rect, y: u16, text: &str, style: Style) -> u16 {
    let columns = u16::try_from(width(text)).unwrap_or(u16::MAX).min(area.width);
    let x = area.right() - columns;
    put(buffer, area, x, y, text, style);
    x
}

/// Fills a line of an area with a style, over what stands there.
pub fn shade(buffer: &mut Buffer, area: Rect, y: u16, style: Style) {
    let line = Rect { y, height: 1, ..area }.intersection(area).intersection(*buffer.area());
    buffer.set_style(line, style);
}

/// Breaks a text into lines of so many columns, at spaces where that is possible.
pub fn wrap(text: &str, columns: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let Some(line) = lines.last_mut() else { break };
        if line.is_empty() {
            line.push_str(word);
        } else if width(line) + 1 + width(word) <= columns {
            line.push(' ');
            line.push_str(word);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

/// Writes a count with commas between thousands.
pub fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Writes a length of time in two figures or so, such as `0.4 s`, `12 s`, `3 min` or `2 h`.
pub fn age(ns: i64) -> String {
    let seconds = ns.max(0) as f64 / crate::time::SECOND as f64;
    match seconds {
        s if s < 10.0 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.0} h", s / 3600.0),
        s => format!("{:.0} d", s / 86_400.0),
    }
}

/// Writes a length of time as axes have it: `10 µs`, `1 ms`, `2 s`.
pub fn tick(ns: i64) -> String {
    match ns {
        ..1_000_000 => format!("{} µs", ns / 1000),
        1_000_000..1_000_000_000 => format!("{} ms", ns / 1_000_000),
        _ => format!("{} s", ns / 1_000_000_000),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_ends_in_an_ellipsis() {
        assert_eq!(cut("temperature", 6), "tempe…");
        assert_eq!(cut("µg/L", 4), "µg/L");
        assert_eq!((cut("abc", 0), cut("abc", 1)), (String::new(), "…".to_owned()));
    }

    #[test]
    fn counts_and_times_read_well() {
        assert_eq!(thousands(1_234_567), "1,234,567");
        assert_eq!(thousands(999), "999");
        assert_eq!((age(400_000_000), age(90_000_000_000)), ("0.4 s".to_owned(), "90 s".to_owned()));
        assert_eq!(wrap("one two three", 7), ["one two", "three"]);
    }
}
