//! From bytes to transactions: pure, with time and bytes as arguments.

pub mod chunk;
pub mod frame;
pub mod function;
pub mod pdu;
pub mod shape;
pub mod transaction;
