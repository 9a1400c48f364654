//! What is known of the device at an address: identity, values, registers, settings.

use std::collections::VecDeque;
use std::sync::Arc;

use super::age;
use super::pages::Pages;
use crate::decode::transaction::Outcome;
use crate::time::{SECOND, Span, Timestamp};

/// How many points of a quantity are kept; then those of long ago are thinned.
const MOST_POINTS: u64 = 8192;
/// How many points of a quantity are never thinned.
const LATEST_POINTS: usize = 32;
/// How many buckets the points of a quantity have for each time their age doubles, when they are thinned.
const PER_DOUBLING: u64 = 8;
/// How many quantities, registers and settings a device can have.
const MOST: usize = 256;
/// How many changes of a setting are kept.
const MOST_CHANGES: usize = 64;
/// Over how many requests the polls a second are taken.
const POLLS: usize = 16;

/// Is the device at an address.
#[derive(Clone, Debug, Default)]
pub struct Device {
    /// Index of the bus.
    pub bus: usize,
    /// Unit address.
    pub address: u8,
    /// The id of its profile, when it is known.
    pub id: Option<Arc<str>>,
    /// What it is called in rows: short, or likely with a `?`.
    pub label: Arc<str>,
    /// What shows what it is, as it goes on after 'recognised by'.
    pub evidence: Option<Arc<str>>,
    /// Its serial number.
    pub serial: Option<Arc<str>>,
    /// Its software version.
    pub firmware: Option<Box<str>>,
    /// Its hardware version.
    pub hardware: Option<Box<str>>,
    /// Its own error flag, in words, when it was read last.
    pub error_flag: Option<Box<str>>,
    /// Transactions by outcome, in the order of [`Outcome::ALL`].
    pub outcomes: [u64; Outcome::ALL.len()],
    /// Damaged runs that seem to be to or from it.
    pub damaged: u64,
    /// When it was asked or spoke last.
    pub seen: Option<Timestamp>,
    /// When it was read last.
    pub read: Option<Timestamp>,
    /// When it was written to last.
    pub written: Option<Timestamp>,
    /// The last latency.
    pub latency: Option<Span>,
    /// When it was asked, the latest times.
    pub(super) polls: VecDeque<Timestamp>,
    /// What it measures, in the order in which it was first seen.
    pub quantities: Vec<Quantity>,
    /// What was read or written, by function and register.
    pub registers: Vec<Register>,
    /// What it is set to, in the order in which it was first seen.
    pub settings: Vec<Setting>,
    /// What its clock showed.
    pub clock: Option<SensorClock>,
}

/// Is a value at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// When.
    pub time: Timestamp,
    /// The value.
    pub value: f64,
}

/// Is what a device measures.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// What it is called.
    pub name: Arc<str>,
    /// In what it is measured.
    pub unit: Option<Arc<str>>,
    /// The last value in words.
    pub text: Box<str>,
    /// The last value; `None` when it was none.
    pub value: Option<f64>,
    /// When it was measured last.
    pub time: Option<Timestamp>,
    /// Whether the last value is outside of what can be.
    pub is_implausible: bool,
    /// Whether it is calculated.
    pub is_derived: bool,
    /// Whether it is only the likeliest reading.
    pub is_guess: bool,
    /// What was measured.
    pub history: Pages<Point>,
}

/// Is a stretch of registers as it was read or written last.
#[derive(Clone, Debug, PartialEq)]
pub struct Register {
    /// Function code of the request.
    pub function: u8,
    /// The first register.
    pub start: u16,
    /// How many were asked for.
    pub quantity: Option<u16>,
    /// What it is called.
    pub title: Arc<str>,
    /// The data last read or written, high byte first.
    pub words: Box<[u8]>,
    /// How often.
    pub count: u64,
    /// When last.
    pub time: Option<Timestamp>,
    /// How it ended last.
    pub outcome: Outcome,
}

