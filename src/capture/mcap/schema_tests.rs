use prost_reflect::{DescriptorPool, DynamicMessage};

use super::*;

/// Compiles a file of this directory, with all it imports.
fn compile(file: &str) -> Vec<u8> {
    let directory = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/capture/mcap");
    let mut compiler = protox::Compiler::new([directory]).expect("the directory is there");
    compiler.include_imports(true).include_source_info(false);
    compiler.open_file(file).expect("a correct proto file");
    compiler.encode_file_descriptor_set()
}

/// `RTUTAP_COMPILE_PROTO=1 cargo test descriptors` writes the compiled files anew.
#[test]
fn the_descriptors_are_what_the_proto_file_says() {
    let compiled = compile("recording.proto");
    if std::env::var_os("RTUTAP_COMPILE_PROTO").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/capture/mcap/recording.binpb");
        #[expect(clippy::disallowed_methods, reason = "writes what the next build includes")]
        std::fs::write(path, compiled).expect("the directory can be written to");
    } else {
        assert!(compiled == RECORDING, "recording.binpb is not what recording.proto compiles to");
    }
}

/// Reads a message by its descriptor, and says what it holds as text; fails on a field the descriptor lacks.
fn read(name: &str, descriptors: &[u8], message: &impl Message) -> String {
    let pool = DescriptorPool::decode(descriptors).expect("a descriptor set with all imports");
    let descriptor = pool.get_message_by_name(name).expect("the set defines the message");
    let read = DynamicMessage::decode(descriptor, &message.encode_to_vec()[..]).expect("readable");
    assert_eq!(read.unknown_fields().count(), 0, "{read:?}");
    read.to_string()
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
