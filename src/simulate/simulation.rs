//! The whole of it, from a seed to reads and truth.

use crate::line::LineSettings;
use crate::simulate::adapter::{Adapter, Packets, Reader};
use crate::simulate::bus::Bus;
use crate::simulate::generic::Generic;
use crate::simulate::installation::Installation;
use crate::simulate::random::Random;
use crate::simulate::read::Read;
use crate::simulate::scenario::{Equipment, Scenario};
use crate::simulate::script::Scripted;
use crate::simulate::tap::Tap;
use crate::simulate::traffic::Traffic;
use crate::simulate::truth::TruthFrame;
use crate::time::{SECOND, Timestamp};

/// 2026-01-01T00:00:00Z, when every simulation begins.
pub(super) const EPOCH: Timestamp = Timestamp::from_ns(1_767_225_600 * SECOND);

/// Says what to simulate.
#[derive(Clone, Copy, Debug)]
pub struct Config {
    /// Chooses among all possible courses of events.
    pub seed: u64,
    /// After how many frames on the wire, echoes too, no more requests are made; answers still come in.
    pub frames: u64,
    /// Speed and character format; Modbus RTU needs 8 data bits.
    pub line: LineSettings,
    /// How the listener is connected.
    pub adapter: Adapter,
    /// What goes on.
    pub scenario: Scenario,
}

/// Yields what a listener reads from a simulated bus, in the order of time.
pub struct Simulation {
    reader: Reader,
    /// Counts the bytes of the reads so far.
    delivered: u64,
}

impl Simulation {
    /// Prepares a simulation; nothing else but `config` decides its course.
    pub fn new(config: Config) -> Self {
        let packets = packets(config);
        Simulation { reader: Reader::new(packets, config.scenario, stage(config, 5)), delivered: 0 }
    }

    /// Hands over the frames that the reads so far have brought to an end, or lost, in stream order.
    ///
    /// Each frame is handed over once; until then it is kept.
    pub fn take_truth(&mut self) -> Vec<TruthFrame> {
        let truth = &mut self.reader.packets.tap.truth;
        let done = truth.iter().take_while(|frame| frame.end <= self.delivered).count();
        truth.drain(..done).collect()
    }
}

/// Starts the random numbers of a stage: a change in one stage leaves the others as they are.
fn stage(config: Config, stage: u64) -> Random {
    Random::new(config.seed, stage)
}

/// Joins all stages up to the host's queue.
fn packets(config: Config) -> Packets {
    let Config { line, adapter, scenario, .. } = config;
    Packets::new(tap(config), adapter, scenario, line, stage(config, 4))
}

/// Joins all stages up to the receiver of the tap.
pub(super) fn tap(config: Config) -> Tap {
    let Config { frames, line, scenario, .. } = config;
    let random = stage(config, 1);
    let traffic = match scenario.equipment {
        Equipment::Generic => Traffic::Generic(Generic::new(random, scenario, line)),
        Equipment::Installation => Traffic::Installation(Box::new(Installation::new(random, false, EPOCH))),
        Equipment::RunningInstallation => {
            Traffic::Installation(Box::new(Installation::new(random, true, EPOCH)))
        }
        Equipment::Script(script) => Traffic::Scripted(Box::new(Scripted::new(script, random, EPOCH))),
    };
    let bus = Bus::new(traffic, scenario, line, stage(config, 2), EPOCH, frames);
    Tap::new(bus, scenario, line, stage(config, 3))
}

impl Iterator for Simulation {
    type Item = Read;

    fn next(&mut self) -> Option<Read> {
        let read = self.reader.next()?;
        self.delivered += read.bytes.len() as u64;
        Some(read)
    }
}

#[cfg(test)]
mod tests;
