//! Masters as data: what one asks, and how long it waits, for a bus with sensors of the manuals.

use crate::simulate::adu::{adu, two_words, write};
use crate::simulate::random::Random;
use crate::simulate::sensor::{Sensor, bcd_time};
use crate::simulate::traffic::Exchange;
use crate::time::{MILLISECOND, SECOND, Timestamp};

pub use crate::simulate::sensor::{Fault, Model};

/// Is a sensor on a scripted bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fitted {
    /// What it is.
    pub model: Model,
    /// Its unit address.
    pub address: u8,
    /// What is wrong with it.
    pub fault: Fault,
}

/// Is what a master sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
    /// Function 3: address, start register, quantity.
    Read(u8, u16, u16),
    /// Function 16: address, start register, quantity, data.
    Write(u8, u16, u16, &'static [u8]),
    /// Any function: address, function, what follows; the CRC is right.
    Any(u8, u8, &'static [u8]),
    /// These bytes, whatever they are.
    Bytes(&'static [u8]),
    /// Sets the clock of the sonde at an address.
    SetTime(u8),
}

/// Is a step of a master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// What it sends.
    pub ask: Ask,
    /// From its start to that of the next, at least, in milliseconds.
    pub next_ms: i64,
}

/// Is what a master does on a bus with these sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Script {
    /// Who answers.
    pub sensors: &'static [Fitted],
    /// What is done at first.
    pub once: &'static [Step],
    /// What is done again and again.
    pub cycle: &'static [Step],
}

const fn fitted(model: Model, address: u8) -> Fitted {
    Fitted { model, address, fault: Fault::None }
}

const fn read(address: u8, register: u16, quantity: u16, next_ms: i64) -> Step {
    Step { ask: Ask::Read(address, register, quantity), next_ms }
}

const fn put(address: u8, register: u16, quantity: u16, data: &'static [u8], next_ms: i64) -> Step {
    Step { ask: Ask::Write(address, register, quantity, data), next_ms }
}

const OXYGEN: u8 = 1;
const CONDUCTIVITY: u8 = 2;
const SONDE: u8 = 3;

/// Start, a second, ten reads a good second apart, stop: the procedure of the dissolved oxygen manual, section 3.
pub static GOOD_OXYGEN: Script = Script {
    sensors: &[fitted(Model::Oxygen, OXYGEN)],
    once: &[read(OXYGEN, 0x0900, 7, 200), read(OXYGEN, 0x0700, 2, 200), read(OXYGEN, 0x1100, 4, 200)],
    cycle: &[
        read(OXYGEN, 0x2500, 0, 1200),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2600, 4, 1100),
        read(OXYGEN, 0x2E00, 0, 8000),
    ],
};

/// Start, ten seconds, reads 3 s apart, stop: the procedure of the conductivity manual, section 3.
pub static GOOD_CONDUCTIVITY: Script = Script {
    sensors: &[fitted(Model::Conductivity, CONDUCTIVITY)],
    once: &[read(CONDUCTIVITY, 0x0900, 7, 200), read(CONDUCTIVITY, 0x0700, 2, 200)],
    cycle: &[
        put(CONDUCTIVITY, 0x1C00, 0, &[], 11_000),
        read(CONDUCTIVITY, 0x2600, 5, 3100),
        read(CONDUCTIVITY, 0x2600, 5, 3100),
        read(CONDUCTIVITY, 0x2600, 5, 3100),
        read(CONDUCTIVITY, 0x2600, 5, 3100),
        read(CONDUCTIVITY, 0x2600, 5, 3100),
        read(CONDUCTIVITY, 0x2E00, 1, 5000),
    ],
};

