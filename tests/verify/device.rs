//! D: what a device's manual asks of a master.

use rtutap::analyze::verify::Finding;
use rtutap::analyze::verify::Party::Master;

use crate::story::{Story, hex, sealed};

const DO: &[&str] = &["1=yosemitech-do"];
const COND: &[&str] = &["1=yosemitech-conductivity"];
const SONDE: &[&str] = &["1=yosemitech-sonde"];
const START: (&str, &str) = ("01 03 25 00 00 00", "01 03 00");
const STOP: (&str, &str) = ("01 03 2E 00 00 00", "01 03 00");
const READ: (&str, &str) = ("01 03 26 00 00 04", "01 03 08 00 00 8D 41 66 66 66 3F");
const VERSION: (&str, &str) = ("01 03 07 00 00 02", "01 03 04 02 00 05 07");
const BRUSH: (&str, &str) = ("01 10 2F 00 00 00 00", "01 10 2F 00 00 00");
const SONDE_READ: &str = "01 03 26 01 00 10";
const SONDE_DATA: &str = "01 03 20 00 00 00 41 00 00 00 41 00 00 00 3F 00 00 00 41 00 00 00 41 00 00 00 43 00 00 80 40 00 00 80 44";

fn tell(story: Story, (request, response): (&str, &str)) -> Story {
    story.tell(request, response)
}

/// Lets a device come to life with something it answers.
fn alive(devices: &[&str]) -> Story {
    tell(Story::of(devices), VERSION)
}

#[test]
fn a_register_served_with_another_function_is_named() {
    alive(SONDE).ask("01 06 2F 00 00 01").wait(6000).shows("D01", Master, &[2], Some(1..2));
    alive(DO).ask("01 04 26 00 00 04").wait(6000).shows("D01", Master, &[2], Some(1..2));
    assert_eq!(alive(DO).ask("01 04 26 00 00 04").wait(6000).codes(), ["D01", "T01"]);
}

#[test]
fn a_register_beside_a_command_is_off_by_one() {
    alive(SONDE).ask("01 03 26 00 00 10").wait(6000).shows("D02", Master, &[2], Some(2..4));
    let unknown = tell(Story::of(&[]), VERSION).ask("02 03 08 FF 00 07").wait(6000);
    unknown.shows("D02", Master, &[2], Some(2..4));
    let far = alive(SONDE).ask("01 03 25 FF 00 10").wait(6000);
    assert_eq!(far.codes(), ["D04", "T01"]);
}

#[test]
fn a_bus_without_such_devices_is_not_held_against_their_manuals() {
    let stranger = ("07 03 00 00 00 02", "07 03 04 00 00 00 01");
    for wrong in ["07 03 08 FF 00 07", "07 04 26 00 00 04", "07 10 11 00 00 04 08 00 00 00 00 00 00 00 00"] {
        let story = tell(Story::of(&[]), stranger).ask(wrong).wait(6000);
        assert_eq!(story.codes(), ["T01"], "{wrong}");
    }
    let all = tell(Story::of(&[]), stranger).ask("00 10 30 00 00 01 02 05 00").wait(6000);
    assert_eq!(all.codes(), [""; 0]);
}

#[test]
fn a_quantity_that_no_variant_takes_is_wrong() {
    let four = ("01 03 26 00 00 04", "01 03 08 00 00 8D 41 66 66 66 3F");
    tell(alive(COND), four).shows("D03", Master, &[2], Some(4..6));
    let five = ("01 03 26 00 00 05", "01 03 0A 00 00 8D 41 66 66 66 3F 00 00");
    assert!(tell(alive(COND), five).codes().is_empty());
}

#[test]
fn a_register_that_the_profile_does_not_know_is_noted() {
    alive(SONDE).ask("01 03 09 00 00 07").wait(6000).shows("D04", Master, &[2], Some(2..4));
}

