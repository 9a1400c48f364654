//! How a value lies in the bytes of a frame.

use std::borrow::Cow;
use std::fmt;

use super::value::{Value, ascii};

/// Names the order of the bytes A B C D of a value, A the most significant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// A B C D, as the Modbus specification has it.
    Big,
    /// D C B A, what Yosemitech sensors send (manuals, figure 28).
    Little,
    /// C D A B: words in little-endian order.
    BigSwapped,
    /// B A D C: bytes of each word swapped.
    LittleSwapped,
}

impl Order {
    /// All orders.
    pub const ALL: [Order; 4] = [Order::Big, Order::Little, Order::BigSwapped, Order::LittleSwapped];

    /// Says in words why a float has no value.
    pub(super) fn name_non_finite(self, bytes: &[u8]) -> &'static str {
        match f32::from_bits(unsigned(bytes, self)) {
            number if number.is_nan() => "not a number",
            number if number < 0.0 => "minus infinity",
            _ => "infinite",
        }
    }
}

/// Says how a value is encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// An IEEE 754 single precision float.
    Float32(Order),
    /// A whole number.
    Integer {
        /// Bytes: 1, 2 or 4.
        size: usize,
        /// Whether it is a two's complement.
        signed: bool,
        /// Order of the bytes.
        order: Order,
    },
    /// A mask of flags, most significant byte first.
    Flags {
        /// Bytes: 1, 2 or 4.
        size: usize,
    },
    /// Characters.
    Ascii {
        /// Bytes, from 1.
        length: usize,
    },
    /// Two bytes, major and minor.
    Version,
    /// Eight bytes of binary coded decimals: second, minute, hour, day, month, 0, year, 0.
    ///
    /// The year counts from 2000 (sonde manual, 2.2.6).
    BcdTime,
}

/// Names of all types that a profile may use, for messages.
pub(super) const TYPE_NAMES: [&str; 25] = [
    "f32-le",
    "f32-be",
    "f32-be-swapped",
    "f32-le-swapped",
    "u8",
    "i8",
    "u16-le",
    "u16-be",
    "i16-le",
    "i16-be",
    "u32-le",
    "u32-be",
    "u32-be-swapped",
    "u32-le-swapped",
    "i32-le",
    "i32-be",
    "i32-be-swapped",
    "i32-le-swapped",
    "u16",
    "i16",
    "u32",
    "i32",
    "bcd-time",
    "version",
    "f32",
];

impl Encoding {
    /// Returns the encoding of a type name; `length` in bytes is for `ascii` and `flags`.
    ///
    /// A number without an order is big-endian, as the Modbus specification has it.
    pub(super) fn from_name(name: &str, length: usize) -> Option<Self> {
        let (base, suffix) = name.split_once('-').unwrap_or((name, "be"));
        let order = match suffix {
            "be" => Order::Big,
            "le" => Order::Little,
            "be-swapped" => Order::BigSwapped,
            "le-swapped" => Order::LittleSwapped,
            _ => Order::Big,
        };
        let integer = |size, signed| Encoding::Integer { size, signed, order };
        Some(match (base, name) {
            (_, "ascii") => Encoding::Ascii { length },
            (_, "flags") => Encoding::Flags { size: length },
            _ if !TYPE_NAMES.contains(&name) => return None,
            (_, "version") => Encoding::Version,
            (_, "bcd-time") => Encoding::BcdTime,
            ("f32", _) => Encoding::Float32(order),
            ("u8", _) => integer(1, false),
            ("i8", _) => integer(1, true),
            ("u16", _) => integer(2, false),
            ("i16", _) => integer(2, true),
            ("u32", _) => integer(4, false),
            ("i32", _) => integer(4, true),
            _ => return None,
        })
    }

