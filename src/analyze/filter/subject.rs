//! What a filter can ask of a row.

use crate::decode::frame::{Reason, Role};
use crate::decode::function::{ExceptionCode, FunctionCode};
use crate::decode::transaction::Outcome;

/// Answers a filter's questions about a row; what a row does not have stays `None`.
///
/// The methods that visit call `test` with one thing after another until it says true, and return whether it did.
pub trait Subject {
    /// Returns the unit address.
    fn address(&self) -> Option<u8> {
        None
    }

    /// Returns the function code, as the row shows it.
    fn function(&self) -> Option<FunctionCode> {
        None
    }

    /// Returns the first register the request names.
    fn start_register(&self) -> Option<u16> {
        None
    }

    /// Returns how many registers or coils the request names.
    fn quantity(&self) -> Option<u16> {
        None
    }

    /// Returns the code of an exception response.
    fn exception_code(&self) -> Option<ExceptionCode> {
        None
    }

    /// Returns how the transaction ended.
    fn outcome(&self) -> Option<Outcome> {
        None
    }

    /// Returns who sent the frame.
    fn role(&self) -> Option<Role> {
        None
    }

    /// Returns what is wrong with the row's damaged run.
    fn reason(&self) -> Option<Reason> {
        None
    }

    /// Tells whether the row is or has a damaged run.
    fn is_damaged(&self) -> bool {
        self.reason().is_some()
    }

    /// Tells whether the row is the adapter's echo of a request.
    fn is_echo(&self) -> bool {
        false
    }

    /// Tells whether the CRC is right; `None` where there is none.
    fn crc_is_good(&self) -> Option<bool> {
        None
    }

    /// Returns the profile id of the device.
    fn device(&self) -> Option<&str> {
        None
    }

    /// Returns the serial number of the device.
    fn serial_number(&self) -> Option<&str> {
        None
    }

    /// Returns the name of the profile's command.
    fn command(&self) -> Option<&str> {
        None
    }

    /// Returns the name of the bus.
    fn bus(&self) -> Option<&str> {
        None
    }

    /// Returns the nanoseconds from the request's end to the response's start.
    fn latency_ns(&self) -> Option<i64> {
        None
    }

    /// Returns when the row began, in nanoseconds since the Unix epoch.
    fn start_ns(&self) -> Option<i64> {
        None
    }

    /// Returns when the row began, in nanoseconds since local midnight.
    fn time_of_day_ns(&self) -> Option<i64> {
        None
    }

    /// Visits the codes of the row's findings, such as `D06`.
    fn any_finding(&self, test: &mut dyn FnMut(&str) -> bool) -> bool {
        let _ = test;
        false
    }

    /// Visits the byte strings of the row: its frame, or request and response.
    fn any_bytes(&self, test: &mut dyn FnMut(&[u8]) -> bool) -> bool {
        let _ = test;
        false
    }

    /// Visits the decoded fields of a name.
    fn any_field(&self, name: &str, test: &mut dyn FnMut(Field<'_>) -> bool) -> bool {
        let _ = (name, test);
        false
    }
}

/// Is a decoded field, as a filter sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field<'a> {
    /// Its value.
    pub value: FieldValue<'a>,
    /// How it is shown, such as `17.625 °C`; searched by `~`, compared with texts where the value is none.
    pub text: Option<&'a str>,
}

/// Is the value of a decoded field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldValue<'a> {
    /// A number; not a number compares with nothing.
    Number(f64),
    /// A number from a 32-bit float.
    Single(f32),
    /// A text.
    Text(&'a str),
    /// Yes or no; compares with the words `true` and `false`.
    Flag(bool),
    /// No value, only a text.
    Null,
}
