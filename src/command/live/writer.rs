//! The writer's side of a recording: the only thread that touches the disk.
//!
//! Knows no clock: what is due is done when a tick says that its time has come.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender};

use super::super::journal::Journal;
use super::disk::{Disk, Floor, Room};
use super::entry::Entry;
use super::notice::Notice;
use super::tape::Batch;
use crate::capture::mcap::RecordError;
use crate::time::{SECOND, Timestamp};

/// How often the room on the disk is looked at, in nanoseconds.
const LOOK_EVERY: i64 = SECOND;

/// Is what a writer tells while it writes.
#[derive(Debug, PartialEq)]
pub(in crate::command) enum Told {
    /// Something people should know.
    Notice(Notice),
    /// This file is being written.
    File(PathBuf),
    /// Nothing is written any more: the disk is full.
    Closed,
}

/// Is what became of a recording.
#[derive(Debug, Default)]
pub(in crate::command) struct Outcome {
    /// The files it is in.
    pub(in crate::command) files: Vec<PathBuf>,
    /// How many bytes the disk did not take.
    pub(in crate::command) lost: u64,
    /// Why the last file could not be finished.
    pub(in crate::command) error: Option<RecordError>,
    /// Whether it ended for want of room.
    pub(in crate::command) is_short: bool,
}

/// Writes entries, and sees to the room on the disk.
pub(super) struct Writer {
    journal: Option<Journal>,
    floor: Floor,
    disk: Box<dyn Disk>,
    looked: Timestamp,
    /// Whether the disk did not take what it was given last.
    is_failing: bool,
    file: Option<PathBuf>,
    outcome: Outcome,
    /// Where notices go; that nobody hears them is no reason to stop.
    told: Sender<Told>,
}

impl Writer {
    /// Makes a writer of a recording that has begun.
    pub(super) fn new(journal: Journal, floor: Floor, disk: Box<dyn Disk>, told: Sender<Told>) -> Self {
        Writer {
            journal: Some(journal),
            floor,
            disk,
            looked: Timestamp::MIN,
            is_failing: false,
            file: None,
            outcome: Outcome::default(),
            told,
        }
    }

    /// Writes all that comes, and ends the recording when nothing will come any more.
    pub(super) fn run(mut self, batches: &Receiver<Batch>) -> Outcome {
        while let Ok(batch) = batches.recv() {
            batch.iter().for_each(|entry| self.take(entry));
        }
        self.finish("ended");
        self.outcome
    }

    /// Writes an entry.
    pub(super) fn take(&mut self, entry: &Entry) {
        let Some(journal) = &mut self.journal else { return };
        let written = match entry {
            Entry::Begin(settings) => journal.begin(settings.clone()),
            Entry::Chunk { .. } | Entry::Lost { .. } | Entry::Silence { .. } => {
                entry.item().map_or(Ok(()), |item| journal.item(&item))
            }
            Entry::Message(message) => journal.message(message),
            Entry::Clock { monotonic_ns, realtime } => {
                journal.recorder().write_clock(*monotonic_ns, *realtime)
            }
            Entry::Rest => journal.recorder().rest("window"),
            Entry::Tick(now) => journal.recorder().tick(*now),
        };
        if let Err(error) = written {
            self.fails(&error);
        } else if let Entry::Tick(now) = entry {
            self.look(*now);
        }
    }

    fn tell(&self, told: Told) {
        let _ = self.told.send(told);
    }

    /// Says, once, that the disk does not take what it is given.
    fn fails(&mut self, error: &RecordError) {
        self.file = None;
        if !std::mem::replace(&mut self.is_failing, true) {
            let text = format!("{error}; trying again every second, what comes meanwhile is lost");
            self.tell(Told::Notice(Notice::Warning(text)));
        }
    }

    /// Looks after the file that is written, and the room on its disk.
    fn look(&mut self, now: Timestamp) {
        let Some(journal) = &mut self.journal else { return };
        let lost = journal.recorder().bytes_lost_to_disk();
        let Some(file) = journal.recorder().current().map(PathBuf::from) else { return };
        if self.file.as_ref() != Some(&file) {
            if std::mem::take(&mut self.is_failing) {
                let text =
                    format!("recording goes on in '{}'; {lost} bytes were lost so far", file.display());
                self.tell(Told::Notice(Notice::Note(text)));
            }
            self.tell(Told::File(file.clone()));
            self.file = Some(file.clone());
        }
        if self.floor.min_free == 0 || now - self.looked < LOOK_EVERY {
            return;
        }
        self.looked = now;
        let (removed, short) = match self.floor.check(&*self.disk, &file) {
            Room::Enough(removed) => (removed, None),
            Room::Short { free, removed } => (removed, Some(free)),
        };
        for path in removed {
            let text = format!("removed '{}' to make room", path.display());
            self.tell(Told::Notice(Notice::Note(text)));
        }
        if let Some(free) = short {
            self.outcome.is_short = true;
            let text = format!(
                "only {} MB are free for '{}': the recording is closed",
                free / 1_000_000,
                file.display()
            );
            self.tell(Told::Notice(Notice::Warning(text)));
            self.finish("disk-full");
            self.tell(Told::Closed);
        }
    }

    /// Ends the recording; one without a byte leaves nothing behind.
    fn finish(&mut self, reason: &str) {
        let Some(mut journal) = self.journal.take() else { return };
        // What becomes of the last reads counts, too.
        let flushed = journal.recorder().flush_reads();
        self.outcome.lost = journal.recorder().bytes_lost_to_disk();
        if !journal.recorder().has_begun() {
            return journal.abandon();
        }
        self.outcome.files = journal.recorder().finished().to_vec();
        match journal.finish(reason) {
            Ok(files) => {
                self.outcome.files = files;
                self.outcome.error = flushed.err();
            }
            Err(error) => self.outcome.error = Some(error),
        }
    }
}
