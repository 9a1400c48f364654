//! The master of the installation: it sets three sensors up, then polls them as their manuals ask.
//!
//! Dissolved oxygen at address 1, conductivity at 2, the sonde at 3. The conductivity probe comes with
//! address 20 and is found by the service address while it is alone on the bus.

use std::collections::VecDeque;

use crate::simulate::adu::{two_words, write};
use crate::simulate::random::Random;
use crate::simulate::sensor::{Model, SERVICE_ADDRESS, Sensor, bcd_time};
use crate::simulate::traffic::Exchange;
use crate::time::{MILLISECOND, SECOND, Timestamp};

const OXYGEN: u8 = 1;
const CONDUCTIVITY: u8 = 2;
const SONDE: u8 = 3;
/// The address the conductivity probe has before it is set up; the manuals' example of a new address.
const OLD_ADDRESS: u8 = 20;

/// The step that stops the conductivity probe, and the one that starts it again.
const CONDUCTIVITY_STOP: u32 = 90;
const CONDUCTIVITY_START: u32 = 91;

/// Is a sensor's turn in the polling plan.
#[derive(Clone, Copy, Debug)]
struct Duty {
    address: u8,
    /// Counts the steps of a round.
    step: u32,
    due: Timestamp,
}

/// Plans the exchanges of the installation.
pub(super) struct Installation {
    sensors: [Sensor; 3],
    script: VecDeque<Vec<u8>>,
    duties: [Duty; 3],
    random: Random,
}

impl Installation {
    /// Starts with setting the sensors up, or, when they are running, with asking who they are.
    pub(super) fn new(random: Random, running: bool, start: Timestamp) -> Self {
        let conductivity = if running { CONDUCTIVITY } else { OLD_ADDRESS };
        let mut script = if running { VecDeque::new() } else { address_script() };
        script.extend(identity_script(start));
        let duty = |address, step, due| Duty { address, step, due };
        Installation {
            sensors: [
                Sensor::new(Model::Oxygen, OXYGEN),
                Sensor::new(Model::Conductivity, conductivity),
                Sensor::new(Model::Sonde, SONDE),
            ],
            duties: [
                duty(OXYGEN, 0, start),
                duty(CONDUCTIVITY, if running { 0 } else { CONDUCTIVITY_START }, start + SECOND),
                duty(SONDE, 0, start + 2 * SECOND),
            ],
            script,
            random,
        }
    }

    /// Plans the next exchange: the script to its end, then whatever is due first.
    pub(super) fn next(&mut self, now: Timestamp) -> Exchange {
        let ready = self.ready(now);
        if let Some(request) = self.script.pop_front() {
            return self.exchange(ready, request);
        }
        let mut first = 0;
        for (index, duty) in self.duties.iter().enumerate() {
            if duty.due < self.duties[first].due {
                first = index;
            }
        }
        let duty = self.duties[first];
        let start = ready.max(duty.due);
        let (request, pause, steps) = match duty.address {
            OXYGEN => oxygen_step(duty.step),
            CONDUCTIVITY => conductivity_step(duty.step),
            _ => sonde_step(duty.step),
        };
        self.duties[first] = Duty { step: (duty.step + 1) % steps, due: start + pause, ..duty };
        self.exchange(start, request)
    }

    /// Returns when the master can ask after it has been busy until now.
    pub(super) fn ready(&mut self, now: Timestamp) -> Timestamp {
        now + self.random.range(8 * MILLISECOND, 25 * MILLISECOND)
    }

    /// Lets the sensors answer; the turn-around is the sensor's own (up to 42 ms were seen on a real bus).
    fn exchange(&mut self, start: Timestamp, request: Vec<u8>) -> Exchange {
        let mut found = (None, Model::Oxygen);
        for sensor in &mut self.sensors {
            // Whoever would answer 0xFF besides the conductivity probe is not connected yet.
            if let Some(response) = sensor.answer(&request, start, &mut self.random) {
                found = (Some(response), sensor.model);
                break;
            }
        }
        let (response, model) = found;
        let usual = match model {
            Model::Oxygen => 14 * MILLISECOND,
            Model::Conductivity => 23 * MILLISECOND,
            Model::Sonde => 35 * MILLISECOND,
        };
        let latency = self.random.times(usual, 0.9, 1.15);
        Exchange { start, request, response, latency, weak: model == Model::Conductivity }
    }
}

/// Finds the conductivity probe, moves it to its place, and looks whether it is there.
fn address_script() -> VecDeque<Vec<u8>> {
    VecDeque::from([
        two_words(SERVICE_ADDRESS, 0x03, 0x3000, 1),
        write(OLD_ADDRESS, 0x10, 0x3000, 1, &[CONDUCTIVITY, 0]),
        two_words(SERVICE_ADDRESS, 0x03, 0x3000, 1),
    ])
}

