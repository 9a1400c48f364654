//! A field of a PDU: its name, its value, its bytes, and what is odd about it.

use std::fmt;
use std::ops::Range;

use crate::decode::function::{ExceptionCode, FunctionCode};

/// Is a named stretch of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PduField<'a> {
    /// What the specification calls it, in lower case.
    pub name: &'static str,
    /// What it says.
    pub value: PduValue<'a>,
    /// Its bytes, half-open, counted from the address byte.
    pub span: Range<usize>,
    /// Which sub-request or object of a list it belongs to, from 1; `None` outside of lists.
    pub item: Option<u16>,
    /// What is unusual about it.
    pub remark: Option<Remark>,
}

impl fmt::Display for PduField<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(item) = self.item {
            write!(f, "[{item}] ")?;
        }
        write!(f, "{} {}", self.name, self.value)?;
        match self.remark {
            Some(remark) => write!(f, " ({remark})"),
            None => Ok(()),
        }
    }
}

/// Is what a field says, before any device is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PduValue<'a> {
    /// A count, a length or a small number, shown in decimal.
    Number(u16),
    /// A register, a mask or a word, shown in hexadecimal.
    Word(u16),
    /// A number that has a name in the specification, shown in decimal up to 255.
    Named(u16, &'static str),
    /// A function code as on the wire.
    Function(FunctionCode),
    /// An exception code.
    Exception(ExceptionCode),
    /// Coils, inputs or status bits, the first in the lowest bit of the first byte; `count` of them are meant.
    Bits {
        /// The bytes as sent.
        bytes: &'a [u8],
        /// How many bits are meant, at most eight a byte.
        count: usize,
    },
    /// Registers, high byte first; an odd byte at the end is a register cut in two.
    Registers(&'a [u8]),
    /// Characters.
    Text(&'a [u8]),
    /// Bytes without a meaning here.
    Raw(&'a [u8]),
}

impl fmt::Display for PduValue<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            PduValue::Number(number) => write!(f, "{number}"),
            PduValue::Word(word) => write!(f, "0x{word:04x}"),
            PduValue::Named(number @ 0x100.., name) => write!(f, "0x{number:04x} {name}"),
            PduValue::Named(number, name) => write!(f, "{number} {name}"),
            PduValue::Function(code) if code.is_exception() => {
                write!(f, "{} exception of {}", code.0, code.without_exception())
            }
            PduValue::Function(code) => match code.name() {
                Some(name) => write!(f, "{} {name}", code.0),
                None => write!(f, "{}", code.0),
            },
            PduValue::Exception(code) => match code.name() {
                Some(name) => write!(f, "{} {name}", code.0),
                None => write!(f, "{}", code.0),
            },
            PduValue::Bits { bytes, count } => write_bits(f, bytes, count),
            PduValue::Registers(bytes) => write_groups(f, bytes, 2, "0x"),
            PduValue::Text(bytes) => write!(f, "\"{}\"", bytes.escape_ascii()),
            PduValue::Raw(bytes) => write_groups(f, bytes, 1, ""),
        }
    }
}

/// Writes bits in the order of their numbers, eight to a group.
fn write_bits(f: &mut fmt::Formatter<'_>, bytes: &[u8], count: usize) -> fmt::Result {
    for index in 0..count.min(bytes.len().saturating_mul(8)) {
        if index > 0 && index % 8 == 0 {
            f.write_str(" ")?;
        }
        let byte = bytes.get(index / 8).copied().unwrap_or(0);
        f.write_str(if byte >> (index % 8) & 1 == 1 { "1" } else { "0" })?;
    }
    Ok(())
}

/// Writes bytes in hexadecimal, in groups with a prefix.
fn write_groups(f: &mut fmt::Formatter<'_>, bytes: &[u8], size: usize, prefix: &str) -> fmt::Result {
    for (index, group) in bytes.chunks(size).enumerate() {
        f.write_str(if index == 0 { "" } else { " " })?;
        f.write_str(prefix)?;
        for byte in group {
            write!(f, "{byte:02x}")?;
        }
    }
    Ok(())
}

/// Says what is unusual about a field that could be read all the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remark {
    /// The specification allows only `least` to `most`, both included.
    OutsideRange {
        /// The smallest value allowed.
        least: u16,
        /// The largest value allowed.
        most: u16,
    },
    /// Another field of the frame asks for this value.
    Expected(u16),
    /// The byte count is smaller than the bytes that follow.
    Follow {
        /// How many bytes do follow, up to the CRC.
        bytes: usize,
    },
    /// The byte count gives registers: twice as many bytes follow.
    CountsRegisters,
    /// These bytes are no part of the function's form.
    LeftOver,
    /// These bytes could not be read, because reading had stopped before them.
    Unread,
    /// The CRC should be this.
    BadCrc {
        /// What the bytes before the CRC ask for.
        computed: u16,
    },
    /// Something else, in words.
    Note(&'static str),
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Remark::OutsideRange { least, most } => write!(f, "outside {least} to {most}"),
            Remark::Expected(value) => write!(f, "expected {value}"),
            Remark::Follow { bytes } => write!(f, "yet {bytes} {} follow", plural(*bytes)),
            Remark::CountsRegisters => f.write_str("counts registers: twice as many bytes follow"),
            Remark::LeftOver => f.write_str("not part of the function's form"),
            Remark::Unread => f.write_str("not read"),
            Remark::BadCrc { computed } => write!(f, "bad, computed 0x{computed:04x}"),
            Remark::Note(text) => f.write_str(text),
        }
    }
}

/// Says where reading broke off, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// The first byte that could not be read as meant, counted from the address byte.
    pub offset: usize,
    /// The field that could not be read.
    pub field: &'static str,
    /// What was wrong.
    pub reason: StopReason,
}

/// Says why a field could not be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The bytes end too early.
    Missing {
        /// How many bytes the field needs.
        needed: usize,
        /// How many there are.
        present: usize,
    },
    /// A byte count does not leave room for the fields that it covers.
    CountTooSmall {
        /// The byte count given.
        given: usize,
        /// The smallest that would do.
        least: usize,
    },
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "stopped at byte {}: {} ", self.offset, self.field)?;
        match self.reason {
            StopReason::Missing { needed, present: 0 } => {
                write!(f, "is missing ({needed} {})", plural(needed))
            }
            StopReason::Missing { needed, present } => {
                let absent = needed.saturating_sub(present);
                write!(f, "needs {needed} {}, {present} follow, {absent} missing", plural(needed))
            }
            StopReason::CountTooSmall { given, least } => write!(f, "is {given}, and needs at least {least}"),
        }
    }
}

/// Returns the unit for a number of bytes.
fn plural(count: usize) -> &'static str {
    if count == 1 { "byte" } else { "bytes" }
}
