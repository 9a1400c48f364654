//! From text to tree: the grammar of the filter language.

use nom::Parser;
use nom::branch::alt;
use nom::combinator::value;
use nom::multi::many0;
use nom::sequence::preceded;

use super::error::{FilterError, Trouble};
use super::keys::{FIELD_PREFIX, Key, NAMES, RESERVED, nearest};
use super::token::{Parsed, keyword, name, sign, signs, space};
use super::tree::{Condition, Expression, Operator, Test};
use super::value;

/// How deep parentheses and negations may nest, so that no text exhausts the stack.
pub(super) const DEEPEST: usize = 64;

/// The operators that order, and so have no meaning for the texts of a row.
const ORDERING: [Operator; 4] =
    [Operator::Less, Operator::LessOrEqual, Operator::Greater, Operator::GreaterOrEqual];

/// Reads a whole filter.
pub(super) fn filter(text: &str) -> Result<Expression, FilterError> {
    let parsed = any(DEEPEST, text).and_then(|(rest, root)| match space(rest) {
        "" => Ok(root),
        rest => Trouble::at(rest, "'and', 'or' or the end").fail(),
    });
    parsed.map_err(|error| match error {
        nom::Err::Error(trouble) | nom::Err::Failure(trouble) => FilterError::new(text, trouble),
        // Only streaming parsers ask for more, and none is used.
        nom::Err::Incomplete(_) => FilterError::new(text, Trouble::at("", "more")),
    })
}

/// Reads one or more parts, joined by `or`.
fn any(depth: usize, input: &str) -> Parsed<'_, Expression> {
    let (input, first) = all(depth, input)?;
    let or = alt((signs("||"), keyword("or")));
    let (input, more) = many0(preceded(or, |input| all(depth, input))).parse(input)?;
    Ok((input, joined(first, more, Expression::Any)))
}

/// Reads one or more parts, joined by `and`.
fn all(depth: usize, input: &str) -> Parsed<'_, Expression> {
    let (input, first) = part(depth, input)?;
    let and = alt((signs("&&"), keyword("and")));
    let (input, more) = many0(preceded(and, |input| part(depth, input))).parse(input)?;
    Ok((input, joined(first, more, Expression::All)))
}

/// Leaves a single part as it is.
fn joined(
    first: Expression,
    mut more: Vec<Expression>,
    join: fn(Vec<Expression>) -> Expression,
) -> Expression {
    if more.is_empty() {
        return first;
    }
    more.insert(0, first);
    join(more)
}

/// Reads a negation, a filter in parentheses, or a test; fails for good when it is none of them.
fn part(depth: usize, input: &str) -> Parsed<'_, Expression> {
    let at = space(input);
    let deeper = || match depth.checked_sub(1) {
        Some(depth) => Ok(depth),
        None => Trouble::at(at, format!("at most {DEEPEST} levels of parentheses and negations")).fail(),
    };
    if let Ok((input, _)) = alt((signs("!"), keyword("not"))).parse(input) {
        let (input, negated) = part(deeper()?, input)?;
        return Ok((input, Expression::Not(Box::new(negated))));
    }
    if let Ok((input, _)) = sign('(')(input) {
        let (input, inner) = any(deeper()?, input)?;
        return match sign(')')(input) {
            Ok((input, _)) => Ok((input, inner)),
            Err(_) => Trouble::at(space(input), "'and', 'or' or ')'").fail(),
        };
    }
    let (input, test) = test(input)?;
    Ok((input, Expression::Test(test)))
}

