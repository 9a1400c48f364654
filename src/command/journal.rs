//! A recording by the names of its buses and topics: items as they were received, and messages beside them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::capture::Item;
use crate::capture::mcap::{BusId, BusSettings, ChannelId, Options, RecordError, Recorder, Schema};
use crate::report::mcap::{Message, note};

/// Writes a recording.
pub(super) struct Journal {
    recorder: Recorder,
    buses: Vec<(String, BusId)>,
    channels: HashMap<String, ChannelId>,
}

impl Journal {
    /// Begins a recording at `path`.
    pub(super) fn create(path: &Path, options: Options) -> Result<Self, RecordError> {
        let recorder = Recorder::create(path, options)?;
        Ok(Journal { recorder, buses: Vec::new(), channels: HashMap::new() })
    }

    /// Begins a bus, or goes on with other settings.
    pub(super) fn begin(&mut self, settings: BusSettings) -> Result<(), RecordError> {
        if let Some(id) = self.id(&settings.name) {
            return self.recorder.set_line(id, settings);
        }
        let name = settings.name.clone();
        let id = self.recorder.add_bus(settings)?;
        self.buses.push((name, id));
        Ok(())
    }

    fn id(&self, bus: &str) -> Option<BusId> {
        self.buses.iter().find(|(name, _)| name == bus).map(|(_, id)| *id)
    }

    /// Tells whether a bus was begun.
    pub(super) fn has_begun(&self) -> bool {
        !self.buses.is_empty()
    }

    /// Writes what was received of a bus that has begun, what the clocks showed, or what was noted.
    pub(super) fn item(&mut self, item: &Item<'_>) -> Result<(), RecordError> {
        if let Item::Clock { monotonic_ns, realtime } = item {
            return self.recorder.write_clock(*monotonic_ns, *realtime);
        }
        if let Item::Note { time, text } = item {
            return self.message(&note(*time, text));
        }
        let Some(id) = item.bus().and_then(|bus| self.id(bus)) else { return Ok(()) };
        match item {
            Item::Chunk { chunk, ready, .. } => self.recorder.write_chunk(id, chunk, *ready),
            Item::Lost { lost, .. } => self.recorder.write_lost(id, lost),
            Item::Silence { until, .. } => self.recorder.write_silence(id, *until),
            Item::Line(_) | Item::Clock { .. } | Item::Note { .. } => Ok(()),
        }
    }

    /// Writes what the bytes decode to.
    pub(super) fn message(&mut self, message: &Message) -> Result<(), RecordError> {
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

    /// Returns what writes the files.
    pub(super) fn recorder(&mut self) -> &mut Recorder {
        &mut self.recorder
    }

    /// Ends the recording; returns the files it is in.
    pub(super) fn finish(self, reason: &str) -> Result<Vec<PathBuf>, RecordError> {
        self.recorder.finish(reason)
    }

    /// Gives the recording up, and leaves nothing behind of its latest file.
    pub(super) fn abandon(self) {
        let path = self.recorder.current().map(Path::to_owned);
        drop(self.recorder);
        // It holds nothing; that it cannot be removed changes nothing.
        let _ = path.map(std::fs::remove_file);
    }
}
