//! Traffic to test with: frames of real devices, spoilt frames, simulated buses, garbage.

use crc::{CRC_16_MODBUS, Crc};
use proptest::collection::vec;
use proptest::prelude::*;
use rtutap::decode::chunk::ReadTime;
use rtutap::decode::stamp::{EARLIEST, LATEST};
use rtutap::line::LineSettings;
use rtutap::simulate::{Adapter, Config, Scenario, Simulation};
use rtutap::time::Timestamp;

use super::Read;

/// Computes the CRC independently of the program under test.
pub fn crc(bytes: &[u8]) -> u16 {
    const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_MODBUS);
    CRC.checksum(bytes)
}

/// Draws 64 bits a call, the same for ever for a seed (SplitMix64).
pub fn random(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
}

/// Appends the CRC, low byte first.
pub fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc = crc(&bytes);
    bytes.extend(crc.to_le_bytes());
    bytes
}

/// Bodies without CRC of frames that real devices send and manuals print, of every function with a form of its own.
///
/// From the manuals of the sensors, public captures of a Y511 and the examples of the Modbus application protocol
/// V1.1b3, section 6; the last ones have heads that are frames of another kind once the CRC allows it.
const BODIES: &[&[u8]] = &[
    &[0x01, 0x03, 0x25, 0x00, 0x00, 0x00],
    &[0x01, 0x03, 0x00],
    &[0x01, 0x03, 0x26, 0x00, 0x00, 0x04],
    &[0x01, 0x03, 0x08, 0x00, 0x00, 0x8D, 0x41, 0x00, 0x00, 0x8D, 0x41],
    &[0x01, 0x03, 0x26, 0x00, 0x00, 0x05],
    &[0x01, 0x03, 0x0A, 0x00, 0x00, 0x8D, 0x41, 0x00, 0x00, 0x8D, 0x41, 0x00, 0x00],
    &[0x01, 0x10, 0x1C, 0x00, 0x00, 0x00, 0x00],
    &[0x01, 0x10, 0x1C, 0x00, 0x00, 0x00],
    &[0x01, 0x03, 0x2E, 0x00, 0x00, 0x01],
    &[0x01, 0x03, 0x00, 0x00, 0x00],
    &[0x01, 0x03, 0x02, 0x00, 0x00],
    &[0xFF, 0x03, 0x30, 0x00, 0x00, 0x01],
    &[0xFF, 0x03, 0x02, 0x03, 0x00],
    &[0x01, 0x10, 0x30, 0x00, 0x00, 0x01, 0x02, 0x14, 0x00],
    &[0x01, 0x10, 0x30, 0x00, 0x00, 0x01],
    &[0x03, 0x03, 0x09, 0x00, 0x00, 0x07],
    &[0x03, 0x03, 0x0E, 0x29, b'Y', b'L', b'2', b'9', b'1', b'7', b'0', b'5', b'0', b'2', b'0', b'9', 0x00],
    &[0x03, 0x10, 0x11, 0x00, 0x00, 0x04, 0x08, 0x00, 0x00, 0x80, 0x3F, 0x00, 0x00, 0x00, 0x00],
    &[0x03, 0x10, 0x11, 0x00, 0x00, 0x04],
    &[0x01, 0x83, 0x02],
    &[0x01, 0x90, 0x03],
    &[0x00, 0x10, 0x30, 0x00, 0x00, 0x01, 0x02, 0x14, 0x00],
    &[0x11, 0x01, 0x00, 0x13, 0x00, 0x13],
    &[0x11, 0x01, 0x03, 0xCD, 0x6B, 0x05],
    &[0x11, 0x02, 0x03, 0x04, 0x00, 0x16],
    &[0x11, 0x02, 0x03, 0xAC, 0xDB, 0x35],
    &[0x11, 0x04, 0x00, 0x08, 0x00, 0x01],
    &[0x11, 0x04, 0x02, 0x00, 0x0A],
    &[0x11, 0x05, 0x00, 0xAC, 0xFF, 0x00],
    &[0x11, 0x06, 0x00, 0x01, 0x00, 0x03],
    &[0x11, 0x07],
    &[0x11, 0x07, 0x6D],
    &[0x11, 0x08, 0x00, 0x00, 0xA5, 0x37],
    &[0x11, 0x0B],
    &[0x11, 0x0B, 0xFF, 0xFF, 0x01, 0x08],
    &[0x11, 0x0F, 0x00, 0x13, 0x00, 0x0A, 0x02, 0xCD, 0x01],
    &[0x11, 0x0F, 0x00, 0x13, 0x00, 0x0A],
    &[0x11, 0x11],
    &[0x11, 0x11, 0x03, 0x41, 0xFF, 0x00],
    &[0x11, 0x14, 0x07, 0x06, 0x00, 0x04, 0x00, 0x01, 0x00, 0x02],
    &[0x11, 0x14, 0x06, 0x05, 0x06, 0x0D, 0xFE, 0x00, 0x20],
    &[0x11, 0x15, 0x0D, 0x06, 0x00, 0x04, 0x00, 0x07, 0x00, 0x03, 0x06, 0xAF, 0x04, 0xBE, 0x10, 0x0D],
    &[0x11, 0x16, 0x00, 0x04, 0x00, 0xF2, 0x00, 0x25],
    &[0x11, 0x17, 0x00, 0x03, 0x00, 0x02, 0x00, 0x0E, 0x00, 0x01, 0x02, 0x00, 0xFF],
    &[0x11, 0x17, 0x04, 0x00, 0xFE, 0x0A, 0xCD],
    &[0x11, 0x18, 0x04, 0xDE],
    &[0x11, 0x18, 0x00, 0x06, 0x00, 0x02, 0x01, 0xB8, 0x12, 0x84],
    &[0x11, 0x2B, 0x0E, 0x01, 0x00],
    &[0x11, 0x2B, 0x0E, 0x01, 0x01, 0x00, 0x00, 0x01, 0x00, 0x03, b'A', b'B', b'C'],
    &[0x11, 0x64, 0x01, 0x02, 0x03],
    &[0x02, 0x03, 0x02, 0x00, 0x00, 0x01],
    &[0x02, 0x03, 0x02, 0x00, 0x01],
    &[0x02, 0x03, 0x04, 0x00, 0x00, 0x00, 0x01],
    &[0x02, 0x03, 0x04, 0x00, 0x00, 0x01],
    &[0x02, 0x01, 0x02, 0x10, 0x00, 0x08],
];

