//! From bytes to transactions: pure, with time and bytes as arguments.
//!
//! In the order of the data: [`chunk`] comes in, [`store`] keeps the bytes and [`stamp`] their times, [`framer`] finds
//! the frames with [`candidate`], [`shape`] and [`crc`], [`damage`] names what is left, [`pairing`] decides who sent
//! what and joins requests with answers. [`frame`], [`function`] and [`transaction`] are what comes out, and [`pdu`]
//! reads a frame field by field.

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
