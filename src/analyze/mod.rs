//! Judgement over what was decoded: pure, with time as an argument.
pub mod filter;
