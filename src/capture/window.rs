//! A window on a file: as much of it as is held at once.

use std::io::{self, Read};

/// Holds a stretch of a source that moves on as it is consumed.
pub(super) struct Window<R> {
    source: R,
    buffer: Box<[u8]>,
    start: usize,
    end: usize,
    at_end: bool,
    read: u64,
}

impl<R: Read> Window<R> {
    /// Makes a window that holds up to `size` bytes.
    pub(super) fn new(source: R, size: usize) -> Self {
        let buffer = vec![0; size].into_boxed_slice();
        Window { source, buffer, start: 0, end: 0, at_end: false, read: 0 }
    }

    /// Returns what is held and not consumed.
    pub(super) fn data(&self) -> &[u8] {
        &self.buffer[self.start..self.end]
    }

    /// Lets go of the first `count` bytes, at most what is held.
    pub(super) fn consume(&mut self, count: usize) {
        self.start = self.end.min(self.start + count);
    }

    /// Reads on, as long as there is room.
    pub(super) fn fill(&mut self) -> io::Result<()> {
        self.buffer.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        if self.is_full() {
            return Ok(());
        }
        let read = loop {
            match self.source.read(&mut self.buffer[self.end..]) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        self.at_end = read == 0;
        self.read += read as u64;
        self.end += read;
        Ok(())
    }

    /// Tells whether there is no room for more.
    pub(super) fn is_full(&self) -> bool {
        self.end - self.start == self.buffer.len()
    }

    /// Tells whether there is nothing after what is held.
    pub(super) fn is_at_end(&self) -> bool {
        self.at_end
    }

    /// Returns how many bytes have been read from the source.
    pub(super) fn position(&self) -> u64 {
        self.read
    }

    /// Returns the offset in the source of the first byte of `data`.
    pub(super) fn offset(&self) -> u64 {
        self.read - (self.end - self.start) as u64
    }

    /// Finds the next line, or as much of it as can be held: its length, and whether it ends there.
    pub(super) fn line(&mut self) -> io::Result<Option<(usize, bool)>> {
        let mut searched = 0;
        loop {
            if let Some(length) = self.data()[searched..].iter().position(|&c| c == b'\n') {
                return Ok(Some((searched + length, true)));
            }
            searched = self.data().len();
            if self.at_end {
                return Ok((searched > 0).then_some((searched, true))); // what ends the file ends the line
            }
            if self.is_full() {
                return Ok(Some((searched, false)));
            }
            let begins = self.read == 0;
            self.fill()?;
            if begins && self.data().starts_with(b"\xef\xbb\xbf") {
                self.consume(3); // a byte order mark, as some editors write
            }
        }
    }

    /// Tells whether the next line has to be waited for.
    pub(super) fn awaits_line(&self) -> bool {
        !self.data().contains(&b'\n')
    }
}
