//! What the views show: rows, devices, health, findings. Bounded, and cheap to copy.
//!
//! ```text
//! pipeline events ──▶ Feed ──▶ Store ──▶ a copy for the screen
//! ```
//!
//! A [`Store`] is a value: whoever decodes grows one through a [`Feed`], and hands copies to the screen, which shows
//! the latest it was given. A seek in a recording hands over a store as it was there; a frozen screen keeps the one it
//! has. Rows have absolute numbers, which stay the same as old rows leave memory.

mod age;
mod device;
mod feed;
mod finding;
mod health;
mod json;
mod learn;
mod names;
mod pages;
mod row;
mod subject;

use std::sync::Arc;

pub use device::{Change, Device, Point, Quantity, Register, SensorClock, Setting};
pub use feed::{BusFacts, Feed};
pub use finding::{Findings, Found};
pub use health::{Health, Histogram, Second};
pub use json::RowJson;
pub use pages::Pages;
pub use row::{Exchange, Field, Remark, RemarkKind, Row, Run, RunKind, Tone};
pub use subject::RowSubject;

use crate::line::LineSettings;
use crate::time::Timestamp;

/// How many transactions, and how many frames, are kept at most.
pub const MOST_ROWS: u64 = 100_000;
/// How much memory the rows of a list take at most, in bytes, by estimate.
pub const MOST_BYTES: usize = 32 << 20;

/// From where on rows are counted while nobody knows how many came before them.
pub const PROVISIONAL: u64 = 1 << 40;

/// Names the lists of rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum List {
    /// Transactions, and damaged runs that belong to none.
    #[default]
    Exchanges,
    /// Frames and damaged runs in the order of the stream.
    Frames,
}

/// Holds what is known of a bus.
#[derive(Clone, Debug)]
pub struct Bus {
    /// What it is called.
    pub name: Arc<str>,
    /// Speed and character format.
    pub line: LineSettings,
    /// Where it is received from.
    pub source: Option<Arc<str>>,
    /// The longest time the adapter keeps a byte back, in nanoseconds; `None` while it is estimated.
    pub hold_ns: Option<i64>,
    /// Facts about the adapter: key and value.
    pub facts: Arc<[(String, String)]>,
    /// What the adapter tells of line errors, in words.
    pub error_reports: Option<&'static str>,
    /// Since when its source is gone.
    pub away_since: Option<Timestamp>,
    /// Counts and series.
    pub health: Arc<Health>,
}

/// Is a list of rows with its size.
#[derive(Clone, Debug, Default)]
struct Rows {
    pages: Pages<Row>,
    /// Estimated bytes of what is kept.
    size: usize,
}

impl Rows {
    /// Adds a row and forgets the oldest, where it gets too much.
    fn push(&mut self, row: Row) -> u64 {
        self.size = self.size.saturating_add(row.size());
        let number = self.pages.push(row);
        while self.size > MOST_BYTES || self.pages.total() - self.pages.first_kept() > MOST_ROWS {
            let first = self.pages.first_kept();
            let before: usize = self.pages.range(first..first + pages::PAGE as u64).map(Row::size).sum();
            self.pages.drop_oldest();
            if self.pages.first_kept() == first {
                break;
            }
            self.size = self.size.saturating_sub(before);
        }
        number
    }

    /// Forgets the rows before this one.
    fn forget_before(&mut self, number: u64) {
        self.pages.forget_before(number);
        self.size = self.pages.iter().map(Row::size).sum();
    }
}

/// Holds what the views show.
#[derive(Clone, Debug, Default)]
pub struct Store {
    exchanges: Rows,
    frames: Rows,
    buses: Vec<Arc<Bus>>,
    devices: Vec<Arc<Device>>,
    findings: Findings,
    /// The first time there is.
    begun: Option<Timestamp>,
    /// Up to when everything is in here.
    now: Option<Timestamp>,
    /// From when on it was decoded, where that is not from the beginning.
    known_from: Option<Timestamp>,
    /// Counts what happened: two stores of one session with the same count are the same.
    revision: u64,
}

impl Store {
    /// Returns a list of rows.
    pub fn list(&self, list: List) -> &Pages<Row> {
        match list {
            List::Exchanges => &self.exchanges.pages,
            List::Frames => &self.frames.pages,
        }
    }

    /// Returns the buses in the order in which they began.
    pub fn buses(&self) -> &[Arc<Bus>] {
        &self.buses
    }

    /// Returns the devices by bus and address.
    pub fn devices(&self) -> &[Arc<Device>] {
        &self.devices
    }

    /// Returns the device at an address of a bus.
    pub fn device(&self, bus: usize, address: u8) -> Option<&Arc<Device>> {
        let at = self.devices.binary_search_by_key(&(bus, address), |device| device.key()).ok()?;
        self.devices.get(at)
    }

    /// Returns what is wrong with the traffic.
    pub fn findings(&self) -> &Findings {
        &self.findings
    }

    /// Returns the first time there is; `None` for traffic without times.
    pub fn begun(&self) -> Option<Timestamp> {
        self.begun
    }

    /// Returns up to when everything is in here; `None` for traffic without times.
    pub fn now(&self) -> Option<Timestamp> {
        self.now
    }

    /// Returns from when on the traffic was decoded, where what came before is not known yet: numbers, ids
    /// and offsets of rows say nothing then, findings are not there, and devices and counts are those since.
    pub fn known_from(&self) -> Option<Timestamp> {
        self.known_from
    }

    /// Returns since when counts and series are in here: the first time there is, or from when on it was decoded.
    pub fn counted_since(&self) -> Option<Timestamp> {
        self.known_from.or(self.begun)
    }

    /// Returns about how many bytes of memory it takes.
    pub fn size(&self) -> usize {
        let rows = self.exchanges.size + self.frames.size;
        let devices = self.devices.iter().map(|device| device.size()).sum::<usize>();
        let buses = self.buses.iter().map(|bus| bus.health.size() + size_of::<Bus>()).sum::<usize>();
        rows + devices + buses + self.findings.size()
    }

    /// Returns a count of what happened so far.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns the number of the row of a frame or damaged run by its id, as far as it is kept.
    pub fn frame_row(&self, id: u64) -> Option<u64> {
        let frames = &self.frames.pages;
        let id_at = |number: u64| match frames.get(number) {
            Some(Row::Run(run)) => Some(run.id),
            _ => None,
        };
        // Ids grow with the numbers, but for remarks between them and a little disorder among buses.
        let (mut low, mut high) = (frames.first_kept(), frames.total());
        while low < high {
            let middle = low + (high - low) / 2;
            let nearest = (middle..high).find_map(|number| Some((number, id_at(number)?)));
            match nearest {
                Some((number, found)) if found < id => low = number + 1,
                _ => high = middle,
            }
        }
        let around = low.saturating_sub(64)..low.saturating_add(64);
        around.clone().find(|number| id_at(*number) == Some(id))
    }
}
