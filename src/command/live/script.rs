//! A source and a clock for tests: what they do is written down beforehand.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::time::Duration;

use crate::decode::chunk::LineError;
use crate::source::{Clock, Counters, Received, Reception, Source, SourceError};
use crate::time::Timestamp;

/// A clock that shows what it is told, first an hour after it started.
pub(super) struct ScriptClock {
    monotonic_ns: AtomicU64,
    /// Wall clock less monotonic clock.
    difference_ns: AtomicI64,
}

impl ScriptClock {
    pub(super) fn new() -> Arc<Self> {
        Arc::new(ScriptClock {
            monotonic_ns: AtomicU64::new(3_600_000_000_000),
            difference_ns: AtomicI64::new(1_767_225_600_000_000_000),
        })
    }

    /// Goes on to a time, never back.
    pub(super) fn go_to(&self, monotonic_ns: u64) {
        self.monotonic_ns.fetch_max(monotonic_ns, Ordering::Relaxed);
    }

    /// Sets the wall clock.
    pub(super) fn set_by(&self, ns: i64) {
        self.difference_ns.fetch_add(ns, Ordering::Relaxed);
    }
}

impl Clock for ScriptClock {
    fn monotonic_ns(&self) -> u64 {
        self.monotonic_ns.load(Ordering::Relaxed)
    }

    fn realtime(&self) -> Timestamp {
        let monotonic_ns = i64::try_from(self.monotonic_ns()).expect("within a test");
        Timestamp::from_ns(monotonic_ns + self.difference_ns.load(Ordering::Relaxed))
    }
}

/// Is what a scripted source does at a time of the monotonic clock.
#[derive(Clone, Debug)]
pub(super) enum Act {
    Read {
        bytes: Vec<u8>,
        line_errors: Vec<LineError>,
        is_suspect: bool,
    },
    Gone,
    /// Counts so many overruns more.
    Overruns(u64),
    Fail,
}

impl Act {
    pub(super) fn read(bytes: &[u8]) -> Self {
        Act::Read { bytes: bytes.into(), line_errors: Vec::new(), is_suspect: false }
    }
}

/// A source that follows a script, and ends with it.
pub(super) struct Script {
    clock: Arc<ScriptClock>,
    acts: VecDeque<(u64, Act)>,
    counters: Option<Counters>,
    /// Until when it cannot be opened again.
    away_until: u64,
}

impl Script {
    /// Makes a source; one that `counts` says what it has counted.
    pub(super) fn new(clock: &Arc<ScriptClock>, acts: Vec<(u64, Act)>, counts: bool) -> Self {
        let counters = counts.then(Counters::default);
        Script { clock: Arc::clone(clock), acts: acts.into(), counters, away_until: 0 }
    }

    fn failure() -> SourceError {
        SourceError { name: "script".into(), action: "read", error: io::Error::other("no more"), hint: None }
    }
}

impl Source for Script {
    fn name(&self) -> &str {
        "script"
    }

    fn receive(&mut self, timeout: Duration, reception: &mut Reception) -> Result<Received, SourceError> {
        let until = self.clock.monotonic_ns() + timeout.as_nanos() as u64;
        *reception = Reception::default();
        let Some((time, _)) = self.acts.front() else { return Ok(Received::Ended) };
        if *time > until {
            self.clock.go_to(until);
            reception.monotonic_ns = until;
            return Ok(Received::Silence);
        }
        self.clock.go_to(*time);
        reception.monotonic_ns = self.clock.monotonic_ns();
        reception.ready_ns = reception.monotonic_ns;
        match self.acts.pop_front() {
            Some((_, Act::Read { bytes, line_errors, is_suspect })) => {
                (reception.bytes, reception.line_errors, reception.is_suspect) =
                    (bytes, line_errors, is_suspect);
                Ok(Received::Bytes)
            }
            Some((time, Act::Gone)) => {
                self.away_until = time + 3_000_000_000;
                Ok(Received::Gone)
            }
            Some((_, Act::Overruns(count))) => {
                if let Some(counters) = &mut self.counters {
                    counters.overruns += count;
                }
                Ok(Received::Silence)
            }
            Some((_, Act::Fail)) | None => Err(Script::failure()),
        }
    }

    fn reopen(&mut self) -> Result<(), SourceError> {
        if self.clock.monotonic_ns() < self.away_until { Err(Script::failure()) } else { Ok(()) }
    }

    fn adapter_hold_ns(&self) -> Option<i64> {
        Some(2_000_000)
    }

    fn counters(&mut self) -> Option<Counters> {
        self.counters
    }
}
