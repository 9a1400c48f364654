//! The request that waits for its answer, and how an answer fits it.

use crate::decode::candidate::{Basis, Candidate};
use crate::decode::shape::{Form, Shapes};
use crate::time::Timestamp;

/// Is what an answer with the registers or coils asked for looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlainAnswer {
    /// Unit address, function code, byte count.
    pub head: [u8; 3],
    /// Bytes from address to CRC.
    pub length: u16,
}

/// Says how a response fits a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// Unit, function, and byte count or echoed fields.
    Full,
    /// Unit and function only.
    Function,
    /// Not at all.
    None,
}

/// Holds what an answer must match; small enough to copy along every reading of the bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outstanding {
    /// Stream offset of the request.
    pub offset: u64,
    /// Unit address.
    pub address: u8,
    /// Function code.
    pub function: u8,
    /// Whether devices answer at this reserved address with their own or with it.
    service: bool,
    /// Whether a device declares forms of its own for this register.
    declared: bool,
    counts_registers: bool,
    /// Whether its echo has come: there is only one.
    pub echoed: bool,
    length: u16,
    start_register: u16,
    quantity: u16,
    head: [u8; 8],
    crc: [u8; 2],
    /// Best estimate of the request's end; `None` where the input has no times.
    pub end: Option<Timestamp>,
}

impl Outstanding {
    /// Makes it from a request of at least four bytes.
    pub fn new(offset: u64, bytes: &[u8], end: Option<Timestamp>, shapes: &Shapes) -> Self {
        let word = |at: usize| match bytes.get(at..at + 2) {
            Some(pair) => u16::from_be_bytes([pair[0], pair[1]]),
            None => 0,
        };
        let mut head = [0; 8];
        let known = bytes.len().min(8);
        head[..known].copy_from_slice(&bytes[..known]);
        let (function, start_register) = (bytes[1], word(2));
        Outstanding {
            offset,
            address: bytes[0],
            function,
            service: shapes.is_service_address(bytes[0]),
            declared: shapes.declares(function, start_register, Form::ZeroQuantity)
                || shapes.declares(function, start_register, Form::UncountedData),
            counts_registers: shapes.declares(function, start_register, Form::CountsRegisters),
            echoed: false,
            length: bytes.len() as u16,
            start_register,
            quantity: word(4),
            head,
            crc: [bytes[bytes.len() - 2], bytes[bytes.len() - 1]],
            end,
        }
    }

    /// Returns the request after its echo.
    pub fn after_echo(self) -> Self {
        Outstanding { echoed: true, ..self }
    }

    /// Tells whether nobody answers it.
    pub fn is_broadcast(&self) -> bool {
        self.address == 0
    }

    /// Tells whether the bytes are the request again; long requests are compared by head, length and CRC.
    pub fn same_bytes(&self, bytes: &[u8]) -> bool {
        bytes.len() == usize::from(self.length)
            && bytes[..bytes.len().min(8)] == self.head[..bytes.len().min(8)]
            && bytes.ends_with(&self.crc)
    }

    /// Tells whether the bytes begin like the request again: address, function and start register.
    pub fn repeats(&self, bytes: &[u8]) -> bool {
        self.length >= 8 && bytes.len() >= 4 && bytes[..4] == self.head[..4]
    }

    /// Tells whether the request begins with the bytes.
    pub fn starts_with(&self, bytes: &[u8]) -> bool {
        bytes.len() <= usize::from(self.length).min(8) && self.head.starts_with(bytes)
    }

    fn unit_and_function(&self, bytes: &[u8]) -> bool {
        (bytes[0] == self.address || self.service)
            && bytes.get(1).is_none_or(|function| function & 0x7F == self.function & 0x7F)
    }

    /// Returns the length of a normal response from address to CRC, where the request tells.
    pub fn response_length(&self) -> Option<usize> {
        Some(match self.function {
            1 | 2 => 5 + usize::from(self.quantity.div_ceil(8)),
            3 | 4 | 23 => 5 + 2 * usize::from(self.quantity),
            5 | 6 | 8 | 15 | 16 => 8,
            7 => 5,
            11 => 8,
            22 => 10,
            21 => usize::from(self.length),
            _ => return None,
        })
        .filter(|length| *length <= crate::decode::frame::MAX_FRAME)
    }

    /// Returns the answer that holds just what was asked for, where no device declares anything else for it.
    pub fn plain_answer(&self) -> Option<PlainAnswer> {
        let count = match self.function {
            1 | 2 if (1..=2000).contains(&self.quantity) => self.quantity.div_ceil(8),
            3 | 4 if (1..=125).contains(&self.quantity) => 2 * self.quantity,
            _ => return None,
        };
        let is_plain = !self.is_broadcast() && !self.service && !self.declared && !self.counts_registers;
        // At most 250, by the quantities above.
        is_plain
            .then_some(PlainAnswer { head: [self.address, self.function, count as u8], length: 5 + count })
    }

    /// Returns the length of the answer that begins here, if it is the plain one: at least six bytes.
    pub fn plain_response_length(&self, bytes: &[u8]) -> Option<usize> {
        let answer = self.plain_answer()?;
        bytes.starts_with(&answer.head).then_some(usize::from(answer.length))
    }

    /// Says how a whole response fits.
    pub fn fit(&self, candidate: Candidate, bytes: &[u8]) -> Fit {
        if !self.unit_and_function(bytes) || self.is_broadcast() {
            return Fit::None;
        }
        if bytes[1] & 0x80 != 0 {
            return Fit::Full;
        }
        let full = match self.function {
            3 | 4 if candidate.basis == Basis::Declared(Form::CountsRegisters) => {
                return if self.counts_registers && u16::from(bytes[2]) == self.quantity {
                    Fit::Full
                } else {
                    Fit::None
                };
            }
            3 | 4 if candidate.basis == Basis::Declared(Form::UncountedData) => {
                if !self.declared {
                    return Fit::None;
                }
                bytes.len() == 5 + 2 * usize::from(self.quantity)
            }
            // Start and stop are acknowledged with and without the bytes asked for.
            3 | 4 if self.declared && bytes[2] <= 2 => true,
            1..=4 | 23 => Some(bytes.len()) == self.response_length(),
            5 | 6 | 22 | 21 => self.same_bytes(bytes),
            8 => bytes[2..4] == self.head[2..4],
            15 | 16 => bytes[2..6] == self.head[2..6],
            _ => true,
        };
        if full { Fit::Full } else { Fit::Function }
    }

    /// Says whether the beginning of a response fits in unit and function, and, once it tells, in its fields.
    pub fn head_fit(&self, candidate: Candidate, bytes: &[u8]) -> (bool, Option<bool>) {
        if !self.unit_and_function(bytes) || self.is_broadcast() {
            return (false, None);
        }
        if bytes.len() < 3 {
            return (true, None);
        }
        if bytes[1] & 0x80 != 0 {
            return (true, Some(true));
        }
        let fits = match self.function {
            3 | 4 if self.declared && bytes[2] <= 2 => true,
            3 | 4 if candidate.basis == Basis::Declared(Form::CountsRegisters) => {
                self.counts_registers && u16::from(bytes[2]) == self.quantity
            }
            1..=4 | 23 => Some(usize::from(candidate.length)) == self.response_length(),
            5 | 6 | 8 | 15 | 16 | 22 => {
                let known = bytes.len().min(6);
                if known < 6 && bytes[2..known] == self.head[2..known] {
                    return (true, None);
                }
                bytes[2..known] == self.head[2..known]
            }
            _ => return (true, None),
        };
        (true, Some(fits))
    }
}