#[test]
fn a_read_before_any_start_is_told_by_its_values() {
    let (zero, moving) = ("01 03 08 00 00 8D 41 00 00 00 00", "01 03 08 00 00 8E 41 66 66 66 3F");
    let zeros = |count| alive(DO).repeat(count, 1000, READ.0, zero);
    zeros(3).shows("D05", Master, &[6], None);
    assert!(zeros(2).codes().is_empty());
    let frozen = |story: Story, ms| story.repeat(12, ms, READ.0, READ.1).findings();
    let count = |found: &[Finding]| found.iter().filter(|finding| finding.rule.code == "D05").count();
    assert_eq!(count(&frozen(Story::of(DO), 1000)), 3, "from the tenth on");
    assert_eq!(count(&frozen(Story::of(DO), 10)), 0, "faster than it measures");
    assert_eq!(count(&frozen(tell(Story::of(DO), START), 1000)), 0);
    let middle = alive(DO).repeat(12, 1000, READ.0, READ.1).tell(READ.0, moving);
    assert!(!tell(alive(DO), READ).codes().contains(&"D05"), "the start may have been long before");
    assert_eq!(count(&middle.findings()), 3, "what moves has started");
}

#[test]
fn later_oxygen_probes_need_no_start() {
    let count = |story: Story| story.findings().iter().filter(|finding| finding.rule.code == "D05").count();
    let version = |software| tell(Story::of(DO), (VERSION.0, software)).repeat(12, 1000, READ.0, READ.1);
    assert_eq!(count(version("01 03 04 02 00 06 02")), 0);
    assert_eq!(count(version(VERSION.1)), 3);
    let six = ("01 03 26 00 00 06", "01 03 0C 00 00 8D 41 66 66 66 3F 00 00 00 41");
    assert_eq!(count(Story::of(DO).repeat(12, 1000, six.0, six.1)), 0);
}

#[test]
fn a_read_before_the_warm_up_is_too_early() {
    tell(tell(alive(DO), START), READ).shows("D06", Master, &[3, 4], None);
    assert!(tell(tell(alive(DO), START).wait(500), READ).codes().is_empty());
    let start = ("01 10 1C 00 00 00 00", "01 10 1C 00 00 00");
    let five = ("01 03 26 00 00 05", "01 03 0A 00 00 8D 41 66 66 66 3F 00 00");
    assert_eq!(tell(tell(alive(COND), start).wait(9000), five).codes(), ["D06"]);
    assert!(tell(tell(alive(COND), start).wait(9500), five).codes().is_empty());
}

#[test]
fn polls_keep_the_manuals_cycle() {
    let read = |ms| tell(tell(tell(alive(DO), START).wait(1000), READ).wait(ms), READ);
    assert_eq!(read(100).codes(), ["D07"]);
    assert!(read(480).codes().is_empty());
}

#[test]
fn a_retry_is_no_poll_of_its_own() {
    let polls = |retries: usize| {
        let mut story = tell(tell(alive(DO), START).wait(1000), READ).wait(1000);
        for _ in 0..retries {
            story = story.ask(READ.0);
        }
        // The next poll keeps the time of the first attempt.
        tell(tell(story, READ), READ).codes()
    };
    assert_eq!(polls(0), ["D07"], "0.5 s after the one before");
    assert_eq!(polls(2), ["T01"], "1.5 s after the first attempt");
    // The master asks again right when a slow answer is over: both are answered, and are one poll.
    let slow = tell(tell(alive(DO), START).wait(1000), READ).wait(1000).ask(READ.0).wait(400);
    let again = slow.bytes(&sealed(READ.1)).wait(10).bytes(&sealed(READ.0)).wait(20).bytes(&sealed(READ.1));
    assert!(tell(again.wait(100), READ).codes().is_empty(), "1.1 s after the first of the two");
}

#[test]
fn a_read_after_a_stop_needs_a_start_between() {
    let stopped = || tell(tell(alive(DO), START).wait(2000), STOP).wait(2000);
    tell(stopped(), READ).shows("D08", Master, &[5, 6], None);
    assert!(tell(tell(stopped(), START).wait(2000), READ).codes().is_empty());
    let damaged = stopped().bytes(&hex("01 03 25 00 00 00 11 22")).wait(3000);
    assert!(!tell(damaged, READ).codes().contains(&"D08"));
}

