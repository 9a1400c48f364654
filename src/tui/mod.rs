//! The terminal UI: pure state and drawing. It owns no thread, clock, file or terminal.
//!
//! ```text
//!              events          copies            keys, mouse, time
//! pipeline ──▶ store::Feed ──▶ store::Store ──▶ app::App::update ──▶ Effect, for who owns the terminal
//!                                                │
//!                                                └──▶ view::draw ──▶ a buffer of cells
//! ```
//!
//! State knows nothing of drawing, and drawing changes no state; where things are on the screen is a function of both
//! ([`layout`]), which the mouse uses too.

pub mod action;
pub mod app;
pub mod keymap;
pub mod layout;
pub mod sieve;
pub mod store;
pub mod theme;
pub mod timeline;
pub mod view;
pub mod widget;
