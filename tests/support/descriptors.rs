//! Holds compiled protobuf descriptors against what they were compiled from.

use std::path::Path;

use prost::Message;
use prost_reflect::{DescriptorPool, DynamicMessage};

/// Compiles a file with all it imports, and compares it with the compiled file kept beside it.
///
/// `RTUTAP_COMPILE_PROTO=1 cargo test descriptors` writes the compiled files anew.
pub fn check(directory: &str, stem: &str, kept: &[u8]) {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join(directory);
    let mut compiler = protox::Compiler::new([&directory]).expect("the directory is there");
    compiler.include_imports(true).include_source_info(false);
    compiler.open_file(format!("{stem}.proto")).expect("a correct proto file");
    let compiled = compiler.encode_file_descriptor_set();
    if std::env::var_os("RTUTAP_COMPILE_PROTO").is_some() {
        #[expect(clippy::disallowed_methods, reason = "writes what the next build includes")]
        std::fs::write(directory.join(format!("{stem}.binpb")), compiled)
            .expect("the directory can be written to");
    } else {
        assert!(compiled == kept, "{stem}.binpb is not what {stem}.proto compiles to");
    }
}

/// Reads a message by its descriptor, and says what it holds as text; fails on a field the descriptor lacks.
pub fn read(name: &str, descriptors: &[u8], message: &impl Message) -> String {
    let pool = DescriptorPool::decode(descriptors).expect("a descriptor set with all imports");
    let descriptor = pool.get_message_by_name(name).expect("the set defines the message");
    let read = DynamicMessage::decode(descriptor, &message.encode_to_vec()[..]).expect("readable");
    assert_eq!(read.unknown_fields().count(), 0, "{read:?}");
    read.to_string()
}