/// Asks all sensors who they are and how they are set, and sets the sonde's clock.
fn identity_script(now: Timestamp) -> [Vec<u8>; 12] {
    let read = |address, start, quantity| two_words(address, 0x03, start, quantity);
    [
        read(CONDUCTIVITY, 0x0900, 7),
        read(CONDUCTIVITY, 0x0700, 2),
        read(CONDUCTIVITY, 0x1100, 4),
        read(OXYGEN, 0x0900, 7),
        read(OXYGEN, 0x0700, 2),
        read(OXYGEN, 0x1100, 4),
        read(SONDE, 0x1400, 6),
        read(SONDE, 0x0800, 1),
        read(SONDE, 0x0E00, 1),
        write(SONDE, 0x10, 0x1300, 4, &bcd_time(now)),
        read(SONDE, 0x1300, 4),
        read(SONDE, 0x1E00, 2),
    ]
}

/// Returns a step of a round with the pause before the next, and how many steps a round has.
///
/// Start, at least a second, ten readings a good second apart, stop (manual of the probe, section 3).
fn oxygen_step(step: u32) -> (Vec<u8>, i64, u32) {
    let (start, quantity, pause) = match step {
        0 => (0x2500, 0, 1200 * MILLISECOND),
        1..=10 => (0x2600, 4, 1100 * MILLISECOND),
        _ => (0x2E00, 0, 48 * SECOND),
    };
    (two_words(OXYGEN, 0x03, start, quantity), pause, 12)
}

/// Returns a step of a round with the pause before the next, and how many steps a round has.
///
/// Readings every 3 s (manual, section 3); every five minutes stop, start and ten seconds of warm-up.
fn conductivity_step(step: u32) -> (Vec<u8>, i64, u32) {
    match step {
        0..=89 => (two_words(CONDUCTIVITY, 0x03, 0x2600, 5), 3100 * MILLISECOND, 92),
        CONDUCTIVITY_STOP => (two_words(CONDUCTIVITY, 0x03, 0x2E00, 1), SECOND, 92),
        _ => (write(CONDUCTIVITY, 0x10, 0x1C00, 0, &[]), 11 * SECOND, 92),
    }
}

/// Returns a step of a round with the pause before the next, and how many steps a round has.
///
/// All values once a minute (manual, section 3) with the error flag before; every fifth minute the brush,
/// with 40 s until the next reading, and what else the sonde tells.
fn sonde_step(step: u32) -> (Vec<u8>, i64, u32) {
    let read = |start, quantity| two_words(SONDE, 0x03, start, quantity);
    let soon = 100 * MILLISECOND;
    match step {
        0 | 2 | 4 | 6 | 8 => (read(0x0800, 1), soon, 14),
        1 | 3 | 5 | 7 => (read(0x2601, 16), 61 * SECOND, 14),
        9 => (read(0x2601, 16), 20 * SECOND, 14),
        10 => (read(0x1E00, 2), soon, 14),
        11 => (read(0x1300, 4), soon, 14),
        12 => (read(0x0E00, 1), soon, 14),
        _ => (write(SONDE, 0x10, 0x2F00, 0, &[]), 41 * SECOND, 14),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_request_is_answered_and_measurements_keep_the_manuals_distance() {
        let mut installation = Installation::new(Random::new(5, 0), false, Timestamp::default());
        let mut now = Timestamp::default();
        let mut last = [Timestamp::MIN; 4];
        for _ in 0..2000 {
            let exchange = installation.next(now);
            assert!(exchange.start > now);
            assert!(exchange.response.is_some(), "{:02X?}", exchange.request);
            now = exchange.start;
            let address = exchange.request[0] as usize;
            if exchange.request[2] == 0x26 {
                let least = [0, 1, 3, 60][address] * SECOND;
                assert!(now - last[address] >= least, "address {address} polled too fast");
                last[address] = now;
            }
        }
        assert!(last.iter().skip(1).all(|time| *time > Timestamp::default()), "all three are polled");
    }

    #[test]
    fn the_service_address_is_used_only_while_one_sensor_is_on_the_bus() {
        let mut installation = Installation::new(Random::new(5, 0), false, Timestamp::default());
        let mut now = Timestamp::default();
        let addresses: Vec<u8> = (0..500)
            .map(|_| {
                let exchange = installation.next(now);
                now = exchange.start;
                exchange.request[0]
            })
            .collect();
        assert_eq!(addresses[..4], [SERVICE_ADDRESS, OLD_ADDRESS, SERVICE_ADDRESS, CONDUCTIVITY]);
        assert!(addresses[4..].iter().all(|address| [OXYGEN, CONDUCTIVITY, SONDE].contains(address)));
    }
}
