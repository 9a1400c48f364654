//! The engine's side of a recording: gathers what is to be written and hands it to the writer, without waiting.

use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};

use super::entry::Entry;
use super::ring::{Change, Ring};
use crate::capture::Item;
use crate::capture::mcap::BusSettings;
use crate::decode::chunk::{Lost, LostKind, ReadTime};
use crate::report::mcap::Message;
use crate::time::{MILLISECOND, Timestamp};

/// How long entries are gathered, in nanoseconds; the disk is given them once a second.
const GATHER: i64 = 250 * MILLISECOND;
/// How many bytes are gathered.
const GATHERED: usize = 64 * 1024;
/// How many bytes wait for a writer that is not done with those before; beyond, what was received is lost.
const MOST_WAITING: usize = 4 << 20;
/// How many batches the queue to the writer holds.
pub(super) const BATCHES: usize = 32;

/// Is what the writer gets at once.
pub(super) type Batch = Vec<Entry>;

/// Gathers what is to be written.
pub(in crate::command) struct Tape {
    queue: SyncSender<Batch>,
    /// Whether to wait for the writer: the sources can.
    is_patient: bool,
    /// Whether what the bytes decode to is left out.
    raw_only: bool,
    batch: Batch,
    size: usize,
    passed: Timestamp,
    ring: Option<Ring>,
    /// The names of buses, shared by their entries.
    buses: Vec<Arc<str>>,
}

impl Tape {
    /// Makes a tape to a writer; without a ring all is written.
    pub(super) fn new(
        queue: SyncSender<Batch>,
        is_patient: bool,
        raw_only: bool,
        ring: Option<Ring>,
    ) -> Self {
        let (batch, buses) = (Vec::new(), Vec::new());
        Tape { queue, is_patient, raw_only, batch, size: 0, passed: Timestamp::MIN, ring, buses }
    }

    fn bus(&mut self, name: &str) -> Arc<str> {
        if let Some(bus) = self.buses.iter().find(|bus| ***bus == *name) {
            return Arc::clone(bus);
        }
        let bus: Arc<str> = name.into();
        self.buses.push(Arc::clone(&bus));
        bus
    }

    /// Takes the settings of a bus; the first ones are written at once.
    pub(in crate::command) fn begin(&mut self, settings: BusSettings) {
        let is_known = self.buses.iter().any(|bus| **bus == *settings.name);
        self.bus(&settings.name);
        let entry = Entry::Begin(settings);
        if is_known { self.push(entry) } else { self.gather(entry) }
    }

    /// Takes what was received.
    pub(in crate::command) fn received(&mut self, item: &Item<'_>) {
        let Some(bus) = item.bus() else { return };
        let bus = self.bus(bus);
        if let Some(entry) = Entry::of(item, bus) {
            self.push(entry);
        }
    }

    /// Tells whether messages are wanted.
    pub(in crate::command) fn wants_messages(&self) -> bool {
        !self.raw_only
    }

    /// Takes what the bytes decode to.
    pub(in crate::command) fn message(&mut self, message: Message) {
        self.push(Entry::Message(Box::new(message)));
    }

    /// Takes what both clocks show.
    pub(in crate::command) fn clock(&mut self, monotonic_ns: u64, realtime: Timestamp) {
        self.push(Entry::Clock { monotonic_ns, realtime });
    }

    /// Takes note of a match: the minutes around it are wanted.
    pub(in crate::command) fn trigger(&mut self, now: Timestamp) {
        let Some(mut ring) = self.ring.take() else { return };
        // What the ring holds is more than may wait; the captures' queue is long enough for writing it.
        let is_patient = std::mem::replace(&mut self.is_patient, true);
        ring.trigger(now, |entry| self.gather(entry));
        self.is_patient = is_patient;
        self.ring = Some(ring);
    }

    /// Takes note of the time, and whether everything received is decided; hands over what was gathered.
    pub(in crate::command) fn pass(&mut self, now: Timestamp, is_settled: bool) {
        if now - self.passed < GATHER && self.size < GATHERED {
            return;
        }
        self.passed = now;
        let mut is_open = true;
        if let Some(mut ring) = self.ring.take() {
            is_open = ring.is_open();
            if ring.pass(now, is_settled, |entry| self.gather(entry)) == Change::Closed {
                self.gather(Entry::Rest);
            }
            self.ring = Some(ring);
        }
        // A tick would date the next file before what is kept in the ring.
        if is_open {
            self.gather(Entry::Tick(now));
        }
        self.hand_over();
    }

