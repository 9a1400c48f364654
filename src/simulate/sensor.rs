//! The three sensors of the manuals, as far as a master uses them: a request in, a response out.
//!
//! Floats and intervals are sent least significant byte first, a read of zero registers is a command,
//! and the stop of the conductivity probe is acknowledged with two uncounted bytes, all as the manuals print it.

use chrono::{DateTime, Datelike, Timelike};

use crate::simulate::adu::{adu, counted, two_words};
use crate::simulate::random::Random;
use crate::simulate::script::DEAD_NS;
use crate::simulate::water::Water;
use crate::time::{SECOND, Timestamp};

/// The address at which a sensor answers whatever its own is (conductivity manual, 2.2.9).
pub(super) const SERVICE_ADDRESS: u8 = 0xFF;

/// Names a sensor by its manual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Optical dissolved oxygen, software 5.7.
    Oxygen,
    /// Conductivity, software 1.8.
    Conductivity,
    /// Multi-parameter sonde, software 1.6.
    Sonde,
}

/// Names what is wrong with a sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    #[default]
    None,
    /// It loses its power when the brush starts.
    WeakSupply,
    /// Its first value after the temperature is infinite.
    Infinite,
    /// Its driver is enabled too late: the first byte of an answer is lost.
    LateDriver,
}

/// Is a sensor with its settings.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    pub(super) model: Model,
    pub(super) address: u8,
    /// `YL`, two digits of the type, six of the date, two of the piece.
    pub(super) serial_number: [u8; 12],
    /// In minutes.
    brush_interval: u16,
    fault: Fault,
    /// Whether it measures; an oxygen probe does only after its start.
    measures: bool,
    /// What it measured last.
    stale: Vec<u8>,
    /// Until when it has no power.
    dead_until: Timestamp,
    /// When its clock began at 2000-01-01, if it lost its power.
    clock_from: Option<Timestamp>,
}

impl Sensor {
    /// Makes a sensor with factory settings but for its address.
    pub(super) fn new(model: Model, address: u8) -> Self {
        let serial_number = *match model {
            Model::Oxygen => b"YL0119052307",
            Model::Conductivity => b"YL0918110612",
            Model::Sonde => b"YL3819082103",
        };
        Sensor {
            model,
            address,
            serial_number,
            brush_interval: 30,
            fault: Fault::None,
            measures: model != Model::Oxygen,
            stale: Vec::new(),
            dead_until: Timestamp::MIN,
            clock_from: None,
        }
    }

    /// Gives it a fault.
    pub(super) fn with(self, fault: Fault) -> Self {
        Sensor { fault, ..self }
    }

    /// Answers a request; `None` when it is not for this sensor or not in its manual.
    pub(super) fn answer(&mut self, request: &[u8], time: Timestamp, random: &mut Random) -> Option<Vec<u8>> {
        let &[address, function, s1, s0, q1, q0, ref rest @ ..] = request else { return None };
        if address != self.address && address != SERVICE_ADDRESS {
            return None;
        }
        let (start, quantity) = (u16::from_be_bytes([s1, s0]), u16::from_be_bytes([q1, q0]));
        if time < self.dead_until {
            return None;
        }
        let mut answer = match function {
            0x03 => self.read(address, start, quantity, time, random),
            0x10 => {
                let is_known = self.write(start, quantity, rest, time);
                is_known.then(|| two_words(address, function, start, quantity))
            }
            _ => None,
        }?;
        if self.fault == Fault::LateDriver && function == 0x03 && quantity > 3 {
            answer.remove(0); // an ADU has an address
        }
        Some(answer)
    }

    /// Answers a read.
    fn read(
        &mut self,
        address: u8,
        start: u16,
        quantity: u16,
        time: Timestamp,
        random: &mut Random,
    ) -> Option<Vec<u8>> {
        use Model::{Conductivity, Oxygen, Sonde};
        if matches!((self.model, start), (Oxygen, 0x2500 | 0x2E00) | (Conductivity, 0x2E00)) {
            self.measures = start == 0x2500;
        }
        let data: &[u8] = match (self.model, start, quantity) {
            (Oxygen, 0x2500 | 0x2E00, 0) => &[],
            (Conductivity, 0x2E00, 1) => return Some(adu(address, 0x03, &[0, 0, 0])), // count 0, two bytes
            (Oxygen | Conductivity, 0x0900, 7) => &self.serial_with_type(),
            (Oxygen, 0x0700, 2) => &[2, 0, 5, 7],
            (Conductivity, 0x0700, 2) => &[1, 0, 1, 8],
            (Oxygen | Conductivity, 0x1100, 4) => &floats([1.0, 0.0]),
            (Conductivity, 0x3000, 1) => &[self.address, 0],
            (Sonde, 0x1400, 6) => &self.serial_number,
            (Sonde, 0x0800, 1) => &[0, 0],
            (Sonde, 0x0E00, 1) => &self.brush_interval.to_le_bytes(),
            (Sonde, 0x1300, 4) => &bcd_time(self.clock(time)),
            (Sonde, 0x1E00, 2) => &floats([rounded(Water::at(time, random).supply_voltage, 100.0)]),
            (_, 0x2600 | 0x2601, _) => {
                return self.measurement(start, quantity, time, random).map(|d| counted(address, 0x03, &d));
            }
            _ => return None,
        };
        Some(counted(address, 0x03, data))
    }

