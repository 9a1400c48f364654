//! What is wrong with the traffic: where a master departs from the specification and from its devices' manuals, and
//! what the devices, the wire and the adapter did wrong.
//!
//! ```text
//! frame, damaged run, loss, transaction ──▶ Verifier ──▶ Finding: rule, party, frames, span, what was observed
//!                                             │
//!              line  frame  transaction  modbus  device  value  quirk      a file a family
//! ```
//!
//! Rules that rest on the order of events keep silent after damage or a hole, which may hide the frame that matters;
//! rules that rest on time speak only when the interval leaves no doubt.

mod catalogue;
mod finding;
mod verifier;

pub use catalogue::{CATALOGUE, all_rules, rule};
pub use finding::{Finding, Party, Rule, Severity};
pub use verifier::Verifier;
