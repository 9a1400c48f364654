//! The state of the UI, and how it changes: keys, mouse, time and new traffic in, effects out.

pub mod columns;
pub mod detail;
mod devices;
mod mouse;
pub mod order;
pub mod prompt;
mod records;
pub mod replay;
mod search;
pub mod traffic;

use crossterm::event::{KeyEvent, MouseEvent};

use super::action::{Action, Context};
use super::keymap::{Key, Keymap};
use super::layout::{self, Regions};
use super::store::{List, RowSubject, Store, Tone};
use super::theme::{Theme, ThemeKind};
use crate::analyze::filter::{Filter, Vocabulary};
use crate::report::{Clock, TimeStyle};
use crate::time::{SECOND, Timestamp};
pub use devices::{DeviceSort, DevicesState, PageItem};
use prompt::{Ask, Prompt, Typed};
use replay::{Deck, Order, Replay};
use traffic::{Pane, Traffic};

/// How long a message stays in the footer, in nanoseconds.
const SAID_FOR: i64 = 6 * SECOND;
/// How many messages are kept.
const MOST_MESSAGES: usize = 500;

/// Names the views.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// Rows as they come.
    #[default]
    Traffic,
    /// A row an address.
    Devices,
    /// How the bus is.
    Health,
    /// What is wrong with the traffic.
    Findings,
}

impl View {
    /// Lists the views in the order of their tabs.
    pub const ALL: [View; 4] = [View::Traffic, View::Devices, View::Health, View::Findings];

    /// Returns what its tab says.
    pub fn title(self) -> &'static str {
        match self {
            View::Traffic => "Traffic",
            View::Devices => "Devices",
            View::Health => "Health",
            View::Findings => "Findings",
        }
    }
}

/// Is what the UI is told.
#[derive(Clone, Debug)]
pub enum Message {
    /// Do this.
    Act(Action),
    /// A key was pressed.
    Key(KeyEvent),
    /// A text was pasted.
    Paste(String),
    /// The mouse did something.
    Mouse(MouseEvent),
    /// The terminal has so many columns and lines.
    Resize(u16, u16),
    /// It is now, by the clock of this machine.
    Tick(Timestamp),
    /// Traffic went on.
    Grown(Store),
    /// The traffic is another, or seen at another time: nothing follows from what was shown before.
    Replaced(Store),
    /// People should know this.
    Said(Tone, String),
    /// The recording under way, if there is one.
    Recording(Option<Recording>),
    /// How the replay goes.
    Replay(Replay),
}

/// Is what is to be done outside.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// End.
    Quit,
    /// Stop until the shell brings it back.
    Suspend,
    /// Draw every cell anew.
    Redraw,
    /// Put a text on the clipboard.
    Copy(String),
    /// Keep a note in the recording, at a time of the traffic.
    Note(Option<Timestamp>, String),
    /// Start recording, or stop.
    Record(bool),
    /// Write what passes a filter to a file.
    Export {
        /// The filter; without it all passes.
        filter: Option<String>,
        /// The file.
        path: String,
    },
    /// Take the mouse, or leave it to the terminal.
    Mouse(bool),
    /// Go about in the recording that is shown.
    Replay(Order),
}

/// Says how the recording goes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// The file that is written.
    pub file: String,
    /// Since when.
    pub since: Option<Timestamp>,
    /// What is wrong with it.
    pub trouble: Option<String>,
}

/// Is a window over the view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialog {
    /// The keys, from this line on.
    Help(usize),
    /// The columns of the traffic view, with this one selected.
    Columns(usize),
    /// What was said so far, back from the end by so many.
    Messages(usize),
}

/// Is what makes the UI go on what it shows.
#[derive(Clone, Debug)]
pub struct Options {
    /// How things look.
    pub theme: ThemeKind,
    /// Which key does what.
    pub keymap: Keymap,
    /// How times are shown.
    pub time: TimeStyle,
    /// Whether the mouse is used.
    pub mouse: bool,
    /// The filter to begin with.
    pub filter: Option<Filter>,
    /// What is shown as its source, such as a file.
    pub source: String,
    /// Whether the traffic happens now.
    pub is_live: bool,
    /// Whether it is worth a warning that nothing is recorded.
    pub must_record: bool,
    /// Words for filters that depend on the profiles.
    pub vocabulary: Vocabulary,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            theme: ThemeKind::Dark,
            keymap: Keymap::default(),
            time: TimeStyle::Local,
            mouse: true,
            filter: None,
            source: String::new(),
            is_live: true,
            must_record: true,
            vocabulary: Vocabulary::default(),
        }
    }
}

