//! Live capture: threads, queues, and what decides in between.
//!
//! ```text
//! Capture ─▶ Queue ─▶ Engine ─▶ Session ─▶ Stage ─┬▶ RowStream ─▶ standard output
//! a thread   bounded  the calling thread          └▶ Tape ─▶ Ring ─▶ Writer ─▶ disk
//! a source                                           batches         a thread
//! ```
//!
//! Whatever decides is in a structure that takes time as an argument; the threads only wait. Captures never wait for
//! the engine, nor the engine for the disk: what finds no room is counted where it is missing. Sources that can wait
//! themselves, pipes and servers, are waited for instead.

#[cfg(test)]
mod bits;
mod capture;
mod desk;
mod disk;
mod driver;
mod engine;
mod entry;
mod link;
mod monitor;
mod notice;
mod queue;
mod ring;
mod rows;
#[cfg(test)]
mod script;
mod signals;
#[cfg(test)]
mod soak;
mod sources;
mod stage;
mod status;
mod tally;
mod tape;
mod target;
mod watch;
mod writer;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::thread::{Builder, JoinHandle};

use indicatif::DecimalBytes;

use super::failure::Failure;
use super::journal::Journal;
use super::output::Output;
use super::printing::Printing;
use super::session::Setup;
use crate::capture::mcap::{Anchor, Options};
use crate::report::Judge;
use crate::report::audit::Audit;
use crate::report::info::Info;
use crate::source::Clock;
use crate::time::Timestamp;
use capture::{Capture, Order};
use desk::Desk;
pub(super) use desk::{Request, Screen};
use disk::{Floor, SystemDisk};
use driver::Driver;
use engine::{Engine, Tapped};
use monitor::Monitor;
pub(super) use monitor::facts;
use notice::Notice;
use queue::{Inbox, queue};
use ring::Ring;
use rows::RowStream;
pub(super) use signals::stop_flag;
pub(super) use sources::{Opened, open, setup};
use stage::Stage;
pub(super) use status::{Status, counts};
use tally::Tally;
use tape::Tape;
use target::Target;
use writer::{Outcome, Told, Writer};

/// How much memory a ring takes at most, in bytes.
const RING: usize = 16 << 20;

/// Says what to do with live sources.
pub(super) struct Job<'a> {
    pub(super) setup: &'a Setup,
    pub(super) sources: Vec<Opened>,
    pub(super) clock: Arc<dyn Clock>,
    pub(super) anchor: Anchor,
    /// Rows, and where they go.
    pub(super) rows: Option<(Printing, Output)>,
    pub(super) recording: Option<Recording>,
    /// Takes all events, for a summary.
    pub(super) info: Option<Info>,
    /// Shows all of it, and asks for things.
    pub(super) screen: Option<Screen>,
    /// Takes all events, for a conformance report.
    pub(super) audit: Option<Audit>,
    pub(super) status: Status,
    /// Ends the session when it is set.
    pub(super) stop: Arc<AtomicBool>,
    /// Ends the session after so many nanoseconds.
    pub(super) duration_ns: Option<u64>,
}

/// Says how to record.
pub(super) struct Recording {
    pub(super) path: PathBuf,
    /// How files are written; the session is named and tied to its clock here.
    pub(super) options: Options,
    /// How many bytes are to stay free on the disk.
    pub(super) min_free: u64,
    /// Whether old recordings are removed for that.
    pub(super) drop_oldest: bool,
    /// Whether what the bytes decode to is left out.
    pub(super) raw_only: bool,
    /// What is worth recording, and the nanoseconds around it; without it all is.
    pub(super) around: Option<(Judge, i64)>,
    /// Whether the session ends when the disk is full.
    pub(super) is_all: bool,
}

/// Is what came of a session.
pub(super) struct Report {
    pub(super) tally: Tally,
    pub(super) recorded: Option<Outcome>,
    /// What made the rows.
    pub(super) printing: Option<Printing>,
    pub(super) info: Option<Info>,
    pub(super) audit: Option<Audit>,
    /// Whether a source failed for good, or rows could not be written.
    pub(super) ended: Result<(), Failure>,
}