/// Reads a name and what is asked of it.
fn test(input: &str) -> Parsed<'_, Test> {
    let at = space(input);
    if let Some(input) = at.strip_prefix(FIELD_PREFIX) {
        return match name(input) {
            Ok((rest, name)) if space(input) == input => field(name, rest),
            _ => Trouble::at(input, "the name of a field").fail(),
        };
    }
    let Ok((input, word)) = name(input) else {
        return Trouble::at(at, "a name, 'not' or '('").fail();
    };
    if RESERVED.iter().any(|reserved| reserved.eq_ignore_ascii_case(word)) {
        return Trouble::at(at, "a name, 'not' or '('").fail();
    }
    match Key::named(word) {
        None => field(word, input),
        Some(Key::Echo) => Ok((input, Test::Echo)),
        Some(Key::Damaged) => Ok((input, Test::Damaged)),
        Some(Key::Crc) => crc(input),
        Some(Key::Bytes) => bytes(input),
        Some(Key::Latency) => {
            let (input, condition) = condition(word, &[Operator::Like], value::duration, input)?;
            Ok((input, Test::Latency(condition)))
        }
        Some(Key::Time) => {
            let (input, condition) = condition(word, &[Operator::Like], value::moment, input)?;
            Ok((input, Test::Time(condition)))
        }
        Some(Key::Number(key)) => {
            let (input, condition) = condition(word, &[Operator::Like], value::number, input)?;
            Ok((input, Test::Number(key, condition)))
        }
        Some(Key::Text(key)) => {
            let read = |operator, input| value::text(key, operator, input);
            let (input, condition) = condition(word, &ORDERING, read, input)?;
            Ok((input, Test::Text(key, condition)))
        }
    }
}

/// Reads what is asked of a decoded field.
fn field<'a>(name: &str, input: &'a str) -> Parsed<'a, Test> {
    let (input, condition) = condition(name, &[], value::literal, input)?;
    Ok((input, Test::Field(name.to_owned(), condition)))
}

/// Reads `good` or `bad`.
fn crc(input: &str) -> Parsed<'_, Test> {
    let input = signs("==")(input).map_or(input, |(rest, _)| rest);
    let state = alt((value(true, keyword("good")), value(false, keyword("bad")))).parse(input);
    match state {
        Ok((input, good)) => Ok((input, Test::CrcIs { good })),
        Err(_) => Trouble::at(space(input), "'good' or 'bad'").fail(),
    }
}

/// Reads `contains` and bytes.
fn bytes(input: &str) -> Parsed<'_, Test> {
    let Ok((input, _)) = keyword("contains")(input) else {
        return Trouble::at(space(input), "'contains'").fail();
    };
    let (input, bytes) = value::bytes(input)?;
    Ok((input, Test::BytesContain(bytes)))
}

/// Reads an operator with its value, or `in` with several.
fn condition<'a, T>(
    name: &str,
    forbidden: &[Operator],
    read: impl Fn(Operator, &'a str) -> Parsed<'a, T>,
    input: &'a str,
) -> Parsed<'a, Condition<T>> {
    if let Ok((input, _)) = keyword("in")(input) {
        return list(|input| read(Operator::Equal, input), input);
    }
    let at = space(input);
    let known = Operator::ALL.iter().find_map(|(sign, operator)| Some((at.strip_prefix(sign)?, *operator)));
    match known {
        Some((input, operator)) if !forbidden.contains(&operator) => {
            let (input, value) = read(operator, input)?;
            Ok((input, Condition::Is(operator, value)))
        }
        _ => {
            let allowed = Operator::ALL.iter().filter(|(_, operator)| !forbidden.contains(operator));
            let signs: Vec<_> = allowed.map(|(sign, _)| *sign).collect();
            Trouble::at(at, format!("{} or in behind '{name}'", signs.join(" "))).hint(lead(name, at)).fail()
        }
    }
}

/// Guesses why no operator stands behind a name.
fn lead(name: &str, rest: &str) -> Option<String> {
    if rest.starts_with('=') {
        return Some("write '==' to compare".to_owned());
    }
    if Key::named(name).is_some() {
        return None;
    }
    let names = NAMES.iter().map(|(name, _)| *name).chain(RESERVED.iter().copied());
    nearest(name, names).map(|near| format!("did you mean '{near}'?"))
}

/// Reads values in parentheses, with commas between them.
fn list<'a, T>(read: impl Fn(&'a str) -> Parsed<'a, T>, input: &'a str) -> Parsed<'a, Condition<T>> {
    let Ok((input, _)) = sign('(')(input) else {
        return Trouble::at(space(input), "'(' behind 'in'").fail();
    };
    let (input, first) = read(input)?;
    let (input, mut more) = many0(preceded(sign(','), read)).parse(input)?;
    let Ok((input, _)) = sign(')')(input) else {
        return Trouble::at(space(input), "',' or ')'").fail();
    };
    more.insert(0, first);
    Ok((input, Condition::In(more)))
}
