//! What the bytes of a frame say, field by field, damaged or not.
//!
//! The forms are those of the Modbus application protocol V1.1b3, section 6; each parser names its own.
//! Nothing is refused: a form that breaks off is read as far as it goes, and the rest is kept raw.

mod access;
mod crc;
mod data;
mod device_id;
mod diagnostic;
mod draft;
mod field;
mod file;
#[cfg(test)]
mod tests;

use std::cmp::Reverse;
use std::fmt;

pub use access::{exception_code, quantity, start_register};
pub use crc::Crc;
pub use field::{PduField, PduValue, Remark, Stop, StopReason};

use crate::decode::frame::Role;
use crate::decode::function::FunctionCode;
use draft::{Draft, Parser};

/// Holds what a run of bytes says, read as one frame from address to CRC.
///
/// The spans of the fields lie end to end and cover every byte.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dissection<'a> {
    /// Who sent it, as it was read; unknown where it makes no difference.
    pub role: Role,
    /// The unit address, the first byte.
    pub address: Option<u8>,
    /// The function code as on the wire, with the exception bit.
    pub function: Option<FunctionCode>,
    /// Every byte, from address to CRC, in order.
    pub fields: Vec<PduField<'a>>,
    /// The last two bytes taken as a CRC; `None` under four bytes. In a truncated run they are data, and bad.
    pub crc: Option<Crc>,
    /// Where and why reading broke off; `None` when the form was complete.
    pub stopped: Option<Stop>,
}

impl Dissection<'_> {
    /// Tells whether the bytes have exactly the form of their function: nothing missing, nothing left over.
    pub fn is_whole(&self) -> bool {
        self.stopped.is_none() && self.fields.iter().all(|field| field.remark != Some(Remark::LeftOver))
    }

    /// Ranks how well the form fits: complete, then few bytes left over, then few remarks.
    fn fit(&self) -> (bool, Reverse<usize>, Reverse<usize>) {
        let left_over = self.fields.iter().filter(|field| field.remark == Some(Remark::LeftOver));
        let remarks = self.fields.iter().filter(|field| field.remark.is_some()).count();
        (self.stopped.is_none(), Reverse(left_over.map(|field| field.span.len()).sum()), Reverse(remarks))
    }

    /// Returns the field that covers a byte, counted from the address.
    pub fn field_at(&self, offset: usize) -> Option<&PduField<'_>> {
        self.fields.iter().find(|field| field.span.contains(&offset))
    }
}

impl fmt::Display for Dissection<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, field) in self.fields.iter().enumerate() {
            let comma = if index == 0 { "" } else { ", " };
            write!(f, "{comma}{field}")?;
        }
        match self.stopped {
            Some(stop) => write!(f, "; {stop}"),
            None => Ok(()),
        }
    }
}

/// Reads the bytes of a frame or of a damaged run, from the address to the CRC.
///
/// An unknown role is settled by which form the bytes have; where both fit as well, they are read as a
/// request and the function field says so. A good CRC fixes where the PDU ends; else the form does, and
/// what follows it is taken for the CRC.
pub fn dissect(bytes: &[u8], role: Role) -> Dissection<'_> {
    if role != Role::Unknown {
        return read(bytes, role);
    }
    let mut request = read(bytes, Role::Request);
    let response = read(bytes, Role::Response);
    if request.fields == response.fields && request.stopped == response.stopped {
        request.role = Role::Unknown;
    } else if request.fit() == response.fit() {
        if let Some(function) = request.fields.get_mut(1) {
            function.remark = Some(Remark::Note("direction unknown, read as a request"));
        }
    } else if response.fit() > request.fit() {
        return response;
    }
    request
}

/// Reads bytes whose sender is settled.
fn read(bytes: &[u8], role: Role) -> Dissection<'_> {
    let mut draft = Draft::new(bytes);
    let parsed = head(&mut draft, role);
    let stopped = draft.finish(parsed.err());
    Dissection {
        role,
        address: bytes.first().copied(),
        function: bytes.get(1).copied().map(FunctionCode),
        crc: draft.crc,
        fields: draft.fields,
        stopped,
    }
}

/// Reads address and function, then what the function asks for.
fn head<'a>(draft: &mut Draft<'a>, role: Role) -> Result<(), draft::Broken> {
    let (input, address) = draft.u8("address", draft.body())?;
    match address {
        0 => draft.remark(Remark::Note("broadcast")),
        248..=255 => draft.remark(Remark::Note("reserved address")),
        _ => {}
    }
    let (input, code) = draft.u8_as("function", |code| PduValue::Function(FunctionCode(code)), input)?;
    let parser = parser(FunctionCode(code), role);
    parser(draft, input)?;
    Ok(())
}

/// Chooses the parser for what follows the function code.
fn parser(function: FunctionCode, role: Role) -> Parser {
    let request = role == Role::Request;
    match function {
        code if code.is_exception() => diagnostic::exception,
        FunctionCode::READ_COILS | FunctionCode::READ_DISCRETE_INPUTS if request => data::read_bits,
        FunctionCode::READ_COILS | FunctionCode::READ_DISCRETE_INPUTS => data::bits,
        FunctionCode::READ_HOLDING_REGISTERS | FunctionCode::READ_INPUT_REGISTERS if request => {
            data::read_registers
        }
        FunctionCode::READ_HOLDING_REGISTERS | FunctionCode::READ_INPUT_REGISTERS => data::registers,
        FunctionCode::WRITE_SINGLE_COIL => data::write_coil,
        FunctionCode::WRITE_SINGLE_REGISTER => data::write_register,
        FunctionCode::WRITE_MULTIPLE_COILS if request => data::write_coils,
        FunctionCode::WRITE_MULTIPLE_COILS => data::coils_written,
        FunctionCode::WRITE_MULTIPLE_REGISTERS if request => data::write_registers,
        FunctionCode::WRITE_MULTIPLE_REGISTERS => data::registers_written,
        FunctionCode::MASK_WRITE_REGISTER => data::mask_write,
        FunctionCode::READ_WRITE_MULTIPLE_REGISTERS if request => data::read_write,
        FunctionCode::READ_WRITE_MULTIPLE_REGISTERS => data::registers,
        FunctionCode::READ_FIFO_QUEUE if request => data::read_fifo,
        FunctionCode::READ_FIFO_QUEUE => data::fifo,
        FunctionCode::DIAGNOSTICS if request => diagnostic::diagnostics_request,
        FunctionCode::DIAGNOSTICS => diagnostic::diagnostics_response,
        FunctionCode::READ_EXCEPTION_STATUS
        | FunctionCode::GET_COMM_EVENT_COUNTER
        | FunctionCode::GET_COMM_EVENT_LOG
        | FunctionCode::REPORT_SERVER_ID
            if request =>
        {
            draft::nothing
        }
        FunctionCode::READ_EXCEPTION_STATUS => diagnostic::exception_status,
        FunctionCode::GET_COMM_EVENT_COUNTER => diagnostic::event_counter,
        FunctionCode::GET_COMM_EVENT_LOG => diagnostic::event_log,
        FunctionCode::REPORT_SERVER_ID => diagnostic::server_id,
        FunctionCode::READ_FILE_RECORD if request => file::read_request,
        FunctionCode::READ_FILE_RECORD => file::read_response,
        FunctionCode::WRITE_FILE_RECORD => file::write,
        FunctionCode::ENCAPSULATED_INTERFACE if request => device_id::request,
        FunctionCode::ENCAPSULATED_INTERFACE => device_id::response,
        _ => draft::anything,
    }
}
