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
    assert!(never.message.contains("9 has not answered yet"), "{}", never.message);
    let since = Story::of(DO).tell(VERSION, VERSION_IS).ask(VERSION).ask(VERSION).wait(6000);
    assert!(since.findings()[1].message.contains("silent for 2 requests"));
    let unknown = Story::of(DO).tell(VERSION, VERSION_IS).ask("01 03 14 00 00 06").wait(6000);
    let unknown = unknown.shows("T01", Master, &[2], None);
    assert!(unknown.message.contains("does not know it"), "{}", unknown.message);
    assert!(Story::of(DO).tell(VERSION, VERSION_IS).codes().is_empty());
}

#[test]
fn a_request_that_nobody_could_answer_is_the_masters() {
    let alive = || Story::of(DO).tell(VERSION, VERSION_IS);
    let moved = || alive().tell("01 10 30 00 00 01 02 14 00", "01 10 30 00 00 01");
    for (story, why) in [
        (alive().ask("01 10 30 00 00 01 02 00 05"), "D13 says why"),
        (alive().ask("01 10 30 00 00 01 02 F8 00"), "D14 says why"),
        (moved().ask(VERSION), "D15 says why"),
        (alive().ask("01 03 11 00 00 00"), "does not know it, and answers others (M01)"),
        (alive().ask("F8 03 07 00 00 02"), "the address is reserved (F06)"),
        (alive().ask("01 11"), "yosemitech-do has nothing with function 17"),
        (alive().ask("01 2B 0E 01 00"), "yosemitech-do has nothing with function 43"),
    ] {
        let found = story.wait(6000).findings();
        let silent: Vec<_> = found.iter().filter(|finding| finding.rule.code == "T01").collect();
        assert_eq!((silent.len(), silent.first().map(|it| it.party)), (1, Some(Master)), "{why}: {found:#?}");
        assert!(silent[0].message.ends_with(why), "{} for {why}", silent[0].message);
    }
    let plain = alive().ask(VERSION).wait(6000).findings();
    assert_eq!((plain[0].rule.code, plain[0].party), ("T01", Device));
}

#[test]
fn a_late_answer_that_meets_a_retry_is_late() {
    let story = || Story::of(DO).repeat(4, 500, VERSION, VERSION_IS).ask(VERSION).wait(300);
    // The answer to the first begins right behind the second; its own comes as usual.
    let crossed = story().bytes(&sealed(VERSION)).wait(1).bytes(&sealed(VERSION_IS));
    let crossed = crossed.wait(20).bytes(&sealed(VERSION_IS)).wait(3000);
    assert_eq!(crossed.codes(), ["T02"]);
    let crossed = story().bytes(&sealed(VERSION)).wait(1).bytes(&sealed(VERSION_IS)).wait(3000);
    crossed.shows("T02", Device, &[8, 9, 10], None);
    let retried = story().bytes(&sealed(VERSION)).wait(20).bytes(&sealed(VERSION_IS)).wait(3000);
    assert_eq!(retried.codes(), ["T01"]);
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
    let stray = [&answer[..], &hex("41 07 9A")].concat();
    let story = Story::of(DO).ask(VERSION).wait(20).bytes(&stray).wait(1000);
    assert_eq!(story.codes(), ["F01", "L05"], "too few for a talker");
    answer.extend(hex("41 07 9A 22 5C"));
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
    let all = Story::of(DO).tell(VERSION, VERSION_IS).ask("00 10 30 00 00 01 02 05 00").wait(6000);
    all.shows("D22", Master, &[2], Some(0..1));
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
