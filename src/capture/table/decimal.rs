//! Decimals read exactly: none passes through a float.

/// Attoseconds in a nanosecond: what is finer than the resolution of times, but may add up to it.
pub(super) const PER_NANOSECOND: i128 = 1_000_000_000;
/// Attoseconds in a second.
pub(super) const PER_SECOND: i128 = PER_NANOSECOND * 1_000_000_000;

/// Reads a decimal number such as `-0.0025` or `2.375e-05`, in units of 10 to the minus `decimals` seconds.
///
/// Returns attoseconds, cut off; `None` when it is no decimal number or more than 10¹⁰ years.
pub(super) fn attoseconds(text: &[u8], decimals: u8) -> Option<i128> {
    let (is_negative, text) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
    let (mantissa, exponent) = match text.iter().position(|c| matches!(c, b'e' | b'E')) {
        Some(at) => (&text[..at], exponent(&text[at + 1..])?),
        None => (text, 0),
    };
    let (whole, fraction) = match mantissa.iter().position(|&c| c == b'.') {
        Some(point) => (&mantissa[..point], &mantissa[point + 1..]),
        None => (mantissa, &b""[..]),
    };
    if whole.is_empty() && fraction.is_empty() {
        return None;
    }
    let mut number: i128 = 0;
    for digit in whole.iter().chain(fraction) {
        let digit = char::from(*digit).to_digit(10)?;
        number = number.checked_mul(10)?.checked_add(i128::from(digit))?;
    }
    let shift = exponent + 18 - i32::from(decimals) - i32::try_from(fraction.len()).ok()?;
    let power = 10_i128.checked_pow(shift.unsigned_abs());
    let number = match (power, shift < 0) {
        (Some(power), true) => number / power,
        (Some(power), false) => number.checked_mul(power)?,
        (None, true) => 0,
        (None, false) if number == 0 => 0,
        (None, false) => return None,
    };
    Some(if is_negative { -number } else { number })
}

/// Reads an exponent from -999 to 999.
fn exponent(text: &[u8]) -> Option<i32> {
    let (sign, digits) = match text {
        [b'-', rest @ ..] => (-1, rest),
        [b'+', rest @ ..] => (1, rest),
        rest => (1, rest),
    };
    if digits.is_empty() || digits.len() > 3 {
        return None;
    }
    let mut number = 0;
    for digit in digits {
        number = number * 10 + i32::try_from(char::from(*digit).to_digit(10)?).ok()?;
    }
    Some(sign * number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_exact_in_every_form() {
        for (text, decimals, expected) in [
            ("0.042909760000000", 0, 42_909_760 * PER_NANOSECOND),
            ("2.375e-05", 0, 23_750 * PER_NANOSECOND),
            ("-0.5", 0, -PER_SECOND / 2),
            ("+1E+3", 0, 1000 * PER_SECOND),
            ("54414000.00000000000000000000", 9, 54_414_000 * PER_NANOSECOND),
            ("12", 3, 12_000_000 * PER_NANOSECOND),
            (".5", 6, 500 * PER_NANOSECOND),
            ("5.", 0, 5 * PER_SECOND),
            ("0.000000000000000001", 0, 1),
            ("0.0000000000000000019", 0, 1),
            ("1767225600.123456789", 0, 1_767_225_600_123_456_789 * PER_NANOSECOND),
            ("7e-999", 0, 0),
            ("0e999", 0, 0),
        ] {
            assert_eq!(attoseconds(text.as_bytes(), decimals), Some(expected), "{text}");
        }
    }

    #[test]
    fn what_is_no_decimal_or_too_large_is_none() {
        for text in ["", ".", "-", "e5", "1e", "1e+", "1,5", "0x10", "1 ", "nan", "inf", "1e999", "1e1000"] {
            assert_eq!(attoseconds(text.as_bytes(), 0), None, "{text}");
        }
        assert_eq!(attoseconds(&[b'9'; 60], 0), None);
    }
}
