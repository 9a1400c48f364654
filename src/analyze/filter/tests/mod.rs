//! What filters mean, what they say when they are wrong, and that they print as they are read.

mod errors;
mod meaning;
mod round_trip;
