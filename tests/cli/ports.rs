//! `ports`, on whatever machine this is.

use super::rtutap;

#[test]
fn ports_are_json_objects_a_line_or_there_are_none_and_it_says_what_to_check() {
    let output = rtutap(&["ports", "--format", "json"]).assert().success().get_output().clone();
    let ports = String::from_utf8(output.stdout).expect("UTF-8");
    for line in ports.lines() {
        let port: serde_json::Value = serde_json::from_str(line).expect("JSON");
        assert_eq!(port["type"], "port", "{line}");
        assert!(port["device"].is_string(), "{line}");
    }
    let messages = String::from_utf8(output.stderr).expect("UTF-8");
    let is_said =
        messages.contains("there is no serial port") && messages.contains("is the adapter plugged in?");
    assert_eq!(is_said, ports.is_empty(), "{messages}");
}