/// Is something on the wire, before the listener.
#[derive(Clone, Debug)]
enum Piece {
    /// A frame of another unit, so that units are strange and known by turns.
    Frame {
        body: usize,
        unit: Option<u8>,
        spoilt: Option<Spoilt>,
    },
    /// A read of registers, and its answer.
    Exchange {
        unit: u8,
        function: u8,
        start: u16,
        quantity: u8,
        data: u8,
    },
    Noise(Vec<u8>),
}

/// Is what went wrong with a frame.
#[derive(Clone, Debug)]
enum Spoilt {
    Flip { at: usize, bit: u8 },
    Drop { at: usize },
    Insert { at: usize, byte: u8 },
    Cut { at: usize },
    Headless { at: usize },
    Twice,
    Trailing(u8),
}

impl Piece {
    fn bytes(&self) -> Vec<u8> {
        match self {
            Piece::Noise(bytes) => bytes.clone(),
            Piece::Exchange { unit, function, start, quantity, data } => {
                let [high, low] = start.to_be_bytes();
                let mut bytes = sealed(vec![*unit, *function, high, low, 0, *quantity]);
                let mut answer = vec![*unit, *function, 2 * quantity];
                answer.extend((0..2 * quantity).map(|i| if i % 3 == 0 { *data } else { i / 7 }));
                bytes.extend(sealed(answer));
                bytes
            }
            Piece::Frame { body, unit, spoilt } => {
                let mut bytes = BODIES[body % BODIES.len()].to_vec();
                bytes[0] = unit.unwrap_or(bytes[0]);
                let mut bytes = sealed(bytes);
                if let Some(spoilt) = spoilt {
                    spoilt.apply(&mut bytes);
                }
                bytes
            }
        }
    }
}

