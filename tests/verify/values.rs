//! V: what a device says.

use rtutap::analyze::verify::Party::Device;

use crate::story::{Story, sealed};

const COND: &[&str] = &["1=yosemitech-conductivity"];
const SONDE: &[&str] = &["1=yosemitech-sonde"];
const READ: &str = "01 03 26 00 00 05";

/// Writes what the conductivity probe answers.
fn data(temperature: f32, conductivity: f32, flag: u8) -> String {
    let mut bytes = vec![1, 3, 10];
    bytes.extend(temperature.to_le_bytes());
    bytes.extend(conductivity.to_le_bytes());
    bytes.extend([flag, 0]);
    bytes.iter().map(|byte| format!("{byte:02x} ")).collect()
}

#[test]
fn the_devices_own_flag_is_named() {
    let found =
        Story::of(COND).tell(READ, &data(17.5, 0.8, 0xFF)).shows("V01", Device, &[0, 1], Some(11..12));
    assert!(found.message.ends_with("range switching error"), "{}", found.message);
    assert!(Story::of(COND).tell(READ, &data(17.5, 0.8, 0)).codes().is_empty());
    let sonde = Story::of(SONDE).tell("01 03 08 00 00 01", "01 03 02 05 00").findings();
    assert!(sonde[0].message.ends_with("brush, 12 V supply"), "{}", sonde[0].message);
}

#[test]
fn a_value_beyond_reason_is_implausible() {
    Story::of(COND).tell(READ, &data(17.5, f32::INFINITY, 0)).shows("V02", Device, &[0, 1], Some(7..11));
    Story::of(COND).tell(READ, &data(80.0, 0.8, 0)).shows("V02", Device, &[0, 1], Some(3..7));
}

#[test]
fn a_value_that_stays_while_others_move_is_frozen() {
    let story = |count: usize, moves: bool| {
        let mut story = Story::of(COND);
        for index in 0..count {
            let temperature = if moves { 17.0 + index as f32 / 100.0 } else { 17.0 };
            story = story.wait(3000).tell(READ, &data(temperature, 0.803, 0));
        }
        story
    };
    story(40, true).shows("V03", Device, &[60, 61], Some(7..11));
    assert!(story(30, true).codes().is_empty());
    assert!(story(60, false).codes().is_empty(), "still water, or a slow poll of a fast cycle");
}

#[test]
fn silence_after_a_brush_start_tells_of_the_supply() {
    let alive = || Story::of(SONDE).tell("01 03 08 00 00 01", "01 03 02 00 00");
    let brush = alive().tell("01 10 2F 00 00 00 00", "01 10 2F 00 00 00");
    let dead = brush.ask("01 03 08 00 00 01").wait(6000);
    dead.shows("V04", Device, &[3, 4], None);
    let wrong = alive().tell("01 10 2F 00 00 00 00", "01 10 2F 00 00 00").ask("01 03 09 00 00 07").wait(6000);
    assert_eq!(wrong.codes(), ["D04", "T01"], "nobody answers that, brush or not");
    assert_eq!(alive().ask("01 03 08 00 00 01").wait(6000).codes(), ["T01"]);
}

#[test]
fn a_clock_that_jumps_tells_of_the_supply() {
    let clock = |text: &str| ("01 03 13 00 00 04".to_owned(), format!("01 03 08 {text}"));
    let story = |second: &str| {
        let (ask, first) = clock("17 05 13 26 04 00 16 00");
        Story::of(SONDE).tell(&ask, &first).wait(10_000).tell(&ask, &clock(second).1)
    };
    story("00 00 00 01 01 00 00 00").shows("V04", Device, &[1, 3], Some(3..11));
    assert!(story("28 05 13 26 04 00 16 00").codes().is_empty());
}

#[test]
fn an_interval_that_nobody_wrote_tells_of_the_supply() {
    let write = "01 10 0E 00 00 01 02 3C 00";
    let story = |back: &str| {
        let story = Story::of(SONDE).tell(write, "01 10 0E 00 00 01");
        story.tell("01 03 0E 00 00 01", &format!("01 03 02 {back}"))
    };
    story("1E 00").shows("V04", Device, &[0, 3], None);
    assert!(story("3C 00").codes().is_empty());
    assert!(story("28 00").codes().is_empty(), "not the default: somebody may have written it");
    let calibration = |k: &str| ("01 03 11 00 00 04".to_owned(), format!("01 03 08 {k} 00 00 00 00"));
    let (ask, one) = calibration("00 00 80 3F");
    let story = Story::of(&["1=yosemitech-do"]).tell(&ask, &one).tell(&ask, &calibration("00 00 00 40").1);
    assert!(story.codes().is_empty(), "a calibration survives");
    assert!(sealed("01").len() == 3);
}
