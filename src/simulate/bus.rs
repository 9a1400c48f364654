//! Who talks when: masters that ask, wait, ask again and go on, and units that answer.
//!
//! A small simulation of discrete events; each talker hears what is on the line, as real ones do.
//! Masters do not talk into a frame, but know nothing of each other's outstanding answers; units just answer.

use crate::decode::frame::Role;
use crate::line::LineSettings;
use crate::simulate::adu::sealed;
use crate::simulate::random::Random;
use crate::simulate::scenario::{Pace, Scenario};
use crate::simulate::traffic::{Exchange, RESPONSE_TIMEOUT, Traffic};
use crate::time::{MILLISECOND, Timestamp};

/// How long a master waits after a broadcast, in nanoseconds (100 to 200 ms: Modbus serial line V1.02, 2.4.1).
const TURNAROUND: i64 = 100 * MILLISECOND;

/// Is a frame as it was sent.
#[derive(Clone, Debug)]
pub(super) struct Transmission {
    /// Of the first start bit.
    pub(super) start: Timestamp,
    pub(super) bytes: Vec<u8>,
    pub(super) role: Role,
    pub(super) echo: bool,
    /// Index of the transmission it answers.
    pub(super) request: Option<u64>,
    /// A silence inside the frame: before which byte, and how long in nanoseconds.
    pub(super) pause: (usize, i64),
}

impl Transmission {
    /// Returns when a byte's last stop bit ends, with the time of a character in nanoseconds.
    pub(super) fn byte_end(&self, index: usize, character: i64) -> Timestamp {
        let (before, ns) = self.pause;
        let pause = if index >= before { ns } else { 0 };
        self.start + character.saturating_mul(index as i64 + 1) + pause
    }

    /// Returns when the last stop bit ends.
    pub(super) fn end(&self, character: i64) -> Timestamp {
        self.byte_end(self.bytes.len().saturating_sub(1), character)
    }
}

/// Is a master with what it is at.
struct Master {
    exchange: Exchange,
    /// How often it has asked in vain.
    tries: u32,
    /// Counts its requests; an event with an older ticket is about a request that is over.
    ticket: u64,
    /// Whether an answer has begun.
    receiving: bool,
}

/// Names a request among all that a master makes.
#[derive(Clone, Copy, Debug)]
struct Asked {
    master: usize,
    ticket: u64,
    /// Index of the request's transmission.
    index: u64,
}

/// Is something that happens at a time.
#[derive(Clone, Debug)]
enum Event {
    /// A master wants to ask.
    Ask(usize),
    /// A request has been sent.
    Heard(Asked),
    /// A converter repeats a request.
    Repeat(Asked),
    /// A unit begins to answer.
    Answer(Asked, Vec<u8>),
    /// An answer has been sent; the last is its transmission.
    Answered(Asked, u64),
    /// A master's patience ends.
    TimeOut(Asked),
}

/// Is the line with all who talk on it; yields transmissions in the order of their starts.
pub(super) struct Bus {
    traffic: Traffic,
    scenario: Scenario,
    line: LineSettings,
    random: Random,
    masters: Vec<Master>,
    events: Vec<(Timestamp, Event)>,
    /// When each address is done with its last answer.
    occupied: [Timestamp; 256],
    /// When the line falls silent.
    quiet: Timestamp,
    /// The first of the latest transmissions without a silence between them, and whether there are several.
    burst: (u64, bool),
    sent: u64,
    wanted: u64,
    ready: Option<Transmission>,
}

impl Bus {
    /// Starts one master, or two, at a time; they stop after about `wanted` frames.
    pub(super) fn new(
        mut traffic: Traffic,
        scenario: Scenario,
        line: LineSettings,
        random: Random,
        start: Timestamp,
        wanted: u64,
    ) -> Self {
        let masters: Vec<Master> = (0..1 + usize::from(scenario.second_master))
            .map(|_| Master { exchange: traffic.next(start), tries: 0, ticket: 0, receiving: false })
            .collect();
        let events =
            masters.iter().enumerate().map(|(i, master)| (master.exchange.start, Event::Ask(i))).collect();
        Bus {
            traffic,
            scenario,
            line,
            random,
            masters,
            events,
            occupied: [Timestamp::MIN; 256],
            quiet: Timestamp::MIN,
            burst: (0, false),
            sent: 0,
            wanted,
            ready: None,
        }
    }

    /// Lets time run until somebody talks; `None` when all have finished.
    pub(super) fn next(&mut self) -> Option<Transmission> {
        while self.ready.is_none() {
            let (first, _) = self.events.iter().enumerate().min_by_key(|(_, (time, _))| *time)?;
            let (now, event) = self.events.remove(first);
            match event {
                Event::Ask(master) => self.ask(now, master),
                Event::Heard(asked) => self.hear(now, asked),
                Event::Repeat(asked) => {
                    let request = self.masters[asked.master].exchange.request.clone();
                    self.transmit(now, request, Role::Request, true, None);
                }
                Event::Answer(asked, bytes) => self.answer(now, asked, bytes),
                Event::Answered(asked, index) if self.waits(asked) => {
                    let garbled = self.garbled(index);
                    self.finish(now, asked.master, !garbled);
                }
                Event::TimeOut(asked) if self.waits(asked) && !self.masters[asked.master].receiving => {
                    let broadcast = self.masters[asked.master].exchange.response.is_none();
                    self.finish(now, asked.master, broadcast);
                }
                Event::Answered(..) | Event::TimeOut(..) => {}
            }
        }
        self.ready.take()
    }

