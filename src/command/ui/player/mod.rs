//! The player of recordings: what `rtutap replay` shows, and the threads behind it.
//!
//! ```text
//! scan  (a thread)  ─▶ checkpoints, timeline ─┐
//! look  (a thread)  ─▶ hits of the filter ────┤ Shared
//! player (a thread): Head, at the playhead ◀──┘
//!        ▲ Order                     │ Store, Replay
//!        └──────── App, on the screen ◀
//! ```
//!
//! All decode with the same [`decoder::Decoder`], which is a value: a copy kept as a checkpoint goes on exactly as a run
//! from the beginning would have.

mod checkpoints;
mod cold;
mod decoder;
mod find;
mod head;
mod reel;
mod scan;
#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "recordings are files")]
mod tests;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{Builder, Scope, scope};
use std::time::{Duration, Instant};

use super::super::export;
use super::super::failure::Failure;
use super::super::session::Setup;
use super::{Teller, Word};
use crate::capture::InputFormat;
use crate::cli;
use crate::line::LineSettings;
use crate::report::words::Labels;
use crate::source::Clock;
use crate::tui::app::replay::Order;
use crate::tui::app::{App, Effect, Options};
use crate::tui::sieve::Sieve;
use crate::tui::store::Tone;
use checkpoints::{Look, Shared};
use decoder::Decoder;
use head::{Change, Head};
use reel::{Reel, Tracks};

/// How long the player works before it looks for orders.
const SLICE: Duration = Duration::from_millis(15);
/// How often what moves is shown.
const FRAME: Duration = Duration::from_millis(33);
/// How often the progress of the background is shown.
const PROGRESS: Duration = Duration::from_millis(150);

/// Says what to show of a recording.
pub(in crate::command) struct Replayed<'a> {
    pub(in crate::command) setup: &'a Setup,
    /// The parts of the session, in order.
    pub(in crate::command) paths: Vec<PathBuf>,
    pub(in crate::command) format: Option<InputFormat>,
    pub(in crate::command) follows: bool,
    pub(in crate::command) clock: Arc<dyn Clock>,
    pub(in crate::command) options: Options,
    /// What is known of devices and water, for exports.
    pub(in crate::command) equipment: cli::Equipment,
}

/// What all threads read, and where they meet.
#[derive(Clone, Copy)]
struct Stage<'a, 's> {
    setup: &'a Setup,
    tracks: &'s Tracks,
    shared: &'s Shared<'a>,
    labels: &'s Labels,
    line: LineSettings,
}

impl<'a> Stage<'a, '_> {
    fn decoder(&self) -> Decoder<'a> {
        Decoder::new(self.setup, self.labels.clone())
    }
}

/// Shows a recording until somebody quits.
///
/// # Errors
/// When it cannot be read, or there is no terminal.
pub(in crate::command) fn replay(replayed: Replayed<'_>) -> Result<(), Failure> {
    let Replayed { setup, paths, format, follows, clock, options, equipment } = replayed;
    let labels = Labels::new(&setup.profiles);
    let tracks = Tracks::new(paths.clone(), format, setup.line, follows);
    let reel = Reel::open(&tracks)?;
    let line = setup.line.or(reel.input().line()).unwrap_or_default();
    let shared = Shared::default();
    {
        let mut known = shared.lock();
        known.timeline.is_growing = follows;
        if let Some((first, last)) = reel.times() {
            (known.timeline.origin, known.timeline.end_ns) = (Some(first), last - first);
        }
    }
    let stage = Stage { setup, tracks: &tracks, shared: &shared, labels: &labels, line };
    let (teller, heard) = Teller::new();
    let (orders, receiver) = channel();
    let app = App::new(options);
    scope(|scope| {
        let player = teller.clone();
        let player_clock = Arc::clone(&clock);
        let started = Builder::new().name("player".to_owned()).spawn_scoped(scope, move || {
            let result = play(scope, stage, reel, &receiver, &player, &*player_clock);
            if let Err(failure) = result {
                say(&failure, &player);
            }
        });
        started.map_err(|error| Failure::new(format!("cannot start a thread: {error}")))?;
        let mut outside = |effect, _: &App| outside(effect, &orders, &paths, &equipment, &teller);
        let shown = super::run(app, &teller, &heard, clock, &mut outside);
        shared.lock().is_over = true;
        drop(orders);
        shown
    })
}

/// Does what is to be done outside of the screen.
fn outside(
    effect: Effect,
    orders: &Sender<Order>,
    paths: &[PathBuf],
    equipment: &cli::Equipment,
    teller: &Teller,
) -> Option<(Tone, String)> {
    match effect {
        Effect::Replay(order) => {
            let is_sent = orders.send(order).is_ok();
            (!is_sent).then(|| (Tone::Bad, "the recording cannot be read on".to_owned()))
        }
        Effect::Export { filter, path, notes } => {
            let args = export::of(paths.to_vec(), filter, path.into(), equipment.clone(), notes);
            Some(super::session::start_export(args, teller.clone()))
        }
        _ => None,
    }
}

