//! The loop of a live session: takes what comes, and sees when it is over.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::thread::JoinHandle;
use std::time::Duration;

use super::super::failure::Failure;
use super::desk::Desk;
use super::engine::Engine;
use super::queue::Inbox;
use super::status::Status;
use super::writer::{Outcome, Told};
use crate::source::Clock;
use crate::time::SECOND;

/// How long the engine waits for something to take at most.
const HEARTBEAT: Duration = Duration::from_millis(200);
/// How many things are taken before rows are handed on, though more are there.
const AT_ONCE: usize = 256;
/// How long captures have to end, in nanoseconds.
const END_WITHIN: u64 = 2 * SECOND as u64;

/// Waits for what comes, and lets the engine take it.
pub(super) struct Driver {
    clock: Arc<dyn Clock>,
    begun_ns: u64,
    /// When the status was shown last.
    shown_ns: u64,
    told: Option<Receiver<Told>>,
    pub(super) status: Status,
    ends_when_full: bool,
    /// Whether the recording has ended.
    is_closed: bool,
    desk: Option<Desk>,
}

impl Driver {
    /// Makes a driver; `ends_when_full` says whether the session ends with its recording.
    pub(super) fn new(
        clock: Arc<dyn Clock>,
        told: Option<Receiver<Told>>,
        status: Status,
        ends_when_full: bool,
        desk: Option<Desk>,
    ) -> Self {
        let begun_ns = clock.monotonic_ns();
        Driver { clock, begun_ns, shown_ns: 0, told, status, ends_when_full, is_closed: false, desk }
    }

    /// Returns the writers of recordings that were begun from the screen.
    pub(super) fn take_writers(&mut self) -> Vec<JoinHandle<Outcome>> {
        self.desk.as_mut().map(|desk| std::mem::take(&mut desk.writers)).unwrap_or_default()
    }

    /// Goes on until all captures have ended.
    pub(super) fn drive(
        &mut self,
        engine: &mut Engine<'_>,
        inbox: &Inbox,
        stop: &AtomicBool,
        duration_ns: Option<u64>,
    ) -> Result<(), Failure> {
        let mut stopped_ns = None;
        loop {
            let has_ended = take_all(engine, inbox)?;
            if let Some(desk) = &mut self.desk {
                desk.serve(engine, &mut self.told);
            }
            engine.pause()?;
            self.show(engine);
            let now = self.clock.monotonic_ns();
            let elapsed = now.saturating_sub(self.begun_ns);
            let is_over = stop.load(Ordering::Relaxed)
                || duration_ns.is_some_and(|most| elapsed >= most)
                || (self.is_closed && self.ends_when_full);
            if is_over && stopped_ns.is_none() {
                stopped_ns = Some(now);
                engine.stop();
            }
            if has_ended || stopped_ns.is_some_and(|then| now.saturating_sub(then) > END_WITHIN) {
                return Ok(());
            }
        }
    }

    /// Says what people should know, and shows how it goes.
    fn show(&mut self, engine: &mut Engine<'_>) {
        engine.take_notices().iter().for_each(|notice| self.status.say(notice));
        self.hear();
        let now = self.clock.monotonic_ns();
        if now.saturating_sub(self.shown_ns) >= SECOND as u64 {
            self.shown_ns = now;
            let elapsed = i64::try_from(now.saturating_sub(self.begun_ns)).unwrap_or(i64::MAX);
            self.status.update(elapsed, &engine.stage.tally);
        }
    }

    /// Takes what the writer tells.
    pub(super) fn hear(&mut self) {
        for told in self.told.iter().flat_map(Receiver::try_iter) {
            match told {
                Told::Notice(notice) => self.status.say(&notice),
                Told::File(file) => self.status.file(file),
                Told::Closed => {
                    self.is_closed = true;
                    self.status.closed();
                }
            }
        }
    }
}

/// Waits for something and takes all that is there; tells whether nothing will come any more.
fn take_all(engine: &mut Engine<'_>, inbox: &Inbox) -> Result<bool, Failure> {
    match inbox.wait(HEARTBEAT) {
        Ok((source, what)) => engine.take(source, what)?,
        Err(RecvTimeoutError::Timeout) => return Ok(false),
        Err(RecvTimeoutError::Disconnected) => return Ok(true),
    }
    for _ in 1..AT_ONCE {
        match inbox.take() {
            Ok((source, what)) => engine.take(source, what)?,
            Err(TryRecvError::Empty) => return Ok(false),
            Err(TryRecvError::Disconnected) => return Ok(true),
        }
    }
    Ok(false)
}
