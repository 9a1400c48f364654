//! A simulation as a source, in real time.

use std::sync::Arc;
use std::time::Duration;

use crate::simulate::{Read, Simulation};
use crate::source::{Clock, Received, Reception, Source, SourceError};
use crate::time::Timestamp;

/// Maps simulated time to the monotonic clock: its first read is now.
pub(super) struct Pace {
    origin: Option<(Timestamp, u64)>,
}

impl Pace {
    pub(super) fn new() -> Self {
        Pace { origin: None }
    }

    /// Returns how long it is until a read is due.
    pub(super) fn until(&mut self, read: &Read, now_ns: u64) -> Duration {
        let (first, begun_ns) = *self.origin.get_or_insert((read.time, now_ns));
        let due = begun_ns.saturating_add(u64::try_from(read.time - first).unwrap_or(0));
        Duration::from_nanos(due.saturating_sub(now_ns))
    }
}

/// Plays a simulation.
pub(super) struct Played {
    simulation: std::iter::Peekable<Simulation>,
    pace: Pace,
    clock: Arc<dyn Clock>,
}

impl Played {
    pub(super) fn new(simulation: Simulation, clock: Arc<dyn Clock>) -> Self {
        Played { simulation: simulation.peekable(), pace: Pace::new(), clock }
    }
}

impl Source for Played {
    fn name(&self) -> &str {
        "simulation"
    }

    fn receive(&mut self, timeout: Duration, reception: &mut Reception) -> Result<Received, SourceError> {
        reception.clear();
        let Some(read) = self.simulation.peek() else { return Ok(Received::Ended) };
        let wait = self.pace.until(read, self.clock.monotonic_ns());
        #[expect(clippy::disallowed_methods, reason = "the demo runs in real time")]
        std::thread::sleep(wait.min(timeout));
        reception.monotonic_ns = self.clock.monotonic_ns();
        reception.ready_ns = reception.monotonic_ns;
        let Some(read) = self.simulation.next_if(|_| wait <= timeout) else { return Ok(Received::Silence) };
        (reception.bytes, reception.line_errors) = (read.bytes, read.line_errors);
        Ok(Received::Bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::LineSettings;
    use crate::simulate::{Adapter, Config, Scenario};
    use crate::source::SystemClock;

    #[test]
    fn a_played_simulation_gives_its_bytes_in_real_time() {
        let scenario = Scenario::named("installation").expect("a scenario");
        let line = LineSettings::default();
        let config = Config { seed: 1, frames: 2, line, adapter: Adapter::Uart, scenario };
        let expected: Vec<Read> = Simulation::new(config).collect();
        let clock = Arc::new(SystemClock);
        let mut played = Played::new(Simulation::new(config), clock.clone());
        let (begun, mut bytes, mut reception) = (clock.monotonic_ns(), Vec::new(), Reception::default());
        while played.receive(Duration::from_millis(20), &mut reception).expect("never fails")
            != Received::Ended
        {
            bytes.extend_from_slice(&reception.bytes);
        }
        let length = expected[expected.len() - 1].time - expected[0].time;
        assert!(clock.monotonic_ns() - begun >= length as u64);
        assert_eq!(bytes, expected.into_iter().flat_map(|read| read.bytes).collect::<Vec<u8>>());
    }
}
