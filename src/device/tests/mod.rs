//! What the parts do together: stories of a bus, texts for people, and any bytes at all.

mod contradictions;
mod family;
mod properties;
mod stories;
mod texts;

use std::sync::Arc;

use crate::decode::function::{ExceptionCode, FunctionCode};
use crate::decode::transaction::{Outcome, Side, Transaction};

use super::{Devices, Environment, Field, Identified, Meaning, Profile, Profiles};

/// Is a transaction with its own bytes; CRCs are zero, as nothing here looks at them.
#[derive(Clone, Debug)]
struct Exchange {
    id: u64,
    request: Vec<u8>,
    response: Option<Vec<u8>>,
    outcome: Outcome,
    request_damaged: bool,
}

/// Reads frames without their CRC from hex.
fn frame(hex: &str) -> Vec<u8> {
    let digits: String = hex.split_whitespace().collect();
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).expect("hex");
    (0..digits.len()).step_by(2).map(byte).chain([0, 0]).collect()
}

fn asked(request: &str) -> Exchange {
    let outcome = Outcome::NoResponse;
    Exchange { id: 7, request: frame(request), response: None, outcome, request_damaged: false }
}

fn answered(request: &str, response: &str) -> Exchange {
    Exchange { response: Some(frame(response)), outcome: Outcome::Answered, ..asked(request) }
}

impl Exchange {
    fn with_outcome(self, outcome: Outcome) -> Self {
        Exchange { outcome, ..self }
    }

    fn transaction(&self) -> Transaction<'_> {
        let number =
            |at: usize| Some(u16::from_be_bytes([*self.request.get(at)?, *self.request.get(at + 1)?]));
        let side = |id, bytes, damaged| Side { id, bytes, damaged, time: None };
        let code = self.response.as_ref().and_then(|bytes| bytes.get(2));
        Transaction {
            id: self.id,
            address: self.request.first().copied().unwrap_or(0),
            function: FunctionCode(self.request.get(1).copied().unwrap_or(0)),
            start_register: number(2),
            quantity: number(4),
            outcome: self.outcome,
            exception_code: code
                .filter(|_| self.outcome == Outcome::Exception)
                .map(|&code| ExceptionCode(code)),
            request: Some(side(2 * self.id, &self.request, self.request_damaged)),
            response: self.response.as_deref().map(|bytes| side(2 * self.id + 1, bytes, false)),
            latency: None,
        }
    }
}

/// Is a bus on which transactions happen one after the other.
struct Bus {
    devices: Devices,
    next_id: u64,
}

impl Bus {
    fn new() -> Self {
        Bus::with_profiles(Profiles::built_in())
    }

    fn with_profiles(profiles: Profiles) -> Self {
        Bus { devices: Devices::new(Arc::new(profiles), Environment::default()), next_id: 0 }
    }

    fn happens(&mut self, exchange: Exchange) -> (Option<Identified>, Told) {
        let exchange = Exchange { id: self.next_id, ..exchange };
        self.next_id += 1;
        let t = exchange.transaction();
        let identified = self.devices.observe(&t);
        (identified, Told::new(&self.devices.meaning(&t)))
    }

    /// Lets a transaction happen and returns what it identified.
    fn identifies(&mut self, exchange: Exchange) -> Option<Identified> {
        self.happens(exchange).0
    }

    /// Lets a transaction happen and returns what it means.
    fn tells(&mut self, exchange: Exchange) -> Told {
        self.happens(exchange).1
    }
}

/// Is a meaning as text, so that it outlives its transaction.
#[derive(Debug, Default, PartialEq)]
struct Told {
    device: Option<String>,
    serial_number: Option<String>,
    candidates: Vec<String>,
    command: Option<String>,
    fields: Vec<String>,
    likely: Option<(String, String)>,
    likely_fields: Vec<String>,
    readings: Vec<String>,
}

