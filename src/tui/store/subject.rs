//! What the display filter may ask of a row.

use super::row::{Exchange, Row};
use super::{List, Store};
use crate::analyze::filter::{Field, Subject};
use crate::decode::frame::{Reason, Role};
use crate::decode::function::{ExceptionCode, FunctionCode};
use crate::decode::pdu;
use crate::decode::transaction::Outcome;
use crate::report;
use crate::time::Timestamp;

/// Is a row with the store around it.
#[derive(Clone, Copy)]
pub struct RowSubject<'a> {
    store: &'a Store,
    row: &'a Row,
}

impl<'a> RowSubject<'a> {
    /// Asks about a row of a store.
    pub fn new(store: &'a Store, row: &'a Row) -> Self {
        RowSubject { store, row }
    }

    fn exchange(&self) -> Option<&'a Exchange> {
        match self.row {
            Row::Exchange(row) => Some(row),
            // A frame passes as its transaction does, where only that one knows.
            Row::Run(row) => match self.store.list(List::Exchanges).get(row.exchange?)? {
                Row::Exchange(row) => Some(row),
                _ => None,
            },
            Row::Remark(_) => None,
        }
    }

    /// Returns the frames of a transaction, or the frame itself.
    fn runs(&self) -> impl Iterator<Item = &'a super::row::Run> {
        let frames = self.store.list(List::Frames);
        let (own, sides) = match self.row {
            Row::Run(run) => (Some(&**run), [None, None]),
            Row::Exchange(row) => (None, row.sides),
            Row::Remark(_) => (None, [None, None]),
        };
        let sides = sides.into_iter().flatten().filter_map(move |number| match frames.get(number)? {
            Row::Run(run) => Some(&**run),
            _ => None,
        });
        own.into_iter().chain(sides)
    }
}

impl Subject for RowSubject<'_> {
    fn address(&self) -> Option<u8> {
        self.row.address()
    }

    fn function(&self) -> Option<FunctionCode> {
        match self.row {
            Row::Exchange(row) => Some(row.function),
            Row::Run(row) => row.function,
            Row::Remark(_) => None,
        }
    }

    fn start_register(&self) -> Option<u16> {
        match self.row {
            Row::Run(run) if run.reason().is_none() => {
                pdu::start_register(&run.bytes, run.role).or_else(|| self.exchange()?.register)
            }
            _ => self.exchange()?.register,
        }
    }

    fn quantity(&self) -> Option<u16> {
        match self.row {
            Row::Run(run) if run.reason().is_none() => {
                pdu::quantity(&run.bytes, run.role).or_else(|| self.exchange()?.quantity)
            }
            _ => self.exchange()?.quantity,
        }
    }

    fn exception_code(&self) -> Option<ExceptionCode> {
        self.exchange()?.exception.map(ExceptionCode)
    }

    fn outcome(&self) -> Option<Outcome> {
        Some(self.exchange()?.outcome)
    }

    fn role(&self) -> Option<Role> {
        match self.row {
            Row::Run(row) => Some(row.role),
            _ => None,
        }
    }

    fn reason(&self) -> Option<Reason> {
        match self.row {
            Row::Run(row) => row.reason(),
            _ => None,
        }
    }

    fn is_damaged(&self) -> bool {
        match self.row {
            Row::Exchange(row) if row.outcome == Outcome::Damaged => true,
            _ => self.runs().any(|run| run.reason().is_some()),
        }
    }

    fn is_echo(&self) -> bool {
        matches!(self.row, Row::Run(run) if run.is_echo())
    }

    fn crc_is_good(&self) -> Option<bool> {
        match self.row {
            Row::Remark(_) => None,
            _ => Some(!self.is_damaged()),
        }
    }

    fn device(&self) -> Option<&str> {
        self.exchange()?.device.as_deref()
    }

    fn serial_number(&self) -> Option<&str> {
        self.exchange()?.serial.as_deref()
    }

    fn command(&self) -> Option<&str> {
        self.exchange()?.command.as_deref()
    }

    fn bus(&self) -> Option<&str> {
        Some(&self.store.buses().get(self.row.bus())?.name)
    }

    fn latency_ns(&self) -> Option<i64> {
        Some(self.exchange()?.latency?.midpoint())
    }

    fn start_ns(&self) -> Option<i64> {
        self.row.time().map(Timestamp::as_ns)
    }

    fn time_of_day_ns(&self) -> Option<i64> {
        self.row.time().map(report::time_of_day_ns)
    }

    fn any_finding(&self, test: &mut dyn FnMut(&str) -> bool) -> bool {
        if let Some(exchange) = self.exchange()
            && exchange.codes.iter().any(|code| test(code))
        {
            return true;
        }
        self.store.findings().of_row(self.row).any(|finding| test(finding.rule.code))
    }

    fn any_bytes(&self, test: &mut dyn FnMut(&[u8]) -> bool) -> bool {
        self.runs().any(|run| test(&run.bytes))
    }

    fn any_field(&self, name: &str, test: &mut dyn FnMut(Field<'_>) -> bool) -> bool {
        let Some(exchange) = self.exchange() else { return false };
        let mut named = exchange.fields.iter().filter(|field| !field.is_guess && *field.name == *name);
        named.any(|field| test(Field { value: report::compared(&field.value), text: Some(&field.text) }))
    }
}
