//! The terminal UI: pure state and drawing. It owns no thread, clock, file or terminal.
pub mod store;
