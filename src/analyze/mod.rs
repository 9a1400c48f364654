//! Judgement over what was decoded, and over what could not be: pure, with time as an argument.
pub mod connection;
pub mod draft;
pub mod filter;
pub mod line_search;
pub mod plan;
pub mod verify;
