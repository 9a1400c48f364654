//! Receives from one source and hands on what came, with its times: no disk, no decoding.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::time::Duration;

use crate::decode::chunk::{LineError, LostKind};
use crate::line::LineSettings;
use crate::source::{Clock, Counters, Received, Reception, Source, SourceError, backoff};
use crate::time::{MILLISECOND, SECOND};

/// How long a wait for bytes takes at most while a frame may be unfinished, and after that.
const SHORT_WAIT: Duration = Duration::from_millis(20);
const LONG_WAIT: Duration = Duration::from_millis(100);
/// How long to wait for room.
const FULL_WAIT: Duration = Duration::from_millis(1);
/// How long after a byte a frame may be unfinished, in nanoseconds.
const UNFINISHED: u64 = 250 * MILLISECOND as u64;
/// How often the adapter is asked what it has counted, in nanoseconds.
const COUNT_EVERY: u64 = SECOND as u64;

/// Is what a capture hands on, in the order of the stream; times are those of the monotonic clock.
#[derive(Debug)]
pub(in crate::command) enum Captured {
    /// The bytes of one read.
    Read(Read),
    /// Nothing came until then.
    Silence(u64),
    /// Bytes are missing here; 0 of them when nobody knows how many.
    Lost { monotonic_ns: u64, kind: LostKind, count: u64 },
    /// The source went away, and is tried again and again.
    Gone(u64),
    /// It is back.
    Back { adapter_hold_ns: Option<i64>, facts: BTreeMap<String, String> },
    /// It receives with these settings from here on, or does not want to.
    Line { monotonic_ns: u64, set: Result<LineSettings, SourceError> },
    /// What the adapter has counted, if it can.
    Counters(Option<Counters>),
    /// It has ended for good, or failed.
    Ended(Option<SourceError>),
}

/// Holds the bytes of one read.
#[derive(Debug)]
pub(in crate::command) struct Read {
    pub(in crate::command) ready_ns: u64,
    pub(in crate::command) monotonic_ns: u64,
    pub(in crate::command) bytes: Box<[u8]>,
    pub(in crate::command) line_errors: Vec<LineError>,
}

/// Is what a capture can be told to do; when nobody can tell it any more, it ends.
#[derive(Debug)]
pub(in crate::command) enum Order {
    /// Receive with other settings.
    SetLine(LineSettings),
}

/// Takes what was captured, without waiting.
pub(in crate::command) trait Outlet {
    /// Takes it, or gives it back.
    fn offer(&mut self, what: Captured) -> Result<(), Refused>;
}

/// Says why something was not taken.
#[derive(Debug)]
pub(in crate::command) enum Refused<T = Captured> {
    /// There is no room.
    Full(T),
    /// Nobody takes anything any more.
    Closed,
}

/// Tells what to do after a step.
#[derive(Debug, PartialEq)]
pub(in crate::command) enum Next {
    Step,
    Wait(Duration),
    End,
}

/// Receives from a source, one step after the other.
pub(in crate::command) struct Capture {
    source: Box<dyn Source>,
    clock: Arc<dyn Clock>,
    reception: Reception,
    /// Whether what finds no room can wait: what a pipe or a server holds back meanwhile is not lost.
    is_patient: bool,
    /// What found no room and has to come before all else.
    waiting: VecDeque<Captured>,
    /// How often a source that is away was tried; `None` while it is there.
    away: Option<u32>,
    counters: Option<Counters>,
    counted_ns: Option<u64>,
    received_ns: u64,
    has_ended: bool,
}

impl Capture {
    /// Captures from a source; with `is_patient`, what finds no room waits, and else is counted as lost.
    pub(in crate::command) fn new(source: Box<dyn Source>, clock: Arc<dyn Clock>, is_patient: bool) -> Self {
        Capture {
            source,
            clock,
            is_patient,
            reception: Reception::default(),
            waiting: VecDeque::new(),
            away: None,
            counters: None,
            counted_ns: None,
            received_ns: 0,
            has_ended: false,
        }
    }

