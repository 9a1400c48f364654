use std::path::Path;
use std::sync::mpsc::{channel, sync_channel};

use super::super::bits::Bits;
use super::super::capture::{Capture, Next, Outlet, Refused};
use super::super::disk::{Disk, Floor};
use super::super::ring::Ring;
use super::super::rows::RowStream;
use super::super::script::{Act, Script, ScriptClock};
use super::super::tape::Tape;
use super::super::writer::{Outcome, Writer};
use super::*;
use crate::capture::Input;
use crate::capture::mcap::Options;
use crate::command::journal::Journal;
use crate::command::printing::{Printing, judge};
use crate::device::Profiles;
use crate::report::{Json, Show};
use crate::simulate::{Adapter, Config, Scenario, Simulation, Wire};
use crate::source::Source;
use crate::time::MILLISECOND;

const START: u64 = 3_600_000_000_000;

/// A disk with room for everything.
struct Large;

impl Disk for Large {
    fn free(&self, _file: &Path) -> std::io::Result<u64> {
        Ok(u64::MAX)
    }

    fn oldest(&self) -> Vec<std::path::PathBuf> {
        Vec::new()
    }

    fn remove(&self, _path: &Path) -> std::io::Result<()> {
        Ok(())
    }
}

fn setup() -> Setup {
    Setup::new(Arc::new(Profiles::built_in()))
}

fn printing() -> Printing {
    let show = vec![Show::Frames, Show::Transactions, Show::Readings];
    Printing::of(show, Box::new(Json::default()), None, false)
}

/// Simulates a bus: what an adapter reads, on the monotonic clock.
fn traffic(scenario: &str, adapter: Adapter, seed: u64, frames: u64) -> Vec<(u64, Act)> {
    let scenario = Scenario::named(scenario).expect("a scenario");
    let line = LineSettings::default();
    let simulation = Simulation::new(Config { seed, frames, line, adapter, scenario });
    let begun = 1_767_225_600 * SECOND;
    let acts = simulation.map(|read| {
        let time = START + (read.time.as_ns() - begun) as u64;
        let is_suspect = read.bytes.len() > 40;
        (time, Act::Read { bytes: read.bytes, line_errors: read.line_errors, is_suspect })
    });
    acts.collect()
}

/// Is a session on a scripted clock, all in one thread.
struct Bench<'a> {
    engine: Engine<'a>,
    clock: Arc<ScriptClock>,
    captures: Vec<(Capture, bool)>,
    orders: Vec<std::sync::mpsc::Receiver<Order>>,
    rows: std::sync::mpsc::Receiver<Vec<u8>>,
    batches: std::sync::mpsc::Receiver<Vec<super::super::entry::Entry>>,
    writer: Writer,
    lines: Vec<u8>,
    notices: Vec<Notice>,
}

/// Hands on to the engine at once, unless the queue is said to be full.
struct Direct<'a, 'b> {
    engine: &'a mut Engine<'b>,
    source: usize,
    is_full: bool,
}

impl Outlet for Direct<'_, '_> {
    fn offer(&mut self, what: Captured) -> Result<(), Refused> {
        if self.is_full {
            return Err(Refused::Full(what));
        }
        self.engine.take(self.source, what).map_err(|_| Refused::Closed)
    }
}

impl<'a> Bench<'a> {
    fn new(
        setup: &'a Setup,
        path: &Path,
        scripts: Vec<Vec<(u64, Act)>>,
        around: Option<(&str, i64)>,
    ) -> Self {
        let clock = ScriptClock::new();
        let sources = scripts.into_iter().enumerate().map(|(index, acts)| {
            let source: Box<dyn Source> = Box::new(Script::new(&clock, acts, index == 0));
            source
        });
        let sources = sources.collect();
        Bench::of(setup, path, clock, sources, around, false)
    }

