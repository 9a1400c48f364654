//! The lengths a frame can have, from its first bytes: one table for the framer.
//!
//! Ranges are those of the Modbus application protocol V1.1b3, section 6; forms outside it come from the
//! profiles' [`Shapes`]. A header that no form allows has no candidate.

use crate::decode::frame::{MAX_FRAME, Role};
use crate::decode::shape::{Form, Shapes};

/// The shortest frame: address, function, CRC.
pub const MIN_FRAME: usize = 4;

/// Says what a candidate's length rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// The specification's form.
    Standard,
    /// A form that a profile declares.
    Declared(Form),
    /// An unknown function code: any length whose CRC is good.
    AnyLength,
}

/// Says how unusual a candidate is, within its form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Oddity {
    /// Nothing unusual.
    None,
    /// Zero registers asked for or written.
    ZeroQuantity,
    /// A response with byte count 0.
    ZeroByteCount,
    /// A response with byte count 0 and data all the same.
    UncountedData,
    /// A coil value other than FF00 and 0000.
    CoilValue,
    /// An exception code above 0x0B, or an exception of an unknown function.
    Exception,
}

/// Is one form that the bytes may be the beginning of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Who would have sent it.
    pub role: Role,
    /// Bytes from address to CRC; 0 while the header does not tell yet, or for any length.
    pub length: u16,
    /// What the length rests on.
    pub basis: Basis,
    /// How unusual it is.
    pub oddity: Oddity,
}

/// Lists the candidates of one start; at most six.
#[derive(Clone, Copy, Debug)]
pub struct Candidates {
    list: [Candidate; 6],
    len: u8,
    /// Whether more bytes can still change the list.
    pub undecided: bool,
}

impl Candidates {
    const EMPTY: Candidates = Candidates {
        list: [Candidate { role: Role::Unknown, length: 0, basis: Basis::Standard, oddity: Oddity::None }; 6],
        len: 0,
        undecided: false,
    };

    /// Returns the candidates.
    pub fn as_slice(&self) -> &[Candidate] {
        &self.list[..usize::from(self.len)]
    }

    fn push(&mut self, role: Role, length: usize, basis: Basis, oddity: Oddity) {
        if length <= MAX_FRAME && usize::from(self.len) < self.list.len() {
            self.list[usize::from(self.len)] = Candidate { role, length: length as u16, basis, oddity };
            self.len += 1;
        }
    }

    fn standard(&mut self, role: Role, length: usize) {
        self.push(role, length, Basis::Standard, Oddity::None);
    }

    /// Adds a form whose length the bytes so far do not tell.
    fn pending(&mut self, role: Role) {
        self.push(role, 0, Basis::Standard, Oddity::None);
        self.undecided = true;
    }
}

fn be16(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]))
}

/// Tells whether a function code has a length of its own in the specification.
pub const fn has_known_length(function: u8) -> bool {
    matches!(function, 1..=8 | 11 | 12 | 15..=17 | 20..=24 | 43)
}

/// Lists what `bytes`, from an address on, may be the beginning of.
///
/// Fewer than two bytes have no candidates yet, and are undecided.
pub fn candidates(bytes: &[u8], shapes: &Shapes) -> Candidates {
    let mut out = Candidates::EMPTY;
    let Some(&function) = bytes.get(1) else {
        out.undecided = true;
        return out;
    };
    match function {
        1..=4 => read_request(bytes, shapes, &mut out),
        5 => single_coil(bytes, &mut out),
        6 | 8 => both(8, &mut out),
        7 => fixed(4, 5, &mut out),
        11 => fixed(4, 8, &mut out),
        12 | 17 => {
            out.standard(Role::Request, 4);
            counted_response(bytes, &mut out);
        }
        15 | 16 => multiple_write(bytes, &mut out),
        20 | 21 => file_record(bytes, &mut out),
        22 => both(10, &mut out),
        23 => read_write(bytes, &mut out),
        24 => fifo(bytes, &mut out),
        43 => encapsulated(bytes, &mut out),
        0x81..=0xFE => exception(bytes, &mut out),
        9 | 10 | 13 | 14 | 18 | 19 | 25..=42 | 44..=0x7F => {
            out.push(Role::Request, 0, Basis::AnyLength, Oddity::None);
            out.push(Role::Response, 0, Basis::AnyLength, Oddity::None);
        }
        0 | 0x80 | 0xFF => {}
    }
    if matches!(function, 3 | 4) {
        register_response(bytes, shapes, &mut out);
    } else if matches!(function, 1 | 2 | 23) {
        counted_response(bytes, &mut out);
    }
    out
}

