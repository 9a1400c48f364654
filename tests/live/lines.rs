//! What is printed live is what `decode` prints of the recording.

use rtutap::simulate::Adapter;

use crate::bus::{Bus, LAST, Tap, info, printed, reads};

/// Taps buses that speak as fast as they can; holds the lines against the recording's.
///
/// `last` is how a line with the last request of a bus looks, but for the name of the bus.
fn held_against_the_recording(buses: &mut [(Bus, Vec<u8>)], format: &[&str], last: &str) -> String {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let name = path.to_str().expect("UTF-8");
    let sources: Vec<String> = buses.iter().map(|(bus, _)| bus.path.clone()).collect();
    let mut args = vec!["listen", "--record", name];
    args.extend(sources.iter().map(|source| &**source));
    args.extend(format);
    let mut tap = Tap::start(&args);
    buses.iter().for_each(|(bus, _)| bus.wait_for_listener());
    let longest = buses.iter().map(|(_, bytes)| bytes.len()).max().unwrap_or(0);
    for at in (0..longest).step_by(300) {
        for (bus, bytes) in buses.iter_mut() {
            bus.say(bytes.get(at.min(bytes.len())..bytes.len().min(at + 300)).unwrap_or_default());
        }
    }
    for (bus, _) in buses.iter_mut() {
        bus.say(&LAST);
    }
    for _ in buses.iter() {
        tap.wait_for(last);
    }
    tap.interrupt();
    let spoken: usize = buses.iter().map(|(_, bytes)| bytes.len() + LAST.len()).sum();
    assert_eq!(info(&[&path])["bytes"], spoken, "every byte is in the recording");
    let decoded = printed(&[&["decode", name], format].concat());
    assert!(tap.printed == decoded, "live:\n{}\n\ndecoded:\n{decoded}", tap.printed);
    decoded
}

fn spoken(scenario: &str, seed: u64, frames: u64) -> Vec<u8> {
    reads(scenario, Adapter::Uart, seed, frames).into_iter().flat_map(|read| read.bytes).collect()
}

#[test]
fn live_lines_equal_those_of_their_own_recording_in_every_format() {
    let json = ["--show", "frames", "--show", "transactions", "--show", "readings", "--format", "json"];
    let text = ["--show", "frames", "--time", "utc"];
    let csv = ["--show", "frames", "--format", "csv", "--time", "relative"];
    for (seed, format, last) in [
        (1, &json[..], "\"bytes\":\"f70312340001d42a\""),
        (2, &text[..], "f7 03 12 34 00 01 d4 2a"),
        (3, &csv[..], "f70312340001d42a"),
    ] {
        let lines = held_against_the_recording(
            &mut [(Bus::new(), spoken("everything-bad", seed, 200))],
            format,
            last,
        );
        assert!(lines.lines().count() > 80, "{lines}");
    }
}

#[test]
fn so_do_those_of_two_buses_and_of_a_filter() {
    let mut buses =
        [(Bus::new(), spoken("everything-bad", 4, 150)), (Bus::new(), spoken("installation", 5, 150))];
    let json = ["--show", "frames", "--show", "transactions", "--format", "json"];
    let lines = held_against_the_recording(&mut buses, &json, "\"bytes\":\"f70312340001d42a\"");
    assert!(lines.contains("\"bus\":\"bus0\"") && lines.contains("\"bus\":\"bus1\""));
    let mut buses = [(Bus::new(), spoken("installation", 6, 150))];
    let filter = [&json[..], &["--filter", "addr in (1, 247)"]].concat();
    let lines = held_against_the_recording(&mut buses, &filter, "\"bytes\":\"f70312340001d42a\"");
    assert!(lines.lines().all(|line| line.contains("\"address\":1") || line.contains("\"address\":247")));
}

#[test]
fn a_line_to_be_found_is_told_and_a_server_has_none() {
    let mut bus = Bus::new();
    let mut tap = Tap::start(&["listen", "--line", "auto", "--show", "frames", &bus.path]);
    bus.wait_for_listener();
    bus.say(&spoken("installation", 7, 40));
    bus.say(&LAST);
    tap.wait_for("f7 03 12 34 00 01 d4 2a");
    let said = tap.interrupt();
    assert!(said.contains("looking for the line settings; trying 9600-8N1"), "{said}");
    assert!(said.contains("the line is 9600-8N1: "), "{said}");
    assert!(said.contains("no line errors are reported by this adapter"), "{said}");
    let (status, said) = Tap::start(&["listen", "--line", "auto", "tcp://127.0.0.1:9"]).wait();
    assert_eq!(status.code(), Some(2));
    assert!(
        said.contains("no line settings that --line auto could change") && said.contains("hint: "),
        "{said}"
    );
}
