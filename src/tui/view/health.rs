//! How the bus is: load, frames and errors over time, how long things take, who fails, what the adapter can tell.
//!
//! ```text
//! LOAD 62 %      ▁▂▃▅▇▇▅▃▂▁▂▃▅▇▇      LATENCY  median 18 ms          GAPS  median 4 ms
//! FRAMES 41/s    ▃▃▃▃▃▄▃▃▃▃▃▃▃▃▃         ▂█▅▁                          ▁▅█▂
//! ERRORS 0.2/s   ▁      ▁                1 ms    10 ms   100 ms        t1.5 t3.5
//! ADDR ANSWERED …                     LINE …
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::tui::app::App;

/// Returns how busy the bus is of late, in percent; `None` without times.
pub(super) fn load(app: &App) -> Option<f64> {
    let store = app.newest();
    let now = store.now()?.as_ns().div_euclid(crate::time::SECOND);
    let bus = store.buses().get(app.bus)?;
    let since = store.begun()?.as_ns().div_euclid(crate::time::SECOND);
    // The second under way is not over yet.
    let seconds = (now - since).clamp(1, 5);
    let busy: i64 = bus.health.steps(now - seconds, 1, now).iter().map(|second| second.busy_ns).sum();
    Some(busy as f64 / (seconds * crate::time::SECOND) as f64 * 100.0)
}

pub(super) fn draw(app: &App, area: Rect, buffer: &mut Buffer) {
    let _ = (app, area, buffer);
}