    /// Follows orders and takes steps until the source ends, or nobody is left to order or to take.
    pub(in crate::command) fn run(mut self, outlet: &mut impl Outlet, orders: &Receiver<Order>) {
        let mut next = Next::Step;
        loop {
            let order = match next {
                Next::End => return,
                Next::Step => orders.try_recv(),
                Next::Wait(time) => orders.recv_timeout(time).map_err(|error| match error {
                    RecvTimeoutError::Timeout => TryRecvError::Empty,
                    RecvTimeoutError::Disconnected => TryRecvError::Disconnected,
                }),
            };
            next = match order {
                Ok(Order::SetLine(line)) => {
                    self.set_line(line, outlet);
                    Next::Step
                }
                Err(TryRecvError::Empty) => self.step(outlet),
                Err(TryRecvError::Disconnected) => return,
            };
        }
    }

    /// Receives with other settings from here on.
    pub(in crate::command) fn set_line(&mut self, line: LineSettings, outlet: &mut impl Outlet) {
        let set = self.source.set_line(line).map(|()| line);
        self.hand_over(Captured::Line { monotonic_ns: self.clock.monotonic_ns(), set }, outlet);
    }

    /// Waits for bytes once, or tries to get back a source that is away.
    pub(in crate::command) fn step(&mut self, outlet: &mut impl Outlet) -> Next {
        if self.has_ended || (self.is_patient && !self.waiting.is_empty()) {
            return match self.hand_over_waiting(outlet) {
                Ok(()) if self.has_ended => Next::End,
                Ok(()) => Next::Step,
                Err(Refused::Closed) => Next::End,
                Err(Refused::Full(_)) => Next::Wait(FULL_WAIT),
            };
        }
        if let Some(attempts) = self.away {
            return self.reopen(attempts, outlet);
        }
        let now = self.clock.monotonic_ns();
        if self.counted_ns.is_none() && !self.count(now, outlet) {
            return Next::End;
        }
        let since = now.saturating_sub(self.received_ns);
        let wait = if since < UNFINISHED { SHORT_WAIT } else { LONG_WAIT };
        let received = self.source.receive(wait, &mut self.reception);
        let now = self.reception.monotonic_ns;
        let is_open = match received {
            Ok(Received::Bytes) => {
                self.received_ns = now;
                self.take_read(outlet)
            }
            Ok(Received::Silence) => self.hand_over(Captured::Silence(now), outlet),
            Ok(Received::Gone) => {
                self.away = Some(0);
                (self.counters, self.counted_ns) = (None, None);
                self.hand_over(Captured::Gone(now), outlet)
            }
            Ok(Received::Ended) => return self.end(None, outlet),
            Err(error) => return self.end(Some(error), outlet),
        };
        let is_open = is_open && self.count(now, outlet);
        if is_open { Next::Step } else { Next::End }
    }

    /// Ends once all that waits has found room.
    fn end(&mut self, error: Option<SourceError>, outlet: &mut impl Outlet) -> Next {
        self.has_ended = true;
        self.hand_over(Captured::Ended(error), outlet);
        Next::Step
    }

    fn reopen(&mut self, attempts: u32, outlet: &mut impl Outlet) -> Next {
        if self.source.reopen().is_ok() {
            self.away = None;
            let (adapter_hold_ns, facts) = (self.source.adapter_hold_ns(), self.source.facts());
            let is_open = self.hand_over(Captured::Back { adapter_hold_ns, facts }, outlet);
            return if is_open { Next::Step } else { Next::End };
        }
        self.away = Some(attempts.saturating_add(1));
        let is_open = self.hand_over(Captured::Silence(self.clock.monotonic_ns()), outlet);
        if is_open { Next::Wait(backoff(attempts)) } else { Next::End }
    }

