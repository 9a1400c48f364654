//! What the threads of a session tell the screen.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

use crossterm::event::Event;

use crate::time::Timestamp;
use crate::tui::app::replay::Replay;
use crate::tui::store::{Store, Tone};

/// Is something the screen is told.
#[derive(Debug)]
pub(in crate::command) enum Word {
    /// The terminal: keys, mouse, size.
    Terminal(Event),
    /// The store has grown: take it from the [`Teller`].
    Grown,
    /// Something people should know.
    Said(Tone, String),
    /// These marks and notes are in a file now.
    Kept(Vec<(Timestamp, String)>),
    /// How a replay goes.
    Replay(Box<Replay>),
    /// This file is being written, or none any more.
    Recording(Option<PathBuf>),
    /// Somebody asks the program to stop until it is told to go on.
    Suspend,
    /// The session has ended.
    Ended,
}

/// Tells the screen; never waits for it.
#[derive(Clone, Debug)]
pub(in crate::command) struct Teller {
    words: Sender<Word>,
    /// The latest store, until the screen takes it: one place, so that a screen that stalls costs no memory; and whether
    /// it is another than the one that was shown before.
    latest: Arc<Mutex<Option<(Store, bool)>>>,
}

impl Teller {
    /// Makes a teller, and the end that listens.
    pub(in crate::command) fn new() -> (Teller, Receiver<Word>) {
        let (words, heard) = channel();
        (Teller { words, latest: Arc::default() }, heard)
    }

    /// Tells something; that nobody listens any more is no reason to stop.
    pub(in crate::command) fn tell(&self, word: Word) {
        let _ = self.words.send(word);
    }

    /// Tells whether the last store was taken.
    pub(in crate::command) fn is_taken(&self) -> bool {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).is_none()
    }

    /// Shows a store that has grown.
    pub(in crate::command) fn show(&self, store: Store) {
        self.put(store, false);
    }

    /// Shows another store: nothing follows from what was shown before.
    pub(in crate::command) fn replace(&self, store: Store) {
        self.put(store, true);
    }

    fn put(&self, store: Store, is_other: bool) {
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        let before = latest.take();
        let was_other = before.as_ref().is_some_and(|(_, was_other)| *was_other);
        *latest = Some((store, is_other || was_other));
        if before.is_none() {
            self.tell(Word::Grown);
        }
    }

    /// Takes the latest store, and whether it is another.
    pub(in crate::command) fn take(&self) -> Option<(Store, bool)> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}
