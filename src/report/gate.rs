//! Rows wait here, in order, until it is known whether they pass the filter.

use std::collections::VecDeque;

/// Says whether a row passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It is settled.
    Settled(bool),
    /// The transaction of this frame decides; `alone` holds should it belong to none.
    Awaits { frame: u64, alone: bool },
}

/// Holds written rows back until nothing before them is undecided.
#[derive(Debug, Default)]
pub(super) struct Gate {
    bytes: VecDeque<u8>,
    rows: VecDeque<(usize, Verdict)>,
}

impl Gate {
    /// Takes a written row.
    pub(super) fn push(&mut self, row: &[u8], verdict: Verdict) {
        self.bytes.extend(row);
        self.rows.push_back((row.len(), verdict));
    }

    /// Settles the rows of frames by the transaction they belong to.
    pub(super) fn decide(&mut self, frames: [Option<u64>; 2], passes: bool) {
        for (_, verdict) in &mut self.rows {
            if let Verdict::Awaits { frame, .. } = *verdict
                && frames.contains(&Some(frame))
            {
                *verdict = Verdict::Settled(passes);
            }
        }
    }

    /// Lets the rows of frames pass, whatever their transaction is.
    pub(super) fn admit(&mut self, frames: &[u64]) {
        for (_, verdict) in &mut self.rows {
            if matches!(verdict, Verdict::Awaits { frame, .. } if frames.contains(frame)) {
                *verdict = Verdict::Settled(true);
            }
        }
    }

    /// Settles the rows of frames before `settled_frame`, which belong to no transaction, and lets go
    /// of all rows up to the first undecided one: to `out` those that pass.
    pub(super) fn release(&mut self, settled_frame: u64, out: &mut Vec<u8>) {
        while let Some(&(length, verdict)) = self.rows.front() {
            let passes = match verdict {
                Verdict::Settled(passes) => passes,
                Verdict::Awaits { frame, alone } if frame < settled_frame => alone,
                Verdict::Awaits { .. } => return,
            };
            let row = self.bytes.drain(..length);
            if passes {
                out.extend(row);
            }
            self.rows.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn released(gate: &mut Gate, settled: u64) -> String {
        let mut out = Vec::new();
        gate.release(settled, &mut out);
        String::from_utf8(out).expect("rows of this test")
    }

    #[test]
    fn a_frame_passes_with_its_transaction_and_rows_keep_their_order() {
        let mut gate = Gate::default();
        gate.push(b"request ", Verdict::Awaits { frame: 0, alone: false });
        gate.push(b"noise ", Verdict::Awaits { frame: 1, alone: true });
        gate.push(b"response ", Verdict::Awaits { frame: 2, alone: false });
        gate.push(b"identified ", Verdict::Settled(true));
        assert_eq!(released(&mut gate, 0), "");
        gate.decide([Some(0), Some(2)], true);
        assert_eq!(released(&mut gate, 0), "request ", "what the noise belongs to is not known yet");
        gate.push(b"named ", Verdict::Awaits { frame: 2, alone: false });
        gate.push(b"next ", Verdict::Awaits { frame: 3, alone: true });
        gate.admit(&[2]);
        assert_eq!(released(&mut gate, 3), "noise response identified named ");
        gate.decide([Some(3), None], false);
        assert_eq!(released(&mut gate, u64::MAX), "");
    }
}
