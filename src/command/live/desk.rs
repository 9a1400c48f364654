//! What somebody at the screen can tell a live session to do: start and stop recording, keep a note.

use std::sync::mpsc::Receiver;
use std::thread::JoinHandle;

use super::engine::Engine;
use super::writer::{Outcome, Told};
use super::{Recording, Taping, tape};
use crate::capture::mcap::Anchor;
use crate::command::message;
use crate::command::ui::{Teller, Word};
use crate::report::words::Labels;
use crate::time::Timestamp;

/// Is what the engine can be told from the screen.
#[derive(Debug)]
pub(in crate::command) enum Request {
    /// Start recording, or stop.
    Record(bool),
    /// Keep a note, at a time of the traffic.
    Note(Option<Timestamp>, String),
}

/// Is the screen of a live session.
pub(in crate::command) struct Screen {
    pub(in crate::command) teller: Teller,
    pub(in crate::command) labels: Labels,
    pub(in crate::command) requests: Receiver<Request>,
    /// Says how to record when that is asked for.
    pub(in crate::command) recording: Box<dyn Fn() -> Recording + Send>,
}

/// Does what the screen asks for.
pub(super) struct Desk {
    screen: Screen,
    anchor: Anchor,
    is_patient: bool,
    /// The writers of recordings that were begun here.
    pub(super) writers: Vec<JoinHandle<Outcome>>,
}

impl Desk {
    pub(super) fn new(screen: Screen, anchor: Anchor, is_patient: bool) -> Self {
        Desk { screen, anchor, is_patient, writers: Vec::new() }
    }

    /// Does what was asked for; `told` is what the writer of the recording under way tells.
    pub(super) fn serve(&mut self, engine: &mut Engine<'_>, told: &mut Option<Receiver<Told>>) {
        while let Ok(request) = self.screen.requests.try_recv() {
            match request {
                Request::Note(time, text) => {
                    if !engine.note(time, &text) {
                        message::warning("the note is on the screen only: nothing is recorded");
                    }
                }
                Request::Record(true) if engine.stage.tape.is_none() => self.start(engine, told),
                Request::Record(true) => {}
                Request::Record(false) => {
                    if let Some(tape) = engine.stage.tape.take() {
                        tape.finish();
                        message::note("the recording is finished");
                    }
                    self.screen.teller.tell(Word::Recording(None));
                }
            }
        }
    }

    fn start(&mut self, engine: &mut Engine<'_>, told: &mut Option<Receiver<Told>>) {
        match tape((self.screen.recording)(), self.anchor, engine.stage.now, self.is_patient, None) {
            Ok(Taping { tape, told: new, writer }) => {
                engine.record(tape);
                *told = Some(new);
                self.writers.push(writer);
            }
            Err(failure) => failure.say(),
        }
    }
}

impl Outcome {
    /// Adds what became of another recording of the session.
    pub(super) fn and(mut self, other: Outcome) -> Outcome {
        self.files.extend(other.files);
        self.lost = self.lost.saturating_add(other.lost);
        self.error = self.error.or(other.error);
        self.is_short |= other.is_short;
        self
    }
}
