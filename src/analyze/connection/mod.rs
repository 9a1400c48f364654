//! What is wrong between the bus and this program, when what comes makes no sense.
//!
//! Counts over the last two windows of some seconds are held against what a bus does that is well. A trouble is
//! told once it has lasted for a while, with its evidence and what to try; then again only when it has changed.

mod diagnosis;
mod window;

use crate::decode::chunk::{LineError, LineErrorKind};
use crate::decode::frame::{Frame, Role};
use crate::time::{SECOND, Timestamp};
pub(in crate::analyze) use diagnosis::marked;
pub use diagnosis::{Diagnosis, Trouble};
use window::Window;

/// A bus is silent after this long in nanoseconds, if nothing has come from it before; else after this long, or after
/// so many times its longest silence so far. Manuals ask for pauses of ten seconds.
const NOTHING_NS: i64 = 10 * SECOND;
const SILENCE_NS: i64 = 30 * SECOND;
const SILENCES: i64 = 3;
/// The longest silence that is waited for in nanoseconds: a bus that is polled once in five minutes is well.
const LONGEST_SILENCE_NS: i64 = 900 * SECOND;
/// How long a trouble lasts before it is told, in nanoseconds; frames are decided in less (see `decode`).
const LASTS_NS: i64 = 2 * SECOND;
/// How long bytes have come, in nanoseconds, before their sense is judged.
const FIRST_NS: i64 = 3 * SECOND;
/// The least bytes and frames to judge by.
const LEAST_BYTES: u64 = 200;
const LEAST_FRAMES: u64 = 8;

/// Watches a connection; pure, with time as an argument.
#[derive(Clone, Debug)]
pub struct Connection {
    before: Window,
    current: Window,
    begun: Timestamp,
    last_byte: Option<Timestamp>,
    longest_silence: i64,
    /// The bytes of the last frame, if it was a response.
    last_response: Vec<u8>,
    /// What the adapter has counted, where it does.
    counted: Option<u64>,
    /// What seems wrong, and since when.
    suspected: Option<(Trouble, Timestamp)>,
    told: Option<Trouble>,
    diagnosis: Option<Diagnosis>,
}

impl Connection {
    /// Begins to watch at a time.
    pub fn new(now: Timestamp) -> Self {
        Connection {
            before: Window::default(),
            current: Window::default(),
            begun: now,
            last_byte: None,
            longest_silence: 0,
            last_response: Vec::new(),
            counted: None,
            suspected: None,
            told: None,
            diagnosis: None,
        }
    }

    /// Takes in the bytes of a read: how many, and what the UART complained about.
    pub fn handle_bytes(&mut self, now: Timestamp, bytes: usize, line_errors: &[LineError]) {
        if bytes == 0 {
            return;
        }
        if let Some(last) = self.last_byte {
            self.longest_silence = self.longest_silence.max((now - last).min(LONGEST_SILENCE_NS));
        }
        self.last_byte = Some(self.last_byte.map_or(now, |last| last.max(now)));
        let damaged = line_errors.iter().filter(|error| error.kind != LineErrorKind::Overrun).count();
        self.current.since.get_or_insert(now);
        self.current.bytes = self.current.bytes.saturating_add(bytes as u64);
        self.current.errors = self.current.errors.saturating_add(damaged as u64);
    }

    /// Takes in how many parity and framing errors and breaks the adapter has counted since it was opened, for
    /// adapters that mark no bytes.
    pub fn handle_counters(&mut self, line_errors: u64) {
        let before = self.counted.replace(line_errors).unwrap_or(line_errors);
        self.current.errors = self.current.errors.saturating_add(line_errors.saturating_sub(before));
    }

    /// Takes in a frame.
    pub fn handle_frame(&mut self, frame: &Frame<'_>) {
        let bytes = frame.place.bytes;
        self.current.framed = self.current.framed.saturating_add(bytes.len() as u64);
        // Requests and responses of these look alike: they do not tell who is heard.
        if matches!(frame.function().0, 5 | 6 | 8 | 21 | 22) {
            return;
        }
        match frame.role {
            Role::Request if frame.echo => self.current.echoes += 1,
            Role::Request => self.current.requests += 1,
            Role::Response if self.last_response == bytes => {
                self.current.repeats += 1;
                // A third one is another.
                self.last_response.clear();
                return;
            }
            Role::Response => self.current.responses += 1,
            Role::Unknown => {}
        }
        self.last_response.clear();
        if frame.role == Role::Response {
            self.last_response.extend_from_slice(bytes);
        }
    }

