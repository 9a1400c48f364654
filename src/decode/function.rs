//! Modbus function and exception codes, as integers with names: an unknown code stays a number.

use std::fmt;

/// Holds a function code as it is on the wire (Modbus application protocol V1.1b3, section 6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionCode(pub u8);

impl FunctionCode {
    /// Function 1.
    pub const READ_COILS: Self = Self(1);
    /// Function 2.
    pub const READ_DISCRETE_INPUTS: Self = Self(2);
    /// Function 3.
    pub const READ_HOLDING_REGISTERS: Self = Self(3);
    /// Function 4.
    pub const READ_INPUT_REGISTERS: Self = Self(4);
    /// Function 5.
    pub const WRITE_SINGLE_COIL: Self = Self(5);
    /// Function 6.
    pub const WRITE_SINGLE_REGISTER: Self = Self(6);
    /// Function 7.
    pub const READ_EXCEPTION_STATUS: Self = Self(7);
    /// Function 8.
    pub const DIAGNOSTICS: Self = Self(8);
    /// Function 11.
    pub const GET_COMM_EVENT_COUNTER: Self = Self(11);
    /// Function 12.
    pub const GET_COMM_EVENT_LOG: Self = Self(12);
    /// Function 15.
    pub const WRITE_MULTIPLE_COILS: Self = Self(15);
    /// Function 16.
    pub const WRITE_MULTIPLE_REGISTERS: Self = Self(16);
    /// Function 17.
    pub const REPORT_SERVER_ID: Self = Self(17);
    /// Function 20.
    pub const READ_FILE_RECORD: Self = Self(20);
    /// Function 21.
    pub const WRITE_FILE_RECORD: Self = Self(21);
    /// Function 22.
    pub const MASK_WRITE_REGISTER: Self = Self(22);
    /// Function 23.
    pub const READ_WRITE_MULTIPLE_REGISTERS: Self = Self(23);
    /// Function 24.
    pub const READ_FIFO_QUEUE: Self = Self(24);
    /// Function 43, with MEI type 14 for device identification.
    pub const ENCAPSULATED_INTERFACE: Self = Self(43);

    /// Tells whether the exception bit (0x80) is set.
    pub const fn is_exception(self) -> bool {
        self.0 & 0x80 != 0
    }

    /// Returns the code without its exception bit: the function of the request.
    pub const fn without_exception(self) -> Self {
        Self(self.0 & 0x7F)
    }

    /// Returns the name the specification gives the function, if it does; the exception bit is ignored.
    pub const fn name(self) -> Option<&'static str> {
        Some(match self.0 & 0x7F {
            1 => "read coils",
            2 => "read discrete inputs",
            3 => "read holding registers",
            4 => "read input registers",
            5 => "write single coil",
            6 => "write single register",
            7 => "read exception status",
            8 => "diagnostics",
            11 => "get comm event counter",
            12 => "get comm event log",
            15 => "write multiple coils",
            16 => "write multiple registers",
            17 => "report server ID",
            20 => "read file record",
            21 => "write file record",
            22 => "mask write register",
            23 => "read/write multiple registers",
            24 => "read FIFO queue",
            43 => "encapsulated interface transport",
            _ => return None,
        })
    }
}

impl fmt::Display for FunctionCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{name}"),
            None => write!(f, "function {}", self.0 & 0x7F),
        }
    }
}

/// Holds the code of an exception response (Modbus application protocol V1.1b3, section 7).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ExceptionCode(pub u8);

impl ExceptionCode {
    /// Returns the name the specification gives the exception, if it does.
    pub const fn name(self) -> Option<&'static str> {
        Some(match self.0 {
            1 => "illegal function",
            2 => "illegal data address",
            3 => "illegal data value",
            4 => "server device failure",
            5 => "acknowledge",
            6 => "server device busy",
            7 => "negative acknowledge",
            8 => "memory parity error",
            10 => "gateway path unavailable",
            11 => "gateway target device failed to respond",
            _ => return None,
        })
    }
}

impl fmt::Display for ExceptionCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{name}"),
            None => write!(f, "exception {}", self.0),
        }
    }
}
