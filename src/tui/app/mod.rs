//! The state of the UI, and how it changes: keys, mouse, time and new traffic in, effects out.

mod act;
mod browse;
pub mod columns;
pub mod detail;
mod devices;
mod marks;
mod message;
mod mouse;
pub mod order;
pub mod prompt;
mod records;
pub mod replay;
mod search;
pub mod traffic;

use crossterm::event::KeyEvent;

use super::action::Action;
use super::keymap::{Key, Keymap};
use super::layout::{self, Regions};
use super::store::{List, RowSubject, Store, Tone};
use super::theme::Theme;
use super::view;
use crate::analyze::filter::{Filter, Vocabulary};
use crate::report::{Clock, TimeStyle};
use crate::time::{SECOND, Timestamp};
pub use devices::{DeviceSort, DevicesState, PageItem};
pub use message::{Dialog, Effect, Message, Options, Recording, View};
use prompt::{Ask, Prompt, Typed};
use replay::Deck;
use traffic::Traffic;

/// How long a message stays in the footer, in nanoseconds.
const SAID_FOR: i64 = 6 * SECOND;
/// How many messages are kept.
const MOST_MESSAGES: usize = 500;

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
    /// The first line of the health view that is shown, where not all fit.
    pub health_from: u16,
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
    /// How many messages there were when a key was pressed last.
    seen: usize,
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
            health_from: 0,
            span_s: 60,
            finding: 0,
            filter: options.filter,
            breaks_on: None,
            break_from: 0,
            search: None,
            prompt: None,
            history: [Vec::new(), Vec::new()],
            dialog: None,
            seen: 0,
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
        // Who goes on has read what was no warning.
        let is_new = self.messages.len() > self.seen || *tone >= Tone::Warn;
        (is_recent && is_new).then_some((*tone, text.as_str()))
    }

    /// Returns what was typed before in a kind of line.
    pub fn history(&self, ask: Ask) -> &[String] {
        &self.history[usize::from(!ask.is_filter())] // two kinds
    }

    /// Says something.
    pub fn say(&mut self, tone: Tone, text: impl Into<String>) {
        if self.messages.len() == MOST_MESSAGES {
            self.messages.remove(0);
            self.seen = self.seen.saturating_sub(1);
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
            Message::Kept(remarks) => {
                self.keep_notes(&remarks);
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
        if self.view == View::Health {
            self.health_from = self.health_from.min(view::health_rest(self, self.regions().body));
        }
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
        self.select_awaited();
        self.look_for_break();
    }

    fn replace(&mut self, store: Store) {
        if self.store.known_from().or(store.known_from()).is_some() {
            self.traffic.forget_marks();
        }
        let is_known_now = self.store.known_from().is_some() && store.known_from().is_none();
        let same = match is_known_now && self.store.now() == store.now() {
            // Nobody asked for this: who reads a row goes on reading it.
            true => self.traffic.same_row(&self.store, &store),
            false => None,
        };
        self.store = store;
        self.newer = None;
        self.traffic.reset(&self.store, self.filter.as_ref());
        match same {
            Some(number) => self.traffic.renumber(number),
            None => self.traffic.is_following = true,
        }
        self.select_awaited();
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
        // A recording is paused by its player.
        self.is_frozen = self.deck.replay.is_none();
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
        self.seen = self.messages.len();
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
}
