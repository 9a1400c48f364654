//! Bytes on standard input.

use std::fs::File;
use std::io::{self, IsTerminal, Read};
use std::sync::Arc;
use std::time::Duration;

use super::{Clock, Received, Reception, Source, SourceError};

const NAME: &str = "-";
/// How much is read at once: what a Linux pipe holds, 64 KiB.
const BUFFER: usize = 64 * 1024;

/// Receives from a pipe or a file.
pub(super) struct StandardInput {
    file: File,
    clock: Arc<dyn Clock>,
    buffer: Vec<u8>,
}

impl StandardInput {
    /// Opens standard input.
    ///
    /// # Errors
    /// When it is a terminal, which is a person or a device without its line settings.
    pub(super) fn open(clock: Arc<dyn Clock>) -> Result<Self, SourceError> {
        let failed = |error| SourceError::new(NAME, "read", error);
        #[expect(clippy::disallowed_methods, reason = "here it is a source")]
        let input = io::stdin();
        if input.is_terminal() {
            let error = io::Error::new(io::ErrorKind::InvalidInput, "standard input is a terminal");
            return Err(failed(error).hinted("pipe bytes into it; a serial device is given by its name"));
        }
        // Without the buffer of std: what lies in that, poll does not see.
        #[cfg(unix)]
        let file = std::os::fd::AsFd::as_fd(&input).try_clone_to_owned().map_err(failed)?;
        #[cfg(windows)]
        let file = std::os::windows::io::AsHandle::as_handle(&input).try_clone_to_owned().map_err(failed)?;
        Ok(StandardInput::new(file.into(), clock))
    }

    fn new(file: File, clock: Arc<dyn Clock>) -> Self {
        StandardInput { file, clock, buffer: vec![0; BUFFER] }
    }

    /// Waits for bytes or the end; elsewhere than on Unix the read waits, as long as it likes.
    #[cfg_attr(not(unix), expect(unused_variables, reason = "there is no wait for a pipe in std"))]
    fn wait(&self, timeout: Duration) -> io::Result<bool> {
        #[cfg(unix)]
        return super::wait::readable(&self.file, timeout);
        #[cfg(not(unix))]
        return Ok(true);
    }
}

impl Source for StandardInput {
    fn name(&self) -> &str {
        NAME
    }

    fn receive(&mut self, timeout: Duration, reception: &mut Reception) -> Result<Received, SourceError> {
        let failed = |error| SourceError::new(NAME, "read", error);
        reception.clear();
        let is_ready = self.wait(timeout).map_err(failed)?;
        reception.stamp(&*self.clock);
        if !is_ready {
            return Ok(Received::Silence);
        }
        let count = match self.file.read(&mut self.buffer) {
            Ok(count) => count,
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {
                return Ok(Received::Silence);
            }
            Err(error) => return Err(failed(error)),
        };
        reception.monotonic_ns = self.clock.monotonic_ns();
        reception.bytes.extend_from_slice(self.buffer.get(..count).unwrap_or_default());
        Ok(if count == 0 { Received::Ended } else { Received::Bytes })
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::io::Write;

    use super::super::SystemClock;
    use super::*;

    #[test]
    fn a_pipe_gives_its_bytes_then_silence_and_at_last_its_end() {
        let (reader, mut writer) = io::pipe().expect("a pipe");
        let file = File::from(std::os::fd::OwnedFd::from(reader));
        let mut source = StandardInput::new(file, Arc::new(SystemClock));
        let mut reception = Reception::default();
        writer.write_all(b"\x01\xff\x00").expect("room");
        let long = Duration::from_secs(10);
        assert_eq!(source.receive(long, &mut reception).expect("bytes"), Received::Bytes);
        assert_eq!(reception.bytes, b"\x01\xff\x00");
        assert!(reception.ready_ns > 0 && reception.ready_ns <= reception.monotonic_ns);
        assert_eq!(source.receive(Duration::ZERO, &mut reception).expect("a wait"), Received::Silence);
        assert!(reception.bytes.is_empty(), "old content goes");
        writer.write_all(b"last").expect("room");
        drop(writer);
        assert_eq!(source.receive(long, &mut reception).expect("bytes"), Received::Bytes);
        assert_eq!(reception.bytes, b"last", "what was written before the end");
        assert_eq!(source.receive(long, &mut reception).expect("an end"), Received::Ended);
    }
}
