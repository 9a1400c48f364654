//! T: what became of a request.

use super::bus::Bus;
use super::catalogue::{T01, T02, T03, T04, T05, T06, T07, T09};
use super::finding::{Finding, Party, Rule};
use super::line::{milliseconds, seconds};
use super::request;
use super::verifier::Found;
use crate::decode::candidate::has_known_length;
use crate::decode::shape::Form;
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::device::Meaning;
use crate::time::SECOND;

/// How often the same request has to stay unanswered to be a storm.
const STORM: u32 = 3;
/// Nanoseconds after an answer within which another one is a second answer to the same request.
const TWIN_NS: i64 = SECOND;

/// Judges what became of requests.
#[derive(Clone, Debug, Default)]
pub(super) struct TransactionRules {
    /// The last request that stayed unanswered, and how often in a row.
    unanswered: Option<(u64, Vec<u8>, u32)>,
    /// The last answer: address, function, frame.
    answered: Option<(u8, u8, u64, Option<crate::time::Interval>)>,
}

impl TransactionRules {
    /// Judges what became of a request, of which other rules have found what they find; tells whether the request
    /// itself is why nobody answered.
    pub(super) fn transaction(
        &mut self,
        t: &Transaction<'_>,
        meaning: &Meaning<'_>,
        bus: &Bus,
        found: &mut Found,
    ) -> bool {
        let mut is_explained = false;
        match t.outcome {
            Outcome::NoResponse => {
                let why = explanation(t, meaning, bus, found);
                is_explained = why.is_some();
                self.no_response(t, bus, why, found);
            }
            Outcome::Late => found.extend(late(t, bus)),
            Outcome::Unsolicited => self.unsolicited(t, bus, found),
            Outcome::Exception => {
                let code = t.exception_code.map_or_else(String::new, |code| format!("{}: {code}", code.0));
                let message = format!("{} was refused with exception {code}", asked(t));
                found.extend(told(&T04, t, t.response.as_ref(), message));
            }
            Outcome::Answered => found.extend(mismatch(t, bus)),
            Outcome::Broadcast | Outcome::Damaged => {}
        }
        if let (Some(response), Outcome::Answered | Outcome::Unsolicited) = (&t.response, t.outcome) {
            self.answered = Some((t.address, t.function.0, response.id, response.time.map(|time| time.end)));
        }
        is_explained
    }

    fn no_response(&mut self, t: &Transaction<'_>, bus: &Bus, explained: Option<String>, found: &mut Found) {
        let Some(request) = t.request else { return };
        if bus.is_damaged_after(request.id) {
            return; // the answer may be among the damaged bytes
        }
        if bus.crossed.is_some_and(|crossed| crossed.request == request.id) {
            return; // it was answered late
        }
        let unit = bus.unit(t.address);
        let tally = bus.tally(t);
        let (party, why) = match (unit.answered, tally.answered) {
            _ if explained.is_some() => (Party::Master, explained.unwrap_or_default()),
            (0, _) if bus.shapes.is_service_address(t.address) => {
                (Party::Device, "nobody answers there; probes made before about 2020 do not".to_owned())
            }
            (0, _) => (Party::Device, format!("{} has not answered yet", t.address)),
            (_, 0) if tally.unanswered > 0 => {
                (Party::Device, format!("{} answers others, but never this", t.address))
            }
            _ if unit.silent > 0 => {
                let since = format!("{} has been silent for {} requests", t.address, unit.silent + 1);
                (Party::Device, since)
            }
            _ => (Party::Device, format!("{} answers otherwise", t.address)),
        };
        let message = format!("{} was not answered; {why}", asked(t));
        found.extend(told(&T01, t, Some(&request), message).map(|finding| finding.by(party)));
        self.storm(t, &request, bus, found);
    }

    /// Counts requests that are repeated for nothing.
    fn storm(&mut self, t: &Transaction<'_>, request: &Side<'_>, bus: &Bus, found: &mut Found) {
        let count = match &self.unanswered {
            Some((id, bytes, count)) if bytes == request.bytes && !bus.requests_between(*id, request.id) => {
                count + 1
            }
            _ => 1,
        };
        self.unanswered = Some((request.id, request.bytes.to_vec(), count));
        if count >= STORM {
            let message = format!("{} was sent {count} times in a row without an answer", asked(t));
            found.extend(told(&T06, t, Some(request), message));
        }
    }

    fn unsolicited(&mut self, t: &Transaction<'_>, bus: &Bus, found: &mut Found) {
        let Some(response) = t.response else { return };
        if request::looks_like_acknowledgement(t, bus, found) {
            return;
        }
        let twin = self.answered.filter(|(address, function, id, end)| {
            let is_soon = match (end, response.time) {
                (Some(end), Some(time)) => end.until(time.start).least < TWIN_NS,
                _ => true,
            };
            (*address, *function) == (t.address, t.function.0) && response.id == id + 1 && is_soon
        });
        if bus.crossed.is_some_and(|crossed| twin.is_some_and(|(_, _, first, _)| first == crossed.response)) {
            return; // the answer to the repetition
        }
        if let Some((_, _, first, _)) = twin {
            let message = format!("{} answered twice", t.address);
            let finding = told(&T07, t, Some(&response), message);
            found.extend(finding.map(|finding| finding.shown_by([first, response.id])));
            return;
        }
        let after = if bus.is_damaged_after(response.id.saturating_sub(3)) {
            "; damaged bytes lie before it"
        } else {
            ""
        };
        let message = format!("{} answered although nobody asked{after}", t.address);
        found.extend(told(&T03, t, Some(&response), message));
    }
}

