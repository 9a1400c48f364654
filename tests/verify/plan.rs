//! A master held against plans: what departs is said, and nothing else.

use std::sync::Arc;

use rtutap::analyze::plan::{Check, Draft, Plan};
use rtutap::analyze::verify::Finding;
use rtutap::decode::chunk::{Chunk, Lost, LostKind, ReadTime};
use rtutap::decode::crc;
use rtutap::device::{Devices, Environment, Profiles};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Options, Pipeline};
use rtutap::time::{MILLISECOND, SECOND, Timestamp};

const DO: &str = "01 03 26 00 00 04";
const DO_IS: &str = "01 03 08 00 00 8D 41 66 66 66 3F";
const COND: &str = "02 03 26 00 00 05";
const COND_IS: &str = "02 03 0A 00 00 8D 41 66 66 66 3F 00 00";
const VERSION: &str = "02 03 07 00 00 02";
const VERSION_IS: &str = "02 03 04 01 00 01 08";
/// What happens: a request and its answer so many milliseconds later, at a time in milliseconds; or a hole.
type Said<'a> = (i64, &'a str, &'a str, i64);
const HOLE: &str = "";

fn bytes(text: &str) -> Vec<u8> {
    let mut bytes: Vec<u8> =
        text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("hex")).collect();
    let sum = crc::checksum(&bytes);
    bytes.extend(sum.to_le_bytes());
    bytes
}

/// Lets a bus talk, heard through an adapter that keeps bytes back for `hold` milliseconds.
fn heard(said: &[Said<'_>], hold: i64, mut take: impl FnMut(&Event<'_>)) {
    let line = LineSettings::default();
    let profiles = Arc::new(Profiles::built_in());
    let shapes = profiles.shapes();
    let options = Options::new(line, Some(hold * MILLISECOND));
    let mut pipeline = Pipeline::new(options, Devices::new(profiles, Environment::default()), shapes);
    for &(at, request, response, latency) in said {
        let start = 1_000_000 * SECOND + at * MILLISECOND;
        if request == HOLE {
            let time = Some(Timestamp::from_ns(start));
            pipeline.handle_lost(Lost { time, stream_offset: 0, kind: LostKind::SourceGone, count: 0 });
        } else {
            let (request, response) = (bytes(request), bytes(response));
            let asked = start + line.character_ns() * request.len() as i64;
            let answered = asked + latency * MILLISECOND + line.character_ns() * response.len() as i64;
            for (bytes, end) in [(&request, asked), (&response, answered)] {
                // A UART hands over each byte as it comes, an adapter a few at once.
                let most = if hold == 0 { 1 } else { bytes.len() };
                let mut left = bytes.len();
                for bytes in bytes.chunks(most) {
                    left -= bytes.len();
                    let end = end - line.character_ns() * left as i64 + hold * MILLISECOND;
                    let time = ReadTime::At(Timestamp::from_ns(end));
                    pipeline.handle_bytes(&Chunk { time, bytes, line_errors: &[] });
                }
            }
        }
        while let Some(event) = pipeline.poll_event() {
            take(&event);
        }
    }
    pipeline.finish();
    while let Some(event) = pipeline.poll_event() {
        take(&event);
    }
}

fn drafted(said: &[Said<'_>], hold: i64) -> Plan {
    let mut draft = Draft::default();
    heard(said, hold, |event| {
        if let Event::Transaction { transaction, meaning, .. } = event {
            draft.transaction(transaction, meaning);
        }
    });
    draft.finish()
}

fn checked(plan: &Plan, said: &[Said<'_>], hold: i64) -> Vec<Finding> {
    let (mut check, mut found) = (Check::new(plan.clone(), true), Vec::new());
    heard(said, hold, |event| match event {
        Event::Transaction { transaction, meaning, .. } => {
            check.transaction(transaction, meaning, &mut found)
        }
        Event::Lost(_) => check.lost(),
        _ => {}
    });
    check.finish(&mut found);
    found
}

fn codes(found: &[Finding]) -> Vec<&'static str> {
    found.iter().map(|finding| finding.rule.code).collect()
}

/// Polls every second, `from` to `to` in seconds; the second device every third second, to `until`.
fn polls(to: i64, until: i64) -> Vec<Said<'static>> {
    let first = (0..to).map(|second| (second * 1000, DO, DO_IS, 20));
    let second = (0..until).step_by(3).map(|second| (second * 1000 + 500, COND, COND_IS, 30));
    let mut said: Vec<_> = first.chain(second).collect();
    said.sort_by_key(|it| it.0);
    said
}

