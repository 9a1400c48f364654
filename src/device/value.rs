//! What a field is worth, and how numbers are written.

use std::borrow::Cow;
use std::fmt;

/// Holds what a field is worth.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'a> {
    /// A number that came as a 32-bit float; always finite.
    Float32(f32),
    /// A number that was calculated or scaled; always finite.
    Float64(f64),
    /// A whole number, a flag mask or a code.
    Integer(i64),
    /// Text, without control characters.
    Text(Cow<'a, str>),
    /// True or false.
    Boolean(bool),
    /// Not a value: a float that is not a number or infinite, a clock that shows no date.
    Null,
}

impl Value<'_> {
    /// Returns the number as a 64-bit float; `None` when it is none.
    pub fn as_f64(&self) -> Option<f64> {
        match *self {
            Value::Float32(number) => Some(f64::from(number)),
            Value::Float64(number) => Some(number),
            Value::Integer(number) => Some(number as f64),
            Value::Text(_) | Value::Boolean(_) | Value::Null => None,
        }
    }

    /// Tells whether there is no value.
    pub fn is_null(&self) -> bool {
        *self == Value::Null
    }
}

impl fmt::Display for Value<'_> {
    /// Writes a number as the shortest decimal that reads back to the same bits, in its own width.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Float32(number) if is_plain(f64::from(*number)) => write_plain(f, *number),
            Value::Float32(number) => write!(f, "{number:e}"),
            Value::Float64(number) if is_plain(*number) => write_plain(f, *number),
            Value::Float64(number) => write!(f, "{number:e}"),
            Value::Integer(number) => write!(f, "{number}"),
            Value::Text(text) => f.write_str(text),
            Value::Boolean(truth) => write!(f, "{truth}"),
            Value::Null => f.write_str("null"),
        }
    }
}

/// Tells whether a number reads well without an exponent.
fn is_plain(number: f64) -> bool {
    number == 0.0 || (1e-5..1e16).contains(&number.abs())
}

/// Writes a finite number as `{}` does: ryu is faster, but always writes a point, and large numbers by exponent.
fn write_plain(f: &mut fmt::Formatter<'_>, number: impl ryu::Float + fmt::Display) -> fmt::Result {
    let mut buffer = ryu::Buffer::new();
    let text = buffer.format_finite(number);
    if text.contains('e') {
        write!(f, "{number}")
    } else {
        f.write_str(text.strip_suffix(".0").unwrap_or(text))
    }
}

/// Returns bytes of a bus as text: ends trimmed of NUL and space, what is not printable ASCII escaped.
pub(super) fn ascii(bytes: &[u8]) -> Cow<'_, str> {
    let end = bytes.iter().rposition(|&byte| byte != 0 && byte != b' ').map_or(0, |last| last + 1);
    let bytes = &bytes[..end]; // `end` is at most the length
    let printable = |byte: &u8| (0x20..0x7F).contains(byte);
    match std::str::from_utf8(bytes) {
        Ok(text) if bytes.iter().all(printable) => Cow::Borrowed(text),
        _ => Cow::Owned(bytes.escape_ascii().to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_float_is_written_as_the_shortest_decimal_of_its_own_width() {
        assert_eq!(Value::Float32(f32::from_le_bytes([0xCD, 0xCC, 0xFC, 0x40])).to_string(), "7.9");
        assert_eq!(Value::Float64(7.9).to_string(), "7.9");
        assert_eq!(Value::Float32(-0.001).to_string(), "-0.001");
        assert_eq!(Value::Float32(f32::from_be_bytes([0, 0, 0x8D, 0x41])).to_string(), "5.0672e-41");
    }

    #[test]
    fn a_plain_number_has_neither_point_nor_exponent_without_need() {
        for number in [0.0, -0.0, 17.0, -17.625, 2e-5, 0.1, 1e12, 1e13, 123_456_789_012_345.0_f32, 9.9e15] {
            assert_eq!(Value::Float32(number).to_string(), number.to_string());
            assert_eq!(Value::Float64(number.into()).to_string(), f64::from(number).to_string());
        }
    }

    #[test]
    fn text_of_a_bus_cannot_carry_control_characters() {
        assert_eq!(ascii(b"YL0114010022\0\0"), "YL0114010022");
        assert_eq!(ascii(b"\x1b[2J"), "\\x1b[2J");
        assert_eq!(ascii(&[0xFF, 0]), "\\xff");
        assert_eq!(ascii(&[0, 0]), "");
    }
}