    /// Returns what the sensor measures, as its manual orders it.
    fn measurement(
        &mut self,
        start: u16,
        quantity: u16,
        time: Timestamp,
        random: &mut Random,
    ) -> Option<Vec<u8>> {
        if !self.measures && self.stale.len() == 2 * usize::from(quantity) {
            return Some(self.stale.clone());
        }
        let water = Water::at(time, random);
        let temperature = rounded(water.temperature, 100.0);
        let mut data = match (self.model, start, quantity) {
            (Model::Oxygen, 0x2600, 4) => floats([temperature, rounded(water.do_saturation, 1e4)]).to_vec(),
            (Model::Conductivity, 0x2600, 4) => {
                floats([temperature, rounded(water.conductivity, 1e4)]).to_vec()
            }
            (Model::Conductivity, 0x2600, 5) => {
                let mut data = floats([temperature, rounded(water.conductivity, 1e4)]).to_vec();
                data.extend([0, 0]); // no error; reserved
                data
            }
            (Model::Sonde, 0x2601, 16) => floats([
                rounded(water.do_mg_l, 1e3),
                rounded(water.turbidity, 100.0),
                rounded(water.conductivity, 1e4),
                rounded(water.ph, 1e3),
                temperature,
                rounded(water.orp, 10.0),
                rounded(water.chlorophyll, 100.0),
                rounded(water.bga, 1.0),
            ])
            .to_vec(),
            _ => return None,
        };
        if let (Fault::Infinite, Some(value)) = (self.fault, data.get_mut(4..8)) {
            value.copy_from_slice(&f32::INFINITY.to_le_bytes());
        }
        self.stale.clone_from(&data);
        Some(data)
    }

    /// Returns what the sensor's clock shows.
    fn clock(&self, now: Timestamp) -> Timestamp {
        /// 2000-01-01T00:00:00Z.
        const BEGIN: Timestamp = Timestamp::from_ns(946_684_800 * SECOND);
        self.clock_from.map_or(now, |from| BEGIN + (now - from))
    }

    /// Carries out a write; tells whether the sensor knows it.
    fn write(&mut self, start: u16, quantity: u16, rest: &[u8], time: Timestamp) -> bool {
        match (self.model, start, quantity, rest) {
            (_, 0x3000, 1, &[2, new @ 1..=247, ..]) => self.address = new,
            (Model::Sonde, 0x0E00, 1, &[2, low, high, ..]) => {
                self.brush_interval = u16::from_le_bytes([low, high]);
            }
            (Model::Sonde, 0x1300, 4, _) => self.clock_from = None,
            (Model::Sonde, 0x2F00, 0, _) if self.fault == Fault::WeakSupply => {
                self.dead_until = time + DEAD_NS;
                self.clock_from = Some(time);
                self.brush_interval = 30;
            }
            (Model::Sonde, 0x2F00, 0, _) => {}
            (Model::Oxygen | Model::Conductivity, 0x1100, 4, &[8, ..]) => {}
            (Model::Conductivity, 0x1C00, 0, _) => self.measures = true,
            _ => return false,
        }
        true
    }

    /// Returns the serial number as single probes send it: the type in BCD, the 12 characters, a zero.
    fn serial_with_type(&self) -> [u8; 14] {
        let mut data = [0; 14];
        data[0] = (self.serial_number[2] & 0x0F) << 4 | self.serial_number[3] & 0x0F;
        data[1..13].copy_from_slice(&self.serial_number);
        data
    }
}

/// Rounds to a resolution as the sensors' displays have it.
fn rounded(value: f64, steps: f64) -> f32 {
    ((value * steps).round() / steps) as f32
}