fn both(length: usize, out: &mut Candidates) {
    fixed(length, length, out);
}

fn fixed(request: usize, response: usize, out: &mut Candidates) {
    out.standard(Role::Request, request);
    out.standard(Role::Response, response);
}

/// Functions 1 to 4: start and quantity.
fn read_request(bytes: &[u8], shapes: &Shapes, out: &mut Candidates) {
    let most = if bytes[1] <= 2 { 2000 } else { 125 }; // V1.1b3, 6.1 to 6.4
    let (Some(start), Some(quantity)) = (be16(bytes, 2), be16(bytes, 4)) else {
        // The high byte alone often rules a request out.
        if bytes.get(4).is_none_or(|&high| u16::from(high) << 8 <= most) {
            out.pending(Role::Request);
        }
        return;
    };
    if quantity == 0 {
        let declared = shapes.declares(bytes[1], start, Form::ZeroQuantity);
        let basis = if declared { Basis::Declared(Form::ZeroQuantity) } else { Basis::Standard };
        out.push(Role::Request, 8, basis, Oddity::ZeroQuantity);
    } else if quantity <= most && u32::from(start) + u32::from(quantity) <= 0x1_0000 {
        out.standard(Role::Request, 8);
    }
}

/// Functions 3 and 4: an even byte count, or a form a profile declares.
fn register_response(bytes: &[u8], shapes: &Shapes, out: &mut Candidates) {
    let Some(&count) = bytes.get(2) else { return out.pending(Role::Response) };
    let length = 5 + usize::from(count);
    if count == 0 {
        out.push(Role::Response, 5, Basis::Standard, Oddity::ZeroByteCount);
        if shapes.any(bytes[1], Form::UncountedData) {
            let basis = Basis::Declared(Form::UncountedData);
            out.push(Role::Response, 7, basis, Oddity::UncountedData);
            out.push(Role::Response, 9, basis, Oddity::UncountedData);
        }
    } else if count.is_multiple_of(2) && count <= 250 {
        out.standard(Role::Response, length);
        if shapes.counts_registers(bytes[1], count) {
            let basis = Basis::Declared(Form::CountsRegisters);
            out.push(Role::Response, 5 + 2 * usize::from(count), basis, Oddity::None);
        }
    }
}

/// Functions 1, 2, 12, 17 and 23: a byte count.
fn counted_response(bytes: &[u8], out: &mut Candidates) {
    let Some(&count) = bytes.get(2) else { return out.pending(Role::Response) };
    let fits = match bytes[1] {
        12 => (6..=70).contains(&count), // status, two counters, up to 64 events: V1.1b3, 6.10
        23 => count.is_multiple_of(2) && (2..=250).contains(&count),
        _ => (1..=250).contains(&count),
    };
    if fits {
        out.standard(Role::Response, 5 + usize::from(count));
    }
}

/// Function 5: on, off, or an odd value that a device may still accept.
fn single_coil(bytes: &[u8], out: &mut Candidates) {
    let oddity = match be16(bytes, 4) {
        Some(0xFF00 | 0x0000) => Oddity::None,
        Some(_) => Oddity::CoilValue,
        None => {
            out.undecided = true;
            Oddity::None
        }
    };
    out.push(Role::Request, 8, Basis::Standard, oddity);
    out.push(Role::Response, 8, Basis::Standard, oddity);
}

