//! Q: what a device's manual asks for although the specification forbids it. Said once, and never an error.

use std::collections::HashSet;

use super::bus::Bus;
use super::catalogue::Q01;
use super::finding::Finding;
use super::verifier::Found;
use crate::decode::shape::Form;
use crate::decode::transaction::{Outcome, Transaction};
use crate::device::Meaning;

/// Remembers which quirks were noted.
#[derive(Debug, Default)]
pub(super) struct QuirkRules {
    noted: HashSet<(u8, u16, &'static str)>,
}

impl QuirkRules {
    pub(super) fn transaction(
        &mut self,
        t: &Transaction<'_>,
        meaning: &Meaning<'_>,
        bus: &Bus,
        found: &mut Found,
    ) {
        if t.outcome != Outcome::Answered {
            return;
        }
        let (Some(register), Some(request), Some(response)) = (t.start_register, t.request, t.response)
        else {
            return;
        };
        let function = t.function.0;
        let counted = response.bytes.get(2).map_or(0, |count| usize::from(*count));
        let what = if bus.shapes.is_service_address(t.address) {
            "asked at the service address, which the specification reserves"
        } else if t.quantity == Some(0) && bus.declares(function, register, Form::ZeroQuantity) {
            if function == 16 { "writes no register" } else { "reads no register" }
        } else if function == 3 && counted == 0 && response.bytes.len() > 5 {
            "its answer has a byte count of 0, and data all the same"
        } else if function == 3 && counted > 0 && response.bytes.len() > 5 + counted {
            "its answer counts registers where the specification counts bytes"
        } else {
            return;
        };
        if !self.noted.insert((function, register, what)) {
            return;
        }
        let name = meaning.command().unwrap_or("command");
        let message = format!("{name} (FC{function:02} 0x{register:04x}): {what}; the manual asks for it");
        let end = response.time.map(|time| time.end.midpoint());
        let finding = Finding::new(&Q01, end, message).at(t.address).about(register);
        found.push_back(finding.shown_by([request.id, response.id]));
    }
}
