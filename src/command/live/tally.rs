//! Counts what was received, for the status line and the last word.

use std::collections::VecDeque;

use crate::capture::Item;
use crate::capture::mcap::BusSettings;
use crate::pipeline::Event;
use crate::source::Counters;
use crate::time::{SECOND, Timestamp};

/// Over how many seconds the load is taken.
const LOAD_OVER: usize = 10;

/// Counts for a session.
#[derive(Debug, Default)]
pub(in crate::command) struct Tally {
    pub(in crate::command) bytes: u64,
    pub(in crate::command) frames: u64,
    /// Damaged runs.
    pub(in crate::command) damaged: u64,
    /// Bytes with a wrong parity or stop bit, and breaks, as marked in the stream.
    pub(in crate::command) line_errors: u64,
    /// Bytes that are missing, as far as anybody counted.
    pub(in crate::command) lost: u64,
    /// How often an unknown number of bytes is missing.
    pub(in crate::command) holes: u64,
    pub(super) buses: Vec<BusTally>,
    /// Each second, how long all buses together had been busy until then, in nanoseconds.
    pub(super) seconds: VecDeque<(Timestamp, i64)>,
}

#[derive(Debug)]
pub(super) struct BusTally {
    name: String,
    character_ns: i64,
    busy_ns: i64,
    counters: Option<Counters>,
}

impl Tally {
    /// Takes the settings of a bus.
    pub(super) fn begin(&mut self, settings: &BusSettings) {
        let character_ns = settings.line.character_ns();
        match self.buses.iter_mut().find(|bus| bus.name == settings.name) {
            Some(bus) => bus.character_ns = character_ns,
            None => {
                let name = settings.name.clone();
                self.buses.push(BusTally { name, character_ns, busy_ns: 0, counters: None });
            }
        }
    }

    /// Takes what was received.
    pub(super) fn received(&mut self, item: &Item<'_>) {
        match item {
            Item::Chunk { bus, chunk, .. } => {
                self.bytes += chunk.bytes.len() as u64;
                self.line_errors += chunk.line_errors.len() as u64;
                if let Some(bus) = self.buses.iter_mut().find(|known| known.name == *bus) {
                    let length = i64::try_from(chunk.bytes.len()).unwrap_or(i64::MAX);
                    bus.busy_ns = bus.busy_ns.saturating_add(bus.character_ns.saturating_mul(length));
                }
            }
            Item::Lost { lost, .. } => {
                self.lost = self.lost.saturating_add(lost.count);
                self.holes += u64::from(lost.count == 0);
            }
            Item::Line(_) | Item::Silence { .. } | Item::Clock { .. } => {}
        }
    }

    /// Takes an event.
    pub(super) fn event(&mut self, event: &Event<'_>) {
        match event {
            Event::Frame(_) => self.frames += 1,
            Event::Damaged(_) => self.damaged += 1,
            _ => {}
        }
    }

    /// Takes what the adapter of a bus has counted.
    pub(super) fn counters(&mut self, bus: &str, counters: Option<Counters>) {
        if let Some(bus) = self.buses.iter_mut().find(|known| known.name == bus) {
            bus.counters = counters;
        }
    }

    /// Tells whether any adapter reports line errors at all.
    pub(in crate::command) fn counts_line_errors(&self) -> bool {
        self.line_errors > 0 || self.buses.iter().any(|bus| bus.counters.is_some())
    }

    /// Takes note of the time, for the load.
    pub(super) fn pass(&mut self, now: Timestamp) {
        if self.seconds.back().is_some_and(|(last, _)| now - *last < SECOND) {
            return;
        }
        if self.seconds.len() > LOAD_OVER {
            self.seconds.pop_front();
        }
        let busy = self.buses.iter().fold(0_i64, |busy, bus| busy.saturating_add(bus.busy_ns));
        self.seconds.push_back((now, busy));
    }

    /// Returns how busy the buses were of late, from 0 to 1, on average.
    pub(in crate::command) fn load(&self) -> f64 {
        let (Some((from, before)), Some((to, after))) = (self.seconds.front(), self.seconds.back()) else {
            return 0.0;
        };
        let all = (*to - *from) as f64 * self.buses.len() as f64;
        if all > 0.0 { ((after - before) as f64 / all).clamp(0.0, 1.0) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::chunk::{Chunk, ReadTime};

    #[test]
    fn the_load_is_that_of_the_last_ten_seconds() {
        let mut tally = Tally::default();
        tally.begin(&BusSettings { name: "bus0".into(), ..BusSettings::default() });
        for second in 0..60 {
            let now = Timestamp::from_ns(second * SECOND);
            // 480 characters of 9600 8N1 take half a second.
            let bytes = if second < 30 { &[0; 960][..] } else { &[0; 480] };
            let chunk = Chunk { time: ReadTime::At(now), bytes, line_errors: &[] };
            tally.received(&Item::Chunk { bus: "bus0", chunk, ready: None });
            tally.pass(now);
            if second == 20 {
                assert!((tally.load() - 1.0).abs() < 0.01, "{}", tally.load());
            }
        }
        assert!((tally.load() - 0.5).abs() < 0.01, "{}", tally.load());
        assert_eq!(tally.bytes, 30 * 960 + 30 * 480);
    }
}