    /// Taps sources; where it `searches`, their line settings are to be found.
    fn of(
        setup: &'a Setup,
        path: &Path,
        clock: Arc<ScriptClock>,
        sources: Vec<Box<dyn Source>>,
        around: Option<(&str, i64)>,
        searches: bool,
    ) -> Self {
        let anchor = super::super::anchor(&*clock);
        let options = Options { anchor: Some(anchor), is_durable: true, ..Options::default() };
        let journal = Journal::create(path, options).expect("a disk that works");
        let floor = Floor { min_free: 0, drop_oldest: false };
        let writer = Writer::new(journal, floor, Box::new(Large), channel().0);
        let ((queue, batches), (printer, rows)) = (sync_channel(100_000), sync_channel(100_000));
        let ring = around.map(|(_, span)| Ring::new(span, usize::MAX));
        let stage = Stage {
            rows: Some(RowStream::new(printing(), printer, false)),
            tape: Some(Tape::new(queue, false, false, ring)),
            trigger: around.map(|(filter, _)| judge("--trigger", filter, &setup.profiles).expect("a filter")),
            ..Stage::default()
        };
        let (mut tapped, mut captures, mut orders) = (Vec::new(), Vec::new(), Vec::new());
        for (index, source) in sources.into_iter().enumerate() {
            let name = format!("bus{index}");
            let settings = super::super::sources::settings(&*source, name.clone(), LineSettings::default());
            let (order, receiver) = channel();
            tapped.push(Tapped { searches, ..Tapped::new(name, settings, order) });
            captures.push((Capture::new(source, clock.clone(), false), true));
            orders.push(receiver);
        }
        let engine = Engine::new(setup, stage, tapped, anchor, clock.clone()).expect("a reader");
        Bench {
            engine,
            clock,
            captures,
            orders,
            rows,
            batches,
            writer,
            lines: Vec::new(),
            notices: Vec::new(),
        }
    }

    /// Lets every source take a step; tells whether any has not ended.
    fn step(&mut self, is_full: bool) -> bool {
        for (source, (capture, is_open)) in
            self.captures.iter_mut().enumerate().filter(|(_, (_, open))| *open)
        {
            let mut outlet = Direct { engine: &mut self.engine, source, is_full };
            match capture.step(&mut outlet) {
                Next::Step => {}
                Next::Wait(time) => self.clock.go_to(self.clock.monotonic_ns() + time.as_nanos() as u64),
                Next::End => *is_open = false,
            }
        }
        self.engine.pause().expect("a reader");
        for source in 0..self.orders.len() {
            while let Ok(Order::SetLine(line)) = self.orders[source].try_recv() {
                self.set_line(source, line);
            }
        }
        self.notices.extend(self.engine.take_notices());
        self.rows.try_iter().for_each(|rows| self.lines.extend(rows));
        self.batches.try_iter().flatten().for_each(|entry| self.writer.take(&entry));
        self.captures.iter().any(|(_, is_open)| *is_open)
    }

    fn set_line(&mut self, source: usize, line: LineSettings) {
        let mut outlet = Direct { engine: &mut self.engine, source, is_full: false };
        self.captures[source].0.set_line(line, &mut outlet);
    }

    /// Ends the session; returns its rows, what people were told, and what became of the recording.
    fn finish(mut self) -> (String, Vec<Notice>, Outcome) {
        let (mut stage, result) = self.engine.finish();
        result.expect("a reader");
        stage.rows.take().expect("rows").finish();
        stage.tape.take().expect("a tape").finish();
        self.rows.try_iter().for_each(|rows| self.lines.extend(rows));
        let outcome = self.writer.run(&self.batches);
        (String::from_utf8(self.lines).expect("UTF-8"), self.notices, outcome)
    }
}

/// Prints what `decode` prints of a recording.
fn decoded(path: &Path, setup: &Setup) -> String {
    struct Printer(Printing, Vec<u8>);
    impl Sink for Printer {
        const RECEIVES: bool = false;

        fn begin(&mut self, _origin: &Origin) -> Result<(), Failure> {
            Ok(())
        }
        fn event(&mut self, bus: &str, event: &crate::pipeline::Event<'_>) {
            self.0.event(bus, event, &mut self.1);
        }
        fn pause(&mut self, settled_frame: u64, _waits: bool) -> Result<(), Failure> {
            self.0.settle(settled_frame, &mut self.1);
            Ok(())
        }
    }
    let mut printer = Printer(printing(), Vec::new());
    let mut session = Session::new(setup);
    let mut input = Input::open(path, None).expect("a recording");
    while let Some(item) = input.next_item().expect("a disk that works") {
        session.take(&item, &mut printer).expect("a sink that takes all");
    }
    assert!(input.facts().is_some_and(|facts| facts.is_complete()));
    session.finish(&mut printer).expect("a sink that takes all");
    String::from_utf8(printer.1).expect("UTF-8")
}

