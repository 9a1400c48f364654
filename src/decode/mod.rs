//! From bytes to transactions: pure, with time and bytes as arguments.

pub mod candidate;
pub mod chunk;
pub mod crc;
pub mod damage;
pub mod frame;
pub mod framer;
pub mod function;
pub mod pairing;
pub mod pdu;
pub mod shape;
pub mod stamp;
pub mod store;
pub mod transaction;
