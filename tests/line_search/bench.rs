//! A search on a line that is modelled bit by bit.

use rtutap::analyze::line_search::{Action, ErrorReports, LineSearch, Lock, Options};
use rtutap::decode::chunk::{Chunk, LineError, LineErrorKind, ReadTime};
use rtutap::line::LineSettings;
use rtutap::simulate::{AfterFramingError, Uart, Wire};
use rtutap::time::{MILLISECOND, Timestamp};

/// How the receiver hands bytes and their errors to the host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Delivery {
    /// Byte by byte, each with its error.
    Uart,
    /// Every 16 ms, with one mark for all: FTDI.
    Packets,
    /// Every 16 ms, with errors counted only, and asked for once a second: CDC ACM.
    Counts,
    /// Every 16 ms, without errors: CH340.
    Silent,
}

impl Delivery {
    pub const ALL: [Delivery; 4] = [Delivery::Uart, Delivery::Packets, Delivery::Counts, Delivery::Silent];

    fn reports(self) -> ErrorReports {
        match self {
            Delivery::Uart | Delivery::Packets => ErrorReports::Marks,
            Delivery::Counts => ErrorReports::Counts,
            Delivery::Silent => ErrorReports::None,
        }
    }
}

/// What came of a search.
#[derive(Debug, Default)]
pub struct Outcome {
    pub lock: Option<Lock>,
    /// From the beginning to the lock, or to the end.
    pub elapsed_ns: i64,
    pub tried: Vec<LineSettings>,
    pub silences: usize,
    pub misfits: usize,
    pub said: Vec<String>,
}

impl Outcome {
    pub fn line(&self) -> Option<String> {
        self.lock.as_ref().map(|lock| lock.line.to_string())
    }

    pub fn seconds(&self) -> f64 {
        self.elapsed_ns as f64 / 1e9
    }
}

pub fn line(text: &str) -> LineSettings {
    text.parse().expect("a line setting of this test")
}

/// Searches on a wire for at most so long; begins to listen some time after the traffic does.
pub fn search(
    wire: Wire,
    delivery: Delivery,
    after_error: AfterFramingError,
    begin_ns: i64,
    most_ns: i64,
) -> Outcome {
    let begin = Timestamp::from_ns(1_767_225_600_000_000_000) + begin_ns;
    let mut uart = Uart::new(wire, LineSearch::first(), after_error);
    uart.set_line(LineSearch::first(), begin);
    let options = Options { adapter_hold_ns: None, error_reports: delivery.reports() };
    let mut search = LineSearch::new(options, begin);
    let mut outcome = Outcome { tried: vec![LineSearch::first()], ..Outcome::default() };
    let tick = if delivery == Delivery::Uart { MILLISECOND } else { 16 * MILLISECOND };
    let (mut now, mut counted, mut asked) = (begin, 0, begin);
    while now - begin < most_ns && !search.is_over() {
        now = now + tick;
        let characters: Vec<_> = std::iter::from_fn(|| uart.receive(now)).collect();
        let bytes: Vec<u8> = characters.iter().map(|character| character.value).collect();
        let mut errors = Vec::new();
        for (offset, character) in (0..).zip(&characters) {
            errors.extend(character.error.map(|kind| LineError { offset, kind }));
        }
        counted += errors.len() as u64;
        match delivery {
            Delivery::Uart => {}
            Delivery::Packets if !errors.is_empty() => {
                let kind = LineErrorKind::ParityOrFraming;
                errors = (0..bytes.len() as u32).map(|offset| LineError { offset, kind }).collect();
            }
            Delivery::Packets | Delivery::Counts | Delivery::Silent => errors.clear(),
        }
        let chunk = Chunk { time: ReadTime::At(now), bytes: &bytes, line_errors: &errors };
        search.handle_bytes(&chunk);
        if delivery == Delivery::Counts && now - asked >= 1_000_000_000 {
            asked = now;
            search.handle_counters(counted, now);
        }
        search.handle_timeout(now);
        while let Some(action) = search.poll_action() {
            outcome.said.push(action.to_string());
            match action {
                Action::Try(line, _) => {
                    outcome.tried.push(line);
                    // Control transfers take their time.
                    now = now + 3 * MILLISECOND;
                    uart.set_line(line, now);
                    search.handle_line(true, now);
                }
                Action::Lock(lock) => outcome.lock = Some(lock),
                Action::NoTraffic(_) => outcome.silences += 1,
                Action::NothingFits(_) => outcome.misfits += 1,
                Action::Refused => panic!("nothing was refused"),
            }
        }
    }
    outcome.elapsed_ns = now - begin;
    outcome
}
