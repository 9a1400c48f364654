use descriptors::{check, read};

use super::*;

#[allow(
    clippy::duplicate_mod,
    reason = "two modules have schemas of their own, and share how they are checked"
)]
#[path = "../../../tests/support/descriptors.rs"]
mod descriptors;

#[test]
fn the_descriptors_are_what_the_proto_file_says() {
    check("src/capture/mcap", "recording", RECORDING);
}

#[test]
fn messages_are_encoded_as_their_descriptors_say() {
    let raw = RawChunk {
        stream_offset: 1,
        data: b"a".to_vec(),
        monotonic_ns: 2,
        errors: vec![LineError { offset: 3, kind: ErrorKind::Lost as i32, count: 4 }],
        ready_ns: 5,
        earlier: vec![Read { end: 6, monotonic_ns: 7 }],
        dating: Dating::AfterSilence as i32,
    };
    assert_eq!(
        read("rtutap.RawChunk", RECORDING, &raw),
        "stream_offset:1,data:\"a\",monotonic_ns:2,errors:[{offset:3,kind:LOST,count:4}],ready_ns:5,\
         earlier:[{end:6,monotonic_ns:7}],dating:AFTER_SILENCE"
    );
    let line = Line {
        baud: 9600,
        data_bits: 8,
        parity: "none".into(),
        stop_bits: "1".into(),
        adapter_hold_ms: Some(0.0),
    };
    assert_eq!(
        read("rtutap.Line", RECORDING, &line),
        "baud:9600,data_bits:8,parity:\"none\",stop_bits:\"1\",adapter_hold_ms:0.0"
    );
    let clock = Clock { monotonic_ns: 1, realtime_ns: 2 };
    assert_eq!(read("rtutap.Clock", RECORDING, &clock), "monotonic_ns:1,realtime_ns:2");
}