#[test]
fn the_start_of_another_kind_of_device_is_wrong() {
    alive(SONDE).ask(START.0).wait(6000).shows("D09", Master, &[2], Some(1..4));
    alive(DO).ask("01 10 1C 00 00 00 00").wait(6000).shows("D09", Master, &[2], Some(1..4));
    assert!(tell(alive(DO), START).codes().is_empty());
}

#[test]
fn a_calibration_is_said_with_what_was_before() {
    let read = ("01 03 11 00 00 04", "01 03 08 00 00 80 3F 00 00 00 00");
    let write = ("01 10 11 00 00 04 08 8F C2 82 3F 00 00 00 00", "01 10 11 00 00 04");
    let change = tell(tell(alive(DO), read), write).shows("D10", Master, &[4], Some(7..15));
    assert_eq!(change.message, "set-calibration wrote k 1.0215625, b 0; k 1, b 0 was known before (frame 3)");
    assert_eq!(tell(alive(DO), write).codes(), ["D10"]);
    assert!(tell(alive(DO), read).codes().is_empty());
    let nothing = alive(DO).ask("01 10 11 00 00 00 00").wait(6000).findings();
    let codes: Vec<_> = nothing.iter().map(|finding| finding.rule.code).collect();
    assert_eq!(codes, ["M01", "D03", "T01"], "a write of nothing changes nothing");
    assert_eq!(nothing[1].message, "set-calibration takes 4 registers, not 0");
}

#[test]
fn a_factor_beyond_reason_is_implausible() {
    let zero = ("01 10 11 00 00 04 08 00 00 00 00 00 00 00 00", "01 10 11 00 00 04");
    tell(alive(DO), zero).shows("D11", Master, &[2], Some(7..11));
    let nan = ("01 10 11 00 00 04 08 00 00 C0 7F 00 00 00 00", "01 10 11 00 00 04");
    assert_eq!(tell(alive(DO), nan).codes(), ["D10", "D11"]);
    let five = ("01 10 11 00 00 04 08 00 00 A0 40 00 00 00 00", "01 10 11 00 00 04");
    assert_eq!(tell(alive(DO), five).codes(), ["D10"], "5 is just within");
}

#[test]
fn a_calibration_in_parts_is_split() {
    alive(DO).ask("01 10 11 00 00 02 04 00 00 80 3F").wait(6000).shows("D12", Master, &[2], Some(4..6));
    alive(DO).ask("01 10 11 02 00 02 04 00 00 80 3F").wait(6000).shows("D12", Master, &[2], Some(2..6));
}

#[test]
fn a_value_in_the_other_byte_order_is_told_by_its_sense() {
    let float = ("01 10 11 00 00 04 08 3F 80 00 00 00 00 00 00", "01 10 11 00 00 04");
    let found = tell(alive(DO), float).shows("D13", Master, &[2], Some(7..11));
    assert!(found.message.ends_with("in the other byte order it is 1"), "{}", found.message);
    assert_eq!(tell(alive(DO), float).codes(), ["D10", "D13"]);
    let interval = ("01 10 0E 00 00 01 02 00 1E", "01 10 0E 00 00 01");
    tell(alive(SONDE), interval).shows("D13", Master, &[2], Some(7..9));
    let right = ("01 10 0E 00 00 01 02 1E 00", "01 10 0E 00 00 01");
    assert!(tell(alive(SONDE), right).codes().is_empty());
    alive(DO).ask("01 10 30 00 00 01 02 00 05").wait(6000).shows("D13", Master, &[2], Some(7..9));
}

