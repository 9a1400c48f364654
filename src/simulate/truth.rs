//! What was really sent: frames with their places in the delivered stream, to judge a framer by.

use crate::decode::frame::Role;
use crate::time::Timestamp;

/// Is a frame as it was sent, and where its bytes are in what was received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TruthFrame {
    /// Offset of its first byte in the delivered stream; where it would be, when none was delivered.
    pub start: u64,
    /// Offset after its last byte in the delivered stream.
    pub end: u64,
    /// When its first start bit began on the wire.
    pub start_time: Timestamp,
    /// When its last stop bit ended on the wire.
    pub end_time: Timestamp,
    /// Who sent it: request or response.
    pub role: Role,
    /// Whether it was delivered whole and unchanged.
    pub clean: bool,
    /// Whether it is the repetition of a request by a converter.
    pub echo: bool,
    /// Its first byte, as sent.
    pub address: u8,
    /// Its second byte, as sent, with the exception bit.
    pub function: u8,
    /// For a response, the index of the request it answers; truth frames count from 0.
    pub request: Option<u64>,
    /// Its bytes, as sent.
    pub bytes: Vec<u8>,
}

/// Writes a truth frame as a JSON object of one line, without the line's end.
///
/// Keys: `start`, `end` (byte offsets), `role`, `clean`, `echo`, `address`, `function`, `start_ns`, `end_ns`
/// (since the Unix epoch), `request` (number of the line of the request, from 0, or null), `bytes` (hex, as sent).
pub fn truth_json_line(truth: &TruthFrame) -> String {
    let request = truth.request.map_or_else(|| "null".to_owned(), |index| index.to_string());
    let bytes: String = truth.bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!(
        r#"{{"start":{},"end":{},"role":"{}","clean":{},"echo":{},"address":{},"function":{},"start_ns":{},"end_ns":{},"request":{request},"bytes":"{bytes}"}}"#,
        truth.start,
        truth.end,
        truth.role.name(),
        truth.clean,
        truth.echo,
        truth.address,
        truth.function,
        truth.start_time.as_ns(),
        truth.end_time.as_ns(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_truth_line_is_json_with_all_its_keys() {
        let truth = TruthFrame {
            start: 8,
            end: 13,
            start_time: Timestamp::from_ns(1),
            end_time: Timestamp::from_ns(2),
            role: Role::Response,
            clean: true,
            echo: false,
            address: 1,
            function: 3,
            request: Some(0),
            bytes: vec![0x01, 0x03, 0x00, 0x20, 0xF0],
        };
        let expected = serde_json::json!({
            "start": 8, "end": 13, "role": "response", "clean": true, "echo": false, "address": 1, "function": 3,
            "start_ns": 1, "end_ns": 2, "request": 0, "bytes": "01030020f0",
        });
        let read: serde_json::Value = serde_json::from_str(&truth_json_line(&truth)).unwrap();
        assert_eq!(read, expected);
    }
}
