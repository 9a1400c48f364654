//! Input and expected output together, a file for each case: `cargo insta review` shows changes.

use crate::rtutap;

/// A dissolved oxygen probe that answers as its manual prints, then what else happens on a bus.
const BUS: &str = "\
# line 9600-8N1
2026-01-01T00:00:00.010Z > 01 03 09 00 00 07 07 94
2026-01-01T00:00:00.050Z < 01 03 0E 00 59 4C 30 31 31 34 30 31 30 30 32 32 00 19 66
2026-01-01T00:00:01.010Z > 01 03 26 00 00 04 4F 41
2026-01-01T00:00:01.040Z < 01 03 08 00 00 8D 41 66 66 73 3F 2C B2
2026-01-01T00:00:02.010Z > 01 03 00 10 00 01 85 CF
2026-01-01T00:00:02.030Z < 01 83 02 C0 F1
2026-01-01T00:00:03.010Z > 09 03 00 00 00 01 85 42
2026-01-01T00:00:04.010Z > 02 03 00 01 00 01 D5 F9
2026-01-01T00:00:04.030Z < 02 03 02 00 07 BD 86
2026-01-01T00:00:04.035Z FF
2026-01-01T00:00:05.010Z > 01 03 26 00 00 04 4F 41
2026-01-01T00:00:05.040Z < 01 03 08 00 00 8D 41 66 67 73 3F 2C B2
";

/// Runs the program over an input; returns command, input and all output as one text.
fn play(args: &str, input: &str) -> String {
    let words: Vec<&str> = args.split(' ').collect();
    let output = rtutap(&words).write_stdin(input).output().expect("the program runs");
    let stdout = String::from_utf8(output.stdout).expect("UTF-8");
    let stderr = String::from_utf8(output.stderr).expect("UTF-8");
    let status = output.status.code().map_or("none".to_owned(), |code| code.to_string());
    format!(
        "$ rtutap {args}\n--- input\n{input}--- output\n{stdout}--- errors\n{stderr}--- status {status}\n"
    )
}

macro_rules! golden {
    ($($name:ident: $args:literal, $input:expr;)*) => { $(
        #[test]
        fn $name() {
            insta::assert_snapshot!(stringify!($name), play($args, $input));
        }
    )* };
}

golden! {
    transactions_as_text: "decode - --time utc", BUS;
    transactions_as_text_with_fields_and_bytes: "decode - --time relative -v --filter reg==0x2600", BUS;
    transactions_as_json: "decode - --format json", BUS;
    transactions_as_csv: "decode - --format csv --time utc", BUS;
    frames_as_text: "decode - --show frames --time local", BUS;
    frames_as_json: "decode - --show frames --format json", BUS;
    frames_as_csv: "decode - --show frames --format csv --time relative", BUS;
    readings_as_text: "decode - --show readings --time utc --salinity 10", BUS;
    readings_as_json: "decode - --show readings --format json", BUS;
    readings_as_csv: "decode - --show readings --format csv --time utc", BUS;
    info_as_text: "info - --time utc", BUS;
    info_as_json: "info - --format json", BUS;
    frames_without_times: "decode - --show frames --format json", "01 03 26 00 00 04 4F 41\n01 03 08 00 00 8D 41 66 66 73 3F 2C B2\n";
    a_likely_device_is_marked: "decode - --time utc", "1.5 01 03 26 00 00 04 4F 41\n1.53 01 03 08 00 00 8D 41 66 66 73 3F 2C B2\n";
    times_that_go_back: "decode - --show frames --time utc", "# line 9600-8N1\n9.0 01 03 26 00 00 04 4F 41\n1.0 FF\n2.0 FF\n";
    a_slip_in_hex_text: "decode - --input-format hex", "# line 9600-8N1\n1.0 01 03 26 00 00 04 4F 41\n1.5 01 0G\n";
    profiles: "profiles", "";
    a_profile_that_is_not_sure: "profiles show yosemitech-depth", "";
    a_drafted_profile: "profiles new - --address 3", include_str!("../../captures/y511.hex");
}