    /// Puts a frame on the line and returns its index and its end.
    fn transmit(
        &mut self,
        start: Timestamp,
        bytes: Vec<u8>,
        role: Role,
        echo: bool,
        request: Option<u64>,
    ) -> (u64, Timestamp) {
        let character = self.line.character_ns();
        let mut pause = (0, 0);
        if self.scenario.pace == Pace::Sloppy && self.random.chance(0.05) {
            pause = (
                self.random.range(1, bytes.len() as i64 - 1) as usize,
                self.random.times(character, 0.0, 10.0),
            );
        }
        let transmission = Transmission { start, bytes, role, echo, request, pause };
        let (index, end) = (self.sent, transmission.end(character));
        self.burst = if start < self.quiet { (self.burst.0, true) } else { (index, false) };
        self.quiet = self.quiet.max(end);
        self.sent += 1;
        self.ready = Some(transmission);
        (index, end)
    }

    /// Tells whether a transmission that has just ended collided with another.
    fn garbled(&self, index: u64) -> bool {
        let (first, several) = self.burst;
        several && index >= first
    }

    /// Tells whether a master still waits for the answer to a request.
    fn waits(&self, asked: Asked) -> bool {
        self.masters[asked.master].ticket == asked.ticket
    }

    /// Sends a master's request once the line has been silent for t3.5, unless the simulation is to end.
    fn ask(&mut self, now: Timestamp, master: usize) {
        if self.sent >= self.wanted {
            return;
        }
        let free = self.quiet + self.line.t3_5_ns();
        if now < free {
            let later = free + self.random.range(0, self.line.t3_5_ns());
            self.events.push((later, Event::Ask(master)));
            return;
        }
        let request = self.masters[master].exchange.request.clone();
        let (index, end) = self.transmit(now, request, Role::Request, false, None);
        let master_now = &mut self.masters[master];
        master_now.ticket += 1;
        master_now.receiving = false;
        let asked = Asked { master, ticket: master_now.ticket, index };
        self.events.push((end, Event::Heard(asked)));
    }

    /// Lets the unit think about a request that has ended, and the converter repeat it.
    fn hear(&mut self, now: Timestamp, asked: Asked) {
        let character = self.line.character_ns();
        let exchange = self.masters[asked.master].exchange.clone();
        let mut heard = now;
        if self.scenario.echo {
            let begin = now + self.random.times(character, 0.1, 1.0);
            self.events.push((begin, Event::Repeat(asked)));
            heard = begin + character.saturating_mul(exchange.request.len() as i64);
        }
        let Some(response) = exchange.response else {
            self.events.push((heard + TURNAROUND, Event::TimeOut(asked)));
            return;
        };
        self.events.push((heard + RESPONSE_TIMEOUT, Event::TimeOut(asked)));
        let may_fail = exchange.weak || !self.scenario.one_weak_unit;
        let silent = may_fail && self.random.chance(self.scenario.no_response);
        let address = usize::from(exchange.request[0]); // an ADU has an address
        if silent || self.garbled(asked.index) || self.occupied[address] > now {
            return;
        }
        let mut begin = heard + exchange.latency;
        if may_fail && self.random.chance(self.scenario.late) {
            begin = heard + RESPONSE_TIMEOUT + self.random.range(5 * MILLISECOND, 60 * MILLISECOND);
        }
        self.occupied[address] = begin + character.saturating_mul(response.len() as i64);
        if self.random.chance(self.scenario.two_answers) {
            let other = begin + self.random.times(character, 0.05, 3.0);
            self.events.push((other, Event::Answer(asked, self.twin(&response))));
        }
        self.events.push((begin, Event::Answer(asked, response)));
    }

    /// Returns what another unit of the same address says: the same with other data.
    fn twin(&self, response: &[u8]) -> Vec<u8> {
        let mut bytes = response[..response.len() - 2].to_vec(); // an ADU ends in two bytes of CRC
        for byte in bytes.iter_mut().skip(3) {
            *byte = byte.wrapping_add(0x35);
        }
        sealed(bytes)
    }

    /// Lets a unit answer, whoever still listens.
    fn answer(&mut self, now: Timestamp, asked: Asked, bytes: Vec<u8>) {
        let (index, end) = self.transmit(now, bytes, Role::Response, false, Some(asked.index));
        if self.waits(asked) {
            self.masters[asked.master].receiving = true;
        }
        self.events.push((end, Event::Answered(asked, index)));
    }

    /// Ends a master's request, well or not, and plans the next or the same again.
    fn finish(&mut self, now: Timestamp, index: usize, well: bool) {
        let master = &mut self.masters[index];
        master.ticket += 1;
        master.receiving = false;
        if well || master.tries >= self.scenario.retries {
            master.tries = 0;
            master.exchange = self.traffic.next(now);
        } else {
            master.tries += 1;
            master.exchange.start = self.traffic.again(now);
        }
        let mut start = master.exchange.start;
        if index > 0 {
            start = start + self.random.range(50 * MILLISECOND, 400 * MILLISECOND); // the second asks less often
        }
        self.events.push((start, Event::Ask(index)));
    }
}
