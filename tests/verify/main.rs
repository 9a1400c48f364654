//! Every rule of the catalogue: what fires it, with the right frames and bytes, and a near miss that does not.

mod device;
mod frames;
mod hour;
mod line;
mod plan;
mod requests;
mod story;
mod values;
