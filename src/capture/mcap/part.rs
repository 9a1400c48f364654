//! One file of a recording: a valid prefix at every moment, and a whole file once it is finished.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use mcap::records::{Channel, MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapResult, WriteOptions, Writer};

use super::definitions::{self, Definitions};
use super::messages::SchemaRecord;

/// At how many bytes of messages a chunk is closed.
///
/// Small, for a chunk is what one wrong byte costs, and what is read for a moment of time.
const CHUNK: usize = 32 * 1024;
/// How long a chunk is at most, from its first message to its last, in nanoseconds.
const CHUNK_NS: u64 = 30 * 1_000_000_000;
/// After so many chunks they become twice as large, for each costs memory until the end: about 2 kB with 28 channels.
const CHUNKS_OF_A_SIZE: u64 = 8192;
/// How often they do: from 32 kB to 256 kB, and from 30 s to 4 min.
const MOST_DOUBLINGS: u64 = 3;
/// Bytes of a message record beside its payload.
const MESSAGE_OVERHEAD: usize = 31;

/// Counts what goes through, for the writer keeps its stream to itself.
struct Counted {
    inner: BufWriter<File>,
    written: Arc<AtomicU64>,
}

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.written.fetch_add(written as u64, Ordering::Relaxed);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

/// Writes one MCAP file under a name of its own, and gives it its name when it is finished.
pub(super) struct Part {
    writer: Option<Writer<NoSeek<Counted>>>,
    /// The same file, to bring what was written to the disk.
    file: File,
    written: Arc<AtomicU64>,
    path: PathBuf,
    temporary: PathBuf,
    /// Bytes of messages in the chunk that is open.
    open: usize,
    /// The log time of its first message.
    opened: Option<u64>,
    /// The log time of the last message.
    last: u64,
    /// What the open chunk defines, and nothing else yet.
    defined: Definitions,
    /// Ids from here on are new.
    next_channel: u16,
    chunks: u64,
}

impl Part {
    /// Creates a file that is called `path` once it is finished, and `path` with `suffix` until then.
    ///
    /// With `is_careful`, a file of that name is an error: it may be what is left of a recording.
    pub(super) fn create(path: &Path, suffix: &str, is_careful: bool) -> io::Result<Self> {
        let mut name = path.as_os_str().to_owned();
        name.push(suffix);
        let temporary = PathBuf::from(name);
        let mut options = OpenOptions::new();
        options.write(true);
        if is_careful {
            options.create_new(true)
        } else {
            options.create(true).truncate(true)
        };
        let file = options.open(&temporary)?;
        if is_careful {
            lock(&file);
        }
        let written = Arc::new(AtomicU64::new(0));
        let counted = Counted { inner: BufWriter::new(file.try_clone()?), written: Arc::clone(&written) };
        let writer = WriteOptions::new()
            .disable_seeking(true)
            .chunk_size(None)
            .compression(Some(Compression::Zstd))
            .compression_threads(0)
            .library(concat!("rtutap ", env!("CARGO_PKG_VERSION")))
            .create(NoSeek::new(counted));
        let writer = writer.map_err(io::Error::other)?;
        Ok(Part {
            writer: Some(writer),
            file,
            written,
            path: path.into(),
            temporary,
            open: 0,
            opened: None,
            last: 0,
            defined: Definitions::default(),
            next_channel: 0,
            chunks: 0,
        })
    }

    /// Returns the name the file will have.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the name the file has until it is finished.
    pub(super) fn temporary(&self) -> &Path {
        &self.temporary
    }

