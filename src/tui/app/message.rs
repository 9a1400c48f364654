//! What the UI is told, and what it wants done.

use super::replay::{Order, Replay};
use crossterm::event::{KeyEvent, MouseEvent};

use crate::analyze::filter::{Filter, Vocabulary};
use crate::report::TimeStyle;
use crate::time::Timestamp;
use crate::tui::action::Action;
use crate::tui::keymap::Keymap;
use crate::tui::store::{Store, Tone};
use crate::tui::theme::ThemeKind;

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
    /// These marks and notes, at times of the traffic, are in a file now.
    Kept(Vec<(Timestamp, String)>),
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
        /// What was marked and noted, at times of the traffic.
        notes: Vec<(Timestamp, String)>,
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
    /// The parts of it before this file, in order.
    pub earlier: Vec<String>,
}

impl Recording {
    /// Goes on in another file.
    pub fn go_on(&mut self, file: String) {
        if file != self.file {
            self.earlier.push(std::mem::replace(&mut self.file, file));
        }
    }
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
