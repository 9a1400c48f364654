//! The queue between captures and the engine, bounded by number and by bytes.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::time::Duration;

use super::capture::{Captured, Outlet, Refused};

/// How much can wait: at 115200 baud, byte for byte, 0.7 seconds.
const MOST: usize = 8192;
/// How many bytes can wait; at 115200 baud they come in three minutes.
const MOST_BYTES: usize = 2 << 20;

/// Is the end of the queue that a capture offers to.
pub(super) struct Queue {
    source: usize,
    queue: SyncSender<(usize, Captured)>,
    waiting: Arc<AtomicUsize>,
}

/// Is the end of the queue that the engine takes from.
pub(super) struct Inbox {
    queue: Receiver<(usize, Captured)>,
    waiting: Arc<AtomicUsize>,
}

/// Makes a queue from so many sources.
pub(super) fn queue(sources: usize) -> (Vec<Queue>, Inbox) {
    let (sender, receiver) = sync_channel(MOST);
    let waiting = Arc::new(AtomicUsize::new(0));
    let outlet = |source| Queue { source, queue: sender.clone(), waiting: Arc::clone(&waiting) };
    ((0..sources).map(outlet).collect(), Inbox { queue: receiver, waiting })
}

fn bytes(what: &Captured) -> usize {
    if let Captured::Read(read) = what { read.bytes.len() } else { 0 }
}

impl Outlet for Queue {
    fn offer(&mut self, what: Captured) -> Result<(), Refused> {
        let bytes = bytes(&what);
        // A read larger than all the room there is finds it once that is empty.
        if bytes > 0 && self.waiting.load(Ordering::Relaxed) > MOST_BYTES {
            return Err(Refused::Full(what));
        }
        self.waiting.fetch_add(bytes, Ordering::Relaxed);
        self.queue.try_send((self.source, what)).map_err(|error| {
            self.waiting.fetch_sub(bytes, Ordering::Relaxed);
            match error {
                TrySendError::Full((_, what)) => Refused::Full(what),
                TrySendError::Disconnected(_) => Refused::Closed,
            }
        })
    }
}

impl Inbox {
    /// Waits for what comes next.
    pub(super) fn wait(&self, timeout: Duration) -> Result<(usize, Captured), RecvTimeoutError> {
        self.queue.recv_timeout(timeout).inspect(|(_, what)| self.took(what))
    }

    /// Takes what is there.
    pub(super) fn take(&self) -> Result<(usize, Captured), TryRecvError> {
        self.queue.try_recv().inspect(|(_, what)| self.took(what))
    }

    fn took(&self, what: &Captured) {
        self.waiting.fetch_sub(bytes(what), Ordering::Relaxed);
    }
}
