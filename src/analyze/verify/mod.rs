//! What is wrong with the traffic: where a master departs from the specification and from its devices' manuals, and
//! what the devices, the wire and the adapter did wrong.
//!
//! ```text
//! frame, damaged run, loss, transaction ──▶ Verifier ──▶ Finding: rule, party, frames, span, what was observed
//!                                             │
//!              line  frame  transaction  modbus  request, order, setting, address  value  quirk
//! ```
//!
//! Rules that rest on the order of events keep silent after damage or a hole, which may hide the frame that matters;
//! rules that rest on time speak only when the interval leaves no doubt.

mod address;
mod bus;
mod catalogue;
mod finding;
mod frame;
mod line;
mod modbus;
mod order;
mod quirk;
mod request;
mod setting;
mod transaction;
mod value;
mod verifier;

pub use catalogue::{CATALOGUE, all_rules, rule};
pub(super) use catalogue::{P01, P02, P03, P04, P05, P06, P07, P08};
pub use finding::{Finding, Party, Rule, Severity};
pub use verifier::Verifier;
