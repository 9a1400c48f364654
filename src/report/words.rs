//! The words of rows, the same in text and on the screen: device, command, outcome, values.

use std::fmt::{self, Write};

use crate::decode::frame::Role;
use crate::decode::function::FunctionCode;
use crate::decode::pdu::{self, PduValue};
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::device::{Field, Meaning, Profiles};
use crate::pipeline::Lost;
use crate::time::{MILLISECOND, Span};

/// Shortens the ids of profiles by what all of them begin with.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    /// What the ids of all profiles begin with, up to a hyphen: not worth repeating on every line.
    prefix: String,
    width: usize,
}

impl Labels {
    /// Takes the profiles in use.
    pub fn new(profiles: &Profiles) -> Self {
        let ids: Vec<&str> = profiles.iter().map(|profile| &*profile.id).collect();
        let prefix = common_prefix(&ids).to_owned();
        let width = ids.iter().map(|id| id.len() - prefix.len()).max().unwrap_or(1) + 1;
        Labels { prefix, width }
    }

    /// Returns how many characters the longest takes, with a mark.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Shortens an id.
    pub fn short<'a>(&self, device: &'a str) -> &'a str {
        device.strip_prefix(self.prefix.as_str()).unwrap_or(device)
    }

    /// Returns the device of a transaction: known, likely with a `?`, or `-`.
    pub fn of(&self, meaning: &Meaning<'_>) -> String {
        match (meaning.device(), meaning.likely()) {
            (Some(device), _) => self.short(device).to_owned(),
            (None, Some(likely)) => format!("{}?", self.short(likely.device)),
            (None, None) => "-".to_owned(),
        }
    }
}

/// Returns what a request asks for: the command, a likely one with a `?`, or function and registers.
pub fn command(row: &Transaction<'_>, meaning: &Meaning<'_>) -> String {
    let likely = if meaning.device().is_none() { meaning.likely() } else { None };
    match (meaning.command(), likely) {
        (Some(command), _) => command.to_owned(),
        (None, Some(likely)) => format!("{}?", likely.command),
        (None, None) => function_and_register(row),
    }
}

/// Says how a transaction ended; `None` where the answer is all there is to say.
pub fn outcome(row: &Transaction<'_>) -> Option<String> {
    Some(match row.outcome {
        Outcome::Answered | Outcome::Broadcast => return None,
        Outcome::NoResponse => "no response".to_owned(),
        Outcome::Exception => match row.exception_code {
            Some(code) => match code.name() {
                Some(name) => format!("exception {}: {name}", code.0),
                None => format!("exception {}", code.0),
            },
            None => "exception".to_owned(),
        },
        Outcome::Late => "late".to_owned(),
        Outcome::Unsolicited => "unsolicited".to_owned(),
        Outcome::Damaged => {
            let request = row.request.is_some_and(|side| side.damaged);
            format!("{} damaged", if request { "request" } else { "response" })
        }
    })
}

/// Says what was lost, and where.
pub fn lost(lost: &Lost) -> String {
    format!("{} lost ({}) before byte {}", bytes(lost.count), lost.kind.name(), lost.stream_offset)
}

/// Says how many bytes were lost, of which 0 is the number that nobody knows.
pub fn bytes(count: u64) -> String {
    match count {
        0 => "an unknown number of bytes".to_owned(),
        1 => "1 byte".to_owned(),
        count => format!("{count} bytes"),
    }
}

/// Returns the fields that are sure, then those of the likeliest reading, each with the mark it is shown with.
pub fn marked_fields<'a>(meaning: &Meaning<'a>) -> impl Iterator<Item = (Field<'a>, &'static str)> {
    let sure = meaning.fields().map(|field| (field, ""));
    sure.chain(meaning.likely_fields().map(|field| (field, "?")))
}

