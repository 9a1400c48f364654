//! The checksum of a frame.

use crc::{CRC_16_MODBUS, Crc as Engine, Table};

/// One table of 512 bytes: the least that is still a lookup a byte.
const ENGINE: Engine<u16, Table<1>> = Engine::<u16, Table<1>>::new(&CRC_16_MODBUS);

/// Computes the CRC of bytes (Modbus serial line V1.02, section 6.2.2); it is sent low byte first.
pub fn crc16(bytes: &[u8]) -> u16 {
    ENGINE.checksum(bytes)
}

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
                Some(Crc { given: u16::from_le_bytes([*low, *high]), computed: crc16(before) })
            }
            _ => None,
        }
    }

    /// Tells whether both agree.
    pub fn is_good(self) -> bool {
        self.given == self.computed
    }
}
