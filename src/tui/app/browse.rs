//! What actions do in the views: going through rows, fields, bytes, buses and findings.

use super::traffic::Pane;
use super::{App, View, columns};
use crate::time::Timestamp;
use crate::tui::action::Action;
use crate::tui::layout;
use crate::tui::store::{List, Tone};

impl App {
    pub(super) fn act_in_traffic(&mut self, action: Action) {
        match self.traffic.pane {
            Pane::List => self.act_in_list(action),
            Pane::Tree | Pane::Hex => self.act_in_detail(action),
        }
    }

    /// Does what works in every pane of the traffic view; tells whether it was that.
    fn act_in_every_pane(&mut self, action: Action) -> bool {
        let height = self.regions().rows();
        match action {
            Action::NextPane | Action::PreviousPane => self.next_pane(action == Action::NextPane),
            Action::Zoom => self.traffic.is_zoomed = !self.traffic.is_zoomed,
            Action::Grow => self.traffic.share = (self.traffic.share + 5).min(90),
            Action::Shrink => self.traffic.share = self.traffic.share.saturating_sub(5).max(20),
            Action::Follow => self.traffic.follow(&self.store, height),
            Action::Frames => self.traffic.toggle_frames(&self.store, self.filter.as_ref(), height),
            Action::Mark => self.toggle_mark(),
            Action::Sort => {
                let next = match self.traffic.sorted_by {
                    Some((column, _)) => Some(column),
                    None => Some(columns::Column::Latency),
                };
                self.sort_by(next);
            }
            Action::Partner => self.go_to_partner(),
            Action::NextError | Action::PreviousError => {
                self.go_to("row with trouble", action == Action::NextError, |_, _, row| {
                    row.tone() >= Tone::Warn
                });
            }
            Action::NextFinding | Action::PreviousFinding => {
                let is_forward = action == Action::NextFinding;
                self.go_to("row with a finding", is_forward, |app, _, row| {
                    app.store.findings().of_row(row).next().is_some()
                });
            }
            Action::NextMark | Action::PreviousMark => self.go_to_remark(action == Action::NextMark),
            _ => return false,
        }
        true
    }

    fn act_in_list(&mut self, action: Action) {
        let height = self.regions().rows();
        let page = isize::try_from(height.saturating_sub(1).max(1)).unwrap_or(1);
        let has_room = layout::has_room_for_detail(self);
        let (traffic, store) = (&mut self.traffic, &self.store);
        match action {
            Action::Up => traffic.step(store, -1, height),
            Action::Down => traffic.step(store, 1, height),
            Action::PageUp => traffic.step(store, -page, height),
            Action::PageDown => traffic.step(store, page, height),
            Action::Top => {
                traffic.go(store, 0, height);
                if store.list(traffic.list).first_kept() > 0 {
                    self.say(Tone::Info, "older rows have left memory; the recording has them");
                }
            }
            Action::Bottom => traffic.follow(store, height),
            Action::Open => {
                traffic.pane = Pane::Tree;
                traffic.is_zoomed = traffic.is_zoomed || !has_room;
            }
            Action::Back => {
                traffic.is_zoomed = false;
                if self.messages.last().is_some() {
                    // What was said has been read.
                    self.messages.iter_mut().for_each(|(time, _, _)| *time = Some(Timestamp::MIN));
                }
            }
            _ => drop(self.act_in_every_pane(action)),
        }
    }