    /// Judges what was taken in up to `now`; to be called a few times a second.
    pub fn handle_timeout(&mut self, now: Timestamp) {
        let both = self.before.with(&self.current);
        match self.trouble(now, &both) {
            Some(trouble) => self.suspect(trouble, now, &both),
            None => {
                self.suspected = None;
                self.clear(&both);
            }
        }
        if self.current.is_complete(now) {
            self.before = std::mem::take(&mut self.current);
        }
    }

    /// Returns what has changed.
    pub fn poll_diagnosis(&mut self) -> Option<Diagnosis> {
        self.diagnosis.take()
    }

    /// Tells a trouble that has lasted.
    fn suspect(&mut self, trouble: Trouble, now: Timestamp, both: &Window) {
        let since = match self.suspected {
            Some((before, since)) if before == trouble => since,
            _ => now,
        };
        self.suspected = Some((trouble, since));
        // Silence has lasted.
        if self.told != Some(trouble) && (trouble == Trouble::Silence || now - since >= LASTS_NS) {
            self.told = Some(trouble);
            self.diagnosis = Some(self.diagnose(trouble, now, both));
            if trouble == Trouble::Silence {
                // What was before says nothing of what comes after.
                (self.before, self.current) = (Window::default(), Window::default());
            }
        }
    }

    /// Tells that a trouble is over, once there is enough to say so.
    fn clear(&mut self, both: &Window) {
        let is_well = both.requests >= LEAST_FRAMES / 2 && both.responses >= LEAST_FRAMES / 2;
        if self.told.is_some() && is_well {
            self.told = None;
            let Window { requests, responses, .. } = both;
            self.diagnosis = Some(Diagnosis::well(format!("{requests} requests and {responses} responses")));
        }
    }

    /// Finds what is wrong, the worst first.
    fn trouble(&self, now: Timestamp, both: &Window) -> Option<Trouble> {
        if self.is_silent(now) {
            return Some(Trouble::Silence);
        }
        let is_few = |some: u64, of: u64| some.saturating_mul(20) < of;
        let is_early = both.since.is_none_or(|since| now - since < FIRST_NS);
        let has_bytes = both.bytes >= LEAST_BYTES;
        let Window { bytes, errors, requests, responses, echoes, repeats, .. } = *both;
        let is_doubled = |again: u64, once: u64| {
            again >= LEAST_FRAMES / 2 && again.saturating_mul(10) >= once.saturating_mul(8)
        };
        if is_early {
            None
        } else if has_bytes && both.lacks_frames() {
            Some(Trouble::NoFrames)
        } else if is_doubled(echoes, requests) || is_doubled(repeats, responses) {
            Some(Trouble::Echo)
        } else if requests >= LEAST_FRAMES && is_few(responses, requests) {
            Some(Trouble::OnlyRequests)
        } else if responses >= LEAST_FRAMES && is_few(requests, responses) {
            Some(Trouble::OnlyResponses)
        } else if has_bytes && errors.saturating_mul(4) >= bytes {
            Some(Trouble::LineErrors)
        } else {
            None
        }
    }

    fn is_silent(&self, now: Timestamp) -> bool {
        let Some(last) = self.last_byte else { return now - self.begun >= NOTHING_NS };
        now - last >= SILENCE_NS.max(self.longest_silence.saturating_mul(SILENCES)).min(LONGEST_SILENCE_NS)
    }

    fn diagnose(&self, trouble: Trouble, now: Timestamp, both: &Window) -> Diagnosis {
        let Window { bytes, errors, requests, responses, echoes, repeats, .. } = *both;
        let seconds = both.since.map_or(0, |since| now - since) / SECOND;
        let damaged = marked(bytes, errors).map_or_else(String::new, |share| format!(", {share}"));
        let evidence = match trouble {
            Trouble::Silence => {
                format!("not a byte in {} s", (now - self.last_byte.unwrap_or(self.begun)) / SECOND)
            }
            Trouble::NoFrames => {
                let framed = both.framed;
                format!("{bytes} bytes in {seconds} s{damaged}, and {framed} of them in frames")
            }
            Trouble::OnlyRequests => {
                format!("{requests} requests and {responses} responses in {seconds} s")
            }
            Trouble::OnlyResponses => {
                format!("{responses} responses and {requests} requests in {seconds} s")
            }
            Trouble::Echo if echoes >= repeats => {
                format!("{echoes} of {requests} requests were repeated in {seconds} s")
            }
            Trouble::Echo => format!("{repeats} of {responses} responses were repeated in {seconds} s"),
            Trouble::LineErrors => {
                format!("{bytes} bytes in {seconds} s{damaged}, though they make up frames")
            }
        };
        Diagnosis::of(trouble, evidence)
    }
}
