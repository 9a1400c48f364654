//! Each operator on a row that has everything, and on one that has nothing.

use super::super::{Field, FieldValue, Filter, Subject};
use crate::decode::frame::{Reason, Role};
use crate::decode::function::{ExceptionCode, FunctionCode};
use crate::decode::transaction::Outcome;
use crate::time::SECOND;

/// Has nothing to ask for.
struct Empty;

impl Subject for Empty {}

/// Is a measurement answered late, with a damaged run and two findings beside it.
struct Full;

impl Subject for Full {
    fn address(&self) -> Option<u8> {
        Some(1)
    }
    fn function(&self) -> Option<FunctionCode> {
        Some(FunctionCode(3))
    }
    fn start_register(&self) -> Option<u16> {
        Some(0x2600)
    }
    fn quantity(&self) -> Option<u16> {
        Some(4)
    }
    fn exception_code(&self) -> Option<ExceptionCode> {
        Some(ExceptionCode(2))
    }
    fn outcome(&self) -> Option<Outcome> {
        Some(Outcome::Late)
    }
    fn role(&self) -> Option<Role> {
        Some(Role::Request)
    }
    fn reason(&self) -> Option<Reason> {
        Some(Reason::Crc)
    }
    fn is_echo(&self) -> bool {
        true
    }
    fn crc_is_good(&self) -> Option<bool> {
        Some(false)
    }
    fn device(&self) -> Option<&str> {
        Some("yosemitech-do")
    }
    fn serial_number(&self) -> Option<&str> {
        Some("YL0114010022")
    }
    fn command(&self) -> Option<&str> {
        Some("get-calibration")
    }
    fn bus(&self) -> Option<&str> {
        Some("/dev/tty USB0")
    }
    fn latency_ns(&self) -> Option<i64> {
        Some(100_500_000)
    }
    fn start_ns(&self) -> Option<i64> {
        Some(1_767_272_710 * SECOND) // 2026-01-01T13:05:10Z
    }
    fn time_of_day_ns(&self) -> Option<i64> {
        Some((14 * 3600 + 5 * 60 + 10) * SECOND) // an hour east of Greenwich
    }
    fn any_finding(&self, test: &mut dyn FnMut(&str) -> bool) -> bool {
        ["D06", "L01"].into_iter().any(test)
    }
    fn any_bytes(&self, test: &mut dyn FnMut(&[u8]) -> bool) -> bool {
        [&[1_u8, 3, 0x26, 0][..], &[0, 4]].into_iter().any(test)
    }
    fn any_field(&self, name: &str, test: &mut dyn FnMut(Field<'_>) -> bool) -> bool {
        let field = |value, text| Field { value, text };
        let fields: &[Field<'_>] = match name {
            "temperature" => &[field(FieldValue::Single(17.625), Some("17.625 °C"))],
            "do_mg_l" => &[field(FieldValue::Single(7.9), None), field(FieldValue::Number(8.5), None)],
            "error_flag" => &[field(FieldValue::Number(2.0), Some("Wiper fault"))],
            "hardware_version" => &[field(FieldValue::Text("2.0"), None)],
            "time" => &[field(FieldValue::Text("2016-04-26T13:05:17"), None)],
            "in_water" => &[field(FieldValue::Flag(true), None)],
            "ph" => &[field(FieldValue::Null, Some("not a number"))],
            "orp" => &[field(FieldValue::Number(f64::NAN), Some("NaN"))],
            _ => &[],
        };
        fields.iter().copied().any(test)
    }
}

/// Checks filters that must pass the full row, and ones that must not; none may pass the empty row.
fn assert_passes(passing: &[&str], failing: &[&str]) {
    for (filters, expected) in [(passing, true), (failing, false)] {
        for text in filters {
            let filter = Filter::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(filter.matches(&Full), expected, "{text}");
            assert!(!filter.matches(&Empty), "{text} on an empty row");
        }
    }
}

#[test]
fn numbers_compare_in_decimal_and_hexadecimal() {
    assert_passes(
        &[
            "addr == 1",
            "address != 2",
            "addr < 1.5",
            "addr <= 1",
            "addr > -1",
            "addr >= 0x1",
            "addr in (7, 1)",
            "fn == 0x03",
            "function == 3",
            "reg == 0x2600",
            "start_register == 9728",
            "quantity == 4",
            "exception == 2",
            "exception_code < 3",
        ],
        &[
            "addr == 2",
            "addr != 1",
            "addr < 1",
            "addr > 1",
            "addr <= 0",
            "addr >= 2",
            "addr in (2, 3)",
            "reg == 2600",
        ],
    );
}

#[test]
fn texts_compare_whole_and_by_a_part() {
    assert_passes(
        &[
            "outcome == late",
            "outcome in (no-response, late)",
            "outcome != answered",
            "outcome ~ LAT",
            "role == request",
            "reason == crc",
            "device == yosemitech-do",
            "device ~ Yosemi",
            "serial ~ yl01",
            "cmd ~ calibration",
            "command == get-calibration",
            "bus == \"/dev/tty USB0\"",
            "bus ~ 'tty USB'",
            "finding == D06",
            "finding == l01",
            "finding != D06",
            "finding ~ d",
            "device ~ \"\"",
        ],
        &[
            "outcome == answered",
            "role != request",
            "device == Yosemitech-DO",
            "serial ~ YL02",
            "finding == D07",
            "cmd ~ a-much-longer-word-than-the-command",
        ],
    );
}

#[test]
fn latency_compares_with_units() {
    assert_passes(
        &[
            "latency > 100 ms",
            "latency > 100ms",
            "latency < 0.2 s",
            "latency == 100500 us",
            "latency == 100500µs",
            "latency >= 100500000 ns",
            "latency in (1 s, 100.5 ms)",
            "latency > -1 ms",
        ],
        &["latency > 101 ms", "latency <= 0.1 s", "latency != 100.5 ms"],
    );
}

#[test]
fn time_compares_with_the_local_day_or_an_instant() {
    assert_passes(
        &[
            "time > 14:05",
            "time >= 14:05:10",
            "time < 14:05:10.5",
            "time > 9:00",
            "time == 14:05",
            "time in (13:05, 14:05)",
            "time == 14:05:10",
            "time > 2026-01-01T13:05:00Z",
            "time == 2026-01-01T14:05:10+01:00",
            "time <= 2026-01-01T13:05:10.000Z",
            "time != 14:06",
        ],
        &["time < 14:05", "time <= 14:05", "time != 14:05", "time == 14:04", "time > 2026-01-01T13:05:10Z"],
    );
}

#[test]
fn flags_crc_and_bytes_are_asked_in_words() {
    assert_passes(
        &[
            "echo",
            "damaged",
            "crc bad",
            "crc == bad",
            "bytes contains 26 00",
            "bytes contains 2600",
            "bytes contains 01 03 26",
            "bytes contains 04",
        ],
        &["crc good", "bytes contains 00 04 00", "bytes contains 00 26"],
    );
}

#[test]
fn fields_compare_as_numbers_or_texts_and_one_of_a_name_is_enough() {
    assert_passes(
        &[
            "temperature > 17.5",
            "temperature == 17.625",
            "temperature ~ \"°c\"",
            "do_mg_l > 8",
            "do_mg_l < 8",
            "do_mg_l != 7.9",
            "error_flag == 2",
            "error_flag == 0x2",
            "error_flag ~ wiper",
            "error_flag == 'Wiper fault'",
            "hardware_version == 2.0",
            "hardware_version == 2",
            "hardware_version == \"2.0\"",
            "hardware_version > 1.9",
            "field.time > 2016-04-26",
            "field.time ~ 13:05",
            "in_water == true",
            "in_water != false",
            "ph ~ number",
        ],
        &[
            "temperature > 20",
            "temperature > warm",
            "hardware_version == \"2\"",
            "salinity != 3",
            "in_water == false",
            "ph == 7",
            "ph != 7",
            "orp == 7",
            "orp != 7",
            "orp < 7",
        ],
    );
}

#[test]
fn a_number_from_a_32_bit_float_equals_what_was_printed() {
    assert_passes(
        &["do_mg_l == 7.9", "do_mg_l in (7.9)", "do_mg_l <= 7.9 and not do_mg_l < 7.9"],
        &["do_mg_l == 7.91", "do_mg_l > 8.5", "do_mg_l > 1e300"],
    );
}

#[test]
fn and_binds_closer_than_or_and_parentheses_closer_still() {
    assert_passes(
        &[
            "addr == 1 && reg == 0x2600",
            "addr == 1 and reg == 0x2600 and echo",
            "addr == 2 || reg == 0x2600",
            "echo or addr == 2 and addr == 3",
            "addr == 1 AND (addr == 2 OR echo)",
            "(((echo)))",
            "addr==1&&fn==3||damaged",
        ],
        &["(echo or addr == 2) and addr == 3", "addr == 1 && addr == 2", "addr == 1 and !echo"],
    );
}

#[test]
fn negation_is_true_of_what_is_not_there() {
    for text in ["!(addr == 2)", "not addr == 2", "!!!(addr == 2)", "not (outcome == answered)"] {
        let filter = Filter::parse(text).unwrap();
        assert!(filter.matches(&Full) && filter.matches(&Empty), "{text}");
    }
    assert!(!Filter::parse("!!(addr == 2)").unwrap().matches(&Empty));
    assert!(!Filter::parse("not echo").unwrap().matches(&Full));
}

#[test]
fn names_of_fields_are_told_for_a_warning() {
    let filter = Filter::parse("temprature > 20 and (addr == 1 or not field.time ~ x) or echo").unwrap();
    assert_eq!(filter.field_names(), ["temprature", "time"]);
}
