//! A live session with its screen: the engine on a thread of its own, the UI on this one.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread::{Builder, scope};

use super::super::failure::Failure;
use super::super::live::{self, Job, Opened, Recording, Report, Request, Status};
use super::super::session::Setup;
use super::super::{export, message};
use super::{Teller, Word};
use crate::capture::mcap::Anchor;
use crate::cli;
use crate::report::words::Labels;
use crate::source::Clock;
use crate::time::SECOND;
use crate::tui::app::{self, App, Effect, Options};
use crate::tui::store::Tone;

/// Says what to show of a live session.
pub(in crate::command) struct Live<'a> {
    pub(in crate::command) setup: &'a Setup,
    pub(in crate::command) sources: Vec<Opened>,
    pub(in crate::command) clock: Arc<dyn Clock>,
    pub(in crate::command) anchor: Anchor,
    /// The recording to begin with.
    pub(in crate::command) recording: Option<Recording>,
    /// How to record when that is asked for.
    pub(in crate::command) again: Box<dyn Fn() -> Recording + Send>,
    /// Ends the session when it is set.
    pub(in crate::command) stop: Arc<AtomicBool>,
    pub(in crate::command) duration_s: Option<u32>,
    pub(in crate::command) options: Options,
    /// What is known of devices and water, for exports.
    pub(in crate::command) equipment: cli::Equipment,
}

/// Tells the screen when the engine has ended, however it did.
struct Ended(Teller);

impl Drop for Ended {
    fn drop(&mut self) {
        self.0.tell(Word::Ended);
    }
}

/// Shows a live session until somebody quits it, or it ends.
///
/// # Errors
/// When there is no terminal, or the session cannot begin.
pub(in crate::command) fn live(live: Live<'_>) -> Result<Report, Failure> {
    let Live { setup, sources, clock, anchor, recording, again, stop, duration_s, options, equipment } = live;
    let (teller, heard) = Teller::new();
    let (requests, receiver) = channel();
    let screen = live::Screen {
        teller: teller.clone(),
        labels: Labels::new(&setup.profiles),
        requests: receiver,
        recording: again,
    };
    let (app, stopper, told) = (App::new(options), Arc::clone(&stop), teller.clone());
    let engine_clock = Arc::clone(&clock);
    scope(|scope| {
        let engine = move || {
            let _ended = Ended(told.clone());
            live::run(Job {
                setup,
                sources,
                clock: engine_clock,
                anchor,
                rows: None,
                recording,
                info: None,
                audit: None,
                screen: Some(screen),
                status: Status::told(told.clone()),
                stop,
                duration_ns: duration_s.map(|seconds| u64::from(seconds).saturating_mul(SECOND as u64)),
            })
        };
        let engine = Builder::new().name("engine".to_owned()).spawn_scoped(scope, engine);
        let engine = engine.map_err(|error| Failure::new(format!("cannot start a thread: {error}")))?;
        let mut outside = |effect, app: &App| outside(effect, app, &requests, &equipment, &teller);
        let shown = super::run(app, &teller, &heard, clock, &mut outside);
        stopper.store(true, Ordering::Relaxed);
        let report =
            engine.join().map_err(|_| Failure::new("the session crashed; what was recorded is kept"))?;
        shown.and(report)
    })
}

/// Does what is to be done outside of the screen.
fn outside(
    effect: Effect,
    app: &App,
    requests: &Sender<Request>,
    equipment: &cli::Equipment,
    teller: &Teller,
) -> Option<(Tone, String)> {
    let is_sent = match effect {
        Effect::Note(time, text) => requests.send(Request::Note(time, text)).is_ok(),
        Effect::Record(is_on) => requests.send(Request::Record(is_on)).is_ok(),
        Effect::Export { filter, path, notes } => {
            let Some(recording) = &app.recording else {
                return Some((Tone::Warn, "nothing is recorded that could be exported".to_owned()));
            };
            let args = export::of(parts(recording), filter, path.into(), equipment.clone(), notes);
            return Some(start_export(args, teller.clone()));
        }
        _ => return None,
    };
    (!is_sent).then(|| (Tone::Bad, "the session has ended".to_owned()))
}

/// Returns the files of a recording: one that is finished has lost its `.part`, an old one may be gone.
fn parts(recording: &app::Recording) -> Vec<PathBuf> {
    let there = |file: &String| {
        let names = [Some(&**file), file.strip_suffix(".part")];
        names.into_iter().flatten().map(PathBuf::from).find(|path| path.exists())
    };
    recording.earlier.iter().chain([&recording.file]).filter_map(there).collect()
}

/// Exports while the screen goes on; returns what to say about it.
pub(in crate::command) fn start_export(mut args: cli::Export, teller: Teller) -> (Tone, String) {
    let path = args.output.display().to_string();
    let loses_notes = loses_notes(&args);
    let lost = if loses_notes { ", without marks and notes: only .mcap has them" } else { "" };
    let started = Builder::new().name("export".to_owned()).spawn(move || match export::run(&args) {
        Ok(()) => {
            if !loses_notes {
                teller.tell(Word::Kept(std::mem::take(&mut args.notes)));
            }
            message::note(format_args!("exported to '{}'{lost}", args.output.display()));
        }
        Err(failure) => failure.say(),
    });
    match started {
        Ok(_) => (Tone::Info, format!("exporting to '{path}'")),
        Err(error) => (Tone::Bad, format!("cannot start a thread: {error}")),
    }
}

/// Tells whether there are marks or notes that the format of an export cannot keep.
fn loses_notes(args: &cli::Export) -> bool {
    let extension = args.output.extension();
    !args.notes.is_empty() && !extension.is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"))
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "recordings are files")]
mod tests {
    use super::*;

    #[test]
    fn all_parts_of_a_recording_that_are_there_are_exported() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = |name: &str| directory.path().join(name);
        let said = |name: &str| path(name).display().to_string();
        let mut recording = app::Recording { file: said("1.mcap.part"), ..app::Recording::default() };
        for name in ["2.mcap.part", "2.mcap.part", "3.mcap.part"] {
            recording.go_on(said(name));
        }
        // The first was dropped to make room, the second is finished, the third is being written.
        for name in ["2.mcap", "3.mcap.part"] {
            std::fs::write(path(name), "").expect("a disk that works");
        }
        assert_eq!(parts(&recording), [path("2.mcap"), path("3.mcap.part")]);
    }

    #[test]
    fn only_mcap_keeps_what_was_noted() {
        let note = || vec![(crate::time::Timestamp::from_ns(0), "mark".to_owned())];
        let export = |name: &str, notes| export::of(vec![], None, name.into(), Default::default(), notes);
        assert!(loses_notes(&export("a.csv", note())));
        assert!(!loses_notes(&export("a.csv", vec![])) && !loses_notes(&export("a.MCAP", note())));
    }
}
