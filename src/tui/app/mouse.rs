//! What the mouse does: select, scroll, choose tabs, move splitters.

use crossterm::event::{MouseButton, MouseEvent, MouseEventKind};
use ratatui::layout::{Position, Rect};

use super::prompt::Ask;
use super::traffic::Pane;
use super::{App, Effect, View};

/// How many rows a turn of the wheel moves.
const WHEEL: isize = 3;

/// Names what is dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Drag {
    /// The line between rows and detail.
    Rule,
    /// The line between fields and bytes.
    Bar,
}

impl App {
    pub(super) fn mouse(&mut self, event: MouseEvent) -> Option<Effect> {
        if !self.has_mouse {
            return None;
        }
        let at = Position { x: event.column, y: event.row };
        if let MouseEventKind::Down(MouseButton::Left) | MouseEventKind::Drag(MouseButton::Left) = event.kind
        {
            let is_press = matches!(event.kind, MouseEventKind::Down(_));
            if let Some(effect) = self.seek_by_mouse(at, is_press) {
                return Some(effect);
            }
        }
        match event.kind {
            MouseEventKind::Down(MouseButton::Left) => self.press(at),
            MouseEventKind::Drag(MouseButton::Left) => self.drag(at),
            MouseEventKind::Up(_) => {
                self.dragged = None;
                self.release_playhead();
            }
            MouseEventKind::ScrollUp => self.wheel(at, -WHEEL),
            MouseEventKind::ScrollDown => self.wheel(at, WHEEL),
            _ => {}
        }
        None
    }

    fn press(&mut self, at: Position) {
        if self.dialog.take().is_some() {
            return;
        }
        let regions = self.regions();
        let is_in = |area: &Option<Rect>| area.is_some_and(|area| area.contains(at));
        if let Some((view, _)) = regions.tabs.iter().find(|(_, tab)| tab.contains(at)) {
            self.show(*view);
        } else if is_in(&regions.line) && self.prompt.is_none() {
            self.ask(Ask::Filter);
        } else if is_in(&regions.rule) {
            self.dragged = Some(Drag::Rule);
        } else if is_in(&regions.bar) {
            self.dragged = Some(Drag::Bar);
        } else if let Some(list) = regions.list.filter(|list| list.contains(at)) {
            self.traffic.pane = Pane::List;
            if let Some(line) = at.y.checked_sub(list.y + 1) {
                let place = self.traffic.top(&self.store).saturating_add(usize::from(line));
                if place < self.traffic.order.len(&self.store) {
                    self.traffic.go(&self.store, place, regions.rows());
                }
            }
        } else if let Some(tree) = regions.tree.filter(|tree| tree.contains(at)) {
            self.traffic.pane = Pane::Tree;
            let detail = self.traffic.detail(&self.store);
            let top = crate::tui::view::first_node(self.traffic.node, detail.nodes.len(), tree.height);
            self.traffic.node = (top + usize::from(at.y - tree.y)).min(detail.nodes.len().saturating_sub(1));
            self.traffic.match_panes(&detail);
        } else if let Some(hex) = regions.hex.filter(|hex| hex.contains(at)) {
            self.traffic.pane = Pane::Hex;
            let detail = self.traffic.detail(&self.store);
            let byte = crate::tui::view::byte_at(&detail, self.traffic.byte, hex, at);
            self.traffic.byte = byte.unwrap_or(self.traffic.byte);
            self.traffic.match_panes(&detail);
        } else if regions.body.contains(at) {
            self.press_in_table(usize::from(at.y - regions.body.y));
        }
    }

    /// Selects the line of a table, below its heading.
    fn press_in_table(&mut self, line: usize) {
        let Some(row) = line.checked_sub(1) else { return };
        match self.view {
            View::Devices if self.devices.page.is_none() => {
                let height = usize::from(self.regions().body.height.saturating_sub(1));
                let devices = self.devices.list(&self.store);
                let selected = devices.iter().position(|device| Some(device.key()) == self.devices.selected);
                let top = crate::tui::view::first_row(selected.unwrap_or(0), devices.len(), height);
                let key = devices.get(top + row).map(|device| device.key());
                self.devices.selected = key.or(self.devices.selected);
            }
            View::Findings => {
                let count = self.store.findings().list().len();
                let (height, _) = crate::tui::view::finding_heights(self.regions().body.height);
                let top = crate::tui::view::first_row(self.finding, count, usize::from(height));
                if top + row < count && row < usize::from(height) {
                    self.finding = top + row;
                }
            }
            _ => {}
        }
    }

    fn drag(&mut self, at: Position) {
        let body = self.regions().body;
        let percent = |part: u16, whole: u16| {
            u16::try_from(u32::from(part) * 100 / u32::from(whole.max(1))).unwrap_or(100)
        };
        match self.dragged {
            Some(Drag::Rule) => {
                self.traffic.share = percent(at.y.saturating_sub(body.y), body.height).clamp(20, 90);
            }
            Some(Drag::Bar) => self.traffic.tree_share = percent(at.x, body.width).clamp(20, 80),
            None => {}
        }
    }

    fn wheel(&mut self, at: Position, by: isize) {
        let regions = self.regions();
        let is_detail = [regions.tree, regions.hex].into_iter().flatten().any(|area| area.contains(at));
        let action = if by < 0 { super::Action::Up } else { super::Action::Down };
        if self.view == View::Traffic && !is_detail && self.dialog.is_none() {
            return self.traffic.step(&self.store, by, regions.rows());
        }
        let pane = self.traffic.pane;
        if is_detail && pane == Pane::List {
            self.traffic.pane = Pane::Tree;
        }
        for _ in 0..by.unsigned_abs() {
            self.act(action);
        }
        self.traffic.pane = pane;
    }
}
