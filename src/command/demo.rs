//! `rtutap demo`: a simulated installation with faults in it, as it happens.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::failure::Failure;
use super::output::Output;
use super::{message, simulate};
use crate::capture::BUS;
use crate::cli;
use crate::device::{Devices, Environment, Profiles};
use crate::line::LineSettings;
use crate::pipeline::{Options, Pipeline};
use crate::report::info::Info;
use crate::report::{Clock, Rows, Show, Text, TimeStyle};
use crate::simulate::{Adapter, Config, Read, Simulation};
use crate::time::{SECOND, Timestamp};

/// Runs the command.
pub(super) fn run(args: &cli::Demo, verbose: bool) -> Result<(), Failure> {
    let config = Config {
        seed: args.seed,
        frames: u64::MAX,
        line: LineSettings::default(),
        adapter: Adapter::Usb1,
        scenario: simulate::scenario("demo")?,
    };
    let profiles = Arc::new(Profiles::built_in());
    let (output, colour) = Output::terminal();
    let text = Text::new(Clock::new(TimeStyle::Relative), colour, verbose, &profiles);
    let rows = Rows::new(vec![Show::Devices, Show::Transactions], Box::new(text), None);
    let devices = Devices::new(Arc::clone(&profiles), Environment::default());
    let options = Options {
        line: config.line,
        adapter_hold_ns: Some(config.adapter.hold_ns(config.line)),
        first_frame_id: 0,
        first_transaction_id: 0,
        readings: false,
    };
    let pipeline = Pipeline::new(options, devices, profiles.shapes());
    let mut info = Info::new(&profiles);
    info.begin(BUS, config.line);
    let mut demo = Stage { pipeline, rows, info, output };
    message::note("a simulated installation: one master, three sensors, and faults; nothing is connected");
    demo.play(Simulation::new(config), i64::from(args.duration).saturating_mul(SECOND))
}

/// Plays a simulation in real time.
struct Stage {
    pipeline: Pipeline,
    rows: Rows,
    info: Info,
    output: Output,
}

impl Stage {
    fn play(&mut self, simulation: Simulation, duration: i64) -> Result<(), Failure> {
        let mut clock = None;
        for read in simulation {
            let clock = clock.get_or_insert_with(|| RealTime::new(read.time));
            if read.time - clock.origin > duration {
                break;
            }
            // Silence decides things too: who did not answer is known before the next byte comes.
            while let Some(deadline) = self.pipeline.poll_timeout().filter(|deadline| *deadline < read.time) {
                clock.wait_for(deadline);
                self.pipeline.handle_timeout(deadline);
                self.show()?;
                if self.pipeline.poll_timeout() == Some(deadline) {
                    break;
                }
            }
            clock.wait_for(read.time);
            self.take(&read)?;
        }
        self.pipeline.finish();
        self.show()?;
        let summary = self.info.to_text(Clock::new(TimeStyle::Relative));
        self.output.buffer.push(b'\n');
        self.output.buffer.extend_from_slice(summary.as_bytes());
        self.output.flush()
    }

    fn take(&mut self, read: &Read) -> Result<(), Failure> {
        self.pipeline.handle_bytes(&read.chunk());
        self.show()
    }

    fn show(&mut self) -> Result<(), Failure> {
        while let Some(event) = self.pipeline.poll_event() {
            self.info.event(BUS, &event);
            self.rows.event(BUS, &event, &mut self.output.buffer);
        }
        if self.output.buffer.is_empty() { Ok(()) } else { self.output.flush() }
    }
}

/// Maps simulated time to the clock on the wall.
struct RealTime {
    origin: Timestamp,
    begun: Instant,
}

impl RealTime {
    fn new(origin: Timestamp) -> Self {
        #[expect(clippy::disallowed_methods, reason = "the demo runs in real time")]
        let begun = Instant::now();
        RealTime { origin, begun }
    }

    /// Waits until a simulated time has come.
    fn wait_for(&self, time: Timestamp) {
        let due = Duration::from_nanos(u64::try_from(time - self.origin).unwrap_or(0));
        #[expect(clippy::disallowed_methods, reason = "the demo runs in real time")]
        std::thread::sleep(due.saturating_sub(self.begun.elapsed()));
    }
}
