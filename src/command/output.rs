//! Where results go: standard output or a file, gathered into large writes.

use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use super::failure::Failure;

/// How much is gathered before it is written, in bytes.
pub(super) const GATHER: usize = 64 * 1024;

/// Gathers results and writes them out.
pub(super) struct Output {
    name: String,
    writer: Target,
    /// What has not been written yet; append to it, then call `drain`.
    pub(super) buffer: Vec<u8>,
}

/// Is what is written to.
enum Target {
    Open(Box<dyn Write + Send>),
    /// A file that is created once there is something to write.
    Later(PathBuf),
}

impl Output {
    fn new(name: &str, writer: Target) -> Self {
        Output { name: name.to_owned(), writer, buffer: Vec::with_capacity(GATHER + GATHER / 4) }
    }

    /// Returns standard output, for programs.
    pub(super) fn stdout() -> Self {
        #[expect(clippy::disallowed_methods, reason = "standard output is where results go")]
        let stdout = io::stdout();
        Output::new("standard output", Target::Open(Box::new(stdout)))
    }

    /// Returns standard output for people, and whether it takes colours.
    pub(super) fn terminal() -> (Self, bool) {
        let stream = anstream::stdout();
        let colour = stream.current_choice() != anstream::ColorChoice::Never;
        if !colour {
            return (Output::stdout(), false);
        }
        (Output::new("standard output", Target::Open(Box::new(stream))), true)
    }

    /// Creates a file, or returns standard output for `-`.
    pub(super) fn create(path: &Path) -> Result<Self, Failure> {
        if path.as_os_str() == "-" {
            return Ok(Output::stdout());
        }
        let name = path.display().to_string();
        let file = create(path).map_err(|error| Failure::writing(&name, &error))?;
        Ok(Output::new(&name, Target::Open(file)))
    }

    /// Returns a file that is created when it is flushed first, or standard output for `-`.
    ///
    /// Until then what stands there already is safe: the input may turn out to be none.
    pub(super) fn later(path: &Path) -> Self {
        if path.as_os_str() == "-" {
            return Output::stdout();
        }
        Output::new(&path.display().to_string(), Target::Later(path.to_owned()))
    }

    /// Writes what has been gathered, if it is enough.
    pub(super) fn drain(&mut self) -> Result<(), Failure> {
        if self.buffer.len() < GATHER { Ok(()) } else { self.flush() }
    }

    /// Writes all that has been gathered.
    pub(super) fn flush(&mut self) -> Result<(), Failure> {
        self.write_out().map_err(|error| self.failed(&error))
    }

    /// Makes a failure of what the system said about this output.
    pub(super) fn failed(&self, error: &io::Error) -> Failure {
        Failure::writing(&self.name, error)
    }

    fn write_out(&mut self) -> io::Result<()> {
        if let Target::Later(path) = &self.writer {
            self.writer = Target::Open(create(path)?);
        }
        match &mut self.writer {
            Target::Open(writer) => {
                let result = writer.write_all(&self.buffer).and_then(|()| writer.flush());
                self.buffer.clear();
                result
            }
            Target::Later(_) => Ok(()), // it was opened above
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.buffer.extend_from_slice(bytes);
        if self.buffer.len() >= GATHER {
            self.write_out()?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.write_out()
    }
}

fn create(path: &Path) -> io::Result<Box<dyn Write + Send>> {
    #[expect(clippy::disallowed_methods, reason = "commands write the files they are asked for")]
    let file = File::create(path)?;
    Ok(Box::new(file))
}

/// Tells whether standard output is a terminal.
pub(super) fn stdout_is_terminal() -> bool {
    #[expect(clippy::disallowed_methods, reason = "asked only what it is")]
    let stdout = io::stdout();
    stdout.is_terminal()
}

/// Tells whether standard error is a terminal.
pub(super) fn stderr_is_terminal() -> bool {
    #[expect(clippy::disallowed_methods, reason = "asked only what it is")]
    let stderr = io::stderr();
    stderr.is_terminal()
}

/// Refuses to write MCAP to what is not called so: by its name it would be taken for something else.
pub(super) fn check_mcap(path: &Path, command: &str) -> Result<(), Failure> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap")) {
        return Ok(());
    }
    let named = path.with_extension("mcap");
    let (path, named) = (path.display(), named.display());
    let hint = match Path::new(&path.to_string()).extension() {
        Some(_) => format!("write '{named}', and then 'rtutap export {named} -o {path}'"),
        None => format!("name it '{named}', or create the directory first"),
    };
    Err(Failure::hinted(format!("'{path}': {command} writes MCAP, and its name ends in .mcap"), hint))
}