#[track_caller]
fn assert_same(live: &str, decoded: &str) {
    for (number, (live, decoded)) in live.lines().zip(decoded.lines()).enumerate() {
        assert_eq!(live, decoded, "line {number}");
    }
    assert_eq!(live.lines().count(), decoded.lines().count());
}

/// Runs a session with everything that can happen to it; returns its rows after holding them against its recording.
fn held_against_its_recording(
    scripts: Vec<Vec<(u64, Act)>>,
    mut meanwhile: impl FnMut(u64, &mut Bench<'_>) -> bool,
) -> String {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let setup = setup();
    let mut bench = Bench::new(&setup, &path, scripts, None);
    for step in 0.. {
        let is_full = meanwhile(step, &mut bench);
        if !bench.step(is_full) {
            break;
        }
    }
    let (live, ..) = bench.finish();
    assert_same(&live, &decoded(&path, &setup));
    live
}

#[test]
fn live_rows_equal_those_of_their_own_recording() {
    for (adapter, seed) in [(Adapter::Uart, 1), (Adapter::Ftdi16, 2), (Adapter::Idle64, 3)] {
        let live =
            held_against_its_recording(vec![traffic("everything-bad", adapter, seed, 400)], |_, _| false);
        assert!(live.lines().count() > 400, "{}", live.lines().count());
    }
}

#[test]
fn so_do_those_of_several_buses_with_holes_losses_and_another_line() {
    let mut pump = traffic("everything-bad", Adapter::Ftdi16, 5, 300);
    let middle = pump[pump.len() / 2].0;
    pump.push((middle, Act::Gone));
    pump.push((middle / 2 + START / 2, Act::Overruns(3)));
    pump.sort_by_key(|(time, _)| *time);
    let tank = traffic("installation", Adapter::Uart, 6, 200);
    let live = held_against_its_recording(vec![pump, tank], |step, bench| {
        if step == 500 {
            bench.set_line(1, "9600-8E1".parse().expect("a line"));
        }
        step % 100 > 96
    });
    for word in ["\"bus0\"", "\"bus1\"", "source-gone", "\"queue\"", "\"overrun\"", "no-response"] {
        assert!(live.contains(word), "{word} did not happen");
    }
}

#[test]
fn what_silence_decides_is_said_when_it_does_not_when_the_next_byte_comes() {
    let request = Act::read(&[0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41]);
    let directory = tempfile::tempdir().expect("a directory");
    let setup = setup();
    let script = vec![vec![(START, request.clone()), (START + 60_000_000_000, request)]];
    let mut bench = Bench::new(&setup, &directory.path().join("a.mcap"), script, None);
    while bench.clock.monotonic_ns() < START + 10_000_000_000 {
        bench.step(false);
    }
    let lines = String::from_utf8(bench.lines).expect("UTF-8");
    assert!(lines.contains("no-response"), "{lines}");
}

#[test]
fn a_wall_clock_that_is_set_changes_no_time_and_is_told() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let setup = setup();
    let script = traffic("installation", Adapter::Uart, 1, 100);
    let (first, last) = (script[0].0, script[script.len() - 1].0);
    let mut bench = Bench::new(&setup, &path, vec![script], None);
    let mut was_set = false;
    while bench.step(false) {
        if !was_set && bench.clock.monotonic_ns() > (first + last) / 2 {
            bench.clock.set_by(3600 * SECOND);
            was_set = true;
        }
    }
    let (live, notices, _) = bench.finish();
    assert!(matches!(&notices[..], [Notice::Note(text)] if text.contains("+3600.000 s")), "{notices:?}");
    let times = live.lines().filter_map(|line| {
        let row: serde_json::Value = serde_json::from_str(line).expect("JSON");
        row["end_ns"].as_i64()
    });
    let times: Vec<i64> = times.collect();
    let span = times.iter().max().expect("rows") - times.iter().min().expect("rows");
    assert!(span <= (last - first) as i64 + 2 * SECOND, "{span}");
    assert_same(&live, &decoded(&path, &setup));
}

