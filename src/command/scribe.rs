//! Writes a recording in MCAP: bytes as they come, and beside them what they decode to.

use std::path::{Path, PathBuf};

use super::failure::Failure;
use super::journal::Journal;
use super::session::{Origin, Sink};
use crate::capture::Item;
use crate::capture::mcap::{Options, RecordError};
use crate::pipeline::Event;
use crate::report::mcap::{Message, Messages};
use crate::report::redact::REMARK_KEY;
use crate::report::{Judge, Passing};

/// Writes what a session receives and decodes.
pub(super) struct Scribe {
    journal: Journal,
    decoded: Decoded,
    passing: Passing,
    /// What is said about each bus.
    remark: Option<String>,
    trouble: Option<RecordError>,
}

/// Makes the messages of several buses.
#[derive(Default)]
pub(super) struct Decoded(Vec<(String, Messages)>);

impl Decoded {
    /// Begins a bus that is not known yet.
    pub(super) fn begin(&mut self, bus: &str) {
        if self.0.iter().all(|(known, _)| known != bus) {
            self.0.push((bus.to_owned(), Messages::new(bus)));
        }
    }

    /// Returns the message of an event, if it has one.
    pub(super) fn event(&mut self, bus: &str, event: &Event<'_>) -> Option<Message> {
        let (_, messages) = self.0.iter_mut().find(|(known, _)| known == bus)?;
        messages.event(event)
    }
}

impl Scribe {
    /// Begins a recording at `path`.
    pub(super) fn create(path: &Path, options: Options) -> Result<Self, Failure> {
        Ok(Scribe {
            journal: Journal::create(path, options)?,
            decoded: Decoded::default(),
            passing: Passing::new(None),
            remark: None,
            trouble: None,
        })
    }

    /// Leaves out of what the bytes decode to whatever does not pass.
    pub(super) fn with_filter(mut self, judge: Judge) -> Self {
        self.passing = Passing::new(Some(judge));
        self
    }

    /// Says something about each bus beside its settings.
    pub(super) fn with_remark(mut self, remark: String) -> Self {
        self.remark = Some(remark);
        self
    }

    /// Ends the recording; returns the files it is in.
    pub(super) fn finish(self) -> Result<Vec<PathBuf>, Failure> {
        match self.trouble {
            Some(trouble) => Err(trouble.into()),
            None => Ok(self.journal.finish("finished")?),
        }
    }

    /// Returns of how many transactions none passed the filter, nor anything else; `None` when something did.
    pub(super) fn none_of(&self) -> Option<u64> {
        self.passing.none_of()
    }

    /// Tells whether a bus was begun.
    pub(super) fn has_begun(&self) -> bool {
        self.journal.has_begun()
    }

    /// Gives the recording up, and leaves nothing behind.
    pub(super) fn abandon(self) {
        self.journal.abandon();
    }
}

/// Adds to what an earlier export said about its file.
fn add_remark(said: &mut String, remark: &str) {
    if said.is_empty() {
        remark.clone_into(said);
    } else if !said.contains(remark) {
        *said = format!("{said}; {remark}");
    }
}

impl Sink for Scribe {
    const RECEIVES: bool = true;

    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        let mut settings = origin.settings.clone();
        if let Some(remark) = &self.remark {
            add_remark(settings.facts.entry(REMARK_KEY.to_owned()).or_default(), remark);
        }
        self.decoded.begin(&settings.name);
        Ok(self.journal.begin(settings)?)
    }

    fn received(&mut self, item: &Item<'_>) -> Result<(), Failure> {
        Ok(self.journal.item(item)?)
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        let message = self.decoded.event(bus, event);
        if self.passing.passes(bus, event)
            && let Some(message) = message
        {
            let written = self.journal.message(&message);
            self.trouble = self.trouble.take().or(written.err());
        }
    }

    fn pause(&mut self, _settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        self.trouble.take().map_or(Ok(()), |trouble| Err(trouble.into()))
    }
}
