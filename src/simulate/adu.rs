//! Builds ADUs: address, function, data, CRC.

use crc::{CRC_16_MODBUS, Crc};

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_MODBUS);

/// Appends the CRC, low byte first (Modbus serial line V1.02, section 2.5.1.2).
pub(super) fn sealed(mut adu: Vec<u8>) -> Vec<u8> {
    let crc = checksum(&adu);
    adu.extend(crc.to_le_bytes());
    adu
}

/// Computes the CRC of bytes.
pub(super) fn checksum(bytes: &[u8]) -> u16 {
    CRC.checksum(bytes)
}

/// Builds an ADU from an address, a function and its data.
pub(super) fn adu(address: u8, function: u8, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(data.len() + 4);
    bytes.extend([address, function]);
    bytes.extend(data);
    sealed(bytes)
}

/// Builds an ADU whose data is two 16-bit numbers: most requests, and the acknowledgements of writes.
pub(super) fn two_words(address: u8, function: u8, first: u16, second: u16) -> Vec<u8> {
    let ([a, b], [c, d]) = (first.to_be_bytes(), second.to_be_bytes());
    adu(address, function, &[a, b, c, d])
}

/// Builds the response to a read: the byte count, then the data (at most 250 bytes).
pub(super) fn counted(address: u8, function: u8, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(data.len() + 5);
    bytes.extend([address, function, data.len() as u8]);
    bytes.extend(data);
    sealed(bytes)
}

/// Builds the request to write several registers or coils: start, quantity, byte count, data (at most 246 bytes).
pub(super) fn write(address: u8, function: u8, start: u16, quantity: u16, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(data.len() + 9);
    bytes.extend([address, function]);
    bytes.extend(start.to_be_bytes());
    bytes.extend(quantity.to_be_bytes());
    bytes.push(data.len() as u8);
    bytes.extend(data);
    sealed(bytes)
}