impl Told {
    fn new(meaning: &Meaning<'_>) -> Self {
        let field = |field: Field<'_>| format!("{} {field}", field.name);
        Told {
            device: meaning.device().map(str::to_owned),
            serial_number: meaning.serial_number().map(str::to_owned),
            candidates: meaning.candidates().map(str::to_owned).collect(),
            command: meaning.command().map(str::to_owned),
            fields: meaning.fields().map(field).collect(),
            likely: meaning.likely().map(|likely| (likely.device.to_owned(), likely.command.to_owned())),
            likely_fields: meaning.likely_fields().map(field).collect(),
            readings: meaning.readings().map(|reading| format!("{} {reading}", reading.quantity)).collect(),
        }
    }
}

const DO: &str = "yosemitech-do";
const SONDE: &str = "yosemitech-sonde";
const CONDUCTIVITY: &str = "yosemitech-conductivity";
const TURBIDITY: &str = "yosemitech-turbidity";
const TURBIDITY_WIPER: &str = "yosemitech-turb-wiper";
const CHLOROPHYLL: &str = "yosemitech-chlorophyll";
const BGA: &str = "yosemitech-bga";
const COD: &str = "yosemitech-cod";
const PH: &str = "yosemitech-ph";
const ORP: &str = "yosemitech-orp";
const AMMONIUM: &str = "yosemitech-ammonium";
const DEPTH: &str = "yosemitech-depth";
const SOLIDS: &str = "yosemitech-tss";
const OIL: &str = "yosemitech-oil";
const SONDE_V2: &str = "yosemitech-sonde-v2";

/// Has one register for the serial number and one for the measurement: all but the sondes.
const SINGLE_PROBES: [&str; 13] = [
    DO,
    CONDUCTIVITY,
    TURBIDITY,
    TURBIDITY_WIPER,
    CHLOROPHYLL,
    BGA,
    COD,
    PH,
    ORP,
    AMMONIUM,
    DEPTH,
    SOLIDS,
    OIL,
];

/// Starts by a read at 0x2500, and sends the temperature first.
const OPTICAL_PROBES: [&str; 8] = [DO, TURBIDITY, TURBIDITY_WIPER, CHLOROPHYLL, BGA, COD, SOLIDS, OIL];

/// Returns a read of the serial number by the single probes' register, with its answer.
fn serial_number(address: u8, type_byte: u8, text: &str) -> Exchange {
    assert_eq!(text.len(), 12);
    let text: String = text.bytes().map(|byte| format!("{byte:02x}")).collect();
    answered(
        &format!("{address:02x} 03 0900 0007"),
        &format!("{address:02x} 03 0e {type_byte:02x} {text} 00"),
    )
}

/// Returns a measurement read at 0x2600, answered with 17.625 twice, then zero.
fn measurement(address: u8, quantity: u8) -> Exchange {
    let data: String = "00008d41".repeat(2) + &"00".repeat(2 * usize::from(quantity).saturating_sub(4));
    answered(
        &format!("{address:02x} 03 2600 00{quantity:02x}"),
        &format!("{address:02x} 03 {:02x} {data}", 2 * quantity),
    )
}

/// Returns a read of the sonde's data, answered with 7.9 and zeros.
fn sonde_data(address: u8) -> Exchange {
    let data = format!("cdccfc40{}", "00".repeat(28));
    answered(&format!("{address:02x} 03 2601 0010"), &format!("{address:02x} 03 20 {data}"))
}

/// Returns a start by the optical probes' register, with its answer.
fn optical_start(address: u8) -> Exchange {
    answered(&format!("{address:02x} 03 2500 0000"), &format!("{address:02x} 03 00"))
}

/// Returns a change of address, acknowledged by the old one.
fn set_address(from: u8, to: u8) -> Exchange {
    answered(&format!("{from:02x} 10 3000 0001 02 {to:02x}00"), &format!("{from:02x} 10 3000 0001"))
}
