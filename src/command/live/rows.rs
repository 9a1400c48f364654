//! Rows on their way to standard output, which a thread of its own writes: a reader that stalls stalls nothing else.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError};

use super::super::failure::Failure;
use super::super::output::Output;
use super::super::printing::Printing;
use crate::capture::mcap::BusSettings;
use crate::pipeline::Event;

/// How many bytes of rows wait for whoever reads them.
const MOST_WAITING: usize = 4 << 20;
/// How many writes wait.
pub(super) const WRITES: usize = 64;

/// Makes rows and hands them over.
pub(in crate::command) struct RowStream {
    pub(super) printing: Printing,
    buffer: Vec<u8>,
    queue: SyncSender<Vec<u8>>,
    /// Whether rows may be left out when nobody reads them: they can be made again from the recording.
    may_drop: bool,
    dropped: u64,
}

impl RowStream {
    /// Makes a stream of rows to a writer.
    pub(super) fn new(mut printing: Printing, queue: SyncSender<Vec<u8>>, may_drop: bool) -> Self {
        let mut buffer = Vec::new();
        printing.heading(&mut buffer);
        RowStream { printing, buffer, queue, may_drop, dropped: 0 }
    }

    pub(super) fn begin(&mut self, settings: &BusSettings) {
        self.printing.begin(settings, &mut self.buffer);
    }

    pub(super) fn event(&mut self, bus: &str, event: &Event<'_>) {
        self.printing.event(bus, event, &mut self.buffer);
    }

    /// Takes what can be shown once every frame before `settled_frame` has its transaction or none.
    pub(super) fn settle(&mut self, settled_frame: u64) {
        self.printing.settle(settled_frame, &mut self.buffer);
    }

    /// Hands over the rows so far.
    pub(super) fn flush(&mut self) -> Result<(), Failure> {
        if self.buffer.is_empty() {
            return Ok(());
        }
        match self.queue.try_send(std::mem::take(&mut self.buffer)) {
            Ok(()) => return Ok(()),
            Err(TrySendError::Disconnected(_)) => return Err(Failure::ClosedPipe),
            Err(TrySendError::Full(buffer)) => self.buffer = buffer,
        }
        if self.buffer.len() < MOST_WAITING {
            return Ok(());
        }
        let buffer = std::mem::take(&mut self.buffer);
        if self.may_drop {
            self.dropped += buffer.iter().filter(|byte| **byte == b'\n').count() as u64;
            return Ok(());
        }
        self.queue.send(buffer).map_err(|_| Failure::ClosedPipe)
    }

    /// Hands over the last rows; returns how many lines were left out, and what made them.
    pub(super) fn finish(self) -> (u64, Printing) {
        // A writer that is gone has said why.
        let _ = self.queue.send(self.buffer);
        (self.dropped, self.printing)
    }
}

/// Writes rows until no more come.
pub(super) fn write(mut output: Output, rows: &Receiver<Vec<u8>>) -> Result<(), Failure> {
    while let Ok(buffer) = rows.recv() {
        output.buffer = buffer;
        output.flush()?;
    }
    Ok(())
}
