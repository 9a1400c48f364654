use prost_reflect::{DescriptorPool, DynamicMessage};

use super::*;

/// Compiles a file of this directory, with all it imports.
fn compile(file: &str) -> Vec<u8> {
    let directory = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/report/mcap");
    let mut compiler = protox::Compiler::new([directory]).expect("the directory is there");
    compiler.include_imports(true).include_source_info(false);
    compiler.open_file(file).expect("a correct proto file");
    compiler.encode_file_descriptor_set()
}

/// `RTUTAP_COMPILE_PROTO=1 cargo test descriptors` writes the compiled files anew.
#[test]
fn the_descriptors_are_what_the_proto_files_say() {
    for (stem, kept) in [("decoded", DECODED), ("foxglove_log", FOXGLOVE_LOG)] {
        let compiled = compile(&format!("{stem}.proto"));
        if std::env::var_os("RTUTAP_COMPILE_PROTO").is_some() {
            let path = format!("{}/src/report/mcap/{stem}.binpb", env!("CARGO_MANIFEST_DIR"));
            #[expect(clippy::disallowed_methods, reason = "writes what the next build includes")]
            std::fs::write(path, compiled).expect("the directory can be written to");
        } else {
            assert!(compiled == kept, "{stem}.binpb is not what {stem}.proto compiles to");
        }
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