#[test]
fn a_new_address_is_from_1_to_247() {
    alive(DO).ask("01 10 30 00 00 01 02 F8 00").wait(6000).shows("D14", Master, &[2], Some(7..8));
    alive(DO).ask("01 10 30 00 00 01 02 00 00").wait(6000).shows("D14", Master, &[2], Some(7..8));
    let good = ("01 10 30 00 00 01 02 F7 00", "01 10 30 00 00 01");
    assert!(tell(alive(DO), good).codes().is_empty());
}

#[test]
fn the_old_address_is_not_asked_again() {
    let moved = || tell(alive(DO), ("01 10 30 00 00 01 02 14 00", "01 10 30 00 00 01"));
    moved().ask(VERSION.0).wait(6000).shows("D15", Master, &[3, 4], Some(0..1));
    moved().ask("0E 03 07 00 00 02").wait(6000).shows("D15", Master, &[3, 4], Some(0..1));
    let new = moved().tell("14 03 07 00 00 02", "14 03 04 02 00 05 07");
    assert!(new.codes().is_empty());
}

#[test]
fn the_service_address_is_for_one_device_alone() {
    let ask = ("FF 03 30 00 00 01", "FF 03 02 01 00");
    assert!(tell(alive(DO), ask).codes().is_empty());
    let two = alive(DO).tell("02 03 07 00 00 02", "02 03 04 01 00 01 08");
    tell(two, ask).shows("D16", Master, &[4], Some(0..1));
}

#[test]
fn an_answer_from_the_service_address_is_not_asked_for_again_at_once() {
    let ask = ("FF 03 30 00 00 01", "FF 03 02 01 00");
    let asked = |count, ms| alive(DO).repeat(count, ms, ask.0, ask.1);
    asked(3, 500).shows("D21", Master, &[6, 7], None);
    assert!(asked(2, 500).codes().is_empty());
    assert!(asked(9, 60_000).codes().is_empty(), "once a minute is a poll");
}

#[test]
fn a_read_during_the_sweep_is_disturbed() {
    let sweep = |ms| tell(alive(SONDE), BRUSH).wait(ms).tell(SONDE_READ, SONDE_DATA);
    sweep(5000).shows("D17", Master, &[3, 4], None);
    assert!(sweep(11_000).codes().is_empty());
}

#[test]
fn a_clock_is_set_to_a_date() {
    let wrong = ("01 10 13 00 00 04 08 17 05 1D 26 04 00 16 00", "01 10 13 00 00 04");
    tell(alive(SONDE), wrong).shows("D18", Master, &[2], Some(7..15));
    let right = ("01 10 13 00 00 04 08 17 05 13 26 04 00 16 00", "01 10 13 00 00 04");
    assert!(tell(alive(SONDE), right).codes().is_empty());
}

#[test]
fn a_write_of_nothing_still_has_its_byte_count() {
    // An early sketch: eight bytes, with the CRC of the frame of nine.
    let sketch = hex("01 10 1C 00 00 00 D8 92");
    alive(COND).wait(2000).bytes(&sketch).wait(6000).shows("D19", Master, &[2], Some(6..8));
    alive(COND).wait(2000).bytes(&sealed("01 10 1C 00 00 00")).wait(6000).shows(
        "D19",
        Master,
        &[2],
        Some(6..8),
    );
    let right = ("01 10 1C 00 00 00 00", "01 10 1C 00 00 00");
    assert!(tell(alive(COND), right).codes().is_empty());
}

#[test]
fn the_same_setting_is_not_written_again_and_again() {
    let write = ("01 10 0E 00 00 01 02 1E 00", "01 10 0E 00 00 01");
    let story = |count| alive(SONDE).repeat(count, 1000, write.0, write.1);
    assert!(story(2).codes().is_empty());
    story(3).shows("D20", Master, &[6], Some(7..9));
}

#[test]
fn an_answer_from_the_service_address_is_taken() {
    let ask = ("FF 03 30 00 00 01", "FF 03 02 01 00");
    let story = |count| Story::of(DO).repeat(count, 0, ask.0, ask.1);
    assert!(story(2).codes().is_empty());
    story(3).shows("D21", Master, &[4, 5], None);
}
