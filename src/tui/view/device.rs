//! The page of a device.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::tui::app::App;

pub(super) fn draw(app: &App, area: Rect, buffer: &mut Buffer) {
    let _ = (app, area, buffer);
}
