//! Small things that views are made of.

pub mod bars;
pub mod chart;
pub mod columns;
pub mod text;
