//! A source for tests whose line is modelled bit by bit, so that its settings matter.

use std::sync::Arc;
use std::time::Duration;

use super::script::ScriptClock;
use crate::decode::chunk::LineError;
use crate::line::LineSettings;
use crate::simulate::AfterFramingError::WaitForMark;
use crate::simulate::{Uart, Wire};
use crate::source::{Clock, Received, Reception, Source, SourceError};
use crate::time::{SECOND, Timestamp};

/// When simulations begin.
const BEGIN: i64 = 1_767_225_600 * SECOND;

/// Receives what is on a wire, in packets of 16 ms, until a time of the monotonic clock.
pub(super) struct Bits {
    clock: Arc<ScriptClock>,
    uart: Uart,
    begun_ns: u64,
    end_ns: u64,
}

impl Bits {
    pub(super) fn new(clock: &Arc<ScriptClock>, wire: Wire, line: LineSettings, seconds: u64) -> Self {
        let begun_ns = clock.monotonic_ns();
        let end_ns = begun_ns + seconds * SECOND as u64;
        Bits { clock: Arc::clone(clock), uart: Uart::new(wire, line, WaitForMark), begun_ns, end_ns }
    }

    /// Returns the time on the wire.
    fn wire_time(&self) -> Timestamp {
        let elapsed = self.clock.monotonic_ns() - self.begun_ns;
        Timestamp::from_ns(BEGIN) + i64::try_from(elapsed).expect("within a test")
    }
}

impl Source for Bits {
    fn name(&self) -> &str {
        "bits"
    }

    fn receive(&mut self, _timeout: Duration, reception: &mut Reception) -> Result<Received, SourceError> {
        *reception = Reception::default();
        if self.clock.monotonic_ns() >= self.end_ns {
            return Ok(Received::Ended);
        }
        self.clock.go_to(self.clock.monotonic_ns() + 16_000_000);
        let now = self.wire_time();
        while let Some(character) = self.uart.receive(now) {
            let offset = u32::try_from(reception.bytes.len()).expect("within a test");
            reception.line_errors.extend(character.error.map(|kind| LineError { offset, kind }));
            reception.bytes.push(character.value);
        }
        reception.monotonic_ns = self.clock.monotonic_ns();
        reception.ready_ns = reception.monotonic_ns;
        Ok(if reception.bytes.is_empty() { Received::Silence } else { Received::Bytes })
    }

    fn set_line(&mut self, line: LineSettings) -> Result<(), SourceError> {
        let now = self.wire_time();
        self.uart.set_line(line, now);
        Ok(())
    }

    fn adapter_hold_ns(&self) -> Option<i64> {
        Some(16_000_000)
    }
}
