//! Where an input comes from, and what its first bytes tell.

use std::fs::File;
use std::io::{self, Cursor, Read, Seek};

/// The first bytes of every MCAP file (MCAP specification, "Magic").
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// How much of an input decides what it is, in bytes.
pub(super) const PREFIX: u64 = 4096;

/// Is where an input comes from.
pub(super) enum Origin {
    /// A file that can be sought in.
    File(File),
    Stream(Box<dyn Read + Send>),
}

impl Origin {
    /// Returns the first 4 KiB, and the origin as it was before.
    pub(super) fn prefix(self) -> io::Result<(Vec<u8>, Origin)> {
        let mut prefix = Vec::new();
        match self {
            Origin::File(mut file) => {
                (&mut file).take(PREFIX).read_to_end(&mut prefix)?;
                file.rewind()?;
                Ok((prefix, Origin::File(file)))
            }
            Origin::Stream(mut stream) => {
                (&mut stream).take(PREFIX).read_to_end(&mut prefix)?;
                let stream = Origin::Stream(Box::new(Cursor::new(prefix.clone()).chain(stream)));
                Ok((prefix, stream))
            }
        }
    }

    pub(super) fn stream(self) -> Box<dyn Read + Send> {
        match self {
            Origin::File(file) => Box::new(file),
            Origin::Stream(stream) => stream,
        }
    }
}

/// Tells whether a file begins as MCAP does; one wrong byte does not hide it, nor that it ends within the magic.
pub(super) fn is_mcap(prefix: &[u8]) -> bool {
    if !prefix.is_empty() && MCAP_MAGIC.starts_with(prefix) {
        return true;
    }
    let same = prefix.iter().zip(MCAP_MAGIC).filter(|(a, b)| a == b).count();
    same + 1 >= MCAP_MAGIC.len()
}

/// Tells whether bytes are printable ASCII and white space: a Modbus frame never is, for its function code.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    bytes.iter().all(|byte| matches!(byte, b' '..=b'~' | b'\t' | b'\r' | b'\n'))
}