/// Is a recording under way.
struct Taping {
    tape: Tape,
    told: Receiver<Told>,
    writer: JoinHandle<Outcome>,
}

fn start<T: Send + 'static>(
    name: &str,
    run: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>, Failure> {
    let thread = Builder::new().name(name.to_owned()).spawn(run);
    thread.map_err(|error| Failure::new(format!("cannot start a thread: {error}")))
}

/// Taps live sources until they end, or until told to stop; what was recorded is finished then.
///
/// # Errors
/// When threads or the recording cannot begin.
pub(super) fn run(job: Job<'_>) -> Result<Report, Failure> {
    let is_patient = job.sources.iter().all(|source| source.is_patient);
    let mut stage = Stage { info: job.info, audit: job.audit, ..Stage::default() };
    let mut recording = job.recording;
    let is_all = recording.as_ref().is_some_and(|recording| recording.is_all);
    let around = recording.as_mut().and_then(|recording| recording.around.take());
    let ring = around.map(|(trigger, span_ns)| {
        stage.trigger = Some(trigger);
        Ring::new(span_ns, RING)
    });
    let begun = job.anchor.realtime;
    let taping =
        recording.map(|recording| tape(recording, job.anchor, begun, is_patient, ring)).transpose()?;
    let (tape, told, writer) = match taping {
        Some(Taping { tape, told, writer }) => (Some(tape), Some(told), Some(writer)),
        None => (None, None, None),
    };
    stage.tape = tape;
    let mut printer = None;
    if let Some((printing, output)) = job.rows {
        let (sender, receiver) = sync_channel(rows::WRITES);
        printer = Some(start("rows", move || rows::write(output, &receiver))?);
        stage.rows = Some(RowStream::new(printing, sender, stage.tape.is_some()));
    }
    let desk = job.screen.map(|screen| {
        stage.monitor = Some(Monitor::new(screen.labels.clone(), screen.teller.clone()));
        Desk::new(screen, job.anchor, is_patient)
    });
    let (tapped, inbox) = capture(job.sources, &job.clock)?;
    let mut engine = Engine::new(job.setup, stage, tapped, job.anchor, Arc::clone(&job.clock))?;
    let mut driver = Driver::new(job.clock, told, job.status, is_all, desk);
    let result = driver.drive(&mut engine, &inbox, &job.stop, job.duration_ns);
    let failed = engine.failed().map(|name| Failure::new(format!("receiving from '{name}' failed")));
    let (mut stage, finished) = engine.finish();
    // The recording is made safe before anything that may wait for a reader.
    let recorded = finish_recording(&mut stage, writer.into_iter().chain(driver.take_writers()))?;
    driver.hear();
    driver.status.finish();
    let (printing, written) = finish_rows(&mut stage, printer);
    let ended = written.and(result).and(finished).and(failed.map_or(Ok(()), Err));
    Ok(Report { tally: stage.tally, recorded, printing, info: stage.info, audit: stage.audit, ended })
}

/// Starts a thread for each source.
fn capture(sources: Vec<Opened>, clock: &Arc<dyn Clock>) -> Result<(Vec<Tapped>, Inbox), Failure> {
    let (outlets, inbox) = queue(sources.len());
    let mut tapped = Vec::new();
    for (opened, mut outlet) in sources.into_iter().zip(outlets) {
        let (orders, receiver): (Sender<Order>, _) = channel();
        let capture = Capture::new(opened.source, Arc::clone(clock), opened.is_patient);
        start("capture", move || capture.run(&mut outlet, &receiver))?;
        let Opened { name, settings, searches, .. } = opened;
        tapped.push(Tapped { searches, ..Tapped::new(name, settings, orders) });
    }
    Ok((tapped, inbox))
}