/// Writes fields; without a profile, the data of the PDU.
///
/// # Errors
/// When a value's `Display` fails.
pub fn write_meaning(line: &mut String, row: &Transaction<'_>, meaning: &Meaning<'_>) -> fmt::Result {
    let mut separator = "";
    let mut known = false;
    let mut field = |line: &mut String, text: fmt::Arguments<'_>| {
        let before = std::mem::replace(&mut separator, " · ");
        known = true;
        write!(line, "{before}{text}")
    };
    for (f, mark) in marked_fields(meaning) {
        field(line, format_args!("{}{mark} {f}", f.name))?;
    }
    if known || meaning.command().is_some() || meaning.likely().is_some() {
        return Ok(());
    }
    let mut sides = [(row.request, Role::Request), (row.response, Role::Response)];
    if !is_write(row.function) {
        sides.reverse();
    }
    for (side, role) in sides {
        let Some(side) = side.filter(|side| !side.damaged) else { continue };
        if write_data(line, side, role)? {
            break;
        }
    }
    Ok(())
}

/// Tells whether what a function is about is in its request.
pub fn is_write(function: FunctionCode) -> bool {
    matches!(
        function,
        FunctionCode::WRITE_SINGLE_COIL
            | FunctionCode::WRITE_SINGLE_REGISTER
            | FunctionCode::WRITE_MULTIPLE_COILS
            | FunctionCode::WRITE_MULTIPLE_REGISTERS
            | FunctionCode::WRITE_FILE_RECORD
            | FunctionCode::MASK_WRITE_REGISTER
    )
}

/// Writes what a PDU carries besides its header; tells whether there was something.
fn write_data(line: &mut String, side: Side<'_>, role: Role) -> Result<bool, fmt::Error> {
    let mut separator = "";
    for field in pdu::dissect(side.bytes, role).fields {
        let is_header = matches!(
            field.name,
            "address"
                | "function"
                | "start register"
                | "start address"
                | "quantity"
                | "byte count"
                | "register"
                | "reference type"
                | "file response length"
                | "MEI type"
                | "read device ID code"
                | "conformity level"
                | "more follows"
                | "next object ID"
                | "number of objects"
                | "object ID"
                | "object length"
        ) || field.span.end == side.bytes.len()
            || matches!(field.value, PduValue::Raw([]) | PduValue::Registers([]));
        if !is_header {
            write!(line, "{separator}{}", field.value)?;
            separator = " · ";
        }
    }
    Ok(!separator.is_empty())
}

/// Writes function code and register in the shorthand of the trade, such as `FC03 0x2600 ×4`.
fn function_and_register(row: &Transaction<'_>) -> String {
    let mut text = function(row.function);
    if let Some(register) = row.start_register {
        let _ = write!(text, " 0x{register:04x}");
    }
    if let Some(quantity) = row.quantity {
        let _ = write!(text, " ×{quantity}");
    }
    text
}

/// Writes a function code in the shorthand of the trade; an exception has a `!`.
pub fn function(code: FunctionCode) -> String {
    let mark = if code.is_exception() { "!" } else { "" };
    format!("FC{:02}{mark}", code.without_exception().0)
}

/// Returns the direction of a frame: to the device, from it, or a dot where that cannot be told.
pub fn arrow(role: Role) -> char {
    match role {
        Role::Request => '→',
        Role::Response => '←',
        Role::Unknown => '·',
    }
}

/// Writes a length of time in milliseconds with its error, such as `18.4 ±0.3 ms`.
pub fn latency(span: Option<Span>) -> String {
    match span {
        Some(span) => format!("{} ±{} ms", Tenths(span.midpoint()), Tenths(span.half_width())),
        None => String::new(),
    }
}

/// Shows nanoseconds as milliseconds with a decimal.
struct Tenths(i64);

impl fmt::Display for Tenths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tenth = MILLISECOND.unsigned_abs() / 10;
        let tenths = (self.0.unsigned_abs() + tenth / 2) / tenth;
        let sign = if self.0 < 0 && tenths > 0 { "-" } else { "" };
        write!(f, "{sign}{}.{}", tenths / 10, tenths % 10)
    }
}

/// Returns what all ids begin with, up to and with a hyphen.
fn common_prefix<'a>(ids: &[&'a str]) -> &'a str {
    let Some(first) = ids.first() else { return "" };
    let end = first.find('-').map_or(0, |hyphen| hyphen + 1);
    let prefix = &first[..end];
    if ids.iter().all(|id| id.len() > end && id.starts_with(prefix)) { prefix } else { "" }
}
