//! Imports: the same bytes as hex text, packets or a table of a logic analyser mean the same.

use predicates::prelude::*;

use crate::{rtutap, stdout};

/// What a real probe said, a frame a line.
const HEX: &str = include_str!("../../captures/y511.hex");

/// 2026-01-01T00:00:00Z.
const START: u64 = 1_767_225_600;
/// Time of a character of 9600-8N1 in nanoseconds.
const CHARACTER_NS: u64 = 1_041_667;

/// Returns the frames of the hex text.
fn frames() -> Vec<Vec<u8>> {
    let lines = HEX.lines().filter_map(|line| line.strip_prefix(['<', '>']));
    let bytes = lines.map(|line| line.split('#').next().unwrap_or("").split_whitespace());
    bytes.map(|bytes| bytes.map(|byte| u8::from_str_radix(byte, 16).expect("hex")).collect()).collect()
}

/// Returns when a byte of a frame ended, in nanoseconds after the start: a frame every 60 ms.
fn end_ns(frame: usize, byte: usize) -> u64 {
    frame as u64 * 60_000_000 + (byte as u64 + 1) * CHARACTER_NS
}

/// Writes a block of pcapng.
fn block(kind: u32, body: &[u8]) -> Vec<u8> {
    let length = (body.len().next_multiple_of(4) as u32 + 12).to_le_bytes();
    let padding = vec![0; body.len().next_multiple_of(4) - body.len()];
    [&kind.to_le_bytes()[..], &length, body, &padding, &length].concat()
}

/// Writes pcapng of the buses with these names and descriptions, on which the frames come in turn.
fn pcapng_of(buses: &[(&str, &str)]) -> Vec<u8> {
    let option = |code: u16, text: &str| {
        let padding = vec![0; text.len().next_multiple_of(4) - text.len()];
        [&code.to_le_bytes()[..], &(text.len() as u16).to_le_bytes(), text.as_bytes(), &padding].concat()
    };
    let mut file = pcapng(147, &[])[..28].to_vec(); // the section's header
    for (name, description) in buses {
        let resolution = [9, 0, 1, 0, 9, 0, 0, 0, 0, 0, 0, 0];
        let options = [&option(2, name)[..], &option(3, description), &resolution].concat();
        file.extend(block(1, &[&[147, 0, 0, 0, 0, 0, 0, 0][..], &options].concat()));
    }
    for (index, frame) in frames().iter().enumerate() {
        let bus = (index / 2 % buses.len()) as u32;
        file.extend(packet(bus, index, frame));
    }
    file
}

/// Writes the packet of a frame, of which the data holds a header, too.
fn packet(interface: u32, index: usize, data: &[u8]) -> Vec<u8> {
    let ns = START * 1_000_000_000 + end_ns(index, frames()[index].len() - 1);
    let length = data.len() as u32;
    let numbers = [interface, (ns >> 32) as u32, ns as u32, length, length].map(u32::to_le_bytes).concat();
    block(6, &[&numbers[..], data].concat())
}

/// Writes pcapng with times in nanoseconds; `header` stands before each frame.
fn pcapng(link_type: u16, header: &[u8]) -> Vec<u8> {
    let section = [&0x1A2B_3C4D_u32.to_le_bytes()[..], &[1, 0, 0, 0], &[0xFF; 8]].concat();
    let interface = [&link_type.to_le_bytes()[..], &[0; 6], &[9, 0, 1, 0, 9, 0, 0, 0, 0, 0, 0, 0]].concat();
    let mut file = [block(0x0A0D_0D0A, &section), block(1, &interface)].concat();
    for (index, frame) in frames().iter().enumerate() {
        file.extend(packet(0, index, &[header, frame].concat()));
    }
    file
}

/// Writes a table with a line for each byte, and when it began.
fn table(head: &str, row: impl Fn(u64, u8) -> String) -> Vec<u8> {
    let mut text = format!("{head}\n");
    for (index, frame) in frames().iter().enumerate() {
        for (at, byte) in frame.iter().enumerate() {
            text += &format!("{}\n", row(end_ns(index, at) - CHARACTER_NS, *byte));
        }
    }
    text.into_bytes()
}