impl Spoilt {
    fn apply(&self, bytes: &mut Vec<u8>) {
        let within = |at: usize| at % bytes.len();
        match *self {
            Spoilt::Flip { at, bit } => {
                let at = within(at);
                bytes[at] ^= 1 << (bit % 8);
            }
            Spoilt::Drop { at } => {
                bytes.remove(within(at));
            }
            Spoilt::Insert { at, byte } => bytes.insert(within(at), byte),
            Spoilt::Cut { at } => bytes.truncate(within(at)),
            Spoilt::Headless { at } => {
                bytes.drain(..within(at));
            }
            Spoilt::Twice => bytes.extend(bytes.clone()),
            Spoilt::Trailing(byte) => bytes.push(byte),
        }
    }
}

fn spoilt() -> impl Strategy<Value = Spoilt> {
    prop_oneof![
        (any::<usize>(), any::<u8>()).prop_map(|(at, bit)| Spoilt::Flip { at, bit }),
        any::<usize>().prop_map(|at| Spoilt::Drop { at }),
        (any::<usize>(), any::<u8>()).prop_map(|(at, byte)| Spoilt::Insert { at, byte }),
        any::<usize>().prop_map(|at| Spoilt::Cut { at }),
        any::<usize>().prop_map(|at| Spoilt::Headless { at }),
        Just(Spoilt::Twice),
        prop_oneof![Just(0), Just(0xFF), any::<u8>()].prop_map(Spoilt::Trailing),
    ]
}

fn piece() -> impl Strategy<Value = Piece> {
    let unit = prop_oneof![3 => Just(None), 2 => (0_u8..4).prop_map(Some), 1 => any::<u8>().prop_map(Some)];
    let frame = (0..BODIES.len(), unit, prop::option::weighted(0.3, spoilt()))
        .prop_map(|(body, unit, spoilt)| Piece::Frame { body, unit, spoilt });
    let start = prop_oneof![0x0200_u16..0x0220, 0x0400_u16..0x0410, any::<u16>()];
    let exchange = (1_u8..5, 3_u8..5, start, 1_u8..20, any::<u8>()).prop_map(
        |(unit, function, start, quantity, data)| Piece::Exchange { unit, function, start, quantity, data },
    );
    let byte = prop_oneof![3 => any::<u8>(), 1 => Just(0), 1 => Just(0xFF), 1 => 1_u8..8];
    prop_oneof![6 => frame, 4 => exchange, 1 => vec(byte, 1..12).prop_map(Piece::Noise)]
}

/// Draws the bytes of a bus where real frames, spoilt frames and noise follow each other.
pub fn spoilt_traffic(pieces: std::ops::Range<usize>) -> impl Strategy<Value = Vec<u8>> {
    vec(piece(), pieces).prop_map(|pieces| pieces.iter().flat_map(Piece::bytes).collect())
}

/// Draws frames without a fault, each of them whole.
pub fn whole_exchanges(exchanges: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Vec<u8>>> {
    let exchange =
        (1_u8..5, 0x1000_u16..0x1100, 1_u8..10, any::<u8>()).prop_map(|(unit, start, quantity, data)| {
            let both = Piece::Exchange { unit, function: 3, start, quantity, data }.bytes();
            let (request, response) = both.split_at(8);
            [request.to_vec(), response.to_vec()]
        });
    vec(exchange, exchanges).prop_map(|exchanges| exchanges.into_iter().flatten().collect())
}

/// Draws any bytes at all: uniform, and with the values that mean something in Modbus.
pub fn garbage(length: std::ops::Range<usize>) -> impl Strategy<Value = Vec<u8>> {
    let telling = prop_oneof![any::<u8>(), 0_u8..6, Just(0xFF), Just(0x10), Just(0x83)];
    prop_oneof![vec(any::<u8>(), length.clone()), vec(telling, length)]
}

/// Draws any bytes at all, or traffic with faults.
pub fn any_bytes() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![2 => spoilt_traffic(0..30), 1 => garbage(0..1200)]
}

/// Draws where to cut a stream into reads: lengths, used over and over.
pub fn cuts() -> impl Strategy<Value = Vec<usize>> {
    prop_oneof![Just(vec![1]), Just(vec![62]), vec(1_usize..40, 1..30), vec(1_usize..600, 1..10)]
}

