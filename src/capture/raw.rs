//! Raw bytes: nothing but what was received, without times.

use std::io::{self, Read};

use super::reader::{Failure, ReadChunks};
use crate::decode::chunk::{Chunk, ReadTime};

/// How many bytes make a chunk at most.
const CHUNK: usize = 8 * 1024;

/// Reads raw bytes a block at a time.
pub(super) struct Raw<R> {
    source: R,
    block: Box<[u8]>,
    filled: usize,
    position: u64,
}

impl<R: Read> Raw<R> {
    pub(super) fn new(source: R) -> Self {
        Raw { source, block: vec![0; CHUNK].into_boxed_slice(), filled: 0, position: 0 }
    }

    fn fill(&mut self) -> io::Result<bool> {
        self.filled = loop {
            match self.source.read(&mut self.block) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        self.position += self.filled as u64;
        Ok(self.filled > 0)
    }
}

impl<R: Read> ReadChunks for Raw<R> {
    fn advance(&mut self) -> Result<bool, Failure> {
        Ok(self.fill()?)
    }

    fn chunk(&self) -> Chunk<'_> {
        Chunk { time: ReadTime::Unknown, bytes: &self.block[..self.filled], line_errors: &[] }
    }

    fn position(&self) -> u64 {
        self.position
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_out_in_blocks_that_join_to_the_input() {
        let bytes: Vec<u8> = (0..200_000_u32).map(|i| (i % 251) as u8).collect();
        let mut raw = Raw::new(&bytes[..]);
        let mut joined = Vec::new();
        while raw.advance().expect("memory can be read") {
            assert_eq!(raw.chunk().time, ReadTime::Unknown);
            assert!(raw.chunk().bytes.len() <= CHUNK);
            joined.extend_from_slice(raw.chunk().bytes);
        }
        assert_eq!((joined, raw.position()), (bytes, 200_000));
    }
}
