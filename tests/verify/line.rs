//! L: silences, line errors, echoes and holes.

use rtutap::analyze::verify::Party::{Adapter, Device, Line, Master};
use rtutap::analyze::verify::Severity;
use rtutap::decode::chunk::LineErrorKind;

use crate::story::{Story, hex, sealed};

const DO: &[&str] = &["1=yosemitech-do"];
const VERSION: &str = "01 03 07 00 00 02";
const VERSION_IS: &str = "01 03 04 02 00 05 07";

/// Lets a request come byte by byte, with a pause before one of them.
fn paused(mut story: Story, at: usize, ms: i64) -> Story {
    for (index, byte) in sealed(VERSION).iter().enumerate() {
        let pause = if index == at { ms } else { 0 };
        story = story.wait(pause).bytes(&[*byte]);
    }
    story
}

#[test]
fn a_certain_pause_inside_a_frame_is_the_senders() {
    let story = paused(Story::of(DO), 4, 10).wait(20).bytes(&sealed(VERSION_IS));
    story.shows("L01", Master, &[0], Some(3..5));
    // The host may have stalled once: what it then reads at once could have come in time.
    let story = Story::of(DO).chunk(&hex("01 03 07 00")).wait(10).chunk(&sealed(VERSION)[4..]);
    assert!(!story.codes().contains(&"L01"));
}

#[test]
fn a_pause_that_comes_every_time_is_no_stall_of_the_host() {
    let halves = |mut story: Story| {
        for _ in 0..5 {
            let request = sealed(VERSION);
            story = story.wait(500).bytes(&request[..7]).wait(10).bytes(&request[7..]);
            story = story.wait(20).bytes(&sealed(VERSION_IS));
        }
        story
    };
    assert_eq!(halves(Story::of(DO)).codes(), ["L01"]);
    let coarse = Story::with(DO, "9600-8N1", Some(16_000_000));
    assert!(halves(coarse).codes().is_empty(), "an adapter may have made it");
    assert!(halves(Story::with(DO, "9600-8N1", None)).codes().is_empty(), "nothing is known of the adapter");
}

#[test]
fn an_answer_right_behind_its_request_is_too_soon() {
    let soon = Story::of(DO).ask(VERSION).wait(2).bytes(&sealed(VERSION_IS));
    soon.shows("L02", Device, &[0, 1], None);
    let request = Story::of(DO).tell(VERSION, VERSION_IS).wait(2).bytes(&sealed(VERSION));
    let request = request.wait(20).bytes(&sealed(VERSION_IS));
    request.shows("L02", Master, &[1, 2], None);
    assert!(Story::of(DO).ask(VERSION).wait(4).bytes(&sealed(VERSION_IS)).codes().is_empty());
}

#[test]
fn above_19200_baud_short_of_the_fixed_silence_is_a_note() {
    let fast = |us: i64| {
        let story = Story::with(DO, "57600-8N1", Some(0)).ask(VERSION);
        story.wait_ns(us * 1000).bytes(&sealed(VERSION_IS)).findings()
    };
    let severity = |us| fast(us).first().map(|finding| finding.severity);
    assert_eq!(severity(50), Some(Severity::Error), "under 3.5 characters: 0.61 ms");
    assert_eq!(severity(700), Some(Severity::Note));
    assert_eq!(severity(1800), None);
}

#[test]
fn what_the_adapter_hides_is_said_once() {
    let notes = |hold| {
        let story = Story::with(DO, "9600-8N1", hold).repeat(3, 500, VERSION, VERSION_IS);
        let found = story.all_findings();
        found
            .iter()
            .filter(|finding| finding.rule.code == "L03")
            .map(|it| it.message.clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(notes(Some(17_000_000)).len(), 1);
    assert!(notes(Some(17_000_000))[0].contains("17.00 ms: t1.5 and t3.5"));
    assert!(notes(Some(2_000_000))[0].ends_with("t1.5 cannot be measured"));
    assert!(notes(Some(1_000_000)).is_empty());
}

#[test]
fn what_the_uart_reported_is_passed_on() {
    let error = LineErrorKind::ParityOrFraming;
    let story = Story::of(DO).errors(&sealed(VERSION), &[2, 4], error);
    story.wait(20).bytes(&sealed(VERSION_IS)).shows("L04", Line, &[0], Some(2..5));
    let overrun = Story::of(DO).errors(&sealed(VERSION), &[2], LineErrorKind::Overrun);
    overrun.wait(20).bytes(&sealed(VERSION_IS)).shows("L07", Adapter, &[0], Some(2..3));
}

#[test]
fn other_settings_are_advised_only_where_most_is_received_badly() {
    let advised = |story: Story| {
        let found = story.errors(&sealed(VERSION), &[2], LineErrorKind::ParityOrFraming).findings();
        let told: Vec<_> = found.iter().filter(|finding| finding.rule.code == "L04").collect();
        assert!(!told.is_empty());
        told.iter().any(|finding| finding.message.contains("such as 8E1"))
    };
    assert!(advised(Story::of(DO)));
    assert!(!advised(Story::of(DO).repeat(5, 2000, VERSION, VERSION_IS).wait(2000)));
}

#[test]
fn a_byte_beside_a_frame_is_stray() {
    let story = Story::of(DO).ask(VERSION).wait(20).bytes(&[sealed(VERSION_IS), vec![0xFF]].concat());
    story.tell(VERSION, VERSION_IS).shows("L05", Line, &[2], None);
}

#[test]
fn an_echo_is_the_adapters() {
    let mut story = Story::of(DO);
    for _ in 0..20 {
        story = story.ask(VERSION).wait(1).bytes(&sealed(VERSION)).wait(20).bytes(&sealed(VERSION_IS));
    }
    let found = story.findings();
    assert!(found.iter().any(|finding| finding.rule.code == "L06" && finding.party == Adapter), "{found:?}");
}

#[test]
fn a_hole_is_said_where_it_is() {
    let found =
        Story::of(DO).tell(VERSION, VERSION_IS).wait(500).lose(7).tell(VERSION, VERSION_IS).findings();
    let holes: Vec<_> = found.iter().filter(|finding| finding.rule.code == "L07").collect();
    assert_eq!(holes.len(), 1);
    assert!(holes[0].message.starts_with("7 bytes lost before byte 17"), "{}", holes[0].message);
}