/// Is the state of the UI.
#[derive(Clone, Debug)]
pub struct App {
    store: Store,
    /// What came since the screen was frozen.
    newer: Option<Store>,
    is_frozen: bool,
    size: (u16, u16),
    now: Option<Timestamp>,
    /// How things look.
    pub theme: Theme,
    /// Which key does what.
    pub keymap: Keymap,
    /// What is shown.
    pub view: View,
    /// The traffic view.
    pub traffic: Traffic,
    /// The devices view.
    pub devices: DevicesState,
    /// The bus whose health is shown.
    pub bus: usize,
    /// Over how many seconds series are drawn; 0 over all.
    pub span_s: i64,
    /// The selected finding.
    pub finding: usize,
    /// The filter that rows pass.
    pub filter: Option<Filter>,
    /// What stops the screen.
    pub breaks_on: Option<Filter>,
    /// Up to which row that was looked for.
    break_from: u64,
    /// What is searched for.
    pub search: Option<String>,
    /// The line that is typed.
    pub prompt: Option<Prompt>,
    /// What was typed before, filters and all else.
    history: [Vec<String>; 2],
    /// The window over the view.
    pub dialog: Option<Dialog>,
    /// What was said, with the time, the newest at the end.
    pub messages: Vec<(Option<Timestamp>, Tone, String)>,
    /// The recording under way.
    pub recording: Option<Recording>,
    /// How times are shown.
    pub time: TimeStyle,
    /// Whether the mouse is used.
    pub has_mouse: bool,
    /// What a replay has beside a live session.
    deck: Deck,
    /// What is dragged.
    dragged: Option<mouse::Drag>,
    /// What is shown as the source.
    pub source: String,
    /// Whether the traffic happens now.
    pub is_live: bool,
    /// Whether it is worth a warning that nothing is recorded.
    pub must_record: bool,
    vocabulary: Vocabulary,
}

impl App {
    /// Begins with nothing to show.
    pub fn new(options: Options) -> Self {
        App {
            store: Store::default(),
            newer: None,
            is_frozen: false,
            size: (80, 24),
            now: None,
            theme: Theme::of(options.theme),
            keymap: options.keymap,
            view: View::default(),
            traffic: Traffic::default(),
            devices: DevicesState::default(),
            bus: 0,
            span_s: 60,
            finding: 0,
            filter: options.filter,
            breaks_on: None,
            break_from: 0,
            search: None,
            prompt: None,
            history: [Vec::new(), Vec::new()],
            dialog: None,
            messages: Vec::new(),
            recording: None,
            time: options.time,
            has_mouse: options.mouse,
            deck: Deck::default(),
            dragged: None,
            source: options.source,
            is_live: options.is_live,
            must_record: options.must_record,
            vocabulary: options.vocabulary,
        }
    }

    /// Returns what is shown.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// Returns the newest there is, shown or not.
    pub fn newest(&self) -> &Store {
        self.newer.as_ref().unwrap_or(&self.store)
    }

    /// Tells whether the screen stands still while traffic goes on.
    pub fn is_frozen(&self) -> bool {
        self.is_frozen
    }

    /// Returns columns and lines of the terminal.
    pub fn size(&self) -> (u16, u16) {
        self.size
    }

    /// Returns where things are on the screen.
    pub fn regions(&self) -> Regions {
        layout::regions(self)
    }

    /// Returns what shows times.
    pub fn clock(&self) -> Clock {
        let clock = Clock::new(self.time);
        self.store.begun().map_or(clock, |begun| clock.since(begun))
    }

    /// Returns the time by the clock of this machine.
    pub fn now(&self) -> Option<Timestamp> {
        self.now
    }

    /// Returns the message that is still to be read.
    pub fn said(&self) -> Option<(Tone, &str)> {
        let (time, tone, text) = self.messages.last()?;
        let is_recent = match (time, self.now) {
            (Some(time), Some(now)) => now - *time < SAID_FOR,
            _ => true,
        };
        is_recent.then_some((*tone, text.as_str()))
    }

    /// Returns what was typed before in a kind of line.
    pub fn history(&self, ask: Ask) -> &[String] {
        &self.history[usize::from(!ask.is_filter())] // two kinds
    }

    /// Says something.
    pub fn say(&mut self, tone: Tone, text: impl Into<String>) {
        if self.messages.len() == MOST_MESSAGES {
            self.messages.remove(0);
        }
        self.messages.push((self.now, tone, text.into()));
    }

    /// Takes in a message; returns what is to be done outside.
    pub fn update(&mut self, message: Message) -> Option<Effect> {
        let is_tick = matches!(message, Message::Tick(_));
        let effect = match message {
            Message::Act(action) => self.act(action),
            Message::Key(key) => self.key(key),
            Message::Paste(text) => {
                if let Some(prompt) = &mut self.prompt {
                    prompt.paste(&text, &self.vocabulary);
                }
                None
            }
            Message::Mouse(event) => self.mouse(event),
            Message::Resize(columns, lines) => {
                self.size = (columns, lines);
                None
            }
            Message::Tick(now) => {
                self.now = Some(now);
                None
            }
            Message::Grown(store) => {
                self.grow(store);
                None
            }
            Message::Replaced(store) => {
                self.replace(store);
                None
            }
            Message::Said(tone, text) => {
                self.say(tone, text);
                None
            }
            Message::Recording(recording) => {
                self.recording = recording;
                None
            }
            Message::Replay(replay) => {
                self.set_replay(replay);
                None
            }
        };
        self.settle();
        effect.or_else(|| if is_tick { None } else { self.look() })
    }