/// Is a setting or a calibration value.
#[derive(Clone, Debug)]
pub struct Setting {
    /// What it is called.
    pub name: Arc<str>,
    /// Each time it was seen with another value, the last at the end.
    pub changes: VecDeque<Change>,
}

/// Is a setting seen at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// When it was seen first.
    pub time: Option<Timestamp>,
    /// The value in words.
    pub text: Box<str>,
    /// Whether it was written then, or only read.
    pub is_written: bool,
}

/// Is what a device's clock showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorClock {
    /// What it showed, as nanoseconds since 1970 in its own zone.
    pub shown: Timestamp,
    /// When that was, by the host.
    pub at: Timestamp,
}

impl Device {
    /// Returns bus and address: devices are in the order of these.
    pub fn key(&self) -> (usize, u8) {
        (self.bus, self.address)
    }

    /// Returns how many transactions were to it.
    pub fn transactions(&self) -> u64 {
        self.outcomes.iter().sum()
    }

    /// Returns how many of them had an outcome.
    pub fn count(&self, outcome: Outcome) -> u64 {
        let place = Outcome::ALL.iter().position(|known| *known == outcome);
        place.and_then(|place| self.outcomes.get(place)).copied().unwrap_or(0)
    }

    /// Returns how many of them went wrong: exceptions, no response, damaged, late.
    pub fn errors(&self) -> u64 {
        [Outcome::Exception, Outcome::NoResponse, Outcome::Damaged, Outcome::Late]
            .map(|outcome| self.count(outcome))
            .iter()
            .sum()
    }

    /// Returns how often it is asked a second, of late, as of now; `None` after a single request.
    pub fn polls_per_second(&self, now: Option<Timestamp>) -> Option<f64> {
        let (first, last) = (*self.polls.front()?, *self.polls.back()?);
        let count = i64::try_from(self.polls.len()).unwrap_or(i64::MAX) - 1;
        if count < 1 {
            return None;
        }
        let usual = (last - first) / count;
        // When the next request is overdue, the wait for it counts, too.
        let waited = now.map_or(0, |now| now - last);
        let elapsed = if waited > usual.saturating_mul(2) { last - first + waited } else { last - first };
        (elapsed > 0).then(|| count as f64 / (elapsed as f64 / SECOND as f64))
    }

    /// Keeps of the points of each series only the least and the most of stretches, the longer the longer ago.
    pub(super) fn thin(&mut self) {
        self.quantities.iter_mut().for_each(|quantity| thin(&mut quantity.history));
    }

    /// Returns about how many bytes its series and lists take.
    pub(super) fn size(&self) -> usize {
        let points = |quantity: &Quantity| {
            size_of::<Quantity>() + quantity.history.len() * size_of::<Point>() + quantity.text.len() + 64
        };
        let changes = |setting: &Setting| {
            size_of::<Setting>() + setting.changes.len() * (size_of::<Change>() + 32) + 64
        };
        let words = |register: &Register| size_of::<Register>() + register.words.len() + 16;
        size_of::<Device>()
            + self.quantities.iter().map(points).sum::<usize>()
            + self.settings.iter().map(changes).sum::<usize>()
            + self.registers.iter().map(words).sum::<usize>()
    }

    /// Takes note of a request.
    pub(super) fn poll(&mut self, time: Option<Timestamp>) {
        let Some(time) = time else { return };
        if self.polls.len() == POLLS {
            self.polls.pop_front();
        }
        self.polls.push_back(time);
    }

    /// Takes a measured or derived value.
    pub(super) fn measure(&mut self, new: Quantity) {
        let known = self.quantities.iter_mut().find(|known| known.name == new.name);
        let Some(known) = known else {
            if self.quantities.len() < MOST {
                self.quantities.push(Quantity { history: history(Pages::default(), &new), ..new });
            }
            return;
        };
        let before = std::mem::take(&mut known.history);
        *known = Quantity { history: history(before, &new), ..new };
    }

