//! A bus that isn't there: masters, units, faults, and the adapter that hears them, with the truth beside.
//!
//! ```text
//! scenario ─▶ generic | installation | script ─▶ bus ────────────▶ tap ──────────▶ adapter ────────▶ Read
//!             what is asked and said    who talks when    faults, bytes   packets, reads    TruthFrame
//! ```
//!
//! For receivers with other line settings than the sender's there is the line itself: `wire` has its levels bit by
//! bit, and `uart` is a receiver that samples them.
//!
//! The same seed gives the same bytes at the same times, on every platform and for ever; sample recordings
//! and the thresholds of tests rest on it. What is on the wire does not depend on the adapter. Memory stays
//! flat whatever the length, if the truth is taken as it comes.

mod adapter;
mod adu;
mod bus;
mod generic;
mod installation;
mod random;
mod read;
mod scenario;
mod script;
mod sensor;
mod simulation;
mod tap;
mod traffic;
mod truth;
mod uart;
mod water;
mod wire;

pub use adapter::{Adapter, AdapterError};
pub use read::Read;
pub use scenario::{Equipment, Pace, Scenario};
pub use script::{
    Ask, Fault, Fitted, GOOD_CONDUCTIVITY, GOOD_MASTER, GOOD_OXYGEN, GOOD_SONDE, MISTAKEN_MASTER, Model,
    Script, Step,
};
pub use simulation::{Config, Simulation};
pub use truth::{TruthFrame, truth_json_line};
pub use uart::{AfterFramingError, Character, Uart};
pub use wire::Wire;
