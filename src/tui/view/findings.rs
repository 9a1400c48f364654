//! The findings, folded, with explanation and next check of the selected one.
//!
//! ```text
//!   CODE  NAME               ADDR  COUNT  LAST          OBSERVED
//! ✗ T01   no-response           9     12  12:00:08.031  request unanswered …
//! ─────────────────────────────────────────────────────────────────
//! what it may mean, what to check next
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::analyze::verify::{Finding, Severity};
use crate::tui::app::App;
use crate::tui::store::Tone;
use crate::tui::theme::glyph;
use crate::tui::widget::columns::{Spec, fit};
use crate::tui::widget::text::{put, put_right, shade, thousands, wrap};

/// Returns how many rows the list has, and how many lines are below it.
pub fn heights(height: u16) -> (u16, u16) {
    let below = if height >= 10 { (height / 3).max(5) } else { 0 };
    (height.saturating_sub(1 + below), below)
}

pub(super) fn draw(app: &App, area: Rect, buffer: &mut Buffer) {
    let findings = app.store().findings().list();
    if findings.is_empty() {
        let lines: &[&str] = match app.store().known_from() {
            Some(_) => &["not known yet:", "what came before is not decoded"],
            None => &["nothing was found wrong with the traffic so far"],
        };
        return super::empty(app, area, lines, buffer);
    }
    let spec = |width, extra, leaves| Spec { width, extra, leaves };
    let specs =
        [spec(4, 0, 0), spec(22, 0, 3), spec(4, 0, 1), spec(7, 0, 2), spec(12, 0, 5), spec(14, u16::MAX, 0)];
    let columns = fit(&specs, area.width.saturating_sub(2));
    let titles = ["CODE", "NAME", "ADDR", "COUNT", "LAST", "OBSERVED"];
    let (height, _) = heights(area.height);
    let top = super::first_row(app.finding, findings.len(), usize::from(height));
    let at = |column: &crate::tui::widget::columns::Placed, y| Rect {
        x: area.x + 2 + column.x,
        y,
        width: column.width,
        height: 1,
    };
    for column in &columns {
        let cell = at(column, area.y);
        match column.at {
            2 | 3 => drop(put_right(buffer, cell, area.y, titles[column.at], app.theme.dim)), // from `titles`
            _ => drop(put(buffer, cell, cell.x, area.y, titles[column.at], app.theme.dim)),
        }
    }
    for (y, (index, found)) in (area.y + 1..area.y + 1 + height).zip(findings.iter().enumerate().skip(top)) {
        let finding = &found.finding;
        let tone = tone(finding.severity);
        put(buffer, area, area.x, y, glyph(tone), app.theme.tone(tone));
        for column in &columns {
            let cell = at(column, y);
            let (text, style) = match column.at {
                0 => (finding.rule.code.to_owned(), app.theme.tone(tone)),
                1 => (finding.rule.name.to_owned(), app.theme.text),
                2 => (finding.address.map_or_else(String::new, |at| at.to_string()), app.theme.strong),
                3 => (thousands(finding.count), app.theme.text),
                4 => (finding.last.map_or_else(String::new, |last| app.clock().of_day(last)), app.theme.dim),
                _ => (finding.message.clone(), app.theme.text),
            };
            match column.at {
                2 | 3 => drop(put_right(buffer, cell, y, &text, style)),
                _ => drop(put(buffer, cell, cell.x, y, &text, style)),
            }
        }
        if index == app.finding {
            shade(buffer, area, y, app.theme.selected);
        }
    }
    if let Some(found) = findings.get(app.finding) {
        explain(app, &found.finding, area, buffer);
    }
}

fn tone(severity: Severity) -> Tone {
    match severity {
        Severity::Error => Tone::Bad,
        Severity::Warning => Tone::Warn,
        Severity::Note => Tone::Info,
    }
}

fn explain(app: &App, finding: &Finding, area: Rect, buffer: &mut Buffer) {
    let (_, below) = heights(area.height);
    if below == 0 {
        return;
    }
    let top = area.bottom() - below;
    put(buffer, area, area.x, top, &"─".repeat(usize::from(area.width)), app.theme.rule);
    let columns = usize::from(area.width.saturating_sub(2));
    let party = format!("{}: {}", finding.party.name(), finding.message);
    let mut lines: Vec<(String, _)> = Vec::new();
    lines.extend(wrap(&party, columns).into_iter().map(|line| (line, app.theme.strong)));
    lines.extend(wrap(finding.help(), columns).into_iter().map(|line| (line, app.theme.text)));
    lines.extend(wrap(finding.rule.explanation, columns).into_iter().map(|line| (line, app.theme.dim)));
    lines.extend(wrap(finding.rule.reference, columns).into_iter().map(|line| (line, app.theme.dim)));
    for (y, (line, style)) in (top + 1..area.bottom()).zip(lines) {
        put(buffer, area, area.x + 1, y, &line, style);
    }
}