/// Does what is ordered until nobody orders anything any more; runs in a thread of its own.
fn play<'scope, 'a: 'scope, 's: 'scope>(
    scope: &'scope Scope<'scope, '_>,
    stage: Stage<'a, 's>,
    reel: Reel<'s>,
    orders: &Receiver<Order>,
    teller: &Teller,
    clock: &dyn Clock,
) -> Result<(), Failure> {
    let mut head = Head::new(reel, stage.decoder(), stage.shared, stage.line);
    let result = drive(scope, stage, &mut head, orders, teller, clock);
    if result.is_err() {
        stage.shared.break_off();
        show(&mut head, teller);
    }
    result
}

/// Moves the playhead as it is ordered.
fn drive<'scope, 'a: 'scope, 's: 'scope>(
    scope: &'scope Scope<'scope, '_>,
    stage: Stage<'a, 's>,
    head: &mut Head<'a, 's>,
    orders: &Receiver<Order>,
    teller: &Teller,
    clock: &dyn Clock,
) -> Result<(), Failure> {
    head.work(clock.realtime(), &mut || true)?;
    show(head, teller);
    if stage.tracks.follows() {
        head.order(Order::End);
    }
    start(scope, "scan", teller, move || {
        let scanned = scan::scan(stage.tracks, stage.decoder(), stage.shared, stage.line);
        scanned.inspect_err(|_| stage.shared.break_off())
    });
    let mut is_waiting = false;
    loop {
        let is_known = stage.shared.lock().timeline.is_complete;
        let wait = match (head.is_busy() && !is_waiting, head.is_moving() || is_waiting, is_known) {
            (true, ..) => Duration::ZERO,
            (_, true, _) => FRAME,
            (_, _, false) => PROGRESS,
            _ if stage.shared.lock().is_looking() => PROGRESS,
            _ => Duration::from_secs(1),
        };
        match orders.recv_timeout(wait) {
            Ok(order) => {
                for order in std::iter::once(order).chain(orders.try_iter()) {
                    if let Some((what, sieve)) = sought(&order, head) {
                        let number = stage.shared.lock().begin_look(what, sieve.is_some());
                        let mut decoder = stage.decoder();
                        match what {
                            Look::Filter => decoder.watched.filter = sieve.map(Arc::new),
                            Look::Words => decoder.watched.words = sieve.map(Arc::new),
                        }
                        let watches = decoder.watched.filter.is_some() || decoder.watched.words.is_some();
                        if watches {
                            start(scope, "look", teller, move || {
                                scan::look(stage.tracks, decoder, stage.shared, stage.line, (what, number))
                            });
                        }
                    }
                    head.order(order);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
        let begun = now();
        is_waiting = head.work(clock.realtime(), &mut || begun.elapsed() < SLICE)?;
        show(head, teller);
    }
}

/// Returns what an order looks for in all of the recording, if that is something else than before.
fn sought(order: &Order, head: &Head<'_, '_>) -> Option<(Look, Option<Sieve>)> {
    match order {
        Order::Look(filter) => Some((Look::Filter, filter.clone().map(Sieve::Filter))),
        Order::Words { sieve, .. } if head.decoder.watched.words.as_deref() != Some(sieve) => {
            Some((Look::Words, Some(sieve.clone())))
        }
        _ => None,
    }
}

fn now() -> Instant {
    #[expect(clippy::disallowed_methods, reason = "how long to work before looking up depends on real time")]
    Instant::now()
}

/// Starts a thread, which says what goes wrong.
fn start<'scope>(
    scope: &'scope Scope<'scope, '_>,
    name: &str,
    teller: &Teller,
    work: impl FnOnce() -> Result<(), Failure> + Send + 'scope,
) {
    let listener = teller.clone();
    let started = Builder::new().name(name.to_owned()).spawn_scoped(scope, move || {
        if let Err(failure) = work() {
            say(&failure, &listener);
        }
    });
    if let Err(error) = started {
        teller.tell(Word::Said(Tone::Bad, format!("cannot start a thread: {error}")));
    }
}

/// Says on the screen why something failed: it has the terminal, or will have it soon.
fn say(failure: &Failure, teller: &Teller) {
    if let Failure::Problem { message, hint } = failure {
        tracing::error!("{message}");
        let hint = hint.as_ref().map_or_else(String::new, |hint| format!("; {hint}"));
        teller.tell(Word::Said(Tone::Bad, format!("{}{hint}", message.replace('\n', "; "))));
    }
}

/// Shows what has changed.
fn show(head: &mut Head<'_, '_>, teller: &Teller) {
    if let Some(state) = head.take_state() {
        teller.tell(Word::Replay(Box::new(state)));
    }
    if let Some((change, store)) = head.take_change() {
        match change {
            Change::Replaced => teller.replace(store),
            Change::Grown | Change::None => teller.show(store),
        }
    }
    if let Some(text) = head.take_said() {
        teller.tell(Word::Said(Tone::Info, text));
    }
}
