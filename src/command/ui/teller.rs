//! What the threads of a session tell the screen.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

use crossterm::event::Event;

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
    /// This file is being written, or none any more.
    Recording(Option<PathBuf>),
    /// The session has ended.
    Ended,
}

/// Tells the screen; never waits for it.
#[derive(Clone, Debug)]
pub(in crate::command) struct Teller {
    words: Sender<Word>,
    /// The latest store, until the screen takes it: one place, so that a screen that stalls costs no memory.
    latest: Arc<Mutex<Option<Store>>>,
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

    /// Shows a store.
    pub(in crate::command) fn show(&self, store: Store) {
        let before = self.latest.lock().unwrap_or_else(PoisonError::into_inner).replace(store);
        if before.is_none() {
            self.tell(Word::Grown);
        }
    }

    /// Takes the latest store.
    pub(in crate::command) fn take(&self) -> Option<Store> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}