/// Functions 15 and 16: quantity and byte count must agree.
fn multiple_write(bytes: &[u8], out: &mut Candidates) {
    let most = if bytes[1] == 15 { 1968 } else { 123 }; // V1.1b3, 6.11 and 6.12
    let Some(quantity) = be16(bytes, 4) else {
        out.pending(Role::Request);
        return out.push(Role::Response, 8, Basis::Standard, Oddity::None);
    };
    if quantity > most {
        return;
    }
    let oddity = if quantity == 0 { Oddity::ZeroQuantity } else { Oddity::None };
    out.push(Role::Response, 8, Basis::Standard, oddity);
    let Some(&count) = bytes.get(6) else { return out.pending(Role::Request) };
    let expected = if bytes[1] == 15 { quantity.div_ceil(8) } else { 2 * quantity };
    if u16::from(count) == expected {
        out.push(Role::Request, 9 + usize::from(count), Basis::Standard, oddity);
    }
}

/// Functions 20 and 21: sub-requests of at least seven bytes.
fn file_record(bytes: &[u8], out: &mut Candidates) {
    let Some(&count) = bytes.get(2) else {
        out.pending(Role::Request);
        return out.pending(Role::Response);
    };
    let length = 5 + usize::from(count);
    let (request, response) = if bytes[1] == 20 {
        ((7..=245).contains(&count) && count.is_multiple_of(7), (2..=245).contains(&count)) // 6.14
    } else {
        let fits = (9..=251).contains(&count); // 6.15; the response repeats the request
        (fits, fits)
    };
    if request {
        out.standard(Role::Request, length);
    }
    if response {
        out.standard(Role::Response, length);
    }
}

/// Function 23: read and write quantities in one request.
fn read_write(bytes: &[u8], out: &mut Candidates) {
    let (Some(read), Some(write), Some(&count)) = (be16(bytes, 4), be16(bytes, 8), bytes.get(10)) else {
        return out.pending(Role::Request);
    };
    if (1..=125).contains(&read) && (1..=121).contains(&write) && u16::from(count) == 2 * write {
        out.standard(Role::Request, 13 + usize::from(count)); // 6.17
    }
}

/// Function 24: a two-byte count of at most 64 bytes.
fn fifo(bytes: &[u8], out: &mut Candidates) {
    out.standard(Role::Request, 6);
    match be16(bytes, 2) {
        None => out.pending(Role::Response),
        Some(count @ 2..=64) if count.is_multiple_of(2) => {
            out.standard(Role::Response, 6 + usize::from(count)); // 6.18
        }
        Some(_) => {}
    }
}

/// Function 43: device identification (MEI type 14), or any length for other types.
fn encapsulated(bytes: &[u8], out: &mut Candidates) {
    match bytes.get(2) {
        None => {
            out.pending(Role::Request);
            out.pending(Role::Response);
        }
        Some(14) => {
            if bytes.get(3).is_none_or(|code| (1..=4).contains(code)) {
                out.standard(Role::Request, 7);
                match identification_length(bytes) {
                    Some(length) => out.standard(Role::Response, length),
                    None => out.pending(Role::Response),
                }
            }
        }
        Some(_) => {
            out.push(Role::Request, 0, Basis::AnyLength, Oddity::None);
            out.push(Role::Response, 0, Basis::AnyLength, Oddity::None);
        }
    }
}

/// Walks the object list of a device identification response (6.21); `None` until all lengths are there.
fn identification_length(bytes: &[u8]) -> Option<usize> {
    let objects = *bytes.get(7)?;
    let mut at = 8;
    for _ in 0..objects {
        at += 2 + usize::from(*bytes.get(at + 1)?);
        if at + 2 > MAX_FRAME {
            return Some(MAX_FRAME + 1); // too long to be a frame: dropped by `push`
        }
    }
    Some(at + 2)
}

/// Exceptions: a code from 1 to 0x7F, those the specification lists being usual.
fn exception(bytes: &[u8], out: &mut Candidates) {
    let known = has_known_length(bytes[1] & 0x7F);
    match bytes.get(2) {
        None => out.pending(Role::Response),
        Some(1..=0x0B) if known => out.standard(Role::Response, 5),
        Some(1..=0x7F) => out.push(Role::Response, 5, Basis::Standard, Oddity::Exception),
        Some(_) => {}
    }
}