/// All values once a minute, and now and then the brush: the procedure of the multi-parameter manual, section 3.
pub static GOOD_SONDE: Script = Script {
    sensors: &[fitted(Model::Sonde, SONDE)],
    once: &[
        read(SONDE, 0x1400, 6, 200),
        Step { ask: Ask::SetTime(SONDE), next_ms: 200 },
        put(SONDE, 0x0E00, 1, &[60, 0], 200),
    ],
    cycle: &[
        read(SONDE, 0x0800, 1, 100),
        read(SONDE, 0x2601, 16, 20_000),
        read(SONDE, 0x1300, 4, 100),
        read(SONDE, 0x0E00, 1, 100),
        read(SONDE, 0x1E00, 2, 100),
        put(SONDE, 0x2F00, 0, &[], 41_000),
    ],
};

/// The three manuals' procedures in turn, on one bus.
pub static GOOD_MASTER: Script = Script {
    sensors: &[
        fitted(Model::Oxygen, OXYGEN),
        fitted(Model::Conductivity, CONDUCTIVITY),
        fitted(Model::Sonde, SONDE),
    ],
    once: &[
        read(OXYGEN, 0x0900, 7, 200),
        read(CONDUCTIVITY, 0x0900, 7, 200),
        read(SONDE, 0x1400, 6, 200),
        Step { ask: Ask::SetTime(SONDE), next_ms: 200 },
        put(CONDUCTIVITY, 0x1C00, 0, &[], 11_000),
    ],
    cycle: &[
        read(OXYGEN, 0x2500, 0, 1200),
        read(OXYGEN, 0x2600, 4, 500),
        read(CONDUCTIVITY, 0x2600, 5, 700),
        read(OXYGEN, 0x2600, 4, 1200),
        read(OXYGEN, 0x2600, 4, 1200),
        read(OXYGEN, 0x2600, 4, 500),
        read(CONDUCTIVITY, 0x2600, 5, 700),
        read(OXYGEN, 0x2E00, 0, 500),
        read(SONDE, 0x0800, 1, 200),
        read(SONDE, 0x2601, 16, 20_000),
        read(SONDE, 0x1300, 4, 200),
        put(SONDE, 0x2F00, 0, &[], 41_000),
    ],
};

/// The same bus with a master that gets most things wrong that the field has seen.
pub static MISTAKEN_MASTER: Script = Script {
    sensors: GOOD_MASTER.sensors,
    once: &[
        read(OXYGEN, 0x0900, 7, 200),
        read(CONDUCTIVITY, 0x0900, 7, 200),
        read(SONDE, 0x1400, 6, 200),
        // The serial number where single probes have it, four times.
        read(SONDE, 0x0900, 7, 600),
        read(SONDE, 0x0900, 7, 600),
        read(SONDE, 0x0900, 7, 600),
        read(SONDE, 0x0900, 7, 600),
        // An interval of 30 minutes with its bytes swapped, and a clock in plain binary.
        put(SONDE, 0x0E00, 1, &[0, 30], 300),
        put(SONDE, 0x1300, 4, &[17, 5, 13, 29, 0x1A, 0, 26, 0], 300),
        // Calibration: K alone, then K of 0.
        put(OXYGEN, 0x1100, 2, &[0, 0, 0x80, 0x3F], 600),
        read(OXYGEN, 0x1100, 4, 300),
        put(OXYGEN, 0x1100, 4, &[0, 0, 0, 0, 0, 0, 0, 0], 300),
        // The service address with three sensors there, a start by the wrong command, and a write to all.
        read(0xFF, 0x3000, 1, 600),
        read(CONDUCTIVITY, 0x2500, 0, 600),
        put(0, 0x2F00, 0, &[], 600),
        // A read without a start, and the start without its byte count, and with the CRC that it would have then.
        read(OXYGEN, 0x2600, 4, 1500),
        Step { ask: Ask::Bytes(&[2, 16, 0x1C, 0, 0, 0, 0xEB, 0x92]), next_ms: 600 },
    ],
    cycle: &[
        // Never started, read twice a second, with function 4 in between, and one register beside.
        read(OXYGEN, 0x2600, 4, 500),
        read(OXYGEN, 0x2600, 4, 500),
        Step { ask: Ask::Any(OXYGEN, 4, &[0x26, 0, 0, 4]), next_ms: 600 },
        read(OXYGEN, 0x25FF, 4, 600),
        // Too few registers: the flag is lost.
        read(CONDUCTIVITY, 0x2600, 4, 3200),
        // The brush by function 6, then right, and a read during its sweep; the interval is rewritten every time.
        Step { ask: Ask::Any(SONDE, 6, &[0x2F, 0, 0, 1]), next_ms: 600 },
        put(SONDE, 0x2F00, 0, &[], 4000),
        read(SONDE, 0x2601, 16, 5000),
        put(SONDE, 0x0E00, 1, &[30, 0], 1000),
        // Read after a stop.
        read(OXYGEN, 0x2E00, 0, 1000),
        read(OXYGEN, 0x2600, 4, 1200),
    ],
};

