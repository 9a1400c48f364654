//! A generic bus: units of any make with random poll maps, and a master that uses all common functions.

use crate::line::LineSettings;
use crate::simulate::adu::{adu, checksum, counted, sealed, two_words, write};
use crate::simulate::random::Random;
use crate::simulate::scenario::{Pace, Scenario};
use crate::simulate::sensor::SERVICE_ADDRESS;
use crate::simulate::traffic::{Exchange, RESPONSE_TIMEOUT};
use crate::time::{MILLISECOND, Timestamp};

/// Units have addresses from 1 to this.
const HIGHEST_ADDRESS: i64 = 40;
/// The share of reads in what a master does (study of framing, simulator).
const READS: f64 = 0.8;

/// Is a block of registers or coils that the master reads again and again.
struct Poll {
    function: u8,
    start: u16,
    quantity: u16,
    /// Whether its registers hold small numbers, as counters and states do.
    small: bool,
}

/// Is a unit on the bus.
struct Unit {
    address: u8,
    /// What it usually takes to answer, in nanoseconds.
    usual_latency: i64,
    polls: Vec<Poll>,
}

/// A request with what the unit says to it.
type Dialogue = (Vec<u8>, Option<Vec<u8>>);

/// Plans the exchanges of a generic bus.
pub(super) struct Generic {
    units: Vec<Unit>,
    vendor_functions: [u8; 2],
    scenario: Scenario,
    line: LineSettings,
    random: Random,
}

impl Generic {
    /// Draws the units and their poll maps.
    pub(super) fn new(mut random: Random, scenario: Scenario, line: LineSettings) -> Self {
        let mut generic = Generic {
            units: Vec::new(),
            // User-defined function codes are 65 to 72 and 100 to 110 (Modbus V1.1b3, section 5).
            vendor_functions: [random.range(65, 72) as u8, random.range(100, 110) as u8],
            scenario,
            line,
            random,
        };
        for _ in 0..generic.random.range(1, 4) {
            let address = generic.free_address();
            let usual_latency = generic.random.range(3 * MILLISECOND, 30 * MILLISECOND);
            let polls = (0..generic.random.range(3, 7)).map(|_| Poll::draw(&mut generic.random)).collect();
            generic.units.push(Unit { address, usual_latency, polls });
        }
        generic
    }

    /// Draws an address that no unit has.
    fn free_address(&mut self) -> u8 {
        loop {
            let address = self.random.range(1, HIGHEST_ADDRESS) as u8;
            if self.units.iter().all(|unit| unit.address != address) {
                return address;
            }
        }
    }

    /// Plans the next exchange.
    pub(super) fn next(&mut self, now: Timestamp) -> Exchange {
        let index = self.random.range(0, self.units.len() as i64 - 1) as usize;
        let (request, response) = if self.random.chance(self.scenario.vendor) {
            self.vendor(index)
        } else if self.random.chance(READS) {
            self.read(index)
        } else {
            self.other(index)
        };
        let start = now + self.pause();
        let latency = self.latency(index);
        // With one unit, that one is the weak one.
        Exchange { start, request, response, latency, weak: index == 1.min(self.units.len() - 1) }
    }

    /// Draws the master's pause before its next request.
    pub(super) fn pause(&mut self) -> i64 {
        let t3_5 = self.line.t3_5_ns();
        match self.scenario.pace {
            Pace::Tight => self.random.times(t3_5, 1.0, 6.0 / 3.5),
            Pace::Relaxed | Pace::Sloppy => self.random.range(5 * MILLISECOND, 60 * MILLISECOND).max(t3_5),
        }
    }

