//! Reads a recording ahead, on a thread of its own: what is compressed and packed takes as long to take out as to decode.

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
/// Batches that wait: as many as make up for either thread's pauses.
const WAITING: usize = 8;
/// Reads of a run at most.
const RUN: u32 = 64;

/// Is a stretch of items, owned.
#[derive(Default)]
struct Batch {
    entries: Vec<Entry>,
    reads: Vec<Read>,
    bytes: Vec<u8>,
    extras: Vec<Extra>,
    line_errors: Vec<LineError>,
    /// The names of the buses.
    buses: Vec<String>,
    /// Bytes of the file that were read up to its end.
    position: u64,
}

/// Is an item of a batch, or a run of reads of one bus.
enum Entry {
    /// So many reads, of which so many have extras.
    Reads {
        bus: u32,
        count: u32,
        extras: u32,
    },
    Line(Box<BusSettings>),
    Lost {
        bus: u32,
        lost: Box<Lost>,
    },
    Silence {
        bus: u32,
        until: Timestamp,
    },
    Clock {
        monotonic_ns: u64,
        realtime: Timestamp,
    },
    Note {
        time: Option<Timestamp>,
        text: Box<str>,
    },
}

/// Is a read of a batch: as small as can be, for it goes from one core to the other.
struct Read {
    time: Timestamp,
    /// Where its bytes end.
    end: u32,
    kind: TimeKind,
    has_extra: bool,
}

/// Is [`ReadTime`] without the time.
#[derive(Clone, Copy)]
enum TimeKind {
    At,
    Unknown,
    UnknownAfterSilence,
}

/// Is what few reads have.
struct Extra {
    ready: Option<Timestamp>,
    /// Where its line errors end.
    line_errors: usize,
}

/// Is what a batch hands out: an item that is no read, or reads of one bus.
pub(super) enum Stretch<'a> {
    Item(Item<'a>),
    Reads(&'a str, Reads<'a>),
}

/// Goes through the reads of a run: each with when its bytes were first there.
#[derive(Clone)]
pub(super) struct Reads<'a> {
    reads: std::slice::Iter<'a, Read>,
    /// What some of them have beside.
    extras: std::slice::Iter<'a, Extra>,
    bytes: &'a [u8],
    line_errors: &'a [LineError],
    /// Where the next read begins, and the next of its line errors.
    at: (usize, usize),
}

impl Batch {
    fn clear(&mut self) {
        self.entries.clear();
        self.reads.clear();
        self.bytes.clear();
        self.extras.clear();
        self.line_errors.clear();
    }

    fn is_full(&self) -> bool {
        self.reads.len() + self.entries.len() >= ITEMS || self.bytes.len() >= BYTES
    }

    fn bus(&mut self, name: &str) -> u32 {
        let at = self.buses.iter().position(|known| known == name).unwrap_or_else(|| {
            self.buses.push(name.to_owned());
            self.buses.len() - 1
        });
        at as u32 // a recording has at most 65536 channels
    }

    fn push(&mut self, item: &Item<'_>) {
        let entry = match *item {
            Item::Chunk { bus, chunk, ready } => {
                let bus = self.bus(bus);
                return self.push_read(bus, &chunk, ready);
            }
            Item::Line(settings) => Entry::Line(Box::new(settings.clone())),
            Item::Lost { bus, lost } => Entry::Lost { bus: self.bus(bus), lost: Box::new(lost) },
            Item::Silence { bus, until } => Entry::Silence { bus: self.bus(bus), until },
            Item::Clock { monotonic_ns, realtime } => Entry::Clock { monotonic_ns, realtime },
            Item::Note { time, text } => Entry::Note { time, text: text.into() },
        };
        self.entries.push(entry);
    }

    #[inline]
    fn push_read(&mut self, bus: u32, chunk: &Chunk<'_>, ready: Option<Timestamp>) {
        self.bytes.extend_from_slice(chunk.bytes);
        let (kind, time) = match chunk.time {
            ReadTime::At(time) => (TimeKind::At, time),
            ReadTime::Unknown => (TimeKind::Unknown, Timestamp::MIN),
            ReadTime::UnknownAfterSilence => (TimeKind::UnknownAfterSilence, Timestamp::MIN),
        };
        let has_extra = ready.is_some() || !chunk.line_errors.is_empty();
        if has_extra {
            self.line_errors.extend_from_slice(chunk.line_errors);
            self.extras.push(Extra { ready, line_errors: self.line_errors.len() });
        }
        let end = self.bytes.len() as u32; // a message is not larger than a chunk of the file: 64 MiB
        self.reads.push(Read { time, end, kind, has_extra });
        match self.entries.last_mut() {
            Some(Entry::Reads { bus: before, count, extras }) if *before == bus && *count < RUN => {
                *count += 1;
                *extras += u32::from(has_extra);
            }
            _ => self.entries.push(Entry::Reads { bus, count: 1, extras: has_extra.into() }),
        }
    }

