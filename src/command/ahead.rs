//! Reads a recording ahead, on a thread of its own: what is compressed and packed takes as long to take out as to decode.

use std::ops::Range;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};

use super::failure::Failure;
use crate::capture::mcap::BusSettings;
use crate::capture::{Input, InputError, Item};
use crate::decode::chunk::{Chunk, LineError, Lost, ReadTime};
use crate::time::Timestamp;

/// Items handed over at once; a hundredth of a second's work.
const ITEMS: usize = 2048;
/// Bytes handed over at once, beside those of one read.
const BYTES: usize = 64 * 1024;
/// Batches that wait.
const WAITING: usize = 2;

/// Is a stretch of items, owned.
#[derive(Default)]
struct Batch {
    entries: Vec<Entry>,
    bytes: Vec<u8>,
    line_errors: Vec<LineError>,
    /// The names of the buses.
    buses: Vec<String>,
    /// Bytes of the file that were read up to its end.
    position: u64,
}

/// Is an item of a batch; a chunk says where its bytes and line errors end.
enum Entry {
    Line(BusSettings),
    Chunk { bus: usize, time: ReadTime, ready: Option<Timestamp>, bytes: usize, line_errors: usize },
    Lost { bus: usize, lost: Lost },
    Silence { bus: usize, until: Timestamp },
    Clock { monotonic_ns: u64, realtime: Timestamp },
    Note { time: Option<Timestamp>, text: String },
}

impl Batch {
    fn clear(&mut self) {
        self.entries.clear();
        self.bytes.clear();
        self.line_errors.clear();
    }

    fn is_full(&self) -> bool {
        self.entries.len() >= ITEMS || self.bytes.len() >= BYTES
    }

    fn bus(&mut self, name: &str) -> usize {
        self.buses.iter().position(|known| known == name).unwrap_or_else(|| {
            self.buses.push(name.to_owned());
            self.buses.len() - 1
        })
    }

    fn push(&mut self, item: &Item<'_>) {
        let entry = match *item {
            Item::Line(settings) => Entry::Line(settings.clone()),
            Item::Chunk { bus, chunk, ready } => {
                self.bytes.extend_from_slice(chunk.bytes);
                self.line_errors.extend_from_slice(chunk.line_errors);
                let (bytes, line_errors) = (self.bytes.len(), self.line_errors.len());
                Entry::Chunk { bus: self.bus(bus), time: chunk.time, ready, bytes, line_errors }
            }
            Item::Lost { bus, lost } => Entry::Lost { bus: self.bus(bus), lost },
            Item::Silence { bus, until } => Entry::Silence { bus: self.bus(bus), until },
            Item::Clock { monotonic_ns, realtime } => Entry::Clock { monotonic_ns, realtime },
            Item::Note { time, text } => Entry::Note { time, text: text.into() },
        };
        self.entries.push(entry);
    }

    /// Hands out the items again, in order.
    fn each(&self, mut take: impl FnMut(&Item<'_>) -> Result<(), Failure>) -> Result<(), Failure> {
        let (mut at_byte, mut at_error) = (0, 0);
        for entry in &self.entries {
            let item = match *entry {
                Entry::Line(ref settings) => Item::Line(settings),
                Entry::Chunk { bus, time, ready, bytes, line_errors } => {
                    let bytes = &self.bytes[upto(&mut at_byte, bytes)];
                    let line_errors = &self.line_errors[upto(&mut at_error, line_errors)];
                    Item::Chunk { bus: &self.buses[bus], chunk: Chunk { time, bytes, line_errors }, ready }
                }
                Entry::Lost { bus, lost } => Item::Lost { bus: &self.buses[bus], lost },
                Entry::Silence { bus, until } => Item::Silence { bus: &self.buses[bus], until },
                Entry::Clock { monotonic_ns, realtime } => Item::Clock { monotonic_ns, realtime },
                Entry::Note { time, ref text } => Item::Note { time, text },
            };
            take(&item)?;
        }
        Ok(())
    }
}

/// Goes on to `end`; returns the range passed over.
fn upto(at: &mut usize, end: usize) -> Range<usize> {
    std::mem::replace(at, end)..end
}

/// Hands out all items of an input that does not grow, each with how many bytes of the file were read by then.
///
/// # Errors
/// As [`Input::advance`], once the items before are handed out; or what `take` fails with.
pub(super) fn read(
    input: &mut Input,
    mut take: impl FnMut(&Item<'_>, u64) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let (sender, batches) = sync_channel(WAITING);
    let (recycler, spare) = channel();
    std::thread::scope(|scope| {
        let reader = scope.spawn(move || fill(input, &sender, &spare));
        let result = drain(batches, &recycler, &mut take);
        match reader.join() {
            Ok(read) => result.and(read.map_err(Failure::from)),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

fn fill(input: &mut Input, full: &SyncSender<Batch>, spare: &Receiver<Batch>) -> Result<(), InputError> {
    loop {
        let mut batch: Batch = spare.try_recv().unwrap_or_default();
        batch.clear();
        let mut more = Ok(true);
        while !batch.is_full() {
            more = input.advance();
            if !matches!(more, Ok(true)) {
                break;
            }
            batch.push(&input.item());
        }
        batch.position = input.position();
        let is_wanted = full.send(batch).is_ok();
        if !(more? && is_wanted) {
            return Ok(());
        }
    }
}

fn drain(
    batches: Receiver<Batch>,
    recycler: &Sender<Batch>,
    take: &mut impl FnMut(&Item<'_>, u64) -> Result<(), Failure>,
) -> Result<(), Failure> {
    for batch in batches {
        batch.each(|item| take(item, batch.position))?;
        // Nobody may be there to fill it again.
        let _ = recycler.send(batch);
    }
    Ok(())
}
