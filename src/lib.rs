//! rtutap listens on a Modbus RTU bus without ever speaking, and says what the sensors said.
//!
//! The way of a byte, from left to right; dependencies point along the arrows only:
//!
//! ```text
//! capture ──▶ decode ─────────────────────────▶ device ──────────▶ analyze ──▶ report
//! hex text    stamp ▸ framer ▸ pairing           identify ▸ meaning  filter      text
//! raw bytes   (pure: no clock, no I/O)           (pure: profiles)                json, csv
//! imports
//! simulate
//! ```
//!
//! - [`time`] and [`mod@line`]: points and stretches of time; speed, character format, and the silences t1.5 and t3.5.
//! - [`source`]: live bytes in: serial ports, serial servers, standard input. Nothing in it can write to a bus.
//! - [`capture`]: recordings in, a [`decode::chunk::Chunk`] a read.
//! - [`simulate`]: a bus that isn't there, with the truth beside it.
//! - [`decode`]: bytes become frames by length, CRC, the outstanding request and hold time, and frames become
//!   transactions. Gaps are reported, not trusted: USB adapters destroy them.
//! - [`device`]: transactions become what a sensor said, by profiles that are data.
//! - [`pipeline`]: the three joined, for one bus: bytes in, [`pipeline::Event`]s out.
//! - [`analyze`]: judgement: the display filter, the search for line settings, the connection check, drafts of profiles.
//! - [`report`]: one file an output format.
//! - [`section`]: TOML read key by key, with all that is wrong with it and where.
//! - [`cli`], [`config`] and [`command`]: the program; the only place that owns files, clocks and the terminal.
//!
//! What always holds: every byte comes out in exactly one frame or damaged run, in stream order; the same chunks give
//! the same events, live or replayed; a time is an interval where the adapter blurs it; bad input is a message,
//! never a panic.

pub mod analyze;
pub mod capture;
pub mod cli;
pub mod command;
pub mod config;
pub mod decode;
pub mod device;
pub mod line;
pub mod pipeline;
pub mod report;
pub mod section;
pub mod simulate;
pub mod source;
pub mod time;