    fn act_in_detail(&mut self, action: Action) {
        let detail = self.traffic.detail(&self.store);
        let bytes = detail.bytes().count();
        let is_hex = self.traffic.pane == Pane::Hex;
        let (at, count) =
            if is_hex { (self.traffic.byte, bytes) } else { (self.traffic.node, detail.nodes.len()) };
        let line = if is_hex { self.regions().bytes_in_line() } else { 1 };
        let to = match action {
            Action::Up => at.saturating_sub(line),
            Action::Down => at.saturating_add(line),
            Action::PageUp => at.saturating_sub(8 * line),
            Action::PageDown => at.saturating_add(8 * line),
            Action::Left if is_hex => at.saturating_sub(1),
            Action::Right if is_hex => at.saturating_add(1),
            Action::Top => 0,
            Action::Bottom => count,
            Action::Back => {
                self.traffic.pane = Pane::List;
                self.traffic.is_zoomed = false;
                return;
            }
            Action::Open => return self.go_to_partner(),
            _ => {
                self.act_in_every_pane(action);
                return;
            }
        };
        let to = to.min(count.saturating_sub(1));
        match self.traffic.pane {
            Pane::Hex => self.traffic.byte = to,
            _ => self.traffic.node = to,
        }
        self.traffic.match_panes(&detail);
    }

    fn next_pane(&mut self, is_forward: bool) {
        let panes = [Pane::List, Pane::Tree, Pane::Hex];
        let at = panes.iter().position(|pane| *pane == self.traffic.pane).unwrap_or(0);
        let step = if is_forward { 1 } else { panes.len() - 1 };
        self.traffic.pane = panes[(at + step) % panes.len()]; // below its length
        if self.traffic.pane != Pane::List && !layout::has_room_for_detail(self) {
            self.traffic.is_zoomed = true;
        } else if self.traffic.pane == Pane::List {
            self.traffic.is_zoomed = false;
        }
        let detail = self.traffic.detail(&self.store);
        self.traffic.match_panes(&detail);
    }

    pub(super) fn act_in_health(&mut self, action: Action) {
        let count = self.store.buses().len().max(1);
        match action {
            Action::Left => self.bus = (self.bus + count - 1) % count,
            Action::Right => self.bus = (self.bus + 1) % count,
            Action::Up => self.health_from = self.health_from.saturating_sub(1),
            Action::Down => self.health_from = self.health_from.saturating_add(1),
            Action::PageUp => self.health_from = self.health_from.saturating_sub(10),
            Action::PageDown => self.health_from = self.health_from.saturating_add(10),
            Action::Top => self.health_from = 0,
            Action::Bottom => self.health_from = u16::MAX,
            Action::Zoom => self.turn_span(),
            _ => {}
        }
    }

    /// Draws series over another span.
    pub(super) fn turn_span(&mut self) {
        let spans = [60, 600, 3600, 86_400, 0];
        let at = spans.iter().position(|span| *span == self.span_s).unwrap_or(0);
        self.span_s = spans[(at + 1) % spans.len()]; // below its length
    }

    pub(super) fn act_in_findings(&mut self, action: Action) {
        let last = self.store.findings().list().len().saturating_sub(1);
        match action {
            Action::Up => self.finding = self.finding.saturating_sub(1),
            Action::Down => self.finding = (self.finding + 1).min(last),
            Action::PageUp => self.finding = self.finding.saturating_sub(10),
            Action::PageDown => self.finding = (self.finding + 10).min(last),
            Action::Top => self.finding = 0,
            Action::Bottom => self.finding = last,
            Action::Open => self.open_finding(),
            Action::Back => self.view = View::Traffic,
            _ => {}
        }
    }

    /// Shows the last frame of the selected finding.
    fn open_finding(&mut self) {
        let Some(found) = self.store.findings().list().get(self.finding) else { return };
        let finding = &found.finding;
        let frame = finding.frames.last().and_then(|id| self.store.frame_row(*id));
        let Some(number) = frame else {
            let text =
                format!("the frames of {} have left memory; the recording has them", finding.rule.code);
            return self.say(Tone::Warn, text);
        };
        self.view = View::Traffic;
        self.traffic.is_following = false;
        if self.traffic.list != List::Frames {
            self.traffic.list = List::Frames;
        }
        self.filter = None;
        self.traffic.reset(&self.store, None);
        let height = self.regions().rows();
        self.traffic.select(&self.store, number, height);
    }
}
