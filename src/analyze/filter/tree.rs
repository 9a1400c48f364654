//! A filter as a tree.

use super::keys::{NumberKey, TextKey};
use super::moment::Moment;

/// Is a filter or a part of one.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Expression {
    /// Two or more, one of which must hold.
    Any(Vec<Expression>),
    /// Two or more, all of which must hold.
    All(Vec<Expression>),
    Not(Box<Expression>),
    Test(Test),
}

/// Asks one thing of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Test {
    Echo,
    Damaged,
    CrcIs {
        good: bool,
    },
    /// One byte or more, in this order, without others between.
    BytesContain(Vec<u8>),
    Number(NumberKey, Condition<f64>),
    Text(TextKey, Condition<String>),
    /// In nanoseconds.
    Latency(Condition<i64>),
    Time(Condition<Moment>),
    Field(String, Condition<Literal>),
}

/// Is what a value is compared with.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Condition<T> {
    Is(Operator, T),
    /// One or more values, one of which must be equal.
    In(Vec<T>),
}

/// Compares two values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Equal,
    Unequal,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    /// Part of a text, whatever the case of ASCII letters.
    Like,
}

/// Is a value to compare a field with: whether the field is a number or a text is not known beforehand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Literal {
    /// As written, without quotes.
    pub(super) text: String,
    /// What it is worth, when it was written as a number without quotes.
    pub(super) number: Option<f64>,
}

impl Operator {
    /// All operators with how they are written, the longer ones before their own beginnings.
    pub(super) const ALL: [(&'static str, Operator); 7] = [
        ("==", Operator::Equal),
        ("!=", Operator::Unequal),
        ("<=", Operator::LessOrEqual),
        (">=", Operator::GreaterOrEqual),
        ("<", Operator::Less),
        (">", Operator::Greater),
        ("~", Operator::Like),
    ];

    /// Returns how it is written.
    pub(super) fn sign(self) -> &'static str {
        Operator::ALL.iter().find(|(_, operator)| *operator == self).map_or("", |(sign, _)| sign)
    }
}

impl Expression {
    /// Tells whether a test is about findings.
    pub(super) fn asks_for_findings(&self) -> bool {
        match self {
            Expression::Any(parts) | Expression::All(parts) => {
                parts.iter().any(Expression::asks_for_findings)
            }
            Expression::Not(part) => part.asks_for_findings(),
            Expression::Test(test) => matches!(test, Test::Text(TextKey::Finding, _)),
        }
    }

    /// Calls `visit` with the name of each decoded field, in order.
    pub(super) fn each_field<'a>(&'a self, visit: &mut dyn FnMut(&'a str)) {
        match self {
            Expression::Any(parts) | Expression::All(parts) => {
                parts.iter().for_each(|part| part.each_field(visit));
            }
            Expression::Not(part) => part.each_field(visit),
            Expression::Test(Test::Field(name, _)) => visit(name),
            Expression::Test(_) => {}
        }
    }
}
