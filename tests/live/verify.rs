//! A live bus judged: what the report says, and how it ends.

use crate::bus::{Bus, Tap};

/// A conductivity probe's serial number and version, and a read of all it measures.
const GOOD: &str = "\
01 03 09 00 00 07 07 94|01 03 0E 09 59 4C 30 39 31 36 31 31 32 31 30 31 00 D9 90\n\
01 03 07 00 00 02 C5 7F|01 03 04 01 00 01 00 FA 5F\n\
01 03 26 00 00 05 8E 81|01 03 0A 00 00 8D 41 00 00 8D 41 00 00 C7 33";
/// A read of too few registers, which is answered.
const MISTAKE: &str = "01 03 26 00 00 04 4F 41|01 03 08 00 00 8D 41 66 66 73 3F 2C B2";

fn bytes(hex: &str) -> Vec<u8> {
    let digits = hex.split([' ', '|', '\n']).map(|byte| u8::from_str_radix(byte, 16));
    digits.collect::<Result<_, _>>().expect("hex")
}

/// Lets a bus say this while it is judged; returns exit status, JSON lines and what was said on standard error.
fn judged(said: &[&str]) -> (Option<i32>, String, String) {
    let mut bus = Bus::new();
    let args = ["verify", &bus.path, "--line", "9600-8N1", "--duration", "2s", "--format", "json"];
    let mut tap = Tap::start(&args);
    bus.wait_for_listener();
    said.iter().for_each(|said| bus.say(&bytes(said)));
    let (status, errors) = tap.wait();
    (status.code(), std::mem::take(&mut tap.printed), errors)
}

#[test]
fn a_good_master_passes_and_a_mistaken_one_fails() {
    let (status, found, said) = judged(&[GOOD]);
    assert_eq!(status, Some(0), "{found}{said}");
    assert!(!found.contains("\"party\":\"master\""), "{found}");
    let (status, found, _) = judged(&[GOOD, MISTAKE]);
    assert_eq!(status, Some(1), "{found}");
    let of_master: Vec<_> = found.lines().filter(|row| row.contains("\"party\":\"master\"")).collect();
    assert!(
        of_master.iter().any(|row| row.contains("\"code\":\"D03\"") && row.contains("\"frames\":[6]")),
        "{found}"
    );
}

#[test]
fn a_bus_without_a_byte_cannot_be_judged() {
    let (status, found, said) = judged(&[]);
    assert_eq!((status, &*found), (Some(2), ""), "{said}");
    assert!(
        said.contains("error: no traffic: not a byte was heard") && said.contains("hint: is the master"),
        "{said}"
    );
}

#[test]
fn noise_on_a_live_bus_is_an_error() {
    let (status, found, _) = judged(&["81 43 09 10 22 87 07 95 31 33 12 8F"]);
    assert_eq!(status, Some(1), "{found}");
    assert!(found.contains("\"code\":\"L04\""), "{found}");
}