    /// Tells, once, that the ring's memory did not suffice.
    pub(in crate::command) fn take_shortage(&mut self) -> bool {
        self.ring.as_mut().is_some_and(Ring::take_shortage)
    }

    /// Hands over all that is left, and waits for it to be taken.
    pub(in crate::command) fn finish(mut self) {
        self.is_patient = true;
        self.hand_over();
    }

    fn push(&mut self, entry: Entry) {
        let entry = match &mut self.ring {
            Some(ring) => ring.push(entry),
            None => Some(entry),
        };
        if let Some(entry) = entry {
            self.gather(entry);
        }
    }

    fn gather(&mut self, entry: Entry) {
        if self.size >= MOST_WAITING {
            return self.lose(entry);
        }
        self.size += entry.size();
        self.batch.push(entry);
        if self.size >= GATHERED && (self.is_patient || self.size < 2 * GATHERED) {
            self.hand_over();
        }
    }

    /// Counts the bytes of what finds no room; what they decode to can be made again.
    fn lose(&mut self, entry: Entry) {
        let Entry::Chunk { bus, time: ReadTime::At(time), bytes, .. } = &entry else {
            if matches!(entry, Entry::Begin(_) | Entry::Rest | Entry::Lost { .. }) {
                self.batch.push(entry);
            }
            return;
        };
        let count = bytes.len() as u64;
        if let Some(Entry::Lost { bus: last_bus, lost }) = self.batch.last_mut()
            && last_bus == bus
            && lost.kind == LostKind::Queue
        {
            lost.count = lost.count.saturating_add(count);
            return;
        }
        let lost = Lost { time: Some(*time), stream_offset: 0, kind: LostKind::Queue, count };
        self.batch.push(Entry::Lost { bus: Arc::clone(bus), lost });
    }

    fn hand_over(&mut self) {
        let batch = std::mem::take(&mut self.batch);
        if self.is_patient {
            // A writer that is gone has said why.
            let _ = self.queue.send(batch);
        } else if let Err(TrySendError::Full(batch)) = self.queue.try_send(batch) {
            self.batch = batch;
            return;
        }
        self.size = 0;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;

    use super::*;
    use crate::decode::chunk::Chunk;

    fn chunk(bytes: &[u8]) -> Item<'_> {
        let time = ReadTime::At(Timestamp::from_ns(5));
        Item::Chunk { bus: "bus0", chunk: Chunk { time, bytes, line_errors: &[] }, ready: None }
    }

    /// Counts the bytes that are there and those that are said to be lost.
    fn bytes(batches: impl Iterator<Item = Batch>) -> (u64, u64) {
        batches.flatten().fold((0, 0), |(there, lost), entry| match entry {
            Entry::Chunk { bytes, .. } => (there + bytes.len() as u64, lost),
            Entry::Lost { lost: more, .. } => (there, lost + more.count),
            _ => (there, lost),
        })
    }

    #[test]
    fn what_a_writer_that_stands_still_has_no_room_for_is_counted() {
        let (queue, batches) = sync_channel(BATCHES);
        let mut tape = Tape::new(queue, false, true, None);
        let total = 40 << 20;
        for _ in 0..total / 4096 {
            tape.received(&chunk(&[0; 4096]));
        }
        let taken = std::thread::scope(|scope| {
            scope.spawn(|| tape.finish());
            bytes(batches.iter())
        });
        assert!(taken.1 > 0 && taken.0 > MOST_WAITING as u64, "{taken:?}");
        assert!(taken.0 < (MOST_WAITING + (BATCHES + 2) * 2 * GATHERED) as u64, "{taken:?}");
        assert_eq!(taken.0 + taken.1, total);
    }

    #[test]
    fn a_full_ring_is_written_whole() {
        let (queue, batches) = sync_channel(BATCHES);
        let mut tape = Tape::new(queue, false, true, Some(Ring::new(i64::MAX, usize::MAX)));
        let total = 16 << 20;
        for _ in 0..total / 4096 {
            tape.received(&chunk(&[0; 4096]));
        }
        let taken = std::thread::scope(|scope| {
            scope.spawn(|| {
                tape.trigger(Timestamp::from_ns(5));
                tape.finish();
            });
            bytes(batches.iter())
        });
        assert_eq!(taken, (total, 0));
    }

    #[test]
    fn entries_are_handed_over_four_times_a_second() {
        let (queue, batches) = sync_channel(BATCHES);
        let mut tape = Tape::new(queue, false, true, None);
        for ms in 0..1000 {
            tape.pass(Timestamp::from_ns(ms * MILLISECOND), true);
        }
        assert_eq!(batches.try_iter().count(), 4);
    }
}
