//! What a wrong filter is told: where, what was expected, and a hint.

use super::super::Filter;
use super::super::parse::DEEPEST;

#[test]
fn an_error_says_where_what_was_expected_and_what_may_have_been_meant() {
    for (text, expected) in [
        ("", "column 1: expected a name, 'not' or '(', found the end"),
        ("   ", "column 4: expected a name, 'not' or '(', found the end"),
        ("addr == 1 &&", "column 13: expected a name, 'not' or '(', found the end"),
        ("addr == 1 & fn == 3", "column 11: expected 'and', 'or' or the end, found '&'"),
        ("addr == 1 fn == 3", "column 11: expected 'and', 'or' or the end, found 'fn'"),
        ("== 3", "column 1: expected a name, 'not' or '(', found '='"),
        ("and echo", "column 1: expected a name, 'not' or '(', found 'and'"),
        ("(echo or damaged", "column 17: expected 'and', 'or' or ')', found the end"),
        ("echo)", "column 5: expected 'and', 'or' or the end, found ')'"),
        ("addr", "column 5: expected == != <= >= < > or in behind 'addr', found the end"),
        (
            "addr = 1",
            "column 6: expected == != <= >= < > or in behind 'addr', found '='; write '==' to compare",
        ),
        ("addr ~ 1", "column 6: expected == != <= >= < > or in behind 'addr', found '~'"),
        ("device < x", "column 8: expected == != ~ or in behind 'device', found '<'"),
        (
            "ehco",
            "column 5: expected == != <= >= < > ~ or in behind 'ehco', found the end; did you mean 'echo'?",
        ),
        ("addr == one", "column 9: expected a number such as 16 or 0x10, found 'one'"),
        ("addr == 0xZZ", "column 9: expected a number such as 16 or 0x10, found '0xZZ'"),
        ("addr == 1e999", "column 9: expected a number such as 16 or 0x10, found '1e999'"),
        ("addr == inf", "column 9: expected a number such as 16 or 0x10, found 'inf'"),
        ("addr in 1", "column 9: expected '(' behind 'in', found '1'"),
        ("addr in (1 2)", "column 12: expected ',' or ')', found '2'"),
        ("addr in ()", "column 10: expected a number such as 16 or 0x10, found ')'"),
        (
            "outcome == lat",
            "column 12: expected one of answered, exception, no-response, late, unsolicited, broadcast, damaged, \
             found 'lat'; did you mean 'late'?",
        ),
        ("role in (request, x)", "column 19: expected one of request, response, unknown, found 'x'"),
        ("finding == wrong", "column 12: expected the code of a finding such as D06, found 'wrong'"),
        (
            "latency > 100",
            "column 14: expected a unit: ns, us, ms or s, found the end; write '100 ms' if milliseconds are meant",
        ),
        ("latency > soon", "column 11: expected a time with its unit such as 100 ms, found 'soon'"),
        (
            "latency > 12 d",
            "column 14: expected a unit: ns, us, ms or s, found 'd'; write '12 ms' if milliseconds are meant",
        ),
        ("latency > 1e9 s", "column 11: expected a time of at most 11 days, found '1e9'"),
        (
            "time > 25:00",
            "column 8: expected a time such as 13:05, 13:05:30 or 2026-01-01T13:05:00Z, found '25:00'",
        ),
        (
            "time > 2026-01-01T13:05:00",
            "column 8: expected a time such as 13:05, 13:05:30 or 2026-01-01T13:05:00Z, \
             found '2026-01-01T13:05:00'; a date needs its time, with seconds, and Z or an offset such as +02:00",
        ),
        ("crc wrong", "column 5: expected 'good' or 'bad', found 'wrong'"),
        ("bytes == 01", "column 7: expected 'contains', found '='"),
        ("bytes contains xyz", "column 16: expected bytes in hexadecimal such as 26 00, found 'xyz'"),
        ("bytes contains 123", "column 18: expected 'and', 'or' or the end, found '3'"),
        ("serial == \"YL", "column 14: expected '\"', found the end"),
        ("serial == \"Y\\n", "column 14: expected a quote or '\\', found 'n'"),
        ("temperature > ", "column 15: expected a number, a word or a text in quotes, found the end"),
        ("field. x == 1", "column 7: expected the name of a field, found ' '"),
        ("µ == 1", "column 1: expected a name, 'not' or '(', found 'µ'"),
        ("bus == ö and $", "column 14: expected a name, 'not' or '(', found '$'"),
    ] {
        let error = Filter::parse(text).expect_err(text);
        assert_eq!(error.to_string(), expected, "{text}");
    }
}

#[test]
fn offsets_count_bytes_and_columns_characters() {
    let error = Filter::parse("bus == ö and $").unwrap_err();
    assert_eq!((error.offset(), error.column()), (14, 14));
    let error = Filter::parse("bus == öö and $").unwrap_err();
    assert_eq!((error.offset(), error.column(), error.hint()), (16, 15, None));
    assert_eq!(error.expected(), "a name, 'not' or '('");
}

#[test]
fn nesting_is_bounded_and_said() {
    for (open, close) in [("(", ")"), ("!", ""), ("not ", ""), ("!(", ")")] {
        let levels = open.matches(['!', '(', 'n']).count();
        let nested = |count: usize| format!("{}echo{}", open.repeat(count), close.repeat(count));
        let deepest = nested(DEEPEST / levels);
        let filter = Filter::parse(&deepest).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(Filter::parse(&filter.to_string()).unwrap(), filter);
        for count in [DEEPEST / levels + 1, 100_000] {
            let error = Filter::parse(&nested(count)).unwrap_err();
            assert!(error.expected().contains("64 levels"), "{error}");
        }
    }
    // Width costs no depth.
    assert!(Filter::parse(&vec!["echo"; 10_000].join(" or ")).is_ok());
}
