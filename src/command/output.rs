//! Where results go: standard output or a file, gathered into large writes.

use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use super::failure::Failure;
use crate::capture::mcap::UNFINISHED;

/// How much is gathered before it is written, in bytes.
pub(super) const GATHER: usize = 64 * 1024;

/// Gathers results and writes them out.
pub(super) struct Output {
    name: String,
    writer: Target,
    /// What has not been written yet; append to it, then call `drain`.
    pub(super) buffer: Vec<u8>,
    /// Whether something is missing in what was written.
    is_broken: bool,
}

/// Is what is written to.
enum Target {
    Open(Box<dyn Write + Send>),
    /// A file that is created once there is something to write, under a name of its own until all is.
    Later {
        path: PathBuf,
        file: Option<File>,
    },
}

impl Output {
    fn new(name: &str, writer: Target) -> Self {
        let buffer = Vec::with_capacity(GATHER + GATHER / 4);
        Output { name: name.to_owned(), writer, buffer, is_broken: false }
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

    /// Returns a file that takes its name when it is kept, or standard output for `-`.
    ///
    /// Until then what stands there already is safe, whatever goes wrong; devices and pipes are written to at once.
    pub(super) fn later(path: &Path) -> Self {
        if path.as_os_str() == "-" {
            return Output::stdout();
        }
        let name = path.display().to_string();
        let target = Target::Later { path: real(path), file: None };
        Output::new(&name, target)
    }

    /// Tells whether something could not be written.
    pub(super) fn is_broken(&self) -> bool {
        self.is_broken
    }

    /// Gives the file its name, if it waits for that.
    pub(super) fn keep(mut self) -> Result<(), Failure> {
        self.flush()?;
        if let Target::Later { path, file: Some(_) } = &self.writer {
            let kept = std::fs::rename(unfinished(path), path);
            kept.map_err(|error| self.failed(&error))?;
        }
        Ok(())
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
        if let Target::Later { path, file: None } = &self.writer {
            let is_special = path.metadata().is_ok_and(|metadata| !metadata.is_file());
            self.writer = match is_special {
                true => Target::Open(create(path)?),
                false => Target::Later { file: Some(begin(path)?), path: path.clone() },
            };
        }
        let result = match &mut self.writer {
            Target::Open(writer) => writer.write_all(&self.buffer).and_then(|()| writer.flush()),
            Target::Later { file, .. } => file.as_mut().map_or(Ok(()), |file| file.write_all(&self.buffer)),
        };
        self.buffer.clear();
        self.is_broken |= result.is_err();
        result
    }
}

impl Drop for Output {
    /// Removes what was not kept; once it has its name, nothing is there.
    fn drop(&mut self) {
        if let Target::Later { path, file: Some(_) } = &self.writer {
            let _ = std::fs::remove_file(unfinished(path));
        }
    }
}

/// Returns where a file is written that is named like this: a link stays one.
pub(super) fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned()) // nothing is there yet
}

/// Returns what a file is called until it is kept.
pub(super) fn unfinished(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(UNFINISHED);
    name.into()
}

/// Begins a file that is to take the place of another one, with the same permissions.
fn begin(path: &Path) -> io::Result<File> {
    #[expect(clippy::disallowed_methods, reason = "commands write the files they are asked for")]
    let file = File::create(unfinished(path))?;
    if let Ok(before) = path.metadata() {
        // Where they cannot be set, the usual ones do.
        let _ = file.set_permissions(before.permissions());
    }
    Ok(file)
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
