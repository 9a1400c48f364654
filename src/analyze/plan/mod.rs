//! What a master is expected to do: written down from one that is known to be good, held against another.
//!
//! ```toml
//! [[device]]
//! address = 1
//! device = "yosemitech-do"
//! latency = 40                  # ms: an answer begins within this time
//! silence = 10                  # s: it is asked something at least this often; without it it may be left alone
//! order = ["start-measurement > get-measurement", "get-measurement > get-measurement"]
//!
//! [[device.command]]
//! name = "get-measurement"
//! function = 3
//! register = 0x2600
//! quantity = 4
//! every = [1.0, 1.5]            # s between two, on average, at least and at most; without it it may come or not
//! ```

mod check;
mod draft;
mod pace;
mod parse;

use std::fmt;

pub use check::Check;
pub use draft::Draft;

use crate::decode::transaction::Transaction;
use crate::device::Profiles;
use crate::section::Problem;
use crate::time::{MILLISECOND, SECOND};

/// From how many requests on something is a habit.
const HABIT: u64 = 3;

/// The least and the most time between two on average, in nanoseconds.
type Pace = (i64, i64);

/// Says what a master is expected to do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// The devices it asks.
    pub devices: Vec<Device>,
}

/// Says what a master is expected to ask a device.
#[derive(Clone, Debug, PartialEq)]
pub struct Device {
    /// The unit address, 0 to 255.
    pub address: u8,
    /// The id of its profile; any when `None`.
    pub device: Option<String>,
    /// How long an answer takes at most to begin, in nanoseconds.
    pub latency_ns: Option<i64>,
    /// How long it may be asked nothing at all, in nanoseconds; for ever when `None`.
    pub silence_ns: Option<i64>,
    /// Which command may follow which, by name; any when empty.
    pub order: Vec<(String, String)>,
    /// What it is asked.
    pub commands: Vec<Command>,
}

/// Is something that a master is expected to ask.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// What it is called; no two of a device are the same.
    pub name: String,
    /// The function code.
    pub function: u8,
    /// The first register, for functions that name one.
    pub register: Option<u16>,
    /// The quantity, for functions that name one.
    pub quantity: Option<u16>,
    /// The least and the most time between two on average, in nanoseconds; `None` for what may come or not.
    pub every_ns: Option<Pace>,
}

impl Plan {
    /// Reads a plan from TOML, for devices of these profiles.
    ///
    /// # Errors
    /// All problems in the order of the text.
    pub fn from_toml(text: &str, profiles: &Profiles) -> Result<Plan, Vec<Problem>> {
        parse::plan(text, profiles)
    }
}

impl Command {
    /// Tells whether a transaction's request is this one.
    fn is(&self, t: &Transaction<'_>) -> bool {
        (self.function, self.register, self.quantity) == (t.function.0, t.start_register, t.quantity)
    }
}

impl fmt::Display for Plan {
    /// Writes the plan as it is read.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, device) in self.devices.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            writeln!(f, "[[device]]\naddress = {}", device.address)?;
            if let Some(id) = &device.device {
                writeln!(f, "device = {id:?}")?;
            }
            if let Some(latency) = device.latency_ns {
                let milliseconds = latency as f64 / MILLISECOND as f64;
                writeln!(f, "latency = {milliseconds} # ms: an answer begins within this time")?;
            }
            if let Some(silence) = device.silence_ns {
                let seconds = silence as f64 / SECOND as f64;
                writeln!(f, "silence = {seconds} # s: it is asked something at least this often")?;
            }
            if !device.order.is_empty() {
                writeln!(f, "# Which command may follow which; any, without this.\norder = [")?;
                device.order.iter().try_for_each(|(from, to)| writeln!(f, "    \"{from} > {to}\","))?;
                writeln!(f, "]")?;
            }
            device.commands.iter().try_for_each(|command| command.fmt(f))?;
        }
        Ok(())
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\n[[device.command]]\nname = {:?}\nfunction = {}", self.name, self.function)?;
        if let Some(register) = self.register {
            writeln!(f, "register = 0x{register:04X}")?;
        }
        if let Some(quantity) = self.quantity {
            writeln!(f, "quantity = {quantity}")?;
        }
        if let Some((least, most)) = self.every_ns {
            let seconds = |ns: i64| ns as f64 / SECOND as f64;
            let (least, most) = (seconds(least), seconds(most));
            writeln!(f, "every = [{least}, {most}] # s between two, on average")?;
        }
        Ok(())
    }
}