    /// Draws how long a unit thinks.
    fn latency(&mut self, index: usize) -> i64 {
        let t3_5 = self.line.t3_5_ns();
        let usual = match self.scenario.pace {
            Pace::Sloppy => self.line.character_ns(),
            Pace::Tight => self.random.times(t3_5, 1.0, 6.0 / 3.5),
            Pace::Relaxed => self.random.times(self.units[index].usual_latency, 0.85, 1.2).max(t3_5),
        };
        if !self.scenario.heavy_tail {
            return usual;
        }
        // A Pareto distribution of exponent 1: half the answers take twice as long, one in a hundred 100 times.
        let slower = usual as f64 / (1.0 - self.random.fraction());
        (slower as i64).min(RESPONSE_TIMEOUT / 5 * 4).max(usual)
    }

    /// Asks for something in a function of the vendor.
    fn vendor(&mut self, index: usize) -> Dialogue {
        let (address, function) = (self.units[index].address, self.random.pick(self.vendor_functions));
        let asked = self.bytes(0, 12);
        let told = self.bytes(1, 20);
        (adu(address, function, &asked), Some(adu(address, function, &told)))
    }

    /// Reads a block of the poll map, or one whose frames are ambiguous.
    fn read(&mut self, index: usize) -> Dialogue {
        if self.random.chance(self.scenario.ambiguous) {
            let (address, function) = (self.units[index].address, self.random.pick([3, 4]));
            let dialogue =
                if self.random.chance(0.5) { self.request_like_response(address, function) } else { None };
            return dialogue.unwrap_or_else(|| self.response_like_request(address, function));
        }
        let unit = &self.units[index];
        let poll = &unit.polls[self.random.range(0, unit.polls.len() as i64 - 1) as usize];
        let (address, function) = (unit.address, poll.function);
        let request = two_words(address, function, poll.start, poll.quantity);
        if self.random.chance(self.scenario.exceptions) {
            return (request, Some(exception(address, function, &mut self.random)));
        }
        let data: Vec<u8> = if function <= 2 {
            (0..poll.quantity.div_ceil(8)).map(|_| self.random.byte()).collect()
        } else {
            let highest = if poll.small { 300 } else { 0xFFFF };
            (0..poll.quantity).flat_map(|_| (self.random.range(0, highest) as u16).to_be_bytes()).collect()
        };
        (request, Some(counted(address, function, &data)))
    }

    /// Reads at 0x02xx such that the request's first seven bytes are a valid response of one register.
    ///
    /// The request's CRC must end in 00; then its quantity is a CRC byte of the shorter frame. Every second
    /// address has no such request: a bit of the CRC is a parity, and asks for more than 125 registers there.
    fn request_like_response(&mut self, address: u8, function: u8) -> Option<Dialogue> {
        let first = self.random.byte();
        let (start, quantity) = (0..=255u8).find_map(|step| {
            let low = first.wrapping_add(step);
            let quantity = checksum(&[address, function, 0x02, low, 0]) & 0xFF;
            (1..=40).contains(&quantity).then_some((u16::from_be_bytes([0x02, low]), quantity))
        })?;
        let data = self.bytes(2 * i64::from(quantity), 2 * i64::from(quantity));
        let request = two_words(address, function, start, quantity);
        Some((request, Some(counted(address, function, &data))))
    }

    /// Reads two registers with such values that the response's first eight bytes are a valid request.
    ///
    /// The last value byte and the CRC's low byte are the CRC of all before; the CRC's high byte is then 00.
    fn response_like_request(&mut self, address: u8, function: u8) -> Dialogue {
        let request = two_words(address, function, self.random.range(0, 0xFFFF) as u16 & 0xFFFE, 2);
        let head = [address, function, 4, self.random.byte(), 0, self.random.range(1, 125) as u8];
        let mut response = head.to_vec();
        response.push(checksum(&head).to_le_bytes()[0]);
        (request, Some(sealed(response)))
    }

