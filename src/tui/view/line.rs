//! The filter, or the line that is typed with what is wrong with it and what may come next.
//!
//! ```text
//!  filter › addr == 1 && temperatur > 20
//!  column 14: …                                  temperature  turbidity
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Position;

use crate::tui::app::App;
use crate::tui::app::prompt::{Ask, Prompt};
use crate::tui::layout::Regions;
use crate::tui::widget::text::{put, width};

/// Draws both lines; returns where the cursor is.
pub(super) fn draw(app: &App, regions: &Regions, buffer: &mut Buffer) -> Option<Position> {
    let area = regions.line?;
    let theme = &app.theme;
    let Some(prompt) = &app.prompt else {
        let filter = app.filter.as_ref().map(ToString::to_string).unwrap_or_default();
        let x = put(buffer, area, area.x + 1, area.y, "filter ", theme.dim);
        put(buffer, area, x, area.y, &filter, theme.good);
        return None;
    };
    let title = match prompt.ask {
        Ask::Break if !app.is_live => "pause when",
        ask => ask.title(),
    };
    let title = format!("{title} › ");
    let x = put(buffer, area, area.x + 1, area.y, &title, theme.accent);
    let columns = usize::from(area.right().saturating_sub(x + 1));
    let scroll = prompt.input.visual_scroll(columns);
    let shown: String = prompt.text().chars().skip(scroll).collect();
    let style = match (&prompt.error, prompt.ask.is_filter()) {
        (Some(_), _) => theme.bad,
        (None, true) => theme.good,
        (None, false) => theme.text,
    };
    if prompt.text().is_empty() {
        put(buffer, area, x, area.y, prompt.ask.example(), theme.dim);
    } else {
        put(buffer, area, x, area.y, &shown, style);
    }
    let cursor = u16::try_from(prompt.input.visual_cursor().saturating_sub(scroll)).unwrap_or(0);
    if let Some((column, _)) = &prompt.error
        && let Some(at) = column.checked_sub(1 + scroll)
    {
        let at = x.saturating_add(u16::try_from(at).unwrap_or(u16::MAX));
        if at < area.right() {
            buffer[(at, area.y)].set_style(theme.alarm);
        }
    }
    hint(app, prompt, regions, buffer);
    Some(Position { x: (x + cursor).min(area.right().saturating_sub(1)), y: area.y })
}

fn hint(app: &App, prompt: &Prompt, regions: &Regions, buffer: &mut Buffer) {
    let Some(area) = regions.hint else { return };
    let mut x = area.x + 1;
    let error = prompt.error.as_ref().map(|(column, error)| (*column, error.as_str()));
    // While a word is typed that may become right, what it may become is said first.
    let word_at = prompt.text().get(..prompt.completion.start).map_or(0, |before| before.chars().count());
    let is_unfinished =
        error.is_some_and(|(column, _)| column > word_at) && !prompt.completion.words.is_empty();
    if let Some((_, error)) = error.filter(|_| !is_unfinished) {
        x = put(buffer, area, x, area.y, error, app.theme.bad) + 2;
    } else if error.is_none() && prompt.ask.is_filter() && !prompt.text().is_empty() {
        x = put(buffer, area, x, area.y, "⏎ applies", app.theme.dim) + 2;
    }
    for (at, word) in prompt.completion.words.iter().enumerate() {
        if usize::from(area.right().saturating_sub(x)) < width(word) + 6 {
            break;
        }
        if at == 0 {
            x = put(buffer, area, x, area.y, "tab ", app.theme.dim);
        }
        let style = if at == 0 { app.theme.strong } else { app.theme.dim };
        x = put(buffer, area, x, area.y, word, style) + 2;
        if is_unfinished && at == 4 {
            break;
        }
    }
    if let Some((_, error)) = error.filter(|_| is_unfinished) {
        put(buffer, area, x, area.y, error, app.theme.bad);
    }
}