    /// Keeps what is selected within what there is.
    fn settle(&mut self) {
        let height = self.regions().rows();
        self.traffic.settle(&self.store, height);
        self.bus = self.bus.min(self.store.buses().len().saturating_sub(1));
        self.finding = self.finding.min(self.store.findings().list().len().saturating_sub(1));
        self.devices.settle(&self.store);
    }

    fn grow(&mut self, store: Store) {
        if self.is_frozen {
            self.newer = Some(store);
            return;
        }
        self.store = store;
        let height = self.regions().rows();
        self.traffic.update(&self.store, self.filter.as_ref(), height);
        self.look_for_break();
    }

    fn replace(&mut self, store: Store) {
        self.store = store;
        self.newer = None;
        self.traffic.is_following = true;
        self.traffic.reset(&self.store, self.filter.as_ref());
        self.break_from = self.store.list(List::Exchanges).total();
    }

    /// Freezes when a row has come that is waited for.
    fn look_for_break(&mut self) {
        let rows = self.store.list(List::Exchanges);
        let from = std::mem::replace(&mut self.break_from, rows.total());
        let Some(filter) = &self.breaks_on else { return };
        let passes = |number: &u64| {
            rows.get(*number).is_some_and(|row| filter.matches(&RowSubject::new(&self.store, row)))
        };
        let Some(number) = (from..rows.total()).find(passes) else { return };
        self.break_from = number + 1;
        self.is_frozen = true;
        self.view = View::Traffic;
        if self.traffic.list == List::Frames {
            self.traffic.list = List::Exchanges;
            self.traffic.reset(&self.store, self.filter.as_ref());
        }
        let height = self.regions().rows();
        self.traffic.select(&self.store, number, height);
        let keys = self.shown_key(Action::Freeze);
        self.say(Tone::Warn, format!("a row has come that was waited for; {keys} goes on"));
    }

    /// Freezes the screen, or shows what came meanwhile.
    pub fn set_frozen(&mut self, is_frozen: bool) {
        self.is_frozen = is_frozen;
        if !is_frozen && let Some(newer) = self.newer.take() {
            self.grow(newer);
        }
    }

    /// Returns the first key of an action as it is shown.
    pub fn shown_key(&self, action: Action) -> String {
        self.keymap.keys(action).first().map_or_else(String::new, |key| key.shown())
    }

    fn key(&mut self, key: KeyEvent) -> Option<Effect> {
        if let Some(mut prompt) = self.prompt.take() {
            let typed =
                prompt.key(key, &self.vocabulary, &self.history[usize::from(!prompt.ask.is_filter())]);
            match typed {
                Typed::More => self.prompt = Some(prompt),
                Typed::Cancelled => {}
                Typed::Done => return self.typed(&prompt),
            }
            return None;
        }
        let action = self.keymap.action(Key::from(key))?;
        self.act(action)
    }

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
    fn act(&mut self, action: Action) -> Option<Effect> {
        if !action.entry().is_some_and(|entry| self.works(entry.context)) {
            return None;
        }
        if let Some(dialog) = self.dialog
            && self.act_in_dialog(dialog, action)
        {
            return None;
        }
        if let Some(order) = self.replay_order(action) {
            return Some(Effect::Replay(order));
        }
        match action {
            Action::Quit => return Some(Effect::Quit),
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
            Dialog::Help(_) => super::action::ACTIONS.len(),
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

    fn act_in_traffic(&mut self, action: Action) {
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
            Action::Mark => {
                self.traffic.toggle_mark();
            }
            Action::Sort => {
                let next = match self.traffic.sorted_by {
                    Some((column, _)) => Some(column),
                    None => Some(columns::Column::Latency),
                };
                self.sort_by(next);
            }
            Action::Partner => self.go_to_partner(),
            Action::SearchNext | Action::SearchPrevious => self.search_again(action == Action::SearchNext),
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
            Action::NextMark | Action::PreviousMark => {
                let is_forward = action == Action::NextMark;
                self.go_to("marked row", is_forward, |app, number, _| app.traffic.is_marked(number));
            }
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

    fn act_in_health(&mut self, action: Action) {
        let count = self.store.buses().len().max(1);
        match action {
            Action::Left | Action::Up => self.bus = (self.bus + count - 1) % count,
            Action::Right | Action::Down => self.bus = (self.bus + 1) % count,
            Action::Zoom => self.turn_span(),
            _ => {}
        }
    }

    /// Draws series over another span.
    fn turn_span(&mut self) {
        let spans = [60, 600, 3600, 86_400, 0];
        let at = spans.iter().position(|span| *span == self.span_s).unwrap_or(0);
        self.span_s = spans[(at + 1) % spans.len()]; // below its length
    }

    fn act_in_findings(&mut self, action: Action) {
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
