//! Marks that Linux puts into the bytes of a terminal with `PARMRK`, undone.

use crate::decode::chunk::{LineError, LineErrorKind};

const MARK: u8 = 0xff;

/// Undoes the marks of `PARMRK` (termios(3)); what a read cut in two goes on in the next.
///
/// `ff ff` is a received `ff`; `ff 00 c` is a `c` received with a wrong parity or stop bit. `ff 00 00` is a break or
/// a damaged zero, which the kernel does not tell apart: it becomes a zero byte marked as a break.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Marks {
    state: State,
}

#[derive(Clone, Copy, Debug, Default)]
enum State {
    #[default]
    Plain,
    /// After `ff`.
    Marked,
    /// After `ff 00`.
    Damaged,
}

impl Marks {
    /// Appends what `raw` says to bytes and line errors.
    pub(super) fn undo(&mut self, raw: &[u8], bytes: &mut Vec<u8>, errors: &mut Vec<LineError>) {
        for &byte in raw {
            self.state = match (self.state, byte) {
                (State::Plain, MARK) => State::Marked,
                (State::Marked, 0) => State::Damaged,
                (State::Damaged, _) => {
                    let kind = if byte == 0 { LineErrorKind::Break } else { LineErrorKind::ParityOrFraming };
                    errors.push(LineError { offset: u32::try_from(bytes.len()).unwrap_or(u32::MAX), kind });
                    bytes.push(byte);
                    State::Plain
                }
                (State::Marked, MARK) | (State::Plain, _) => {
                    bytes.push(byte);
                    State::Plain
                }
                // No kernel writes this. Nothing is to be lost: both are taken as received.
                (State::Marked, _) => {
                    bytes.extend([MARK, byte]);
                    State::Plain
                }
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn undo(reads: &[&[u8]]) -> (Vec<u8>, Vec<LineError>) {
        let (mut marks, mut bytes, mut errors) = (Marks::default(), Vec::new(), Vec::new());
        for read in reads {
            marks.undo(read, &mut bytes, &mut errors);
        }
        (bytes, errors)
    }

    #[test]
    fn a_doubled_ff_is_one_and_a_mark_is_a_line_error() {
        let raw = [0x01, 0xff, 0xff, 0x03, 0xff, 0x00, 0x26, 0xff, 0x00, 0xff, 0xff, 0x00, 0x00];
        let (bytes, errors) = undo(&[&raw]);
        assert_eq!(bytes, [0x01, 0xff, 0x03, 0x26, 0xff, 0x00]);
        let kinds: Vec<_> = errors.iter().map(|error| (error.offset, error.kind.name())).collect();
        assert_eq!(kinds, [(3, "parity-or-framing"), (4, "parity-or-framing"), (5, "break")]);
    }

    #[test]
    fn a_mark_that_no_kernel_writes_loses_no_byte() {
        assert_eq!(undo(&[&[0xff, 0x07, 0x08]]).0, [0xff, 0x07, 0x08]);
    }

    proptest! {
        /// What the kernel marks comes back, however reads cut it: n_tty.c, n_tty_receive_char_flagged.
        #[test]
        fn what_was_marked_comes_back_in_any_split(
            line in prop::collection::vec((any::<u8>(), prop::bool::weighted(0.2)), 0..200),
            cuts in prop::collection::vec(0_usize..600, 0..8),
        ) {
            let mut raw = Vec::new();
            for &(byte, is_damaged) in &line {
                match (is_damaged, byte) {
                    (true, _) => raw.extend([0xff, 0, byte]),
                    (false, 0xff) => raw.extend([0xff, 0xff]),
                    (false, _) => raw.push(byte),
                }
            }
            let mut cuts: Vec<usize> = cuts.iter().map(|cut| cut % (raw.len() + 1)).collect();
            cuts.extend([0, raw.len()]);
            cuts.sort_unstable();
            let reads: Vec<&[u8]> = cuts.windows(2).map(|cut| &raw[cut[0]..cut[1]]).collect();
            let (bytes, errors) = undo(&reads);
            let sent: Vec<u8> = line.iter().map(|&(byte, _)| byte).collect();
            prop_assert_eq!(bytes, sent);
            let damaged: Vec<u32> = (0..).zip(&line).filter(|(_, (_, bad))| *bad).map(|(at, _)| at).collect();
            let marked: Vec<u32> = errors.iter().map(|error| error.offset).collect();
            prop_assert_eq!(marked, damaged);
        }
    }
}