/// Plays a script.
pub(super) struct Scripted {
    script: &'static Script,
    sensors: Vec<Sensor>,
    at: usize,
    due: Timestamp,
    random: Random,
}

impl Scripted {
    pub(super) fn new(script: &'static Script, random: Random, start: Timestamp) -> Self {
        let sensor = |fitted: &Fitted| Sensor::new(fitted.model, fitted.address).with(fitted.fault);
        let sensors = script.sensors.iter().map(sensor).collect();
        Scripted { script, sensors, at: 0, due: start, random }
    }

    /// Plans the next step.
    pub(super) fn next(&mut self, now: Timestamp) -> Exchange {
        let (once, cycle) = (self.script.once, self.script.cycle);
        let idle = Step { ask: Ask::Read(1, 0, 1), next_ms: 60_000 };
        let step = match self.at.checked_sub(once.len()) {
            None => once[self.at], // `at` is within
            Some(at) => cycle.get(at % cycle.len().max(1)).copied().unwrap_or(idle),
        };
        self.at += 1;
        let start = self.ready(now).max(self.due);
        self.due = start + step.next_ms.saturating_mul(MILLISECOND);
        let request = request(step.ask, start);
        let random = &mut self.random;
        let response = self.sensors.iter_mut().find_map(|sensor| sensor.answer(&request, start, random));
        let latency = self.random.times(20 * MILLISECOND, 0.9, 1.3);
        Exchange { start, request, response, latency, weak: false }
    }

    /// Returns when the master can ask after it has been busy until now.
    pub(super) fn ready(&mut self, now: Timestamp) -> Timestamp {
        now + self.random.range(8 * MILLISECOND, 25 * MILLISECOND)
    }
}

fn request(ask: Ask, now: Timestamp) -> Vec<u8> {
    match ask {
        Ask::Read(address, register, quantity) => two_words(address, 3, register, quantity),
        Ask::Write(address, register, quantity, data) => write(address, 16, register, quantity, data),
        Ask::Any(address, function, rest) => adu(address, function, rest),
        Ask::Bytes(bytes) => bytes.to_vec(),
        Ask::SetTime(address) => write(address, 16, 0x1300, 4, &bcd_time(now)),
    }
}

/// How long a sensor is dead that lost its power.
pub(super) const DEAD_NS: i64 = 20 * SECOND;

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays an hour; returns how many requests were answered, and how many not.
    fn play(script: &'static Script) -> (usize, usize) {
        let start = Timestamp::default();
        let mut scripted = Scripted::new(script, Random::new(1, 0), start);
        let (mut now, mut counts) = (start, (0, 0));
        while now < start + 3600 * SECOND {
            let exchange = scripted.next(now);
            now = exchange.start;
            if exchange.response.is_some() { counts.0 += 1 } else { counts.1 += 1 }
        }
        counts
    }

    #[test]
    fn good_masters_are_always_answered_and_a_mistaken_one_is_not() {
        for script in [&GOOD_OXYGEN, &GOOD_CONDUCTIVITY, &GOOD_SONDE, &GOOD_MASTER] {
            let (answered, unanswered) = play(script);
            assert!(answered > 200 && unanswered == 0, "{answered} {unanswered}");
        }
        let (answered, unanswered) = play(&MISTAKEN_MASTER);
        assert!(answered > 500 && unanswered > 300, "{answered} {unanswered}");
    }
}