    /// Hands over a read, and that bytes may be missing after it.
    fn take_read(&mut self, outlet: &mut impl Outlet) -> bool {
        let Reception { ready_ns, monotonic_ns, bytes, line_errors, is_suspect } = &self.reception;
        let (monotonic_ns, is_suspect) = (*monotonic_ns, *is_suspect);
        let read = Read {
            ready_ns: *ready_ns,
            monotonic_ns,
            bytes: bytes.as_slice().into(),
            line_errors: line_errors.clone(),
        };
        let is_open = self.hand_over(Captured::Read(read), outlet);
        // An adapter that counts says how many; of another nobody knows.
        if !is_suspect || self.counters.is_some() {
            return is_open;
        }
        self.hand_over(Captured::Lost { monotonic_ns, kind: LostKind::Overrun, count: 0 }, outlet)
    }

    /// Asks what the adapter has counted, when it is time; what it had no room for is missing after the last read.
    fn count(&mut self, now: u64, outlet: &mut impl Outlet) -> bool {
        if self.counted_ns.is_some_and(|last| now.saturating_sub(last) < COUNT_EVERY) {
            return true;
        }
        let is_first = self.counted_ns.replace(now).is_none();
        let lost = |counters: Counters| counters.overruns.saturating_add(counters.buffer_overruns);
        let before = self.counters;
        self.counters = self.source.counters();
        if is_first || self.counters != before {
            self.hand_over(Captured::Counters(self.counters), outlet);
        }
        let (Some(before), Some(after)) = (before, self.counters) else { return true };
        match lost(after).saturating_sub(lost(before)) {
            0 => true,
            count => {
                let kind = LostKind::Overrun;
                self.hand_over(Captured::Lost { monotonic_ns: now, kind, count }, outlet)
            }
        }
    }

    /// Hands over after all that waits; what finds no room waits, or is counted. Tells whether anybody listens.
    fn hand_over(&mut self, what: Captured, outlet: &mut impl Outlet) -> bool {
        let offered = match self.hand_over_waiting(outlet) {
            Ok(()) => outlet.offer(what),
            Err(Refused::Full(_)) => Err(Refused::Full(what)),
            Err(Refused::Closed) => Err(Refused::Closed),
        };
        match offered {
            Ok(()) => true,
            Err(Refused::Closed) => false,
            Err(Refused::Full(what)) => {
                self.keep(what);
                true
            }
        }
    }

    /// Hands over what waits, as far as there is room.
    fn hand_over_waiting(&mut self, outlet: &mut impl Outlet) -> Result<(), Refused<()>> {
        while let Some(first) = self.waiting.pop_front() {
            match outlet.offer(first) {
                Ok(()) => {}
                Err(Refused::Closed) => return Err(Refused::Closed),
                Err(Refused::Full(first)) => {
                    self.waiting.push_front(first);
                    return Err(Refused::Full(()));
                }
            }
        }
        Ok(())
    }

    /// Keeps what is rare until there is room; bytes are counted, and silence will come again.
    fn keep(&mut self, what: Captured) {
        let what = match what {
            Captured::Silence(_) | Captured::Counters(_) => return,
            Captured::Read(read) if read.bytes.is_empty() => return,
            Captured::Read(Read { monotonic_ns, bytes, .. }) if !self.is_patient => {
                Captured::Lost { monotonic_ns, kind: LostKind::Queue, count: bytes.len() as u64 }
            }
            what => what,
        };
        if let Captured::Lost { monotonic_ns, kind, count } = what
            && let Some(Captured::Lost { monotonic_ns: last_ns, kind: last_kind, count: last_count }) =
                self.waiting.back_mut()
            && *last_kind == kind
        {
            (*last_ns, *last_count) = (monotonic_ns, last_count.saturating_add(count));
            return;
        }
        self.waiting.push_back(what);
    }
}

#[cfg(test)]
#[path = "capture_tests.rs"]
mod tests;
