//! Recordings in MCAP: what was received, byte for byte and read for read, and what belongs beside it.
//!
//! ```text
//!  Recorder ─▶ Pending ─▶ Part ──▶ file ──▶ Records ─▶ Messages ─▶ State ─▶ Recording
//!  chunks,     reads      one      MCAP     records,   chunks      items,   files, index,
//!  messages    merged     file              damage     unpacked    losses   what was lost
//! ```
//!
//! The messages are in `recording.proto`. `/<bus>/raw` is the source of truth; every other channel can be made anew
//! from it. Knows bytes and times, no Modbus.
//!
//! What the channels are stands in the chunk that is the first to use them, in an attachment behind it, and in the
//! index at the end.
//!
//! Where the bytes of a bus skip some, the recording says why: a message of its own with the number tells of bytes
//! that the UART (`overrun`) or this program (`queue`) had no room for, one without a number that the source was
//! gone, or that a UART that cannot count may have lost some; bytes that skip without a message are what the disk did
//! not take or give back (`disk`). A message without bytes and errors says that silence decided something there: live,
//! it did when a poll came back empty, and a replay has nothing else to know it by.

mod definitions;
mod index;
mod line;
mod messages;
mod options;
mod part;
mod pending;
mod raw_chunk;
mod reads;
mod recorder;
mod recording;
mod records;
mod salvage;
mod schema;
mod state;
mod time;
mod totals;
mod unpack;

pub use line::BusSettings;
pub use messages::{Cause, Damage};
pub use options::{Options, RecordError, part_path};
pub use recorder::{BusId, ChannelId, Recorder};
pub use recording::{Facts, Place, Preface, Recording, Session};
pub use salvage::{RECOVERING, RecoverError, Recovered, recover};
pub use schema::Schema;
pub use time::Anchor;

/// What follows the name of a file that is made of another one, until it is finished; a live recording has `.part`.
pub const UNFINISHED: &str = ".unfinished";

/// How messages and schemas are encoded.
const ENCODING: &str = "protobuf";
/// The version of the format that is written.
const FORMAT_VERSION: &str = "1";
/// What the metadata record of a session is called.
const SESSION_METADATA: &str = "rtutap.session";
/// Why a file ends that was rewritten from one of which something was missing.
const RECOVERED: &str = "recovered";
/// What the last metadata record is called; a file without it was not closed.
const END_METADATA: &str = "rtutap.end";
