//! Where results go: standard output or a file, gathered into large writes.

use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::Path;

use super::failure::Failure;

/// How much is gathered before it is written, in bytes.
const GATHER: usize = 64 * 1024;

/// Gathers results and writes them out.
pub(super) struct Output {
    name: String,
    writer: Box<dyn Write>,
    /// What has not been written yet; append to it, then call `drain`.
    pub(super) buffer: Vec<u8>,
}

impl Output {
    fn new(name: &str, writer: Box<dyn Write>) -> Self {
        Output { name: name.to_owned(), writer, buffer: Vec::with_capacity(GATHER + GATHER / 4) }
    }

    /// Returns standard output, for programs.
    pub(super) fn stdout() -> Self {
        #[expect(clippy::disallowed_methods, reason = "standard output is where results go")]
        let stdout = io::stdout();
        Output::new("standard output", Box::new(stdout))
    }

    /// Returns standard output for people, and whether it takes colours.
    pub(super) fn terminal() -> (Self, bool) {
        let stream = anstream::stdout();
        let colour = stream.current_choice() != anstream::ColorChoice::Never;
        if !colour {
            return (Output::stdout(), false);
        }
        (Output::new("standard output", Box::new(stream)), true)
    }

    /// Creates a file, or returns standard output for `-`.
    pub(super) fn create(path: &Path) -> Result<Self, Failure> {
        if path.as_os_str() == "-" {
            return Ok(Output::stdout());
        }
        #[expect(clippy::disallowed_methods, reason = "commands write the files they are asked for")]
        let file = File::create(path);
        let name = path.display().to_string();
        let file = file.map_err(|error| Failure::writing(&name, &error))?;
        Ok(Output::new(&name, Box::new(file)))
    }

    /// Writes what has been gathered, if it is enough.
    pub(super) fn drain(&mut self) -> Result<(), Failure> {
        if self.buffer.len() < GATHER { Ok(()) } else { self.flush() }
    }

    /// Writes all that has been gathered.
    pub(super) fn flush(&mut self) -> Result<(), Failure> {
        let result = self.writer.write_all(&self.buffer).and_then(|()| self.writer.flush());
        self.buffer.clear();
        result.map_err(|error| Failure::writing(&self.name, &error))
    }
}

/// Tells whether standard output is a terminal.
pub(super) fn stdout_is_terminal() -> bool {
    #[expect(clippy::disallowed_methods, reason = "asked only what it is")]
    let stdout = io::stdout();
    stdout.is_terminal()
}
