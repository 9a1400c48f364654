//! A filter prints as text that is read as the same filter.

use proptest::prelude::*;

use super::super::keys::{NumberKey, TextKey};
use super::super::moment::{Moment, Since};
use super::super::tree::{Condition, Expression, Literal, Operator, Test};
use super::super::value::number_of;
use super::super::{Completion, Filter, Vocabulary};
use crate::time::SECOND;

fn condition<T: std::fmt::Debug + Clone + 'static>(
    operators: &'static [Operator],
    value: impl Strategy<Value = T> + Clone + 'static,
) -> BoxedStrategy<Condition<T>> {
    prop_oneof![
        (proptest::sample::select(operators), value.clone())
            .prop_map(|(operator, value)| Condition::Is(operator, value)),
        proptest::collection::vec(value, 1..4).prop_map(Condition::In),
    ]
    .boxed()
}

const ORDERING: &[Operator] = &[
    Operator::Equal,
    Operator::Unequal,
    Operator::Less,
    Operator::LessOrEqual,
    Operator::Greater,
    Operator::GreaterOrEqual,
];
const TEXTS: &[Operator] = &[Operator::Equal, Operator::Unequal];
const EVERY: &[Operator] = &[Operator::Equal, Operator::Less, Operator::GreaterOrEqual, Operator::Like];

fn number() -> impl Strategy<Value = Test> {
    use NumberKey::{Address, Exception, Function, Quantity, Register};
    let keys = proptest::sample::select(vec![Address, Function, Register, Quantity, Exception]);
    let value = prop_oneof![
        any::<u16>().prop_map(f64::from),
        any::<f64>().prop_filter("finite", |number| number.is_finite())
    ];
    (keys, condition(ORDERING, value)).prop_map(|(key, condition)| Test::Number(key, condition))
}

fn text() -> impl Strategy<Value = Test> {
    use TextKey::{Bus, Command, Device, Finding, Outcome, Reason, Role, Serial};
    let fixed = proptest::sample::select(vec![Outcome, Role, Reason]).prop_flat_map(|key| {
        let choices: Vec<String> = key.choices().unwrap().into_iter().map(str::to_owned).collect();
        condition(TEXTS, proptest::sample::select(choices)).prop_map(move |c| Test::Text(key, c))
    });
    let free =
        (proptest::sample::select(vec![Device, Serial, Command, Bus]), condition(TEXTS, any::<String>()));
    let parts = (
        proptest::sample::select(vec![Device, Outcome, Finding]),
        any::<String>().prop_map(|part| Condition::Is(Operator::Like, part)),
    );
    prop_oneof![
        fixed,
        free.prop_map(|(key, condition)| Test::Text(key, condition)),
        parts.prop_map(|(key, condition)| Test::Text(key, condition)),
        condition(TEXTS, "[A-Z][0-9]{2}").prop_map(|condition| Test::Text(Finding, condition)),
    ]
}

fn moment() -> impl Strategy<Value = Moment> + Clone {
    let clock = (0..24 * 60 * 60_i64, 0..=9_u32, any::<bool>(), 0..SECOND).prop_map(
        |(second, digits, minute, fraction)| {
            let width = SECOND / 10_i64.pow(digits);
            if minute {
                let ns = second / 60 * 60 * SECOND;
                return Moment { since: Since::Midnight, ns, width: 60 * SECOND };
            }
            Moment { since: Since::Midnight, ns: second * SECOND + fraction / width * width, width }
        },
    );
    let instant = (any::<i64>(), 0..=9_u32).prop_map(|(ns, digits)| {
        let width = SECOND / 10_i64.pow(digits);
        Moment { since: Since::Epoch, ns: (ns / 2).div_euclid(width) * width, width }
    });
    prop_oneof![clock, instant]
}

fn field() -> impl Strategy<Value = Test> {
    let name = prop_oneof![
        "[A-Za-z_][A-Za-z0-9_]{0,8}",
        proptest::sample::select(vec!["time", "in", "AND", "field", "quantity", "echo"])
            .prop_map(str::to_owned)
    ];
    let literal = prop_oneof![
        any::<String>().prop_map(|text| Literal { text, number: None }),
        "-?[0-9]{1,4}(\\.[0-9]{1,3})?|0x[0-9a-f]{1,4}|[a-z-]{1,5}|1e3|\\+5"
            .prop_map(|text| Literal { number: number_of(&text), text }),
        "[0-9]{1,3}".prop_map(|text| Literal { text, number: None }),
    ];
    (name, condition(EVERY, literal)).prop_map(|(name, condition)| Test::Field(name, condition))
}

