//! The program on live buses, for which ptys stand.
#![cfg(target_os = "linux")]
#![allow(clippy::print_stdout)] // of what is measured
#![allow(clippy::disallowed_methods)] // tests have files, threads and clocks of their own

mod bus;
mod cost;
mod disk;
mod ends;
mod kill;
mod large;
mod lines;
mod masters;
mod screen;
mod terminal;
mod verify;
