//! From transactions to meaning: which device is at an address, and what it says.
//!
//! ```text
//!  profiles/*.toml ──▶ parse ──▶ profile ──▶ registry ─────┐ what each profile declares, and who agrees
//!                                                          ▼
//!  transaction ──▶ exchange ──▶ known ──▶ identify ──▶ meaning ──▶ field, reading ──▶ derive
//!                  what it      what fits   (Devices)     command, fields, readings     formulas
//!                  tells        an address
//! ```
//!
//! Everything a vendor does is in a profile; the code knows no device.

mod data;
mod derive;
mod encoding;
mod exchange;
mod field;
mod identify;
mod known;
mod meaning;
mod parse;
mod problem;
mod profile;
mod registry;
mod routine;
mod serial_number;
mod value;

pub use crate::section::Problem;
pub(crate) use data::data as register_data;
pub use derive::{Environment, Formula};
pub use encoding::{Encoding, Order};
pub(crate) use exchange::is_accepted;
pub use field::{Field, Reading};
pub use identify::{Devices, Identified, UnknownDevice};
pub use meaning::{Likely, Meaning};
pub(crate) use parse::FORMS as FORM_NAMES;
pub use problem::ProfileError;
pub use profile::{
    Command, Condition, Confidence, Derived, FieldSpec, Kind, Measuring, NEW_ADDRESS, Note, NoteAt, Profile,
    SerialNumberRule, Show, Source,
};
pub use registry::Profiles;
pub use value::Value;

#[cfg(test)]
mod tests;
