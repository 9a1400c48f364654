//! T, M and Q: the conversation.

use rtutap::analyze::verify::Party::{Device, Line, Master};

use crate::story::{Story, hex, sealed};

const DO: &[&str] = &["1=yosemitech-do"];
const BOTH: &[&str] = &["1=yosemitech-do", "2=yosemitech-conductivity"];
const VERSION: &str = "01 03 07 00 00 02";
const VERSION_IS: &str = "01 03 04 02 00 05 07";

#[test]
fn an_unanswered_request_is_classified_by_what_the_device_does_otherwise() {
    let never = Story::of(DO).ask("09 03 07 00 00 02").wait(6000).shows("T01", Device, &[0], None);
    assert!(never.message.contains("9 has never answered"), "{}", never.message);
    let since = Story::of(DO).tell(VERSION, VERSION_IS).ask(VERSION).ask(VERSION).wait(6000);
    assert!(since.findings()[1].message.contains("silent for 2 requests"));
    let unknown = Story::of(DO).tell(VERSION, VERSION_IS).ask("01 03 14 00 00 06").wait(6000);
    let unknown = unknown.shows("T01", Master, &[2], None);
    assert!(unknown.message.contains("does not know it"), "{}", unknown.message);
    assert!(Story::of(DO).tell(VERSION, VERSION_IS).codes().is_empty());
}

#[test]
fn an_answer_after_the_next_request_is_late() {
    let other = "02 03 07 00 00 02";
    let story = Story::of(BOTH).repeat(5, 500, VERSION, VERSION_IS);
    let story = story.ask(VERSION).wait(300).bytes(&sealed(other)).wait(20);
    let story = story.bytes(&sealed(VERSION_IS)).wait(10).bytes(&sealed("02 03 04 01 00 01 08"));
    story.shows("T02", Device, &[10, 12], None);
}

#[test]
fn a_request_into_an_answer_that_is_due_is_another_masters() {
    let other = "02 03 07 00 00 02";
    let story = Story::of(BOTH).repeat(5, 500, VERSION, VERSION_IS);
    let story = story.ask(VERSION).wait(8).bytes(&sealed(other)).wait(8);
    let story = story.bytes(&sealed(VERSION_IS)).wait(10).bytes(&sealed("02 03 04 01 00 01 08"));
    story.shows("T09", Master, &[10, 11], None);
}

#[test]
fn a_response_that_nobody_asked_for_is_said_and_a_second_one_is_another_device() {
    let lone = Story::of(DO).tell(VERSION, VERSION_IS).wait(3000).bytes(&sealed("01 03 04 02 00 05 08"));
    assert_eq!(lone.codes(), ["T03"]);
    let twice = Story::of(DO).tell(VERSION, VERSION_IS).wait(10).bytes(&sealed("01 03 04 02 00 05 08"));
    twice.shows("T07", Line, &[1, 2], None);
}

#[test]
fn an_exception_is_named() {
    let refused = Story::of(DO).tell(VERSION, "01 83 02").shows("T04", Device, &[0, 1], None);
    assert!(refused.message.contains("exception 2: illegal data address"), "{}", refused.message);
}

#[test]
fn an_answer_has_the_length_that_was_asked_for() {
    Story::of(DO).tell(VERSION, "01 03 02 02 00").shows("T05", Device, &[0, 1], Some(2..3));
    let stop = Story::of(&["1=yosemitech-conductivity"]).tell("01 03 2E 00 00 01", "01 03 00 00 00");
    assert!(stop.codes().is_empty(), "the manual's answer to a stop counts no bytes");
}

#[test]
fn the_same_three_times_in_vain_is_a_storm() {
    let twice = Story::of(DO).tell(VERSION, VERSION_IS).ask(VERSION).ask(VERSION).wait(6000);
    assert_eq!(twice.codes(), ["T01"]);
    let thrice = Story::of(DO).tell(VERSION, VERSION_IS).ask(VERSION).ask(VERSION).ask(VERSION).wait(6000);
    thrice.shows("T06", Master, &[4], None);
    let between = Story::of(BOTH).tell(VERSION, VERSION_IS).ask(VERSION).ask(VERSION);
    let between = between.tell("02 03 07 00 00 02", "02 03 04 01 00 01 08").ask(VERSION).wait(6000);
    assert_eq!(between.codes(), ["T01"]);
}

#[test]
fn more_damaged_bytes_than_the_answer_has_are_a_collision() {
    let mut answer = sealed(VERSION_IS);
    answer[4] ^= 0x55;
    answer[5] ^= 0x31;
    let damaged = Story::of(DO).ask(VERSION).wait(20).bytes(&answer).wait(1000);
    assert_eq!(damaged.codes(), ["F01"]);
    answer.extend(hex("41 07 9A"));
    Story::of(DO).ask(VERSION).wait(20).bytes(&answer).wait(1000).shows("T08", Line, &[1, 2], None);
}

#[test]
fn a_quantity_is_within_the_specification_or_declared() {
    let start = Story::of(DO).tell("01 03 25 00 00 00", "01 03 00");
    assert!(start.codes().is_empty(), "a read of zero registers that the manual asks for");
    Story::of(DO).ask("01 03 07 00 00 00").wait(6000).shows("M01", Master, &[0], Some(4..6));
    let many = Story::of(DO).tell(VERSION, VERSION_IS).ask("01 03 07 00 00 7E").wait(6000);
    assert!(many.codes().contains(&"M01"));
}

#[test]
fn a_read_to_all_is_an_error_and_a_write_to_all_is_ignored_by_these_devices() {
    Story::of(DO).ask("00 03 07 00 00 02").wait(6000).shows("M02", Master, &[0], Some(0..1));
    Story::of(DO).ask("00 10 30 00 00 01 02 05 00").wait(6000).shows("D22", Master, &[0], Some(0..1));
}

#[test]
fn a_write_counts_two_bytes_a_register() {
    let wrong = Story::of(DO).ask("01 10 11 00 00 04 06 00 00 80 3F 00 00").wait(6000);
    wrong.shows("M03", Master, &[0], Some(4..7));
}

#[test]
fn a_quirk_is_noted_once() {
    let story = Story::of(DO).repeat(3, 2000, "01 03 25 00 00 00", "01 03 00");
    let notes: Vec<_> =
        story.all_findings().into_iter().filter(|finding| finding.rule.code == "Q01").collect();
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert_eq!((&notes[0].frames[..], notes[0].party), (&[0, 1][..], Device));
}