fn expression() -> impl Strategy<Value = Expression> {
    let test = prop_oneof![
        Just(Test::Echo),
        Just(Test::Damaged),
        any::<bool>().prop_map(|good| Test::CrcIs { good }),
        proptest::collection::vec(any::<u8>(), 1..5).prop_map(Test::BytesContain),
        number(),
        text(),
        condition(ORDERING, -1_000_000_000_000_000..=1_000_000_000_000_000_i64).prop_map(Test::Latency),
        condition(ORDERING, moment()).prop_map(Test::Time),
        field(),
    ];
    test.prop_map(Expression::Test).prop_recursive(4, 24, 4, |inner| {
        prop_oneof![
            proptest::collection::vec(inner.clone(), 2..4).prop_map(Expression::Any),
            proptest::collection::vec(inner.clone(), 2..4).prop_map(Expression::All),
            inner.prop_map(|part| Expression::Not(Box::new(part))),
        ]
    })
}

proptest! {
    #[test]
    fn what_is_printed_is_read_as_the_same(root in expression()) {
        let filter = Filter { root };
        let text = filter.to_string();
        let read = Filter::parse(&text);
        prop_assert!(read.is_ok(), "{}: {}", text, read.unwrap_err());
        prop_assert_eq!(read.unwrap(), filter, "{}", text);
    }

    #[test]
    fn no_text_brings_the_parser_down(text in any::<String>()) {
        if let Err(error) = Filter::parse(&text) {
            prop_assert!(error.offset() <= text.len() && text.is_char_boundary(error.offset()));
        }
    }

    #[test]
    fn nor_does_any_order_of_its_own_words(
        words in proptest::collection::vec(proptest::sample::select(vec![
            "addr", "==", "!=", "~", "in", "(", ")", ",", "and", "||", "not", "!", "1", "0x", "-", "\"", "'", "\\",
            "latency", "5 ms", "5µs", "time", "13:05", "2026-01-01T00:00:00Z", "bytes", "contains", "26", "crc", "bad",
            "field.", "µ", ".", "outcome", "late", "echo", "9".repeat(400).leak(),
        ]), 0..12),
        spaced in any::<bool>(),
    ) {
        let text = words.join(if spaced { " " } else { "" });
        match Filter::parse(&text) {
            Ok(filter) => prop_assert_eq!(Filter::parse(&filter.to_string()), Ok(filter)),
            Err(error) => prop_assert!(text.is_char_boundary(error.offset()), "{}", error),
        }
        let completion = Completion::of(&text, &Vocabulary::default());
        prop_assert!(text.is_char_boundary(completion.start));
    }

    #[test]
    fn what_is_offered_next_is_right_as_far_as_it_goes(
        root in expression(),
        cut in any::<proptest::sample::Index>(),
    ) {
        let whole = Filter { root }.to_string();
        let ends: Vec<usize> = whole.match_indices(' ').map(|(at, _)| at + 1).chain([0]).collect();
        let before = &whole[..ends[cut.index(ends.len())]];
        // Within quotes a space ends no word.
        prop_assume!(!before.contains(['"', '\'']));
        let Completion { start, words } = Completion::of(before, &Vocabulary::default());
        prop_assert_eq!(start, before.len());
        // A number may be too large for a unit.
        for word in words.into_iter().filter(|word| !["s", "ms", "us", "ns"].contains(&&**word)) {
            let text = format!("{before}{word} ");
            if let Err(error) = Filter::parse(&text) {
                prop_assert!(error.offset() > start, "'{}': {}", text, error);
            }
        }
    }

    #[test]
    fn a_field_with_its_value_makes_a_filter_that_reads_back(
        name in "[A-Za-z_][A-Za-z0-9_]{0,8}",
        number in any::<f32>().prop_filter("finite", |number| number.is_finite()),
        text in any::<String>(),
        root in expression(),
    ) {
        for filter in [Filter::of_field(&name, &number.to_string(), true), Filter::of_field(&name, &text, false)] {
            prop_assert_eq!(Filter::parse(&filter.to_string()), Ok(filter.clone()));
            let both = Filter { root: root.clone() }.and(filter);
            prop_assert_eq!(Filter::parse(&both.to_string()), Ok(both));
        }
    }
}

#[test]
fn the_printed_form_is_the_short_one() {
    for (text, printed) in [
        ("address==1&&(function==0x10)", "addr == 1 and fn == 16"),
        ("!(echo||damaged)&&start_register==9728", "not (echo or damaged) and reg == 0x2600"),
        ("(echo or damaged) or crc == bad", "(echo or damaged) or crc bad"),
        ("latency > 1500us and latency<0.25s", "latency > 1500 us and latency < 250 ms"),
        (
            "time > 9:05 or time>2026-01-01T02:00:00.50+02:00",
            "time > 09:05 or time > 2026-01-01T00:00:00.50Z",
        ),
        ("bytes contains 2600 FF", "bytes contains 26 00 ff"),
        ("serial == 'a \"b\"' and x == \"5\"", "serial == \"a \\\"b\\\"\" and x == \"5\""),
        ("field.time ~ '2016' and field.temperature > 2e1", "field.time ~ \"2016\" and temperature > 2e1"),
    ] {
        assert_eq!(Filter::parse(text).unwrap().to_string(), printed);
    }
}
