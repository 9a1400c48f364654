//! What became of the bytes of a part.

/// Counts the bytes of a part.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Totals {
    pub(super) written: u64,
    pub(super) lost: u64,
    /// Of those written, the ones that a failing disk would take.
    pub(super) unsafe_bytes: u64,
}

impl Totals {
    /// Counts as lost what the disk did not take; returns how much that was.
    pub(super) fn lose(&mut self) -> u64 {
        let lost = std::mem::take(&mut self.unsafe_bytes);
        self.lost = self.lost.saturating_add(lost);
        self.written = self.written.saturating_sub(lost);
        lost
    }
}
