//! Access to coils, inputs and registers (V1.1b3, sections 6.1 to 6.6, 6.11, 6.12 and 6.16 to 6.18).

use super::draft::{Draft, Parsed};
use super::field::{PduValue, Remark, StopReason};

/// Reads the request of functions 1 and 2 (6.1, 6.2): a start and 1 to 2000 bits.
pub(super) fn read_bits<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    start_and_quantity(draft, "start address", 2000, input).map(|(input, _)| (input, ()))
}

/// Reads the response of functions 1 and 2 (6.1, 6.2): eight bits a byte.
pub(super) fn bits<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, count) = draft.byte_count(input)?;
    let show = |bytes: &'a [u8]| PduValue::Bits { bytes, count: bytes.len().saturating_mul(8) };
    let (input, _) = draft.data("bits", count, show, input)?;
    Ok((input, ()))
}

/// Reads the request of functions 3 and 4 (6.3, 6.4): a start and 1 to 125 registers.
pub(super) fn read_registers<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    start_and_quantity(draft, "start register", 125, input).map(|(input, _)| (input, ()))
}

/// Reads the response of functions 3, 4 and 23 (6.3, 6.4, 6.17): two bytes a register.
pub(super) fn registers<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, count) = draft.byte_count(input)?;
    if count > 0 && draft.before_crc(input) == 2 * count {
        draft.remark(Remark::CountsRegisters);
    } else if count % 2 == 1 {
        draft.remark(Remark::Note("odd"));
    }
    let (input, _) = draft.data("registers", count, PduValue::Registers, input)?;
    Ok((input, ()))
}

/// Reads function 5 (6.5), the same both ways: an output, on or off.
pub(super) fn write_coil<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, _) = draft.word("output address", input)?;
    let show = |value| match value {
        0x0000 => PduValue::Named(value, "off"),
        0xFF00 => PduValue::Named(value, "on"),
        _ => PduValue::Word(value),
    };
    let (input, value) = draft.u16_as("output value", show, input)?;
    if !matches!(value, 0x0000 | 0xFF00) {
        draft.remark(Remark::Note("neither 0x0000 nor 0xff00"));
    }
    Ok((input, ()))
}

/// Reads function 6 (6.6), the same both ways: a register and its value.
pub(super) fn write_register<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, _) = draft.word("register", input)?;
    let (input, _) = draft.word("register value", input)?;
    Ok((input, ()))
}

/// Reads the request of function 15 (6.11): 1 to 1968 coils and their bits.
pub(super) fn write_coils<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, quantity) = start_and_quantity(draft, "start address", 1968, input)?;
    let (input, count) = draft.byte_count(input)?;
    let quantity = usize::from(quantity);
    draft.expect(count, quantity.div_ceil(8));
    let show = |bytes: &'a [u8]| PduValue::Bits { bytes, count: quantity.min(bytes.len().saturating_mul(8)) };
    let (input, _) = draft.data("bits", count, show, input)?;
    Ok((input, ()))
}

/// Reads the response of function 15 (6.11): what was written.
pub(super) fn coils_written<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    start_and_quantity(draft, "start address", 1968, input).map(|(input, _)| (input, ()))
}

/// Reads the request of function 16 (6.12): 1 to 123 registers and their values.
pub(super) fn write_registers<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, quantity) = start_and_quantity(draft, "start register", 123, input)?;
    let (input, count) = draft.byte_count(input)?;
    draft.expect(count, 2 * usize::from(quantity));
    let (input, _) = draft.data("registers", count, PduValue::Registers, input)?;
    Ok((input, ()))
}

/// Reads the response of function 16 (6.12): what was written.
pub(super) fn registers_written<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    start_and_quantity(draft, "start register", 123, input).map(|(input, _)| (input, ()))
}

/// Reads function 22 (6.16), the same both ways: a register and two masks.
pub(super) fn mask_write<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, _) = draft.word("register", input)?;
    let (input, _) = draft.word("AND mask", input)?;
    let (input, _) = draft.word("OR mask", input)?;
    Ok((input, ()))
}

/// Reads the request of function 23 (6.17): 1 to 125 registers to read, 1 to 121 to write.
pub(super) fn read_write<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, _) = draft.word("read start register", input)?;
    let (input, quantity) = draft.u16("read quantity", input)?;
    draft.check(quantity, 1, 125);
    let (input, _) = draft.word("write start register", input)?;
    let (input, quantity) = draft.u16("write quantity", input)?;
    draft.check(quantity, 1, 121);
    let (input, count) = draft.byte_count(input)?;
    draft.expect(count, 2 * usize::from(quantity));
    let (input, _) = draft.data("registers", count, PduValue::Registers, input)?;
    Ok((input, ()))
}

/// Reads the request of function 24 (6.18): where the queue is.
pub(super) fn read_fifo<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let (input, _) = draft.word("FIFO pointer address", input)?;
    Ok((input, ()))
}

/// Reads the response of function 24 (6.18): up to 31 registers, behind a byte count of two bytes.
pub(super) fn fifo<'a>(draft: &mut Draft<'a>, input: &'a [u8]) -> Parsed<'a> {
    let at = input;
    let (input, bytes) = draft.u16("byte count", input)?;
    let bytes = usize::from(bytes);
    if bytes < 2 {
        return Err(draft.broken("byte count", at, StopReason::CountTooSmall { given: bytes, least: 2 }));
    }
    let (input, count) = draft.u16("FIFO count", input)?;
    draft.check(count, 0, 31);
    if bytes != 2 + 2 * usize::from(count) {
        draft.expect(usize::from(count), (bytes - 2) / 2);
    }
    let (input, _) = draft.data("FIFO values", bytes - 2, PduValue::Registers, input)?;
    Ok((input, ()))
}

/// Reads a start and a quantity of 1 to `most`.
fn start_and_quantity<'a>(
    draft: &mut Draft<'a>,
    start: &'static str,
    most: u16,
    input: &'a [u8],
) -> Parsed<'a, u16> {
    let (input, _) = draft.word(start, input)?;
    let (input, quantity) = draft.u16("quantity", input)?;
    draft.check(quantity, 1, most);
    Ok((input, quantity))
}
