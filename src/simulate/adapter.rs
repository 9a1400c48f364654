//! How bytes reach the listener: the adapter's packets, the host's delays, and reads that merge what is queued.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use crate::decode::chunk::{LineError, LineErrorKind};
use crate::line::LineSettings;
use crate::simulate::random::Random;
use crate::simulate::read::Read;
use crate::simulate::scenario::Scenario;
use crate::simulate::tap::{Tap, WireByte};
use crate::time::{MILLISECOND, Timestamp};

/// Bytes of data in a full packet of an FTDI adapter: 64 less two of status (FTDI AN232B-04).
const FTDI_PACKET: usize = 62;
/// Bytes at which an adapter that waits for idleness does not wait any longer.
const IDLE_PACKET: usize = 64;
/// Characters of silence after which such an adapter hands over what it has; an assumption, not from data sheets.
const IDLE_CHARACTERS: i64 = 3;
/// The longest time from a packet's completion to the host, in nanoseconds: a USB frame.
const USB_JITTER: i64 = MILLISECOND;
/// The longest stall of the host or the listener, in nanoseconds.
const LONGEST_STALL: i64 = 50 * MILLISECOND;

/// Names how bytes come from the wire to the listener.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Adapter {
    /// A UART on the board: every byte as it ends.
    Uart,
    /// An FTDI adapter with a latency timer of 1 ms, or one that behaves like it.
    Usb1,
    /// An FTDI adapter with its latency timer of 16 ms, as it leaves the factory.
    #[default]
    Ftdi16,
    /// An adapter that hands over 64 bytes, or what it has once the line is idle for three characters.
    Idle64,
}

impl Adapter {
    /// All adapters, in the order in which they are listed to people.
    pub const ALL: [Adapter; 4] = [Adapter::Uart, Adapter::Usb1, Adapter::Ftdi16, Adapter::Idle64];

    /// Returns the name users give.
    pub fn name(self) -> &'static str {
        match self {
            Adapter::Uart => "uart",
            Adapter::Usb1 => "usb1",
            Adapter::Ftdi16 => "ftdi16",
            Adapter::Idle64 => "idle64",
        }
    }

    /// Returns the longest time the adapter keeps a byte back, in nanoseconds.
    ///
    /// Without stalls of the host, and without the wake-up of the listener (up to 0.3 ms here).
    pub fn hold_ns(self, line: LineSettings) -> i64 {
        match self.tick() {
            Some(tick) => tick + USB_JITTER,
            None if self == Adapter::Idle64 => longest_idle_hold(line).saturating_add(USB_JITTER),
            None => 0,
        }
    }

    /// Returns the period of the latency timer in nanoseconds, for adapters that have one.
    fn tick(self) -> Option<i64> {
        match self {
            Adapter::Usb1 => Some(MILLISECOND),
            Adapter::Ftdi16 => Some(16 * MILLISECOND),
            Adapter::Uart | Adapter::Idle64 => None,
        }
    }
}

/// Returns how long an adapter that waits for idleness keeps its first byte at most: 64 characters and the idle time.
fn longest_idle_hold(line: LineSettings) -> i64 {
    line.character_ns().saturating_mul(IDLE_PACKET as i64 + IDLE_CHARACTERS)
}

/// Says that an adapter is not known.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("'{given}' is not an adapter of the simulation; there are uart, usb1, ftdi16 and idle64")]
pub struct AdapterError {
    given: String,
}

impl FromStr for Adapter {
    type Err = AdapterError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let known = Adapter::ALL.into_iter().find(|adapter| adapter.name() == text);
        known.ok_or_else(|| AdapterError { given: text.to_owned() })
    }
}

impl fmt::Display for Adapter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Packs bytes as an adapter does, and says when each packet reaches the host's queue.
pub(super) struct Packets {
    pub(super) tap: Tap,
    ahead: Option<WireByte>,
    adapter: Adapter,
    line: LineSettings,
    host_stall: f64,
    random: Random,
    /// When the latency timer ticks, give or take whole periods.
    phase: i64,
    /// When the last packet reached the host.
    last: Timestamp,
}

impl Packets {
    pub(super) fn new(
        mut tap: Tap,
        adapter: Adapter,
        scenario: Scenario,
        line: LineSettings,
        mut random: Random,
    ) -> Self {
        let ahead = tap.next();
        let phase = random.range(0, 16 * MILLISECOND);
        let last = Timestamp::MIN;
        Packets { tap, ahead, adapter, line, host_stall: scenario.host_stall, random, phase, last }
    }

