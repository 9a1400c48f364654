//! rtutap listens on a Modbus RTU bus without ever speaking, and says what the sensors said.

pub mod capture;
pub mod decode;
pub mod line;
pub mod time;