    /// Does one of the many other things that masters do.
    fn other(&mut self, index: usize) -> Dialogue {
        let address = self.units[index].address;
        let (start, value) = (self.random.range(0, 0x0FFF) as u16, self.random.range(0, 0xFFFF) as u16);
        let same = |adu: Vec<u8>| (adu.clone(), Some(adu));
        let (request, response) = match self.random.range(0, 15) {
            0 | 1 => same(two_words(address, 5, start, self.random.pick([0, 0xFF00]))),
            2 | 3 => same(two_words(address, 6, start, value)),
            4 => self.write_coils(address, start),
            5 | 6 => self.write_registers(address, start),
            7 => same(adu(address, 22, &[start.to_be_bytes(), [0, 0xF2], value.to_be_bytes()].concat())),
            8 => self.read_write(address, start),
            9 => same(two_words(address, 8, 0, value)), // return query data
            // From here on without exceptions: quirks of the sensors, and what nobody answers.
            10 => return (two_words(address, 3, 0x2500, 0), Some(counted(address, 3, &[]))),
            11 => return (write(address, 16, 0x1C00, 0, &[]), Some(two_words(address, 16, 0x1C00, 0))),
            12 => return (two_words(address, 3, 0x2E00, 1), Some(adu(address, 3, &[0, 0, 0]))),
            13 => {
                let answer = counted(SERVICE_ADDRESS, 3, &[address, 0]);
                return (two_words(SERVICE_ADDRESS, 3, 0x3000, 1), Some(answer));
            }
            14 => return self.set_address(index),
            _ => return (two_words(0, 6, start, value), None),
        };
        if self.random.chance(self.scenario.exceptions) {
            let refusal = exception(address, request[1], &mut self.random); // every ADU has a function
            return (request, Some(refusal));
        }
        (request, response)
    }

    /// Writes up to 24 coils.
    fn write_coils(&mut self, address: u8, start: u16) -> Dialogue {
        let quantity = self.random.range(1, 24) as u16;
        let count = i64::from(quantity.div_ceil(8));
        let data = self.bytes(count, count);
        (write(address, 15, start, quantity, &data), Some(two_words(address, 15, start, quantity)))
    }

    /// Writes up to eight registers.
    fn write_registers(&mut self, address: u8, start: u16) -> Dialogue {
        let quantity = self.random.range(1, 8);
        let data = self.bytes(2 * quantity, 2 * quantity);
        let quantity = quantity as u16;
        (write(address, 16, start, quantity, &data), Some(two_words(address, 16, start, quantity)))
    }

    /// Writes and reads a few registers in one go.
    fn read_write(&mut self, address: u8, start: u16) -> Dialogue {
        let (wanted, given) = (self.random.range(1, 8), self.random.range(1, 4));
        let told = self.bytes(2 * wanted, 2 * wanted);
        let mut data = [start.to_be_bytes(), (wanted as u16).to_be_bytes()].concat();
        data.extend([start.to_be_bytes(), (given as u16).to_be_bytes()].concat());
        data.push(2 * given as u8);
        data.extend(self.bytes(2 * given, 2 * given));
        (adu(address, 23, &data), Some(counted(address, 23, &told)))
    }

    /// Gives a unit another address; the old one acknowledges.
    fn set_address(&mut self, index: usize) -> Dialogue {
        let old = self.units[index].address;
        let new = self.free_address();
        self.units[index].address = new;
        (write(old, 16, 0x3000, 1, &[new, 0]), Some(two_words(old, 16, 0x3000, 1)))
    }

    /// Draws some bytes.
    fn bytes(&mut self, least: i64, most: i64) -> Vec<u8> {
        (0..self.random.range(least, most)).map(|_| self.random.byte()).collect()
    }
}

impl Poll {
    /// Draws a block: registers mostly, coils now and then, many of them where confusion is near.
    fn draw(random: &mut Random) -> Self {
        let function = random.pick([1, 1, 2, 3, 3, 3, 3, 3, 4, 4]);
        let low = u16::from(random.byte());
        let start = match random.range(0, 3) {
            0 => 0x0200 | low,
            1 => 0x0400 | low,
            2 => low,
            _ => random.range(0, 0xFF00) as u16,
        };
        let quantity = match (function, random.range(0, 9)) {
            (1 | 2, 0..=4) => random.range(17, 24), // responses of eight bytes, like requests
            (1 | 2, _) => random.range(1, 100),
            (_, 0..=2) => random.range(1, 2),
            (_, 3..=7) => random.range(2, 10),
            (_, 8) => random.range(10, 30),
            _ => random.range(30, 125),
        };
        Poll { function, start, quantity: quantity as u16, small: random.chance(0.5) }
    }
}