    /// Fills `packet` with the next packet and returns when it reaches the host; empty at the end.
    pub(super) fn next(&mut self, packet: &mut Vec<WireByte>) -> Option<Timestamp> {
        packet.clear();
        let first = self.ahead.take()?;
        packet.push(first);
        self.ahead = self.tap.next();
        let complete = match self.adapter.tick() {
            Some(tick) => {
                let due = first.end + self.phase.saturating_sub(first.end.as_ns()).rem_euclid(tick);
                self.fill(packet, FTDI_PACKET, due, i64::MAX)
            }
            None if self.adapter == Adapter::Idle64 => {
                let due = first.end + longest_idle_hold(self.line);
                let idle = self.line.character_ns().saturating_mul(IDLE_CHARACTERS);
                self.fill(packet, IDLE_PACKET, due, idle)
            }
            None => first.end,
        };
        self.report_errors(packet);
        let mut arrival = complete;
        if self.adapter != Adapter::Uart {
            arrival = arrival + self.random.range(0, USB_JITTER);
            if self.random.chance(self.host_stall) {
                arrival = arrival + self.random.range(0, LONGEST_STALL);
            }
        }
        self.last = self.last.max(arrival); // packets do not overtake each other
        Some(self.last)
    }

    /// Adds bytes until the packet is full, `due` has come, or the line has been idle for `idle` nanoseconds.
    ///
    /// Returns when that is.
    fn fill(&mut self, packet: &mut Vec<WireByte>, full: usize, due: Timestamp, idle: i64) -> Timestamp {
        let mut limit = due.min(packet[0].end + idle); // the packet has its first byte
        while packet.len() < full {
            let Some(byte) = self.ahead.take_if(|byte| byte.end <= limit) else { return limit };
            limit = due.min(byte.end + idle);
            packet.push(byte);
            self.ahead = self.tap.next();
        }
        packet[full - 1].end
    }

    /// Reports errors as the drivers do: a UART by the byte, FTDI for a whole packet, the others never.
    fn report_errors(&self, packet: &mut [WireByte]) {
        let any = packet.iter().any(|byte| byte.error);
        match self.adapter {
            Adapter::Uart => {}
            Adapter::Usb1 | Adapter::Ftdi16 => packet.iter_mut().for_each(|byte| byte.error = any),
            Adapter::Idle64 => packet.iter_mut().for_each(|byte| byte.error = false),
        }
    }
}

/// Reads what is queued whenever the listener wakes.
pub(super) struct Reader {
    pub(super) packets: Packets,
    ahead: Vec<WireByte>,
    /// When the packet ahead reaches the queue; `None` at the end.
    arrival: Option<Timestamp>,
    stall: f64,
    random: Random,
}

impl Reader {
    pub(super) fn new(mut packets: Packets, scenario: Scenario, random: Random) -> Self {
        let mut ahead = Vec::new();
        let arrival = packets.next(&mut ahead);
        Reader { packets, ahead, arrival, stall: scenario.stall, random }
    }

    /// Waits for the next packet and reads it with all that has come until the listener is awake.
    pub(super) fn next(&mut self) -> Option<Read> {
        let mut awake = self.arrival? + self.random.range(MILLISECOND / 10, MILLISECOND * 3 / 10);
        if self.random.chance(self.stall) {
            awake = awake + self.random.range(0, LONGEST_STALL);
        }
        let mut read = Read { time: awake, bytes: Vec::new(), line_errors: Vec::new() };
        while self.arrival.is_some_and(|arrival| arrival <= awake) {
            for byte in &self.ahead {
                if byte.error {
                    let offset = read.bytes.len() as u32; // a few kilobytes: stalls are short
                    read.line_errors.push(LineError { offset, kind: LineErrorKind::ParityOrFraming });
                }
                read.bytes.push(byte.value);
            }
            self.arrival = self.packets.next(&mut self.ahead);
        }
        Some(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_print() {
        for adapter in Adapter::ALL {
            assert_eq!(adapter.to_string().parse(), Ok(adapter));
        }
        let error = "usb16".parse::<Adapter>().unwrap_err().to_string();
        assert!(error.contains("'usb16'") && error.contains("ftdi16"), "{error}");
    }

    #[test]
    fn the_hold_is_the_latency_timer_and_a_usb_frame() {
        let line = LineSettings::default();
        assert_eq!(Adapter::Uart.hold_ns(line), 0);
        assert_eq!(Adapter::Ftdi16.hold_ns(line), 17 * MILLISECOND);
        assert_eq!(Adapter::Idle64.hold_ns(line), 67 * line.character_ns() + MILLISECOND);
    }
}
