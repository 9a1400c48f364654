//! Writes a recording in MCAP: bytes as they come, and beside them what they decode to.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::failure::Failure;
use super::session::{Origin, Sink};
use crate::capture::Item;
use crate::capture::mcap::{BusId, ChannelId, Options, RecordError, Recorder, Schema};
use crate::pipeline::Event;
use crate::report::mcap::{Message, Messages};
use crate::report::{Judge, Passing};

/// Writes what a session receives and decodes.
pub(super) struct Scribe {
    recorder: Recorder,
    buses: Vec<Bus>,
    channels: HashMap<String, ChannelId>,
    passing: Passing,
    /// What is said about each bus.
    remark: Option<String>,
    trouble: Option<RecordError>,
}

struct Bus {
    name: String,
    id: BusId,
    messages: Messages,
}

impl Scribe {
    /// Begins a recording at `path`.
    pub(super) fn create(path: &Path, options: Options) -> Result<Self, Failure> {
        let recorder = Recorder::create(path, options)?;
        Ok(Scribe {
            recorder,
            buses: Vec::new(),
            channels: HashMap::new(),
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
            None => Ok(self.recorder.finish("finished")?),
        }
    }

    /// Tells whether a bus was begun.
    pub(super) fn has_begun(&self) -> bool {
        !self.buses.is_empty()
    }

    /// Gives the recording up, and leaves nothing behind.
    pub(super) fn abandon(self) {
        let path = self.recorder.current().map(Path::to_owned);
        drop(self.recorder);
        // It holds nothing; that it cannot be removed changes nothing.
        let _ = path.map(std::fs::remove_file);
    }

    fn write(&mut self, message: &Message) -> Result<(), RecordError> {
        let channel = match self.channels.get(&message.topic) {
            Some(channel) => *channel,
            None => {
                let schema = Schema { name: message.schema, descriptors: message.descriptors };
                let channel = self.recorder.channel(&message.topic, schema, message.metadata.clone());
                self.channels.insert(message.topic.clone(), channel);
                channel
            }
        };
        self.recorder.write_message(channel, message.time, &message.payload)
    }
}

impl Sink for Scribe {
    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        let mut settings = origin.settings.clone();
        settings.facts.extend(self.remark.iter().map(|remark| ("remark".to_owned(), remark.clone())));
        match self.buses.iter().find(|bus| bus.name == settings.name) {
            Some(bus) => self.recorder.set_line(bus.id, settings)?,
            None => {
                let name = settings.name.clone();
                let id = self.recorder.add_bus(settings)?;
                self.buses.push(Bus { messages: Messages::new(&name), name, id });
            }
        }
        Ok(())
    }

    fn received(&mut self, item: &Item<'_>) -> Result<(), Failure> {
        let id = |bus: &str| self.buses.iter().find(|known| known.name == bus).map(|known| known.id);
        match item {
            Item::Chunk { bus, chunk, ready } => {
                if let Some(id) = id(bus) {
                    self.recorder.write_chunk(id, chunk, *ready)?;
                }
            }
            Item::Lost { bus, lost } => {
                if let Some(id) = id(bus) {
                    self.recorder.write_lost(id, lost)?;
                }
            }
            Item::Line { .. } => {}
        }
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        let known = self.buses.iter_mut().find(|known| known.name == bus);
        let message = known.and_then(|bus| bus.messages.event(event));
        if self.passing.passes(bus, event)
            && let Some(message) = message
        {
            let written = self.write(&message);
            self.trouble = self.trouble.take().or(written.err());
        }
    }

    fn pause(&mut self, _settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        self.trouble.take().map_or(Ok(()), |trouble| Err(trouble.into()))
    }
}