    /// Hands out the items again, in order.
    fn each(&self, mut take: impl FnMut(Stretch<'_>) -> Result<(), Failure>) -> Result<(), Failure> {
        let name = |bus: u32| &*self.buses[bus as usize]; // as put there
        let (mut reads, mut extras, mut at) = (&*self.reads, &*self.extras, (0, 0));
        for entry in &self.entries {
            let item = match *entry {
                Entry::Reads { bus, count, extras: of_them } => {
                    // As counted.
                    let (run, reads_left) = reads.split_at(count as usize);
                    let (extras_of_run, extras_left) = extras.split_at(of_them as usize);
                    let run = Reads {
                        reads: run.iter(),
                        extras: extras_of_run.iter(),
                        bytes: &self.bytes,
                        line_errors: &self.line_errors,
                        at,
                    };
                    at = run.end();
                    (reads, extras) = (reads_left, extras_left);
                    take(Stretch::Reads(name(bus), run))?;
                    continue;
                }
                Entry::Line(ref settings) => Item::Line(settings),
                Entry::Lost { bus, ref lost } => Item::Lost { bus: name(bus), lost: **lost },
                Entry::Silence { bus, until } => Item::Silence { bus: name(bus), until },
                Entry::Clock { monotonic_ns, realtime } => Item::Clock { monotonic_ns, realtime },
                Entry::Note { time, ref text } => Item::Note { time, text },
            };
            take(Stretch::Item(item))?;
        }
        Ok(())
    }
}

impl Reads<'_> {
    /// Returns how many reads are left.
    pub(super) fn len(&self) -> usize {
        self.reads.len()
    }

    /// Returns how many bytes the reads have together.
    pub(super) fn bytes(&self) -> usize {
        self.end().0 - self.at.0
    }

    /// Returns where the bytes and the line errors of the last read end.
    fn end(&self) -> (usize, usize) {
        let bytes = self.reads.as_slice().last().map_or(self.at.0, |last| last.end as usize);
        (bytes, self.extras.as_slice().last().map_or(self.at.1, |last| last.line_errors))
    }
}

impl<'a> Iterator for Reads<'a> {
    type Item = (Chunk<'a>, Option<Timestamp>);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let read = self.reads.next()?;
        let from = std::mem::replace(&mut self.at.0, read.end as usize);
        let (mut line_errors, mut ready) = (&[][..], None);
        if read.has_extra
            && let Some(extra) = self.extras.next()
        {
            let from = std::mem::replace(&mut self.at.1, extra.line_errors);
            (line_errors, ready) = (&self.line_errors[from..self.at.1], extra.ready);
        }
        let time = match read.kind {
            TimeKind::At => ReadTime::At(read.time),
            TimeKind::Unknown => ReadTime::Unknown,
            TimeKind::UnknownAfterSilence => ReadTime::UnknownAfterSilence,
        };
        Some((Chunk { time, bytes: &self.bytes[from..self.at.0], line_errors }, ready))
    }
}

/// Hands out all items of an input that does not grow, with how many bytes of the file were read by then.
///
/// # Errors
/// As [`Input::advance`], once the items before are handed out; or what `take` fails with.
pub(super) fn read(
    input: &mut Input,
    mut take: impl FnMut(Stretch<'_>, u64) -> Result<(), Failure>,
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
            match input.bus_of_read() {
                // Nearly all items, by the shortest way.
                Some(bus) => {
                    let bus = batch.bus(bus);
                    input.each_read(|chunk, ready| {
                        batch.push_read(bus, &chunk, ready);
                        !batch.is_full()
                    });
                }
                None => batch.push(&input.item()),
            }
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
    take: &mut impl FnMut(Stretch<'_>, u64) -> Result<(), Failure>,
) -> Result<(), Failure> {
    for batch in batches {
        batch.each(|stretch| take(stretch, batch.position))?;
        // Nobody may be there to fill it again.
        let _ = recycler.send(batch);
    }
    Ok(())
}
