use descriptors::{check, read};

use super::*;

#[allow(
    clippy::duplicate_mod,
    reason = "two modules have schemas of their own, and share how they are checked"
)]
#[path = "../../../tests/support/descriptors.rs"]
mod descriptors;

#[test]
fn the_descriptors_are_what_the_proto_files_say() {
    check("src/report/mcap", "decoded", DECODED);
    check("src/report/mcap", "foxglove_log", FOXGLOVE_LOG);
}

#[test]
fn messages_are_encoded_as_their_descriptors_say() {
    let transaction = Transaction {
        address: 1,
        function: 3,
        start_register: Some(0),
        quantity: Some(0),
        request: b"q".to_vec(),
        response: b"r".to_vec(),
        outcome: Outcome::Late as i32,
        exception_code: Some(2),
        latency_ms: Some(1.5),
        latency_error_ms: Some(0.5),
        stream_offset: 9,
        device: "d".into(),
        command: "c".into(),
    };
    assert_eq!(
        read("rtutap.Transaction", DECODED, &transaction),
        "address:1,function:3,start_register:0,quantity:0,request:\"q\",response:\"r\",outcome:LATE,\
         exception_code:2,latency_ms:1.5,latency_error_ms:0.5,stream_offset:9,device:\"d\",command:\"c\""
    );
    let reading = Reading { value: 1.5, raw: b"x".to_vec(), derived: true };
    assert_eq!(read("rtutap.Reading", DECODED, &reading), "value:1.5,raw:\"x\",derived:true");
    let log = Log {
        timestamp: Some(Seconds { seconds: 1, nanos: 2 }),
        level: Level::Error as i32,
        message: "m".into(),
        name: "D03".into(),
    };
    assert_eq!(
        read("foxglove.Log", FOXGLOVE_LOG, &log),
        "timestamp{seconds:1,nanos:2},level:ERROR,message:\"m\",name:\"D03\""
    );
}
