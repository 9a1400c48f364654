//! Where things are on the screen: for drawing, and for the mouse.
//!
//! ```text
//! ┌ header: tabs ─────────────────────────── state of capture ┐  1 line
//! │ filter, or the line that is typed                         │  0, 1 or 2 lines
//! │ list                                                      │
//! │ ───────────────────────────────────────────── rule, drags │
//! │ tree                         │ hex                        │
//! └ footer: keys ────────────────────────── where in the rows ┘  1 line
//! ```

use ratatui::layout::Rect;

use super::app::traffic::Pane;
use super::app::{App, View};

/// From how many lines on the timeline has more than one.
const TIMELINE_FROM: u16 = 10;
/// From how many lines on the timeline has a line for marks of its own.
const MARKS_FROM: u16 = 20;
/// From how many lines of the body on the detail pane is beside the list without being asked for.
const DETAIL_FROM: u16 = 13;
/// How few lines the detail pane gets.
const DETAIL_LEAST: u16 = 6;
/// From which width on fields and bytes stand side by side.
const SIDE_BY_SIDE_FROM: u16 = 72;
/// From which width on tabs have their names.
const NAMES_FROM: u16 = 66;

/// Says where things are; what is not on the screen is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Regions {
    /// The first line.
    pub header: Rect,
    /// The tab of each view.
    pub tabs: Vec<(View, Rect)>,
    /// The filter, or the line that is typed.
    pub line: Option<Rect>,
    /// What is wrong with that, or what may come next.
    pub hint: Option<Rect>,
    /// The view.
    pub body: Rect,
    /// The rows of the traffic view, with their heading.
    pub list: Option<Rect>,
    /// The line between rows and detail.
    pub rule: Option<Rect>,
    /// The fields.
    pub tree: Option<Rect>,
    /// The line between fields and bytes.
    pub bar: Option<Rect>,
    /// The bytes.
    pub hex: Option<Rect>,
    /// The timeline of a recording.
    pub timeline: Option<Rect>,
    /// The last line.
    pub footer: Rect,
}

impl Regions {
    /// Returns how many rows of the traffic are on the screen.
    pub fn rows(&self) -> usize {
        self.list.map_or(1, |list| usize::from(list.height.saturating_sub(1))).max(1)
    }

    /// Returns how many bytes stand in a line of the hex pane.
    pub fn bytes_in_line(&self) -> usize {
        self.hex.map_or(8, super::view::in_line)
    }
}

/// Tells whether the detail pane stands beside the list without being asked for.
pub fn has_room_for_detail(app: &App) -> bool {
    regions_of(app, false).tree.is_some()
}

/// Returns where things are.
pub fn regions(app: &App) -> Regions {
    regions_of(app, app.traffic.is_zoomed)
}

fn regions_of(app: &App, is_zoomed: bool) -> Regions {
    let (width, height) = app.size();
    let line = |y: u16| Rect { x: 0, y, width, height: 1 };
    let mut regions = Regions { header: line(0), tabs: tabs(app.view, width), ..Regions::default() };
    let mut top = 1;
    if app.prompt.is_some() || app.filter.is_some() {
        regions.line = Some(line(top));
        top += 1;
    }
    if app.prompt.is_some() {
        regions.hint = Some(line(top));
        top += 1;
    }
    regions.footer = line(height.saturating_sub(1));
    let timeline = match app.replay() {
        None => 0,
        Some(_) if height < TIMELINE_FROM => 1,
        Some(_) if height < MARKS_FROM => 2,
        Some(_) => 3,
    };
    let bottom = regions.footer.y.saturating_sub(timeline);
    regions.timeline = (timeline > 0).then_some(Rect { x: 0, y: bottom, width, height: timeline });
    regions.body = Rect { x: 0, y: top, width, height: bottom.saturating_sub(top) };
    if app.view == View::Traffic {
        traffic(app, is_zoomed, &mut regions);
    }
    // What does not fit is not on the screen.
    let screen = Rect { x: 0, y: 0, width, height };
    for part in [&mut regions.header, &mut regions.body, &mut regions.footer] {
        *part = part.intersection(screen);
    }
    for part in [&mut regions.line, &mut regions.hint, &mut regions.timeline].into_iter().flatten() {
        *part = part.intersection(screen);
    }
    regions
}

/// Lays out the tabs: with names where there is room, else only the current one's.
fn tabs(current: View, width: u16) -> Vec<(View, Rect)> {
    let mut x = 1;
    let tab = |(at, view): (usize, View)| {
        let named = width >= NAMES_FROM || view == current;
        let title = if named { view.title().len() + 2 } else { 1 };
        let title = u16::try_from(title).unwrap_or(1);
        let _ = at;
        let tab = Rect { x, y: 0, width: title, height: 1 };
        x += title + 2;
        (view, tab)
    };
    View::ALL.into_iter().enumerate().map(tab).collect()
}

fn traffic(app: &App, is_zoomed: bool, regions: &mut Regions) {
    let body = regions.body;
    if is_zoomed {
        match app.traffic.pane {
            Pane::List => regions.list = Some(body),
            Pane::Tree | Pane::Hex => detail(app, body, regions),
        }
        return;
    }
    if body.height < DETAIL_FROM {
        regions.list = Some(body);
        return;
    }
    let wanted = u32::from(body.height) * u32::from(app.traffic.share) / 100;
    let most = body.height - DETAIL_LEAST - 1;
    let height = u16::try_from(wanted).unwrap_or(most).clamp(4, most.max(4));
    regions.list = Some(Rect { height, ..body });
    regions.rule = Some(Rect { y: body.y + height, height: 1, ..body });
    let y = body.y + height + 1;
    detail(app, Rect { y, height: body.bottom().saturating_sub(y), ..body }, regions);
}

fn detail(app: &App, area: Rect, regions: &mut Regions) {
    if area.width < SIDE_BY_SIDE_FROM {
        match app.traffic.pane {
            Pane::Hex => regions.hex = Some(area),
            Pane::List | Pane::Tree => regions.tree = Some(area),
        }
        return;
    }
    let wanted = u32::from(area.width) * u32::from(app.traffic.tree_share) / 100;
    let most = area.width - 40;
    let width = u16::try_from(wanted).unwrap_or(most).clamp(24.min(most), most);
    regions.tree = Some(Rect { width, ..area });
    regions.bar = Some(Rect { x: area.x + width, width: 1, ..area });
    let x = area.x + width + 1;
    regions.hex = Some(Rect { x, width: area.right().saturating_sub(x), ..area });
}
