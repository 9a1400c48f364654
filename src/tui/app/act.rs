//! What actions do wherever one is: views, windows, prompts.

use super::{App, Ask, Dialog, Effect, View, columns};
use crate::report::TimeStyle;
use crate::tui::action::{ACTIONS, Action, Context};
use crate::tui::store::Tone;

impl App {
    /// Tells whether an action works where the UI is.
    pub fn works(&self, context: Context) -> bool {
        match context {
            Context::Everywhere => true,
            Context::Traffic => self.view == View::Traffic,
            Context::Replay => self.replay().is_some(),
            Context::Lists => self.view != View::Health,
        }
    }

    /// Does what was asked for.
    pub(super) fn act(&mut self, action: Action) -> Option<Effect> {
        if !action.entry().is_some_and(|entry| self.works(entry.context)) {
            return None;
        }
        if let Some(dialog) = self.dialog
            && self.act_in_dialog(dialog, action)
        {
            return None;
        }
        if let Some(effect) = self.replay_order(action) {
            return Some(effect);
        }
        match action {
            Action::Quit => return (!self.asks_to_keep_notes()).then_some(Effect::Quit),
            Action::Suspend => return Some(Effect::Suspend),
            Action::Redraw => return Some(Effect::Redraw),
            Action::Mouse => {
                self.has_mouse = !self.has_mouse;
                self.say(Tone::Info, if self.has_mouse { "mouse on" } else { "mouse left to the terminal" });
                return Some(Effect::Mouse(self.has_mouse));
            }
            Action::Record if self.is_live => return Some(Effect::Record(self.recording.is_none())),
            Action::Record => self.say(Tone::Info, "this is a recording already"),
            Action::Traffic => self.show(View::Traffic),
            Action::Devices => self.show(View::Devices),
            Action::Health => self.show(View::Health),
            Action::Findings => self.show(View::Findings),
            Action::NextView => self.show_next(1),
            Action::PreviousView => self.show_next(View::ALL.len() - 1),
            Action::Help => self.dialog = Some(Dialog::Help(0)),
            Action::Messages => self.dialog = Some(Dialog::Messages(0)),
            Action::Columns => self.dialog = Some(Dialog::Columns(0)),
            Action::Freeze => self.set_frozen(!self.is_frozen),
            Action::TimeStyle => self.turn_time_style(),
            Action::Filter => self.ask(Ask::Filter),
            Action::Break => self.ask(Ask::Break),
            Action::Search => self.ask(Ask::Search),
            Action::Note => self.ask(Ask::Note),
            Action::GoToTime => self.ask(Ask::Time),
            Action::Export => self.ask(Ask::Export),
            Action::SearchNext | Action::SearchPrevious => {
                return self.search_again(action == Action::SearchNext);
            }
            Action::ClearFilter => self.set_filter(None),
            Action::FilterSelected => self.filter_selected(),
            Action::CopyRow | Action::CopyHex | Action::CopyJson => return self.copy(action),
            _ => match self.view {
                View::Traffic => self.act_in_traffic(action),
                View::Devices => self.act_in_devices(action),
                View::Health => self.act_in_health(action),
                View::Findings => self.act_in_findings(action),
            },
        }
        None
    }

    /// Shows a view.
    pub fn show(&mut self, view: View) {
        if self.view == view && view == View::Devices {
            self.devices.page = None;
        }
        self.view = view;
        self.dialog = None;
    }

    fn show_next(&mut self, by: usize) {
        let at = View::ALL.iter().position(|view| *view == self.view).unwrap_or(0);
        self.show(View::ALL[(at + by) % View::ALL.len()]); // below its length
    }

    fn turn_time_style(&mut self) {
        let (style, name) = match self.time {
            TimeStyle::Local => (TimeStyle::Utc, "universal time"),
            TimeStyle::Utc => (TimeStyle::Relative, "seconds since the first byte"),
            TimeStyle::Relative => (TimeStyle::Local, "local time"),
        };
        self.time = style;
        self.say(Tone::Info, name);
    }

    /// Tells whether a window takes the action for itself.
    fn act_in_dialog(&mut self, dialog: Dialog, action: Action) -> bool {
        let (Dialog::Help(at) | Dialog::Columns(at) | Dialog::Messages(at)) = dialog;
        let most = match dialog {
            Dialog::Help(_) => ACTIONS.len(),
            Dialog::Columns(_) => columns::Column::ALL.len() - 1,
            Dialog::Messages(_) => self.messages.len().saturating_sub(1),
        };
        let to = match action {
            Action::Up => at.saturating_sub(1),
            Action::Down => at + 1,
            Action::PageUp => at.saturating_sub(10),
            Action::PageDown => at + 10,
            Action::Top => 0,
            Action::Bottom => most,
            Action::Open | Action::Freeze | Action::Sort => {
                if let (Dialog::Columns(at), Some(column)) = (dialog, columns::Column::ALL.get(at)) {
                    self.dialog = Some(Dialog::Columns(at));
                    match action {
                        Action::Sort => self.sort_by(Some(*column)),
                        _ => self.traffic.columns.toggle(*column),
                    }
                } else {
                    self.dialog = None;
                }
                return true;
            }
            Action::Back | Action::Quit | Action::Help | Action::Columns | Action::Messages => {
                self.dialog = None;
                return true;
            }
            _ => {
                self.dialog = None;
                return false;
            }
        };
        let to = to.min(most);
        self.dialog = Some(match dialog {
            Dialog::Help(_) => Dialog::Help(to),
            Dialog::Columns(_) => Dialog::Columns(to),
            Dialog::Messages(_) => Dialog::Messages(to),
        });
        true
    }

    /// Sorts the traffic by a column; by the same again the other way round, and then not at all.
    pub fn sort_by(&mut self, column: Option<columns::Column>) {
        let traffic = &mut self.traffic;
        traffic.sorted_by = match (column, traffic.sorted_by) {
            (Some(column), Some((before, false))) if before == column => Some((column, true)),
            (Some(column), Some((before, true))) if before == column => None,
            (column, _) => column.map(|column| (column, false)),
        };
        traffic.order.sort(&self.store, traffic.sorted_by);
        traffic.is_following = false;
        if traffic.sorted_by.is_some() && self.is_live {
            self.say(Tone::Info, "sorted as of now; following lists rows as they come again");
        }
    }
}