    /// Returns how many bytes were written, without the chunk that is open.
    pub(super) fn size(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    /// Returns how many chunks were closed.
    pub(super) fn chunks(&self) -> u64 {
        self.chunks
    }

    /// Tells whether messages wait in an open chunk.
    pub(super) fn is_dirty(&self) -> bool {
        self.open > 0
    }

    fn writer<T>(
        &mut self,
        write: impl FnOnce(&mut Writer<NoSeek<Counted>>) -> McapResult<T>,
    ) -> io::Result<T> {
        let Some(writer) = &mut self.writer else {
            return Err(io::Error::other("writing to it failed before"));
        };
        match write(writer) {
            Ok(value) => Ok(value),
            Err(error) => {
                // After an error the crate refuses everything, and its drop tries once more.
                self.writer.take().map(Writer::into_inner);
                Err(match error {
                    mcap::McapError::Io(error) => error,
                    error => io::Error::other(error),
                })
            }
        }
    }

    /// Adds a schema and a channel of it, and returns the channel's id; channels known already keep theirs.
    pub(super) fn channel(
        &mut self,
        topic: &str,
        schema: (&str, &str, &[u8]),
        encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> io::Result<u16> {
        self.open += 1; // the records open a chunk
        let (schema_id, id) = self.writer(|writer| {
            let schema = match schema {
                ("", "", _) => 0,
                (name, encoding, data) => writer.add_schema(name, encoding, data)?,
            };
            Ok((schema, writer.add_channel(schema, topic, encoding, metadata)?))
        })?;
        if id >= self.next_channel {
            self.next_channel = id.saturating_add(1); // the crate counts them
            let (name, schema_encoding, data) = schema;
            let (name, schema_encoding) = (name.to_owned(), schema_encoding.to_owned());
            if schema_id > 0 {
                let schema = SchemaRecord { name, encoding: schema_encoding, data: data.to_vec() };
                self.defined.schemas.insert(schema_id, schema);
            }
            let (topic, message_encoding) = (topic.to_owned(), encoding.to_owned());
            let metadata = metadata.clone();
            self.defined.channels.insert(id, Channel { id, schema_id, topic, message_encoding, metadata });
        }
        Ok(id)
    }

    /// Closes the chunk that is open, and says again behind it what it defines.
    fn repeat_definitions(&mut self) -> io::Result<()> {
        let defined = std::mem::take(&mut self.defined);
        let attachment = Attachment {
            log_time: self.last,
            create_time: self.last,
            name: definitions::NAME.to_owned(),
            media_type: definitions::MEDIA_TYPE.to_owned(),
            data: defined.to_file().map_err(io::Error::other)?.into(),
        };
        self.writer(|writer| writer.attach(&attachment))
    }

    /// Writes a message; tells whether that closed a chunk.
    pub(super) fn message(&mut self, header: &MessageHeader, payload: &[u8]) -> io::Result<bool> {
        let growth = (self.chunks / CHUNKS_OF_A_SIZE).min(MOST_DOUBLINGS);
        let opened = self.opened.unwrap_or(header.log_time);
        let is_late = header.log_time.saturating_sub(opened) >= CHUNK_NS << growth;
        if is_late {
            self.flush()?;
        }
        self.opened.get_or_insert(header.log_time);
        self.last = header.log_time;
        self.writer(|writer| writer.write_to_known_channel(header, payload))?;
        self.open += MESSAGE_OVERHEAD + payload.len();
        let is_full = self.open >= CHUNK << growth;
        if is_full {
            self.flush()?;
        }
        // Of a late one the message that came too late is in the next chunk.
        Ok(is_full)
    }

    /// Writes facts about the recording; a chunk that is open is closed.
    pub(super) fn metadata(&mut self, name: &str, metadata: BTreeMap<String, String>) -> io::Result<()> {
        self.flush()?;
        let metadata = Metadata { name: name.to_owned(), metadata };
        self.writer(|writer| writer.write_metadata(&metadata))
    }

    /// Writes a file within the file; a chunk that is open is closed.
    pub(super) fn attachment(
        &mut self,
        name: &str,
        media_type: &str,
        times: (u64, u64),
        data: &[u8],
    ) -> io::Result<()> {
        self.flush()?;
        let attachment = Attachment {
            log_time: times.0,
            create_time: times.1,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: data.into(),
        };
        self.writer(|writer| writer.attach(&attachment))
    }

    /// Closes the chunk that is open and hands everything to the system.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        if std::mem::take(&mut self.open) > 0 {
            self.chunks += 1;
        }
        self.opened = None;
        if !self.defined.is_empty() {
            self.repeat_definitions()?;
        }
        self.writer(Writer::flush)
    }

    /// Tells whether the file was removed, so that nobody will find what is written to it.
    pub(super) fn is_removed(&self) -> bool {
        #[cfg(unix)]
        return self.file.metadata().is_ok_and(|file| std::os::unix::fs::MetadataExt::nlink(&file) == 0);
        #[cfg(not(unix))]
        return false; // a file that is open cannot be removed there
    }

    /// Brings to the disk what was handed to the system.
    pub(super) fn sync(&mut self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// Writes the index and gives the file its name; `is_durable` waits for the disk.
    pub(super) fn finish(mut self, is_durable: bool) -> io::Result<PathBuf> {
        self.flush()?;
        self.writer(Writer::finish)?;
        // Flushing the crate's writer would panic now; its stream can be flushed.
        self.writer.take().map_or(Ok(()), |writer| writer.into_inner().flush())?;
        if is_durable {
            self.file.sync_all()?;
        }
        fs::rename(&self.temporary, &self.path)?;
        if is_durable {
            sync_directory(&self.path)?;
        }
        Ok(self.path)
    }
}

/// Shows others that the file is being written; where it cannot be shown, they may think that nobody does.
fn lock(file: &File) {
    #[cfg(unix)]
    let _ = rustix::fs::flock(file, rustix::fs::FlockOperation::NonBlockingLockExclusive);
    #[cfg(not(unix))]
    let _ = file;
}

/// Brings the name of a file to the disk.
fn sync_directory(path: &Path) -> io::Result<()> {
    if cfg!(not(unix)) {
        return Ok(()); // a directory cannot be opened there, and need not be
    }
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    #[expect(clippy::disallowed_methods, reason = "a directory is synced through its descriptor")]
    let directory = File::open(directory.unwrap_or(Path::new(".")))?;
    directory.sync_all()
}
