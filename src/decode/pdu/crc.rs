//! The CRC that a frame carries, beside the one it should.

use crate::decode::crc::checksum;

/// Sets the CRC a frame carries beside the one it should.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crc {
    /// The last two bytes, low byte first.
    pub given: u16,
    /// What the bytes before them ask for.
    pub computed: u16,
}

impl Crc {
    /// Takes the last two bytes for a CRC; `None` under four bytes, the shortest frame.
    pub fn of(bytes: &[u8]) -> Option<Crc> {
        match bytes {
            [before @ .., low, high] if before.len() >= 2 => {
                Some(Crc { given: u16::from_le_bytes([*low, *high]), computed: checksum(before) })
            }
            _ => None,
        }
    }

    /// Tells whether both agree.
    pub fn is_good(self) -> bool {
        self.given == self.computed
    }
}
