//! rtutap listens on a Modbus RTU bus without ever speaking, and says what the sensors said.

pub mod analyze;
pub mod capture;
pub mod cli;
pub mod command;
pub mod config;
pub mod decode;
pub mod device;
pub mod line;
pub mod pipeline;
pub mod report;
pub mod simulate;
pub mod time;