/// Writes floats least significant byte first.
fn floats<const N: usize>(values: [f32; N]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Writes a time as the sonde has it: second, minute, hour, day, month, 0, year, 0, in BCD (manual, 2.2.6).
pub(super) fn bcd_time(time: Timestamp) -> [u8; 8] {
    let bcd = |n: u32| (((n / 10 % 10) << 4) | (n % 10)) as u8;
    let at = DateTime::from_timestamp_nanos(time.as_ns());
    let year = at.year().rem_euclid(100).unsigned_abs();
    [bcd(at.second()), bcd(at.minute()), bcd(at.hour()), bcd(at.day()), bcd(at.month()), 0, bcd(year), 0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::adu::write;

    /// 2016-04-26T13:05:17Z, the time in the sonde's manual.
    const MANUAL_TIME: Timestamp = Timestamp::from_ns(1_461_675_917_000_000_000);

    fn hex(text: &str) -> Vec<u8> {
        text.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
    }

    fn asks(sensor: &mut Sensor, request: &str) -> Option<Vec<u8>> {
        sensor.answer(&hex(request), MANUAL_TIME, &mut Random::new(1, 0))
    }

    #[test]
    fn the_oxygen_probe_answers_as_its_manual_prints() {
        let mut probe = Sensor::new(Model::Oxygen, 1);
        for (request, response) in [
            ("01 03 25 00 00 00 4E C6", "01 03 00 20 F0"),
            ("01 03 2E 00 00 00 4C E2", "01 03 00 20 F0"),
            ("01 03 07 00 00 02 C5 7F", "01 03 04 02 00 05 07 B9 19"),
            ("01 03 11 00 00 04 41 35", "01 03 08 00 00 80 3F 00 00 00 00 9E 12"),
            ("01 10 30 00 00 01 02 14 00 99 53", "01 10 30 00 00 01 0E C9"),
        ] {
            assert_eq!(asks(&mut probe, request), Some(hex(response)), "{request}");
        }
        assert_eq!(probe.address, 0x14, "the new address holds from the next request on");
    }

    #[test]
    fn the_conductivity_probe_answers_as_its_manual_prints() {
        let mut probe = Sensor::new(Model::Conductivity, 3);
        assert_eq!(asks(&mut probe, "FF 03 30 00 00 01 9E D4"), Some(hex("FF 03 02 03 00 91 60")));
        probe.address = 1;
        for (request, response) in [
            ("01 10 1C 00 00 00 00 D8 92", "01 10 1C 00 00 00 C7 99"),
            ("01 03 2E 00 00 01 8D 22", "01 03 00 00 00 19 84"),
            ("01 03 11 00 00 04 41 35", "01 03 08 00 00 80 3F 00 00 00 00 9E 12"),
        ] {
            assert_eq!(asks(&mut probe, request), Some(hex(response)), "{request}");
        }
    }

    #[test]
    fn the_sonde_answers_as_its_manual_prints() {
        let mut sonde = Sensor::new(Model::Sonde, 1);
        for (request, response) in [
            ("01 03 08 00 00 01 86 6A", "01 03 02 00 00 B8 44"),
            ("01 03 0E 00 00 01 86 E2", "01 03 02 1E 00 B1 E4"),
            ("01 10 0E 00 00 01 02 0A 00 4F 30", "01 10 0E 00 00 01 03 21"),
            ("01 10 13 00 00 04 08 17 05 13 26 04 00 16 00 9C F7", "01 10 13 00 00 04 C5 4E"),
            ("01 03 13 00 00 04 40 8D", "01 03 08 17 05 13 26 04 00 16 00 84 09"),
            ("01 10 2F 00 00 00 00 DC 96", "01 10 2F 00 00 00 C8 DD"),
        ] {
            assert_eq!(asks(&mut sonde, request), Some(hex(response)), "{request}");
        }
        assert_eq!(write(1, 0x10, 0x1300, 4, &bcd_time(MANUAL_TIME))[7..15], hex("17 05 13 26 04 00 16 00"));
    }

    #[test]
    fn a_serial_number_comes_after_its_type() {
        // A real probe's answer: lead byte 09, not the 00 of the manual.
        let mut probe = Sensor::new(Model::Conductivity, 1);
        probe.serial_number = *b"YL0916112101";
        let real = hex("01 03 0E 09 59 4C 30 39 31 36 31 31 32 31 30 31 00 D9 90");
        assert_eq!(asks(&mut probe, "01 03 09 00 00 07 07 94"), Some(real));
    }

    #[test]
    fn what_the_manual_does_not_have_is_not_answered() {
        let mut sonde = Sensor::new(Model::Sonde, 1);
        assert_eq!(asks(&mut sonde, "01 03 09 00 00 07 07 94"), None, "the register of the single probes");
        assert_eq!(asks(&mut sonde, "02 03 08 00 00 01 86 59"), None, "another address");
        assert_eq!(asks(&mut sonde, "01 04 26 01 00 10"), None, "another function");
        assert_eq!(asks(&mut sonde, "01"), None);
    }
}
