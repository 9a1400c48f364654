//! What was heard over a while: counts, and nothing that grows.

use crate::time::{SECOND, Timestamp};

/// Counts over a stretch of time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Window {
    /// When its first byte came; `None` before.
    pub(super) since: Option<Timestamp>,
    pub(super) bytes: u64,
    /// Bytes with line errors.
    pub(super) errors: u64,
    /// Bytes in frames.
    pub(super) framed: u64,
    /// Frames that only masters send, without echoes, and that only units send.
    pub(super) requests: u64,
    pub(super) responses: u64,
    /// Requests that came again as echoes.
    pub(super) echoes: u64,
    /// Responses that came again.
    pub(super) repeats: u64,
}

/// A window is complete after this long in nanoseconds, with so many frames or bytes, or after the longer time: a
/// bus that is polled once a minute is judged by what it says in ten.
const COMPLETE_NS: i64 = 5 * SECOND;
const COMPLETE_FRAMES: u64 = 16;
const COMPLETE_BYTES: u64 = 256;
const COMPLETE_ANYWAY_NS: i64 = 600 * SECOND;

impl Window {
    /// Tells whether the next window should begin.
    pub(super) fn is_complete(&self, now: Timestamp) -> bool {
        let Some(since) = self.since else { return false };
        let frames = self.requests.saturating_add(self.responses);
        let is_full = frames >= COMPLETE_FRAMES || self.bytes >= COMPLETE_BYTES;
        now - since >= if is_full { COMPLETE_NS } else { COMPLETE_ANYWAY_NS }
    }

    /// Joins it with the window after it.
    pub(super) fn with(&self, later: &Window) -> Window {
        Window {
            since: self.since.or(later.since),
            bytes: self.bytes.saturating_add(later.bytes),
            errors: self.errors.saturating_add(later.errors),
            framed: self.framed.saturating_add(later.framed),
            requests: self.requests.saturating_add(later.requests),
            responses: self.responses.saturating_add(later.responses),
            echoes: self.echoes.saturating_add(later.echoes),
            repeats: self.repeats.saturating_add(later.repeats),
        }
    }

    /// Tells whether nearly none of the bytes are in frames.
    pub(super) fn lacks_frames(&self) -> bool {
        self.framed.saturating_mul(20) < self.bytes
    }
}