#[test]
fn a_source_that_fails_is_named_and_the_others_go_on() {
    let directory = tempfile::tempdir().expect("a directory");
    let setup = setup();
    let tank = traffic("installation", Adapter::Uart, 1, 50);
    let mut bench =
        Bench::new(&setup, &directory.path().join("a.mcap"), vec![vec![(START, Act::Fail)], tank], None);
    while bench.step(false) {}
    assert_eq!(bench.engine.failed(), Some("bus0"));
    let (live, notices, _) = bench.finish();
    assert!(live.contains("\"bus1\"") && notices.len() == 1, "{notices:?}");
}

#[test]
fn only_the_time_around_what_matches_is_recorded_in_files_that_begin_with_whole_frames() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let setup = setup();
    // Polls four times a second of unit 1, and of unit 9 but twice in ten minutes.
    let [unit_1, unit_9] = [[1, 3, 0, 0, 0, 1, 0x84, 0x0A], [9, 3, 0, 0, 0, 1, 0x85, 0x42]];
    let script = (0..2400_u64).map(|n| {
        let bytes = if n == 800 || n == 1600 { unit_9 } else { unit_1 };
        (START + n * 250_000_000, Act::read(&bytes))
    });
    let mut bench = Bench::new(&setup, &path, vec![script.collect()], Some(("addr == 9", 20 * SECOND)));
    while bench.step(false) {}
    let (_, _, outcome) = bench.finish();
    assert_eq!(outcome.files.len(), 2, "{outcome:?}");
    for file in &outcome.files {
        let rows = decoded(file, &setup);
        let frames = rows.lines().filter(|row| row.contains("\"type\":\"frame\"")).count();
        assert!((160..=180).contains(&frames), "{frames}");
        assert!(!rows.contains("damaged") && rows.contains("\"address\":9"));
        let first: serde_json::Value =
            serde_json::from_str(rows.lines().next().expect("a row")).expect("JSON");
        assert!(first["start_ns"].as_i64() > Some(1_767_225_600 * SECOND + 100 * MILLISECOND), "{first}");
    }
}

/// Taps a bus whose line settings nobody knows, for some seconds; returns rows, notices, and the file, decoded.
fn searched(wire: Wire, seconds: u64) -> (String, String, String) {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let (setup, clock) = (setup(), ScriptClock::new());
    let source: Box<dyn Source> = Box::new(Bits::new(&clock, wire, LineSettings::default(), seconds));
    let mut bench = Bench::of(&setup, &path, clock, vec![source], None, true);
    while bench.step(false) {}
    let (live, notices, _) = bench.finish();
    let said: Vec<String> = notices.iter().map(|notice| format!("{notice:?}")).collect();
    (live, said.join("\n"), decoded(&path, &setup))
}

#[test]
fn a_line_that_nobody_knows_is_found_told_and_recorded_with_all_that_came_before() {
    let line = "38400-8E1".parse().expect("a line");
    let scenario = Scenario::named("installation").expect("a scenario");
    let config = Config { seed: 1, frames: 300, line, adapter: Adapter::Uart, scenario };
    let (live, said, decoded) = searched(Wire::traffic(config), 40);
    for part in ["trying 19200-8N1: 9600-8N1 gave no frame", "trying 38400-8E1", "the line is 38400-8E1"] {
        assert!(said.contains(part), "{said}");
    }
    assert!(!said.contains("Warning"), "{said}");
    let answered = live.lines().filter(|row| row.contains("\"outcome\":\"answered\"")).count();
    assert!(answered > 10 && live.contains("\"damaged\""), "{answered}");
    assert_same(&live, &decoded);
}

#[test]
fn what_no_settings_make_sense_of_is_told_with_what_to_try() {
    let (live, said, decoded) = searched(Wire::noise(5), 60);
    assert!(said.contains("Warning(\"no frames: ") && said.contains("Hint(\"swap A and B"), "{said}");
    assert_same(&live, &decoded);
}
