//! From what is decided to events, in order.

use super::{Event, Pipeline, not_negative};
use crate::decode::frame::{Boundary, Damaged, Frame, Place, Role};
use crate::decode::function::FunctionCode;
use crate::decode::pairing::{Assembled, Choice, Item, Part, Settled, What};
use crate::decode::pdu;
use crate::decode::store::Store;
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::time::{Span, Timestamp};

/// A transaction whose events are still to come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Current {
    pub(super) assembled: Assembled,
    pub(super) id: u64,
    /// Where its events have got to.
    pub(super) stage: Stage,
}

/// Is what the event of a frame says beside its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    pub(super) confidence: f32,
    pub(super) gap_before: Option<Span>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// The frame of a request whose answer is still to come.
    Asked(Seen),
    /// The frames of an exchange are still to come.
    Request([Seen; 2]),
    Response(Seen),
    Observe,
    Say,
    Reading {
        next: usize,
        count: usize,
    },
}

impl Pipeline {
    /// Returns the next event. Take them all after each call that takes something in.
    #[inline]
    pub fn poll_event(&mut self) -> Option<Event<'_>> {
        // Asked after every read, and most reads end no frame.
        if self.is_quiet() { None } else { self.next_event() }
    }

    /// Tells whether nothing is there to say before more bytes or time come in.
    #[inline]
    pub(super) fn is_quiet(&self) -> bool {
        self.verifying.is_none()
            && self.current.is_none()
            && self.framer.is_dry()
            && self.lost.is_none()
            && self.pairing.is_taken()
    }

    #[inline(never)]
    fn next_event(&mut self) -> Option<Event<'_>> {
        if self.verifying.is_some()
            && !matches!(self.current, Some(Current { stage: Stage::Reading { .. }, .. }))
            && self.next_finding()
        {
            return self.verifying.as_ref()?.finding.as_ref().map(Event::Finding);
        }
        while self.current.is_none() {
            match self.pairing.take() {
                Some(Settled::Item(item, choice)) => return Some(self.item_event(item, choice)),
                Some(Settled::Transaction(assembled)) => self.set_current(assembled, Stage::Observe),
                None if self.pump_one(true) => {}
                // What was decided before it was lost comes before it.
                None => return self.lost_event(),
            }
        }
        match self.current.as_ref()?.stage {
            Stage::Asked(_) | Stage::Request(_) | Stage::Response(_) => self.exchange_event(),
            Stage::Observe | Stage::Say => self.transaction_event(),
            Stage::Reading { next, count } => self.reading_event(next, count),
        }
    }

    /// Takes the next finding, if there is one.
    fn next_finding(&mut self) -> bool {
        let Some(verifying) = &mut self.verifying else { return false };
        verifying.finding = verifying.verifier.pop();
        verifying.finding.is_some()
    }

    fn lost_event(&mut self) -> Option<Event<'_>> {
        let lost = self.lost.take()?;
        if let Some(verifying) = &mut self.verifying {
            verifying.verifier.lost(&lost);
        }
        Some(Event::Lost(lost))
    }

    /// Hands out the next frame of the current exchange.
    #[inline]
    fn exchange_event(&mut self) -> Option<Event<'_>> {
        let current = self.current.as_mut()?;
        let (part, role, Seen { confidence, gap_before }) = match current.stage {
            Stage::Asked(seen) => {
                let part = current.assembled.request?;
                self.current = None;
                (part, Role::Request, seen)
            }
            Stage::Request([seen, next]) => {
                current.stage = Stage::Response(next);
                (current.assembled.request?, Role::Request, seen)
            }
            Stage::Response(seen) => {
                current.stage = Stage::Observe;
                (current.assembled.response?, Role::Response, seen)
            }
            _ => return None, // not called for the others
        };
        self.framer.store().errors(part.offset, part.end(), &mut self.line_errors);
        let place = Place {
            id: part.id,
            stream_offset: part.offset,
            bytes: self.framer.store().slice(part.offset, part.end()),
            time: part.time,
            gap_before,
            line_errors: &self.line_errors,
        };
        let frame = Frame { place, role, echo: false, boundary: Boundary::Length, confidence };
        if let Some(verifying) = &mut self.verifying {
            verifying.verifier.frame(&frame, self.framer.stamper());
        }
        Some(Event::Frame(frame))
    }

    /// Tells what the current transaction says of its device, then what it means.
    #[inline]
    fn transaction_event(&mut self) -> Option<Event<'_>> {
        let current = self.current.as_mut()?;
        let transaction = transaction(self.framer.store(), current);
        // The devices learn from a transaction before it is told what it means.
        if current.stage == Stage::Observe
            && let Some(identified) = self.devices.observe(&transaction)
        {
            current.stage = Stage::Say;
            return Some(Event::Identified { identified, time: end(&transaction) });
        }
        let meaning = self.devices.meaning(&transaction);
        let mut count = 0;
        if self.readings && matches!(transaction.outcome, Outcome::Answered | Outcome::Late) {
            count = meaning.readings().count();
        }
        match count {
            0 => self.current = None,
            _ => current.stage = Stage::Reading { next: 0, count },
        }
        let mut codes: &[&'static str] = &[];
        if let Some(verifying) = &mut self.verifying {
            verifying.verifier.transaction(&transaction, &meaning);
            verifying.codes.clear();
            verifying.codes.extend(verifying.verifier.found().map(|finding| finding.rule.code));
            codes = &verifying.codes;
        }
        Some(Event::Transaction { transaction, meaning, codes })
    }

    // Kept out of the way of exchanges, which need far less of the stack.
    #[inline(never)]
    fn reading_event(&mut self, index: usize, count: usize) -> Option<Event<'_>> {
        let current = self.current.as_mut()?;
        let transaction = transaction(self.framer.store(), current);
        let reading = self.devices.meaning(&transaction).readings().nth(index)?;
        let (address, id) = (transaction.address, transaction.id);
        match index + 1 {
            next if next < count => current.stage = Stage::Reading { next, count },
            _ => self.current = None,
        }
        Some(Event::Reading { reading, time: end(&transaction), address, transaction: id })
    }

    // Kept out of the way of exchanges, which need far less of the stack.
    #[inline(never)]
    fn item_event(&mut self, item: Item, choice: Choice) -> Event<'_> {
        self.framer.store().errors(item.offset, item.end(), &mut self.line_errors);
        let place = Place {
            id: item.id,
            stream_offset: item.offset,
            bytes: self.framer.store().slice(item.offset, item.end()),
            time: item.time,
            gap_before: item.gap_before,
            line_errors: &self.line_errors,
        };
        match item.what {
            What::Frame { boundary, confidence, .. } => {
                let echo = choice == Choice::Echo;
                let role = if matches!(choice, Choice::Request | Choice::Echo) {
                    Role::Request
                } else {
                    Role::Response
                };
                let frame = Frame { place, role, echo, boundary, confidence };
                if let Some(verifying) = &mut self.verifying {
                    verifying.verifier.frame(&frame, self.framer.stamper());
                }
                Event::Frame(frame)
            }
            What::Run { reason, role, address, function } => {
                let damaged = Damaged { place, reason, role, address, function };
                if let Some(verifying) = &mut self.verifying {
                    verifying.verifier.damaged(&damaged);
                }
                Event::Damaged(damaged)
            }
        }
    }
}

