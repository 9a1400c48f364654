//! From tree to text: what is printed parses to the same tree.

use std::fmt::{self, Display};

use super::Filter;
use super::keys::{FIELD_PREFIX, Key, NumberKey, RESERVED};
use super::token::is_word;
use super::tree::{Condition, Expression, Literal, Test};
use super::value::number_of;
use crate::time::{MILLISECOND, SECOND};

impl Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.root.fmt(f)
    }
}

impl Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Expression::Any(parts) => joined(f, parts, " or ", |part| matches!(part, Expression::Any(_))),
            Expression::All(parts) => joined(f, parts, " and ", Expression::is_joined),
            Expression::Not(part) if part.is_joined() => write!(f, "not ({part})"),
            Expression::Not(part) => write!(f, "not {part}"),
            Expression::Test(test) => test.fmt(f),
        }
    }
}

impl Expression {
    fn is_joined(&self) -> bool {
        matches!(self, Expression::Any(_) | Expression::All(_))
    }
}

/// Prints parts with a word between them, in parentheses where the word would bind otherwise.
fn joined(
    f: &mut fmt::Formatter<'_>,
    parts: &[Expression],
    word: &str,
    nested: fn(&Expression) -> bool,
) -> fmt::Result {
    for (index, part) in parts.iter().enumerate() {
        f.write_str(if index == 0 { "" } else { word })?;
        if nested(part) { write!(f, "({part})")? } else { part.fmt(f)? }
    }
    Ok(())
}

impl Display for Test {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Test::Echo => f.write_str(Key::Echo.name()),
            Test::Damaged => f.write_str(Key::Damaged.name()),
            Test::CrcIs { good: true } => f.write_str("crc good"),
            Test::CrcIs { good: false } => f.write_str("crc bad"),
            Test::BytesContain(bytes) => {
                f.write_str("bytes contains")?;
                bytes.iter().try_for_each(|byte| write!(f, " {byte:02x}"))
            }
            Test::Number(key, condition) => {
                f.write_str(Key::Number(*key).name())?;
                let hexadecimal = matches!(key, NumberKey::Register);
                condition_with(f, condition, |f, number| write_number(f, *number, hexadecimal))
            }
            Test::Text(key, condition) => {
                f.write_str(Key::Text(*key).name())?;
                condition_with(f, condition, |f, text| write_text(f, text, true))
            }
            Test::Latency(condition) => {
                f.write_str(Key::Latency.name())?;
                condition_with(f, condition, |f, ns| write_duration(f, *ns))
            }
            Test::Time(condition) => {
                f.write_str(Key::Time.name())?;
                condition_with(f, condition, |f, moment| moment.fmt(f))
            }
            Test::Field(name, condition) => {
                let taken = Key::named(name).is_some()
                    || RESERVED.iter().any(|reserved| reserved.eq_ignore_ascii_case(name));
                f.write_str(if taken { FIELD_PREFIX } else { "" })?;
                f.write_str(name)?;
                condition_with(f, condition, write_literal)
            }
        }
    }
}

/// Prints an operator with its value, or `in` with all of them.
fn condition_with<T>(
    f: &mut fmt::Formatter<'_>,
    condition: &Condition<T>,
    write: impl Fn(&mut fmt::Formatter<'_>, &T) -> fmt::Result,
) -> fmt::Result {
    match condition {
        Condition::Is(operator, value) => {
            write!(f, " {} ", operator.sign())?;
            write(f, value)
        }
        Condition::In(values) => {
            f.write_str(" in (")?;
            for (index, value) in values.iter().enumerate() {
                f.write_str(if index == 0 { "" } else { ", " })?;
                write(f, value)?;
            }
            f.write_str(")")
        }
    }
}

/// Prints a number; a register's as the manuals do, when it is one.
fn write_number(f: &mut fmt::Formatter<'_>, number: f64, hexadecimal: bool) -> fmt::Result {
    let whole = number as u16; // saturates; compared below
    if hexadecimal && f64::from(whole) == number { write!(f, "0x{whole:04x}") } else { write!(f, "{number}") }
}

/// Prints nanoseconds in the largest unit that keeps them whole.
fn write_duration(f: &mut fmt::Formatter<'_>, ns: i64) -> fmt::Result {
    for (unit, name) in [(SECOND, "s"), (MILLISECOND, "ms"), (1000, "us")] {
        if ns % unit == 0 {
            return write!(f, "{} {name}", ns / unit);
        }
    }
    write!(f, "{ns} ns")
}

/// Prints what a field is compared with: a number as it was written, a text that looks like one in quotes.
fn write_literal(f: &mut fmt::Formatter<'_>, literal: &Literal) -> fmt::Result {
    write_text(f, &literal.text, literal.number.is_some() || number_of(&literal.text).is_none())
}

/// Prints a text, in quotes where it needs them.
fn write_text(f: &mut fmt::Formatter<'_>, text: &str, bare: bool) -> fmt::Result {
    if bare && !text.is_empty() && text.chars().all(is_word) {
        return f.write_str(text);
    }
    f.write_str("\"")?;
    for c in text.chars() {
        f.write_str(if matches!(c, '"' | '\\') { "\\" } else { "" })?;
        write!(f, "{c}")?;
    }
    f.write_str("\"")
}
