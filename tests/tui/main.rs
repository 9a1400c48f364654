//! The terminal UI, driven without a terminal: what keys do, what views show, what styles mean.

mod keys;
mod notes;
mod pictures;
mod replay;
mod session;
mod settling;
mod store;
mod styles;
mod views;
