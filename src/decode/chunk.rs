//! What a source hands over: the bytes of one read, with its time and line errors, and what was lost.

use crate::time::Timestamp;

/// Says when the bytes of a chunk were on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadTime {
    /// The `read()` that returned the bytes ended at this time.
    At(Timestamp),
    /// Not known; the bytes follow those before at line speed, as far as anybody can tell.
    Unknown,
    /// Not known, and a silence of unknown length lies before the bytes.
    UnknownAfterSilence,
}

/// Holds the bytes of one read.
#[derive(Clone, Copy, Debug)]
pub struct Chunk<'a> {
    /// When the bytes were read.
    pub time: ReadTime,
    /// What was received, in order.
    pub bytes: &'a [u8],
    /// What the UART or the host complained about, in order of their offsets.
    pub line_errors: &'a [LineError],
}

/// Names what a UART or the host reported about a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineErrorKind {
    /// The parity or the stop bit was wrong.
    ParityOrFraming,
    /// The line was held low for longer than a character.
    Break,
    /// Bytes were lost in the UART or in the kernel.
    Overrun,
}

impl LineErrorKind {
    /// Returns the name used in JSON lines.
    pub fn name(self) -> &'static str {
        match self {
            LineErrorKind::ParityOrFraming => "parity-or-framing",
            LineErrorKind::Break => "break",
            LineErrorKind::Overrun => "overrun",
        }
    }
}

/// Marks a byte that the UART complained about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineError {
    /// Offset of the byte in the chunk, or in the frame once framed.
    pub offset: u32,
    /// What was reported.
    pub kind: LineErrorKind,
}

/// Names how bytes were lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LostKind {
    /// The UART or the kernel had no room.
    Overrun,
    /// The program did not keep up.
    Queue,
    /// They could not be written.
    Disk,
    /// The adapter or server went away.
    SourceGone,
}

impl LostKind {
    /// Returns the name used in JSON lines.
    pub fn name(self) -> &'static str {
        match self {
            LostKind::Overrun => "overrun",
            LostKind::Queue => "queue",
            LostKind::Disk => "disk",
            LostKind::SourceGone => "source-gone",
        }
    }
}

/// Says that bytes are missing from the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lost {
    /// When it was noticed; `None` without times.
    pub time: Option<Timestamp>,
    /// Where in the stream they are missing.
    pub stream_offset: u64,
    /// How.
    pub kind: LostKind,
    /// How many bytes; 0 when not known.
    pub count: u64,
}