/// Begins a recording, with a thread that writes it.
fn tape(
    recording: Recording,
    anchor: Anchor,
    begun: Timestamp,
    is_patient: bool,
    ring: Option<Ring>,
) -> Result<Taping, Failure> {
    let Recording { path, mut options, min_free, drop_oldest, raw_only, is_all, .. } = recording;
    let target = Target::new(&path, begun)?;
    if let Some(capacity) = disk::capacity(&target.path).filter(|capacity| is_all && min_free > *capacity) {
        let (floor, capacity) = (DecimalBytes(min_free), DecimalBytes(capacity));
        let message = format!("--min-free {floor} can never be met: the whole disk has {capacity}");
        return Err(Failure::hinted(message, "give less, or 0 to record until the disk is full"));
    }
    for path in target.left_over() {
        let whole = path.with_extension("");
        Notice::Warning(format!("'{}' was never finished", path.display())).say();
        let text = format!("'rtutap recover {} -o {}' makes it whole", path.display(), whole.display());
        Notice::Hint(text).say();
    }
    let time = chrono::DateTime::from_timestamp_nanos(begun.as_ns());
    options.session_id = format!("{}-{}", time.format("%Y%m%dT%H%M%S%.9fZ"), std::process::id());
    options.anchor = Some(anchor);
    options.is_durable = true;
    let journal = Journal::create(&target.path, options)?;
    let (teller, told) = channel();
    let (queue, batches) = sync_channel(tape::BATCHES);
    let floor = Floor { min_free, drop_oldest };
    let writer = Writer::new(journal, floor, Box::new(SystemDisk { target }), teller);
    let writer = start("writer", move || writer.run(&batches))?;
    Ok(Taping { tape: Tape::new(queue, is_patient, raw_only, ring), told, writer })
}

fn finish_recording(
    stage: &mut Stage,
    writers: impl Iterator<Item = JoinHandle<Outcome>>,
) -> Result<Option<Outcome>, Failure> {
    if let Some(tape) = stage.tape.take() {
        tape.finish();
    }
    let crashed = |_| Failure::new("the recording was not finished: its thread crashed");
    let mut outcomes = writers.map(|writer| writer.join().map_err(crashed));
    let first = outcomes.next().transpose()?;
    first.map(|first| outcomes.try_fold(first, |all, next| Ok(all.and(next?)))).transpose()
}

fn finish_rows(
    stage: &mut Stage,
    printer: Option<JoinHandle<Result<(), Failure>>>,
) -> (Option<Printing>, Result<(), Failure>) {
    let printing = stage.rows.take().map(|rows| {
        let (dropped, printing) = rows.finish();
        if dropped > 0 {
            let text =
                format!("{dropped} lines were not printed, for nobody read them; the recording has them");
            Notice::Warning(text).say();
        }
        printing
    });
    let crashed = |_| Failure::new("rows were not written: their thread crashed");
    (printing, printer.map_or(Ok(()), |printer| printer.join().map_err(crashed)?))
}

/// Returns what ties this session's times to the clock.
pub(super) fn anchor(clock: &dyn Clock) -> Anchor {
    Anchor { monotonic_ns: clock.monotonic_ns(), realtime: clock.realtime() }
}

/// Says what became of a recording; fails when it ended for want of room, or could not be finished.
pub(super) fn say_recorded(outcome: Outcome, counts: &str) -> Result<Vec<PathBuf>, Failure> {
    let Outcome { mut files, lost, error, is_short } = outcome;
    Notice::Note(counts.to_owned()).say();
    // Some may have made room for others.
    files.retain(|file| file.exists());
    if lost > 0 {
        Notice::Warning(format!("{lost} bytes could not be written")).say();
    }
    match &files[..] {
        [] if error.is_none() => Notice::Note("nothing was recorded".to_owned()).say(),
        [] => {}
        [file] => Notice::Note(format!("recorded in '{}'", file.display())).say(),
        [first, .., last] => {
            let (first, last) = (first.display(), last.display());
            let text = format!("recorded in {} files, '{first}' to '{last}'", files.len());
            Notice::Note(text).say();
        }
    }
    if let Some(error) = error {
        return Err(error.into());
    }
    if is_short {
        let hint = "--min-free says how much is to stay free; --drop-oldest makes room where old recordings are enough";
        return Err(Failure::hinted("the recording ended early: the disk is nearly full", hint));
    }
    Ok(files)
}