    /// Returns how many bytes a value takes.
    pub fn size(self) -> usize {
        match self {
            Encoding::Float32(_) => 4,
            Encoding::Integer { size, .. } | Encoding::Flags { size } => size,
            Encoding::Ascii { length } => length,
            Encoding::Version => 2,
            Encoding::BcdTime => 8,
        }
    }

    /// Tells whether values are numbers that can be scaled and compared.
    pub fn is_number(self) -> bool {
        matches!(self, Encoding::Float32(_) | Encoding::Integer { .. })
    }

    /// Reads a value; `bytes` too short for it give `Null`.
    pub(crate) fn read(self, bytes: &[u8]) -> Value<'_> {
        let Some(bytes) = bytes.get(..self.size()) else {
            return Value::Null;
        };
        match self {
            Encoding::Float32(order) => match f32::from_bits(unsigned(bytes, order)) {
                number if number.is_finite() => Value::Float32(number),
                _ => Value::Null,
            },
            Encoding::Integer { size, signed, order } => {
                let number = unsigned(bytes, order);
                Value::Integer(match (signed, size) {
                    (false, _) => i64::from(number),
                    (true, 1) => i64::from(number as u8 as i8),
                    (true, 2) => i64::from(number as u16 as i16),
                    (true, _) => i64::from(number as i32),
                })
            }
            Encoding::Flags { .. } => Value::Integer(i64::from(unsigned(bytes, Order::Big))),
            Encoding::Ascii { .. } => Value::Text(ascii(bytes)),
            Encoding::Version => Value::Text(Cow::Owned(format!("{}.{}", bytes[0], bytes[1]))), // two bytes
            Encoding::BcdTime => bcd_time(bytes).map_or(Value::Null, |time| Value::Text(Cow::Owned(time))),
        }
    }
}

impl fmt::Display for Encoding {
    /// Writes the type's name in profiles.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Encoding::Ascii { .. } => "ascii",
            Encoding::Flags { .. } => "flags",
            _ => {
                let is_own = |name: &&&str| Encoding::from_name(name, 1) == Some(*self);
                TYPE_NAMES.iter().find(is_own).unwrap_or(&"unknown")
            }
        })
    }
}

/// Joins up to four bytes to a number.
fn unsigned(bytes: &[u8], order: Order) -> u32 {
    let join = |number: u32, &byte: &u8| number << 8 | u32::from(byte);
    let big = bytes.iter().fold(0, join);
    match order {
        Order::Big => big,
        Order::Little => bytes.iter().rev().fold(0, join),
        Order::BigSwapped => big.rotate_left(16),
        Order::LittleSwapped => bytes.iter().rev().fold(0, join).rotate_left(16),
    }
}