fn seconds(ns: u64) -> String {
    format!("{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000)
}

/// Returns the rows of transactions without their times.
fn meaning(input: &[u8], format: &str) -> Vec<serde_json::Value> {
    let args = ["decode", "-", "--format", "json", "--line", "9600-8N1"];
    let told = stdout(&args, input);
    let forced = stdout(&[&args[..], &["--input-format", format]].concat(), input);
    assert_eq!(told, forced, "told apart by content");
    let mut rows: Vec<serde_json::Value> =
        told.lines().map(|row| serde_json::from_str(row).expect("a JSON object")).collect();
    for row in &mut rows {
        for key in ["start_ns", "end_ns", "latency_ns", "latency_error_ns"] {
            assert_eq!(row[key].is_null(), format == "hex", "{key} of {row}");
            row[key].take();
        }
    }
    rows
}

#[test]
fn packets_and_tables_mean_what_the_same_bytes_in_hex_text_mean() {
    let expected = meaning(HEX.as_bytes(), "hex");
    assert_eq!(expected.len(), 10);
    let rtac = [0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0];
    let logic_2 = table("name,type,start_time,duration,data,error", |ns, byte| {
        format!("\"Async Serial\",\"data\",{},0.001041667,0x{byte:02X},", seconds(ns))
    });
    let logic_1 = table("Time [s],Value,Parity Error,Framing Error", |ns, byte| {
        format!("{},0x{byte:02X},,", seconds(ns))
    });
    let dsview = table("Id,Time[ns],1:UART: RX/TX", |ns, byte| format!("0,{ns}.00,{byte:02X}"));
    assert_eq!(meaning(&pcapng(147, &[]), "pcap"), expected);
    assert_eq!(meaning(&pcapng(250, &rtac), "pcap"), expected);
    assert_eq!(meaning(&logic_2, "table"), expected);
    assert_eq!(meaning(&logic_1, "table"), expected);
    assert_eq!(meaning(&dsview, "table"), expected);
}

#[test]
fn a_table_is_timed_to_the_nanosecond_from_the_year_2000() {
    let text = "time,data\n0.000000001,01\n";
    let args = ["decode", "-", "--format", "json", "--show", "frames", "--line", "9600-8N1"];
    let rows = stdout(&args, text.as_bytes());
    let end = 946_684_800_000_000_001 + CHARACTER_NS;
    let row: serde_json::Value = serde_json::from_str(&rows).expect("a JSON object");
    let (best, error) =
        (row["end_ns"].as_u64().expect("known"), row["uncertainty_ns"].as_u64().expect("known"));
    assert!(best <= end && end - best <= error, "{row}");
}

#[test]
fn an_import_with_something_wrong_is_refused_with_its_place_after_what_came_before() {
    let whole = pcapng(147, &[]);
    for (input, part) in [
        (whole[..70].to_vec(), "the file ends within a block"),
        (pcapng(1, &[]), "packet 1: link type 1 is no serial line"),
        (b"time,data\n0.1,01\n0.2,5\n".to_vec(), "line 3, column 'data': '5' is not a byte"),
    ] {
        let said = predicate::str::contains("error: 'standard input', ").and(predicate::str::contains(part));
        rtutap(&["decode", "-"]).write_stdin(input).assert().code(2).stderr(said);
    }
}

#[test]
fn a_capture_that_was_cut_off_is_read_up_to_there() {
    let mut cut = pcapng(147, &[]);
    cut.truncate(cut.len() - 1);
    let said = predicate::str::contains("warning: 'standard input', byte ")
        .and(predicate::str::contains(": the file ends within a block\nhint: "));
    rtutap(&["info", "-"]).write_stdin(cut).assert().success().stderr(said);
}

#[test]
fn times_of_packets_that_go_back_are_said() {
    let text = "time,data,duration\n2,01,0\n1,03,0\n";
    let said = predicate::str::contains("the time goes back in line 3;");
    rtutap(&["decode", "-"]).write_stdin(text).assert().success().stderr(said);
}

const EVERYTHING: [&str; 7] =
    ["decode", "-", "--format", "json", "--show=frames", "--show=transactions", "--show=readings"];

/// Returns the hex text that an input is exported to, and asserts that it decodes to the letter.
fn hex_to_the_letter(input: &[u8]) -> String {
    let hex = stdout(&["export", "-", "-o", "-", "--format", "hex"], input);
    let before = stdout(&EVERYTHING, input);
    assert!(before.lines().count() > 4);
    assert_eq!(stdout(&EVERYTHING, hex.as_bytes()), before, "{hex}");
    hex
}

#[test]
fn a_bus_that_says_nothing_of_its_line_takes_nothing_from_another_in_hex_text() {
    let hex = hex_to_the_letter(&pcapng_of(&[("A", "19200-8E1"), ("B", "")]));
    assert!(hex.contains("\n# line 19200-8E1\n") && hex.contains("\n# bus 'B' line 9600-8N1\n"), "{hex}");
    let hex = hex_to_the_letter(&pcapng_of(&[("A", ""), ("B", "19200-8E1"), ("C", "")]));
    assert!(!hex.contains("\n# line ") && hex.contains("\n# bus 'C'\n"), "{hex}");
}

#[test]
fn a_bus_that_says_nothing_of_its_adapter_takes_nothing_from_another_in_hex_text() {
    let heads = ["# bus 'A' line 9600-8N1 adapter-hold 40 ms", "# bus 'B'"];
    let mut text = String::new();
    for (index, frame) in frames().iter().enumerate() {
        let bytes: Vec<_> = frame.iter().map(|byte| format!("{byte:02X}")).collect();
        let head = if index < 4 { heads[index / 2] } else { ["# bus 'A'", "# bus 'B'"][index / 2 % 2] };
        let ns = START * 1_000_000_000 + end_ns(index, frame.len() - 1);
        text += &format!("{head}\n{} {}\n", seconds(ns), bytes.join(" "));
    }
    hex_to_the_letter(text.as_bytes());
}

#[test]
fn names_of_any_kind_stay_in_their_line_and_apart() {
    let buses =
        [("/dev/left/bus", ""), ("/dev/right/bus", ""), ("pump\n01 03", ""), ("it's \\ a 'pump'", "")];
    let hex = hex_to_the_letter(&pcapng_of(&buses));
    for name in ["bus-2", "pump_01 03", r"it's \\ a 'pump'"] {
        assert!(hex.contains(&format!("\n# bus '{name}'\n")), "{name}: {hex}");
    }
    assert!(hex.starts_with("# rtutap"));
}

#[test]
fn of_several_buses_each_is_named_that_does_not_say_its_line_settings() {
    let note = "note: 'standard input' does not name ";
    let [first, b, c] = ["its line settings", "the line settings of bus 'B'", "the line settings of bus 'C'"]
        .map(|what| format!("{note}{what}: 9600-8N1 assumed\n"));
    for (a, said) in [("", format!("{first}{b}{c}")), ("19200-8E1", format!("{b}{c}"))] {
        let file = pcapng_of(&[("A", a), ("B", ""), ("C", "")]);
        rtutap(&["info", "-"]).write_stdin(file).assert().success().stderr(said);
    }
}

#[test]
fn a_time_that_nobody_believes_is_refused_with_its_place_and_what_to_write() {
    for (input, place) in [
        ("2200-01-01T00:00:00Z 01 03\n", "line 1, column 1"),
        ("# ms since the epoch\n1767225600000.5 01 03\n", "line 2, column 1"),
        ("time,data\n2200-01-01T00:00:00Z,01\n", "line 2, column 'time'"),
    ] {
        let said = format!(
            "error: 'standard input', {place}: the time is not between the years 1896 and 2116\nhint: "
        );
        rtutap(&["decode", "-"]).write_stdin(input).assert().code(2).stderr(predicate::str::contains(said));
    }
}