/// Estimates when the last frame of a transaction ended.
fn end(transaction: &Transaction<'_>) -> Option<Timestamp> {
    let last = transaction.response.or(transaction.request)?;
    Some(last.time?.end.midpoint())
}

/// Gives an assembled transaction its bytes.
fn transaction<'a>(store: &'a Store, current: &Current) -> Transaction<'a> {
    let Assembled { request, response, outcome } = &current.assembled;
    let side = |part: &Part| Side {
        id: part.id,
        bytes: store.slice(part.offset, part.end()),
        damaged: part.damaged,
        time: part.time,
    };
    let (request, response) = (request.as_ref().map(side), response.as_ref().map(side));
    // A good frame leads: the request's, or else the response's.
    let answer = response.as_ref().filter(|side| !side.damaged).map(|side| side.bytes);
    let (lead, role) = match (&request, answer) {
        (Some(Side { bytes, damaged: false, .. }), _) => (*bytes, Role::Request),
        (_, Some(response)) => (response, Role::Response),
        (_, None) => (&[][..], Role::Unknown), // does not occur: a transaction has a good frame
    };
    let time = |side: &Option<Side<'_>>| side.as_ref()?.time;
    let latency = time(&request).zip(time(&response));
    Transaction {
        id: current.id,
        address: lead.first().copied().unwrap_or_default(),
        function: FunctionCode(lead.get(1).copied().unwrap_or_default()).without_exception(),
        start_register: pdu::start_register(lead, role),
        quantity: pdu::quantity(lead, role),
        outcome: *outcome,
        exception_code: answer.and_then(pdu::exception_code),
        latency: latency.map(|(request, response)| not_negative(request.end.until(response.start))),
        request,
        response,
    }
}
