//! Whether a row passes; nothing here allocates.

use std::cmp::Ordering;

use super::keys::{NumberKey, TextKey};
use super::moment::{Moment, Since};
use super::subject::{Field, FieldValue, Subject};
use super::tree::{Condition, Expression, Literal, Operator, Test};
use super::value::number_of;

/// Tells whether a row passes.
pub(super) fn holds(expression: &Expression, subject: &dyn Subject) -> bool {
    match expression {
        Expression::Any(parts) => parts.iter().any(|part| holds(part, subject)),
        Expression::All(parts) => parts.iter().all(|part| holds(part, subject)),
        Expression::Not(part) => !holds(part, subject),
        Expression::Test(test) => passes(test, subject),
    }
}

fn passes(test: &Test, subject: &dyn Subject) -> bool {
    match test {
        Test::Echo => subject.is_echo(),
        Test::Damaged => subject.is_damaged(),
        Test::CrcIs { good } => subject.crc_is_good() == Some(*good),
        Test::BytesContain(wanted) => {
            subject.any_bytes(&mut |bytes| bytes.windows(wanted.len().max(1)).any(|window| window == wanted))
        }
        Test::Number(key, condition) => number(*key, subject)
            .is_some_and(|number| satisfies(condition, |_, wanted| number.partial_cmp(wanted))),
        Test::Text(TextKey::Finding, condition) => {
            subject.any_finding(&mut |code| text_satisfies(condition, code))
        }
        Test::Text(key, condition) => text(*key, subject).is_some_and(|text| text_satisfies(condition, text)),
        Test::Latency(condition) => {
            subject.latency_ns().is_some_and(|ns| satisfies(condition, |_, wanted| Some(ns.cmp(wanted))))
        }
        Test::Time(condition) => {
            satisfies(condition, |operator, moment| compare_time(operator, moment, subject))
        }
        Test::Field(name, condition) => {
            subject.any_field(name, &mut |field| field_satisfies(condition, field))
        }
    }
}

/// Returns a number of a row.
fn number(key: NumberKey, subject: &dyn Subject) -> Option<f64> {
    match key {
        NumberKey::Address => subject.address().map(f64::from),
        NumberKey::Function => subject.function().map(|code| code.0.into()),
        NumberKey::Register => subject.start_register().map(f64::from),
        NumberKey::Quantity => subject.quantity().map(f64::from),
        NumberKey::Exception => subject.exception_code().map(|code| code.0.into()),
    }
}

/// Returns a text of a row.
fn text(key: TextKey, subject: &dyn Subject) -> Option<&str> {
    match key {
        TextKey::Outcome => subject.outcome().map(|outcome| outcome.name()),
        TextKey::Role => subject.role().map(|role| role.name()),
        TextKey::Reason => subject.reason().map(|reason| reason.name()),
        TextKey::Device => subject.device(),
        TextKey::Serial => subject.serial_number(),
        TextKey::Command => subject.command(),
        TextKey::Bus => subject.bus(),
        TextKey::Finding => None, // there may be several: see `any_finding`
    }
}

/// Tells whether a condition holds, given how the value compares with each value wanted.
fn satisfies<T>(condition: &Condition<T>, compare: impl Fn(Operator, &T) -> Option<Ordering>) -> bool {
    match condition {
        Condition::Is(operator, wanted) => means(*operator, compare(*operator, wanted)),
        Condition::In(wanted) => {
            wanted.iter().any(|wanted| compare(Operator::Equal, wanted) == Some(Ordering::Equal))
        }
    }
}

/// Tells whether an operator is content with an ordering; with none, because the two do not compare, never.
fn means(operator: Operator, ordering: Option<Ordering>) -> bool {
    ordering.is_some_and(|ordering| match operator {
        Operator::Equal => ordering.is_eq(),
        Operator::Unequal => ordering.is_ne(),
        Operator::Less => ordering.is_lt(),
        Operator::LessOrEqual => ordering.is_le(),
        Operator::Greater => ordering.is_gt(),
        Operator::GreaterOrEqual => ordering.is_ge(),
        Operator::Like => false, // decided on texts before
    })
}

fn text_satisfies(condition: &Condition<String>, text: &str) -> bool {
    match condition {
        Condition::Is(Operator::Like, wanted) => is_part(wanted, text),
        _ => satisfies(condition, |_, wanted| Some(text.cmp(wanted))),
    }
}

/// Tells whether a text has a part, without regard to the case of ASCII letters.
fn is_part(wanted: &str, text: &str) -> bool {
    let (wanted, text) = (wanted.as_bytes(), text.as_bytes());
    wanted.is_empty() || text.windows(wanted.len()).any(|window| window.eq_ignore_ascii_case(wanted))
}

/// Compares a row's time with a moment: its first instant, or its whole stretch where equality is asked.
fn compare_time(operator: Operator, moment: &Moment, subject: &dyn Subject) -> Option<Ordering> {
    let ns = match moment.since {
        Since::Midnight => subject.time_of_day_ns()?,
        Since::Epoch => subject.start_ns()?,
    };
    let whole = matches!(operator, Operator::Equal | Operator::Unequal);
    let within = (moment.ns..moment.ns.saturating_add(moment.width)).contains(&ns);
    Some(if whole && within { Ordering::Equal } else { ns.cmp(&moment.ns) })
}

fn field_satisfies(condition: &Condition<Literal>, field: Field<'_>) -> bool {
    match condition {
        Condition::Is(Operator::Like, wanted) => {
            let value = match field.value {
                FieldValue::Text(text) => Some(text),
                _ => None,
            };
            [value, field.text].into_iter().flatten().any(|text| is_part(&wanted.text, text))
        }
        _ => satisfies(condition, |operator, wanted| compare_field(operator, wanted, field)),
    }
}

/// Compares a field with a literal, as numbers where both are, else as texts; texts of numbers only for
/// equality, as their order means nothing.
fn compare_field(operator: Operator, wanted: &Literal, field: Field<'_>) -> Option<Ordering> {
    let equality = matches!(operator, Operator::Equal | Operator::Unequal);
    match (field.value, wanted.number) {
        (FieldValue::Number(value), Some(number)) => value.partial_cmp(&number),
        (FieldValue::Single(value), Some(number)) => compare_single(value, number),
        (FieldValue::Text(text), Some(number)) => match number_of(text) {
            Some(value) if text != wanted.text => value.partial_cmp(&number),
            Some(_) => Some(Ordering::Equal),
            None => equality.then(|| text.cmp(&wanted.text)),
        },
        (FieldValue::Text(text), None) => Some(text.cmp(&wanted.text)),
        (FieldValue::Flag(flag), _) => {
            equality.then(|| if flag { "true" } else { "false" }.cmp(wanted.text.as_str()))
        }
        (FieldValue::Null, Some(_)) => None,
        (FieldValue::Number(_) | FieldValue::Single(_) | FieldValue::Null, None) => {
            field.text.filter(|_| equality).map(|text| text.cmp(&wanted.text))
        }
    }
}

/// Compares a 32-bit float with a number as 32-bit floats, so that 7.9 equals the 7.9 that was received.
fn compare_single(value: f32, number: f64) -> Option<Ordering> {
    let single = number as f32;
    if single.is_finite() { value.partial_cmp(&single) } else { f64::from(value).partial_cmp(&number) }
}