/// Says why a request itself is the reason that nobody answered it; `None` when it is not.
fn explanation(t: &Transaction<'_>, meaning: &Meaning<'_>, bus: &Bus, found: &Found) -> Option<String> {
    /// Rules on requests that a device does not answer.
    const UNANSWERED: [&str; 11] =
        ["M01", "M02", "D01", "D02", "D03", "D04", "D09", "D12", "D13", "D14", "D15"];
    let request = t.request.as_ref()?;
    let is_own = |finding: &&Finding| finding.frames.last() == Some(&request.id);
    let own = found.iter().filter(is_own).map(|finding| finding.rule.code);
    let function = t.function.0;
    if let Some(code) = own.into_iter().find(|code| UNANSWERED.contains(code)) {
        let is_alive = bus.unit(t.address).answered > 0 && !matches!(code, "D13" | "D14" | "D15");
        return Some(match is_alive {
            true => format!("the device at {} does not know it, and answers others ({code})", t.address),
            false => format!("{code} says why"),
        });
    }
    if t.address >= 248 && !bus.shapes.is_service_address(t.address) {
        return Some("the address is reserved (F06)".to_owned());
    }
    if !has_known_length(function) {
        return Some(format!("nobody knows function {function} (F05)"));
    }
    let profile = meaning.profile()?;
    let is_served = profile.commands.iter().any(|command| command.function == function);
    (!is_served).then(|| format!("{} has nothing with function {function}", profile.id))
}

/// Makes a finding about a transaction, shown by its frames up to `last`.
fn told(
    rule: &'static Rule,
    t: &Transaction<'_>,
    last: Option<&Side<'_>>,
    message: String,
) -> Option<Finding> {
    let last = last?;
    let time = last.time.map(|time| time.end.midpoint());
    let subject = u32::from(t.function.0) << 16 | u32::from(t.start_register.unwrap_or(0));
    let request = t.request.map(|request| request.id).filter(|id| *id != last.id);
    let frames = request.into_iter().chain([last.id]);
    Some(Finding::new(rule, time, message).at(t.address).about(subject).shown_by(frames))
}

fn asked(t: &Transaction<'_>) -> String {
    let register = t.start_register.map_or_else(String::new, |register| format!(" 0x{register:04x}"));
    let quantity = t.quantity.map_or_else(String::new, |quantity| format!(" ×{quantity}"));
    format!("FC{:02}{register}{quantity}", t.function.0)
}

/// Judges an answer that came after the master had gone on: a slow device, or another master.
fn late(t: &Transaction<'_>, bus: &Bus) -> Option<Finding> {
    let (request, latency) = (t.request?, t.latency);
    let unit = bus.unit(t.address);
    let next = bus.requests.iter().find(|asked| asked.id > request.id);
    let is_usual =
        latency.is_some_and(|latency| unit.answered > 3 && latency.most <= unit.slowest_ns.saturating_mul(2));
    if let Some(next) = next.filter(|next| is_usual && next.bytes != request.bytes) {
        let other = next.bytes.first().copied().unwrap_or_default();
        let message =
            format!("a request to {other} began while {} was about to answer, as fast as usual", t.address);
        return told(&T09, t, t.response.as_ref(), message)
            .map(|finding| Finding { frames: vec![request.id, next.id], ..finding });
    }
    let after = match latency {
        Some(latency) if latency.midpoint() >= SECOND => format!(" after {}", seconds(latency.midpoint())),
        Some(latency) => format!(" after {}", milliseconds(latency.midpoint())),
        None => String::new(),
    };
    told(
        &T02,
        t,
        t.response.as_ref(),
        format!("{} was answered{after}, when the master had gone on", asked(t)),
    )
}

/// Finds an answer that does not fit its request.
fn mismatch(t: &Transaction<'_>, bus: &Bus) -> Option<Finding> {
    let (request, response) = (t.request?, t.response?);
    let (quantity, register) = (t.quantity, t.start_register?);
    let (message, span) = match (t.function.0, request.bytes, response.bytes) {
        (function @ (3 | 4), _, [_, _, count, ..]) => {
            let asked = usize::from(quantity?);
            let counted = usize::from(*count);
            let data = response.bytes.len().saturating_sub(5);
            let is_declared =
                [(Form::UncountedData, 0), (Form::CountsRegisters, asked), (Form::ZeroQuantity, 0)]
                    .iter()
                    .any(|(form, count)| bus.declares(function, register, *form) && counted == *count);
            if counted == 2 * asked && data == counted || is_declared {
                return None;
            }
            (format!("{asked} registers were asked for, and {counted} bytes came"), 2..3)
        }
        (5 | 6 | 15 | 16, [_, _, q @ ..], [_, _, r @ ..]) if q.len() >= 4 && r.len() >= 4 => {
            if q[..4] == r[..4] {
                return None;
            }
            ("the acknowledgement names another register or quantity than the request".to_owned(), 2..6)
        }
        _ => return None,
    };
    told(&T05, t, Some(&response), message).map(|finding| finding.within(span))
}