fn plan(text: &str) -> Plan {
    Plan::from_toml(text, &Profiles::built_in()).expect("a plan")
}

#[test]
fn a_master_keeps_the_plan_that_was_drafted_from_it_behind_whatever_adapter() {
    let mut said = polls(120, 120);
    said.insert(0, (-400, VERSION, VERSION_IS, 20));
    let draft = drafted(&said, 0);
    assert_eq!(draft.devices.len(), 2);
    assert!(draft.devices.iter().all(|device| device.silence_ns.is_some() && device.latency_ns.is_some()));
    for hold in [0, 16, 40] {
        assert_eq!(codes(&checked(&draft, &said, hold)), [""; 0], "held against behind {hold} ms");
        assert_eq!(codes(&checked(&drafted(&said, hold), &said, 0)), [""; 0], "drafted behind {hold} ms");
    }
}

#[test]
fn an_answer_is_slow_only_when_that_is_certain() {
    let text = "[[device]]\naddress = 1\nlatency = 40\n[[device.command]]\nname = 'a'\nfunction = 3\n\
                register = 0x2600\nquantity = 4\n";
    let slow = |latency, count| {
        let said: Vec<_> = (0..count).map(|at| (at * 1000, DO, DO_IS, latency)).collect();
        codes(&checked(&plan(text), &said, 0)).len()
    };
    assert_eq!((slow(39, 9), slow(60, 1), slow(110, 1)), (0, 0, 1), "a host may pause for once");
    assert_eq!(slow(60, 5), 3, "again and again it is no pause");
}

#[test]
fn a_device_that_is_not_asked_any_more_or_once_or_never_is_told() {
    let good = polls(120, 120);
    let draft = drafted(&good, 0);
    let stopped = checked(&draft, &polls(120, 60), 0);
    assert_eq!(codes(&stopped), ["P01"]);
    assert!(stopped[0].message.starts_with("2 was asked nothing for 6"), "{}", stopped[0].message);
    assert_eq!(stopped[0].frames.len(), 2, "the first and the last request to it");
    assert_eq!(codes(&checked(&draft, &polls(120, 1), 0)), ["P01"], "once");
    let never = checked(&draft, &polls(120, 0), 0);
    assert_eq!((codes(&never), never[0].frames.len()), (vec!["P01"], 2));
    // The same of a plan that has no times.
    let bare = plan(
        "[[device]]\naddress = 1\n[[device.command]]\nname = 'a'\nfunction = 3\nregister = 0x2600\n\
                     quantity = 4\n[[device]]\naddress = 2\n",
    );
    assert_eq!(codes(&checked(&bare, &polls(60, 0), 0)), ["P01"]);
}

#[test]
fn a_command_that_never_comes_or_comes_no_more_is_told_with_frames() {
    let command = |register: &str| {
        format!(
            "[[device.command]]\nname = 'r{register}'\nfunction = 3\nregister = {register}\nquantity = 4\nevery = [0.5, 2]\n"
        )
    };
    let text = format!("[[device]]\naddress = 1\n{}{}", command("0x2600"), command("0x1100"));
    let found = checked(&plan(&text), &polls(60, 0), 0);
    assert_eq!((codes(&found), &found[0].frames[..]), (vec!["P03"], &[0, 118][..]));
    let calibration = (500, "01 03 11 00 00 04", "01 03 08 00 00 80 3F 00 00 00 00", 20);
    let once = [&polls(1, 0)[..], &[calibration], &polls(60, 0)[1..]].concat();
    let found = checked(&plan(&text), &once, 0);
    assert_eq!((codes(&found), &found[0].frames[..]), (vec!["P05"], &[2][..]));
    assert!(
        found[0].message.starts_with("r0x1100 came once, and not in the last 58"),
        "{}",
        found[0].message
    );
}

#[test]
fn a_hole_may_hide_what_the_master_asked() {
    let draft = drafted(&polls(120, 120), 0);
    let (mut said, rest) = (polls(60, 60), polls(240, 240));
    said.push((60_000, HOLE, "", 0));
    said.extend(rest.into_iter().filter(|it| it.0 >= 180_000));
    let found = checked(&draft, &said, 0);
    assert_eq!(codes(&found), [""; 0], "{found:#?}");
}

#[test]
fn nothing_asked_is_no_plan() {
    assert_eq!(drafted(&[], 0), Plan::default());
}