    /// Takes registers that were read or written.
    pub(super) fn register(&mut self, new: Register) {
        let key = |register: &Register| (register.function, register.start);
        match self.registers.binary_search_by_key(&key(&new), key) {
            Ok(at) => {
                let known = &mut self.registers[at]; // found there
                let words = if new.words.is_empty() { std::mem::take(&mut known.words) } else { new.words };
                *known = Register { count: known.count.saturating_add(1), words, ..new };
            }
            Err(at) if self.registers.len() < MOST => self.registers.insert(at, new),
            Err(_) => {}
        }
    }

    /// Takes a setting that was read or written.
    pub(super) fn set(&mut self, name: &Arc<str>, new: Change) {
        let known = self.settings.iter_mut().find(|known| known.name == *name);
        let Some(known) = known else {
            if self.settings.len() < MOST {
                self.settings.push(Setting { name: Arc::clone(name), changes: VecDeque::from([new]) });
            }
            return;
        };
        if known.changes.back().is_some_and(|last| last.text == new.text) {
            return;
        }
        if known.changes.len() == MOST_CHANGES {
            known.changes.pop_front();
        }
        known.changes.push_back(new);
    }
}

/// Adds the value of a quantity to its history.
fn history(mut history: Pages<Point>, quantity: &Quantity) -> Pages<Point> {
    if let (Some(time), Some(value)) = (quantity.time, quantity.value) {
        history.push(Point { time, value });
        if history.len() as u64 > MOST_POINTS {
            thin(&mut history);
            history.keep(MOST_POINTS / 2);
        }
    }
    history
}

/// Keeps the least and the most point of each bucket, and all of the latest.
fn thin(history: &mut Pages<Point>) {
    let Some(now) = history.last().map(|point| point.time.as_ns()) else { return };
    let old = history.len().saturating_sub(LATEST_POINTS);
    let mut kept: Vec<Point> = Vec::new();
    let mut within = None;
    // Where the bucket's points begin among those that are kept: at most two.
    let mut begin = 0;
    for (at, point) in history.iter().enumerate() {
        let bucket = (at < old).then(|| age::bucket(point.time.as_ns(), now, PER_DOUBLING));
        if bucket.is_none() || bucket != within {
            (within, begin) = (bucket, kept.len());
            kept.push(*point);
            continue;
        }
        match kept[begin..] {
            [one] if one.value != point.value => kept.push(*point),
            [one, other] => {
                let (least, most) = (one.value.min(other.value), one.value.max(other.value));
                if point.value < least || point.value > most {
                    // In the order of time: what stays is the other extreme.
                    let is_new_least = point.value < least;
                    kept[begin] = if (one.value <= other.value) == is_new_least { other } else { one };
                    kept[begin + 1] = *point;
                }
            }
            _ => {}
        }
    }
    if kept.len() < history.len() {
        history.replace(&kept);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_month_of_points_is_thinned_to_its_extremes_and_the_latest() {
        let mut history = Pages::default();
        let value = |second: i64| if second == 70_000 { 99.0 } else { (second % 10) as f64 };
        for second in 0..100_000_i64 {
            history.push(Point { time: Timestamp::from_ns(second * SECOND), value: value(second) });
            if second % 1000 == 999 {
                thin(&mut history);
            }
        }
        assert!(history.len() < 400, "{}", history.len());
        assert_eq!(history.total(), 100_000);
        let points: Vec<_> = history.iter().collect();
        assert!(points.windows(2).all(|pair| pair[0].time < pair[1].time));
        assert!(points.iter().any(|point| point.value == 99.0), "the spike is still there");
        let latest: Vec<_> = points.iter().rev().take(LATEST_POINTS).map(|point| point.value).collect();
        assert_eq!(latest, (0..32).map(|ago| value(99_999 - ago)).collect::<Vec<_>>());
        assert!(
            points.iter().all(|point| point.value == value(point.time.as_ns() / SECOND)),
            "all were measured"
        );
    }
}
