//! A request and what became of it.

use crate::decode::frame::WireTime;
use crate::decode::function::{ExceptionCode, FunctionCode};
use crate::time::Span;

/// Says how a transaction ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Outcome {
    /// The response fits the request.
    Answered,
    /// The device answered with an exception.
    Exception,
    /// Nobody answered.
    NoResponse,
    /// The response came after another request had begun.
    Late,
    /// A response without a request.
    Unsolicited,
    /// A request to address 0, which nobody answers.
    Broadcast,
    /// Request or response is a damaged run.
    Damaged,
}

impl Outcome {
    /// All outcomes, in the order in which they are listed to people.
    pub const ALL: [Outcome; 7] = [
        Outcome::Answered,
        Outcome::Exception,
        Outcome::NoResponse,
        Outcome::Late,
        Outcome::Unsolicited,
        Outcome::Broadcast,
        Outcome::Damaged,
    ];

    /// Returns the name used in JSON lines.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Answered => "answered",
            Outcome::Exception => "exception",
            Outcome::NoResponse => "no-response",
            Outcome::Late => "late",
            Outcome::Unsolicited => "unsolicited",
            Outcome::Broadcast => "broadcast",
            Outcome::Damaged => "damaged",
        }
    }
}

/// Is one side of a transaction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side<'a> {
    /// The id of the frame or damaged run.
    pub id: u64,
    /// Its bytes, address to CRC.
    pub bytes: &'a [u8],
    /// Whether it is a damaged run.
    pub damaged: bool,
    /// When it was on the wire; `None` where the input has no times.
    pub time: Option<WireTime>,
}

/// Joins a request with what became of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transaction<'a> {
    /// Counts transactions of a command, from 0.
    pub id: u64,
    /// The request's unit address (255 stays 255), or an unsolicited response's.
    pub address: u8,
    /// The request's function code, without the exception bit.
    pub function: FunctionCode,
    /// The first register the request names, for functions that name one.
    pub start_register: Option<u16>,
    /// How many registers or coils the request names, for functions that name it.
    pub quantity: Option<u16>,
    /// How it ended.
    pub outcome: Outcome,
    /// The code of an exception response.
    pub exception_code: Option<ExceptionCode>,
    /// What the master asked.
    pub request: Option<Side<'a>>,
    /// What the device answered.
    pub response: Option<Side<'a>>,
    /// From the request's end to the response's start; `None` without both, or without times.
    pub latency: Option<Span>,
}