/// Cuts bytes into pieces of these lengths, over and over.
pub fn cut<'a>(bytes: &'a [u8], lengths: &'a [usize]) -> impl Iterator<Item = &'a [u8]> {
    let mut rest = bytes;
    lengths.iter().cycle().map_while(move |length| {
        let (first, then) = rest.split_at((*length).min(rest.len()));
        rest = then;
        (!first.is_empty()).then_some(first)
    })
}

/// Cuts bytes into reads without times.
pub fn untimed(bytes: &[u8], lengths: &[usize]) -> Vec<Read> {
    cut(bytes, lengths).map(|bytes| Read { time: ReadTime::Unknown, bytes: bytes.to_vec() }).collect()
}

/// Draws the steps from read to read in nanoseconds, used over and over: fast, equal, slow, huge, backwards.
pub fn steps() -> impl Strategy<Value = Vec<i64>> {
    let step = prop_oneof![
        4 => 0_i64..30_000_000,
        1 => Just(0),
        1 => 30_000_000_i64..400_000_000,
        1 => 400_000_000_i64..8_000_000_000,
    ];
    let absurd = prop_oneof![
        4 => 0_i64..200_000_000,
        1 => Just(i64::MAX),
        1 => Just(i64::MIN),
        1 => any::<i64>(),
        1 => -2_000_000_000_i64..0,
    ];
    prop_oneof![4 => vec(step, 1..40), 1 => vec(absurd, 1..20)]
}

/// Draws a time to begin at, the ends of what can be counted among them.
pub fn begin() -> impl Strategy<Value = i64> {
    prop_oneof![
        6 => Just(1_767_225_600_000_000_000),
        1 => Just(0),
        1 => Just(LATEST.as_ns() - 1_000_000_000),
        1 => Just(i64::MAX - 1_000_000_000),
        1 => Just(i64::MIN),
        1 => any::<i64>(),
    ]
}

/// Cuts bytes into reads with times.
pub fn timed(bytes: &[u8], lengths: &[usize], begin: i64, steps: &[i64]) -> Vec<Read> {
    let mut now = begin;
    cut(bytes, lengths)
        .zip(steps.iter().cycle())
        .map(|(bytes, step)| {
            now = now.saturating_add(*step);
            Read { time: ReadTime::At(Timestamp::from_ns(now)), bytes: bytes.to_vec() }
        })
        .collect()
}

/// Draws reads with times of every kind.
fn any_times() -> impl Strategy<Value = Vec<Read>> {
    (any_bytes(), cuts(), begin(), steps())
        .prop_map(|(bytes, lengths, begin, steps)| timed(&bytes, &lengths, begin, &steps))
}

/// Draws reads with times of every kind that is believed.
pub fn any_timed() -> impl Strategy<Value = Vec<Read>> {
    any_times().prop_map(|mut reads| {
        for read in &mut reads {
            if let ReadTime::At(time) = &mut read.time {
                *time = (*time).clamp(EARLIEST, LATEST);
            }
        }
        reads
    })
}

/// Draws reads of every kind: with times, without, lines of text.
pub fn any_reads() -> impl Strategy<Value = Vec<Read>> {
    let line = |(bytes, lengths): (Vec<u8>, Vec<usize>)| {
        let time = ReadTime::UnknownAfterSilence;
        cut(&bytes, &lengths).map(|bytes| Read { time, bytes: bytes.to_vec() }).collect()
    };
    prop_oneof![
        4 => any_times(),
        1 => (any_bytes(), cuts()).prop_map(|(bytes, lengths)| untimed(&bytes, &lengths)),
        1 => (any_bytes(), cuts()).prop_map(line),
    ]
}

/// Returns what a listener reads from a simulated bus.
pub fn simulated(
    scenario: Scenario,
    adapter: Adapter,
    line: LineSettings,
    seed: u64,
    frames: u64,
) -> Vec<Read> {
    Simulation::new(Config { seed, frames, line, adapter, scenario })
        .map(|read| Read { time: ReadTime::At(read.time), bytes: read.bytes })
        .collect()
}