/// Returns the date and time of eight bytes, `None` when they show none.
fn bcd_time(bytes: &[u8]) -> Option<String> {
    let decimal = |at: usize| {
        let byte = *bytes.get(at)?;
        let (tens, ones) = (byte >> 4, byte & 0x0F);
        (tens < 10 && ones < 10).then_some(u32::from(tens) * 10 + u32::from(ones))
    };
    let (second, minute, hour) = (decimal(0)?, decimal(1)?, decimal(2)?);
    let (day, month, year) = (decimal(3)?, decimal(4)?, 2000 + decimal(6)?);
    let days = match month {
        2 if year % 4 == 0 => 29, // every fourth year from 2000 to 2099 is a leap year
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => return None,
    };
    let is_time = second < 60 && minute < 60 && hour < 24;
    (is_time && (1..=days).contains(&day))
        .then(|| format!("{year}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read<'a>(name: &str, bytes: &'a [u8]) -> Value<'a> {
        Encoding::from_name(name, 1).expect(name).read(bytes)
    }

    #[test]
    fn the_manuals_example_float_reads_in_its_own_order_only() {
        // 17.625 of figure 28; a wrong order gives next to nothing, not visible garbage.
        let bytes = [0x00, 0x00, 0x8D, 0x41];
        assert_eq!(read("f32-le", &bytes), Value::Float32(17.625));
        assert_eq!(read("f32-be", &bytes), Value::Float32(f32::from_bits(0x0000_8D41)));
        assert_eq!(read("f32-be-swapped", &bytes), Value::Float32(f32::from_bits(0x8D41_0000)));
        assert_eq!(read("f32-le-swapped", &bytes), Value::Float32(f32::from_bits(0x0000_418D)));
    }

    #[test]
    fn negative_floats_read_right_where_the_manuals_sample_code_overflows() {
        // The sample code of section 1.5.1 leaves the sign bit in the exponent.
        assert_eq!(read("f32-le", &[0xE1, 0x7A, 0x24, 0xC1]), Value::Float32(-10.28));
        assert_eq!(read("f32-le", &[0x85, 0xEB, 0xD1, 0xC0]), Value::Float32(-6.56));
        assert_eq!(read("f32-le", &[0x66, 0x66, 0x7B, 0x42]), Value::Float32(62.85));
    }

    #[test]
    fn floats_without_a_value_are_null() {
        assert_eq!(read("f32-le", &f32::NAN.to_le_bytes()), Value::Null);
        assert_eq!(read("f32-le", &f32::INFINITY.to_le_bytes()), Value::Null);
        assert_eq!(read("f32-le", &[0, 0, 0]), Value::Null);
    }

    #[test]
    fn whole_numbers_have_width_sign_and_order() {
        assert_eq!(read("u16-le", &[0x1E, 0x00]), Value::Integer(30));
        assert_eq!(read("u16", &[0x1E, 0x00]), Value::Integer(7680));
        assert_eq!(read("i8", &[0xFF]), Value::Integer(-1));
        assert_eq!(read("i16", &[0xFF, 0xFE]), Value::Integer(-2));
        assert_eq!(read("i32-le", &[0xFE, 0xFF, 0xFF, 0xFF]), Value::Integer(-2));
        assert_eq!(read("u32-be-swapped", &[0x33, 0x44, 0x11, 0x22]), Value::Integer(0x1122_3344));
        assert_eq!(read("u32-le-swapped", &[0x22, 0x11, 0x44, 0x33]), Value::Integer(0x1122_3344));
    }

    #[test]
    fn a_clock_is_a_date_or_nothing() {
        let clock = |bytes: [u8; 8]| bcd_time(&bytes);
        let manual = [0x17, 0x05, 0x13, 0x26, 0x04, 0x00, 0x16, 0x00];
        assert_eq!(clock(manual).as_deref(), Some("2016-04-26T13:05:17"));
        assert_eq!(clock([0x59, 0x59, 0x23, 0x29, 0x02, 0, 0x24, 0]).as_deref(), Some("2024-02-29T23:59:59"));
        for (byte, wrong) in [
            (0, 0x5A),
            (0, 0x60),
            (1, 0x60),
            (2, 0x24),
            (3, 0x00),
            (3, 0x31),
            (4, 0x00),
            (4, 0x13),
            (6, 0xA0),
        ] {
            let mut bytes = manual;
            bytes[byte] = wrong;
            assert_eq!(clock(bytes), None, "byte {byte} {wrong:#04x}");
        }
        assert_eq!(clock([0, 0, 0, 0x29, 0x02, 0, 0x23, 0]), None, "no leap year");
    }

    #[test]
    fn a_type_has_one_spelling() {
        assert_eq!(Encoding::from_name("u8-swapped", 1), None);
        assert_eq!(Encoding::from_name("f64", 1), None);
        assert_eq!(Encoding::from_name("ascii-le", 1), None);
        for name in TYPE_NAMES {
            let encoding = Encoding::from_name(name, 1).expect(name);
            let whole = if encoding.size() > 1 && !name.contains('-') { "-be" } else { "" };
            let shown = if name == "version" { name.to_owned() } else { format!("{name}{whole}") };
            assert_eq!(encoding.to_string(), shown);
        }
    }
}
