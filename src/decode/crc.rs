//! The frame check: CRC-16 with polynomial 0x8005 reflected and start 0xFFFF, low byte first.
//!
//! Run over a whole frame, CRC included, the register ends at 0; a 0x00 byte keeps it there, which is why a
//! good frame followed by 0x00 looks good as well (Modbus serial line V1.02, 2.5.1.2 and appendix B).

use crc::{CRC_16_MODBUS, Crc};

const TABLE: Crc<u16> = Crc::<u16>::new(&CRC_16_MODBUS);
static MODBUS: Crc<u16> = TABLE;

/// Computes the CRC of the bytes; 0 when they end in their own CRC.
pub fn checksum(bytes: &[u8]) -> u16 {
    MODBUS.checksum(bytes)
}

/// Tells whether the bytes end in their own CRC.
pub fn is_good(bytes: &[u8]) -> bool {
    bytes.len() >= 4 && checksum(bytes) == 0
}

/// Holds a CRC register that is fed byte by byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register(u16);

impl Register {
    /// Makes a register that has seen nothing.
    pub const NEW: Register = Register(0xFFFF);

    /// Returns the register after these bytes.
    pub fn after(self, bytes: &[u8]) -> Register {
        // The register is kept as the algorithm sees it; the crate wants a starting value reflected.
        let mut digest = MODBUS.digest_with_initial(self.0.reverse_bits());
        digest.update(bytes);
        Register(digest.finalize())
    }

    /// Tells whether the bytes fed so far end in their own CRC.
    pub fn is_zero(self) -> bool {
        self.0 == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START_MEASUREMENT: [u8; 8] = [0x01, 0x03, 0x25, 0x00, 0x00, 0x00, 0x4E, 0xC6]; // DO manual, figure 23

    #[test]
    fn a_printed_frame_is_good_and_one_flipped_bit_is_not() {
        assert!(is_good(&START_MEASUREMENT));
        let mut flipped = START_MEASUREMENT;
        flipped[3] ^= 0x10;
        assert!(!is_good(&flipped));
        assert_eq!(checksum(&START_MEASUREMENT[..6]), u16::from_le_bytes([0x4E, 0xC6]));
    }

    #[test]
    fn a_register_fed_in_pieces_agrees_with_the_whole() {
        for cut in 0..=START_MEASUREMENT.len() {
            let (head, tail) = START_MEASUREMENT.split_at(cut);
            let head = Register::NEW.after(head);
            assert!(head.after(tail).is_zero(), "cut at {cut}");
        }
        assert_eq!(Register::NEW.after(&START_MEASUREMENT[..6]).0, checksum(&START_MEASUREMENT[..6]));
    }

    #[test]
    fn a_zero_after_a_good_frame_stays_good() {
        let register = Register::NEW.after(&START_MEASUREMENT);
        assert!(register.after(&[0]).is_zero());
        assert!(!register.after(&[1]).is_zero());
    }
}
