//! F: damaged frames, and frames that nobody should send.

use rtutap::analyze::verify::Finding;
use rtutap::analyze::verify::Party::{Line, Master};

use crate::story::{Story, hex, sealed};

const DO: &[&str] = &["1=yosemitech-do"];
const VERSION: &str = "01 03 07 00 00 02";
const VERSION_IS: &str = "01 03 04 02 00 05 07";

/// Lets a request come that is not as it should be, among others that are.
fn spoilt(spoil: impl Fn(&mut Vec<u8>)) -> Story {
    let mut request = sealed(VERSION);
    spoil(&mut request);
    let story = Story::of(DO).repeat(4, 500, VERSION, VERSION_IS);
    story.wait(1000).bytes(&request).wait(3000).tell(VERSION, VERSION_IS)
}

#[test]
fn a_wrong_crc_has_its_nearest_explanation() {
    let flipped = spoilt(|bytes| bytes[3] ^= 0x10).shows("F01", Line, &[8], Some(3..4));
    assert!(flipped.message.contains("bit 4 of byte 3"), "{}", flipped.message);
    let exchanged = spoilt(|bytes| bytes.swap(2, 3)).findings();
    assert!(exchanged[0].message.contains("bytes 2 and 3 are exchanged"), "{}", exchanged[0].message);
    let many = spoilt(|bytes| bytes[5..7].copy_from_slice(&[0x33, 0x17])).findings();
    assert!(
        many[0].message.contains("several bytes") || many[0].message.contains("was lost"),
        "{}",
        many[0].message
    );
}

/// Lets an answer come that is not as it should be, right behind its request.
fn spoilt_answer(spoil: impl Fn(&mut Vec<u8>)) -> Vec<Finding> {
    let mut answer = sealed(VERSION_IS);
    spoil(&mut answer);
    let story = Story::of(DO).repeat(4, 500, VERSION, VERSION_IS).ask(VERSION).wait(20);
    story.bytes(&answer).wait(3000).tell(VERSION, VERSION_IS).findings()
}

fn lose(bytes: &mut Vec<u8>, at: usize) {
    bytes.remove(at);
}

#[test]
fn a_byte_lost_doubled_or_replaced_is_told() {
    let told = |found: Vec<Finding>, what: &str| {
        let codes: Vec<_> = found.iter().map(|finding| finding.rule.code).collect();
        assert_eq!(codes, ["F01"], "{found:#?}");
        assert!(found[0].message.contains(what), "{} for {what}", found[0].message);
    };
    told(spoilt(|bytes| lose(bytes, 3)).findings(), "a byte before byte");
    told(spoilt(|bytes| bytes.insert(3, bytes[3])).findings(), "came twice");
    told(spoilt(|bytes| bytes[3] = 0x5A).findings(), "when byte 3 is 00");
    told(spoilt_answer(|bytes| lose(bytes, 5)), "a byte before byte");
    told(spoilt_answer(|bytes| bytes.insert(5, bytes[5])), "byte 6 came twice");
    told(spoilt_answer(|bytes| bytes[4] = 0x77), "when byte 4 is 00");
    let cut = spoilt_answer(|bytes| bytes.truncate(8));
    assert_eq!((cut[0].rule.code, cut.len()), ("F04", 1), "the last byte is of the tail");
}

#[test]
fn a_fixed_crc_is_the_masters_from_the_first_frame_on_where_nothing_else_is_damaged() {
    // The CRC of address 1, sent to 6: on a clean bus nothing else explains it.
    let fixed = [&[6], &sealed(VERSION)[1..]].concat();
    let story = || Story::of(DO).repeat(4, 500, VERSION, VERSION_IS).wait(1000).bytes(&fixed).wait(3000);
    let found = story().shows("F02", Master, &[8], Some(6..8));
    assert_eq!(found.address, Some(6));
    let noisy = Story::of(DO)
        .tell(VERSION, VERSION_IS)
        .ask(VERSION)
        .wait(20)
        .bytes(&hex("01 03 04 55 12 99 07 00 11"));
    let noisy = noisy.wait(3000).repeat(4, 500, VERSION, VERSION_IS).bytes(&fixed).wait(3000).findings();
    let last = noisy.last().expect("a finding");
    assert_eq!((last.rule.code, last.address), ("F01", Some(1)), "{noisy:#?}");
}

#[test]
fn a_crc_for_another_address_is_the_masters_unless_the_address_was_damaged() {
    let request = sealed("01 10 1C 00 00 00 00");
    let fixed = [&[6], &request[1..]].concat();
    let story = Story::of(DO).bytes(&fixed).wait(3000).bytes(&fixed).wait(3000);
    let found = story.findings();
    assert_eq!((found[0].rule.code, found[0].party, found[0].frames[0]), ("F02", Master, 0), "{found:?}");
    let damaged = spoilt(|bytes| bytes[0] = 5).shows("F01", Line, &[8], Some(0..1));
    assert!(damaged.message.contains("it fits when the address is 1"), "{}", damaged.message);
}

#[test]
fn a_crc_with_its_bytes_swapped_is_the_masters() {
    spoilt(|bytes| bytes.swap(6, 7)).shows("F03", Master, &[8], Some(6..8));
}

#[test]
fn a_frame_cut_at_its_tail_or_head_is_truncated() {
    let tail = spoilt(|bytes| bytes.truncate(6)).shows("F04", Line, &[8], None);
    assert!(tail.message.contains("lost its tail"), "{}", tail.message);
    let story = Story::of(DO).repeat(4, 500, VERSION, VERSION_IS).ask(VERSION);
    let head = story.wait(20).bytes(&sealed(VERSION_IS)[1..]).wait(3000).shows("F04", Line, &[9], None);
    assert!(head.message.contains("lost its head"), "{}", head.message);
}

#[test]
fn a_function_that_nobody_knows_is_said() {
    let mut story = Story::of(DO);
    for _ in 0..3 {
        story = story.tell(VERSION, VERSION_IS).wait(300).bytes(&sealed("01 41 07 00 00 02")).wait(3000);
    }
    let found = story.findings();
    let unknown: Vec<_> = found.iter().filter(|finding| finding.rule.code == "F05").collect();
    assert!(!unknown.is_empty() && unknown[0].span == Some(1..2), "{found:?}");
}

#[test]
fn a_reserved_address_is_said_unless_a_profile_names_it() {
    let story = Story::of(DO).ask("F8 03 07 00 00 02").wait(6000).tell(VERSION, VERSION_IS);
    story.shows("F06", Master, &[0], Some(0..1));
    let service = Story::of(&[]).tell("FF 03 30 00 00 01", "FF 03 02 03 00");
    assert!(service.codes().is_empty());
}

#[test]
fn bytes_that_are_no_frame_are_of_the_line() {
    let story =
        Story::of(DO).tell(VERSION, VERSION_IS).wait(1000).bytes(&hex("37 91 11 C2 5E 08")).wait(3000);
    story.shows("L05", Line, &[2], None);
}