/// Refuses a request, mostly for its address (Modbus V1.1b3, section 7).
fn exception(address: u8, function: u8, random: &mut Random) -> Vec<u8> {
    adu(address, function | 0x80, &[random.pick([1, 2, 2, 2, 3, 4, 6])])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws exchanges on several buses.
    fn exchanges(name: &str, count: u64) -> Vec<Exchange> {
        let scenario = Scenario::named(name).unwrap();
        let bus = |seed| Generic::new(Random::new(seed, 0), scenario, LineSettings::default());
        let some = |mut bus: Generic| (0..count / 10).map(move |_| bus.next(Timestamp::default()));
        (0..10).map(bus).flat_map(some).collect()
    }

    /// Tells whether the last two of `bytes` are the CRC of the others.
    fn is_valid(bytes: &[u8]) -> bool {
        checksum(bytes) == 0
    }

    #[test]
    fn a_third_of_the_reads_of_collisions_collide() {
        let exchanges = exchanges("collisions", 4000);
        let like_response = exchanges.iter().filter(|x| is_valid(&x.request[..7])).count();
        let like_request = exchanges
            .iter()
            .filter_map(|x| x.response.as_ref())
            .filter(|response| response.len() == 9 && is_valid(&response[..8]))
            .count();
        // 80 % reads, 30 % of them: 960, give or take four standard deviations of 27.
        assert!((850..1070).contains(&(like_response + like_request)), "{like_response} {like_request}");
        assert!(like_response > 150 && like_request > 300, "{like_response} {like_request}");
    }

    #[test]
    fn generic_buses_show_every_shape_the_framer_must_know() {
        let exchanges = exchanges("clean", 20_000);
        for function in [1, 2, 3, 4, 5, 6, 8, 15, 16, 22, 23] {
            assert!(exchanges.iter().any(|x| x.request[1] == function), "function {function}");
        }
        let responses = || exchanges.iter().filter_map(|x| x.response.as_ref());
        let said =
            |head: &[u8], length: usize| responses().any(|r| r[1..].starts_with(head) && r.len() == length);
        assert!(said(&[1, 3], 8), "function 1 with a response as long as a request");
        assert!(said(&[3, 0], 5) && said(&[3, 0, 0, 0], 7), "both stop acknowledgements");
        assert!(exchanges.iter().any(|x| x.request[0] == 0 && x.response.is_none()), "broadcast");
        assert!(exchanges.iter().any(|x| x.request[0] == 0xFF), "service address");
        let exceptions = responses().filter(|response| response[1] & 0x80 != 0).count();
        assert!((280..440).contains(&exceptions), "2 % of what can be refused: {exceptions}");
    }

    #[test]
    fn a_new_address_is_acknowledged_from_the_old_one() {
        let exchanges = exchanges("clean", 1000);
        let set = exchanges.iter().find(|x| x.request[1..4] == [16, 0x30, 0]).unwrap();
        assert_eq!(set.response.as_ref().unwrap()[0], set.request[0]);
        assert_ne!(set.request[7], set.request[0]);
    }

    #[test]
    fn every_adu_is_sealed_and_fits_the_limit_of_256_bytes() {
        for name in ["clean", "collisions", "vendor"] {
            for exchange in exchanges(name, 5000) {
                for adu in [Some(exchange.request), exchange.response].into_iter().flatten() {
                    assert!(is_valid(&adu) && (4..=256).contains(&adu.len()), "{adu:02X?}");
                }
            }
        }
    }
}
