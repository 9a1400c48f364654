//! The terminal UI at work: the terminal, the loop that draws, and what effects do.
//!
//! ```text
//! terminal ─▶ a thread ─┐
//! engine   ─▶ Teller ───┼▶ the loop ─▶ App::update ─▶ effects
//! messages ─▶ Teller ───┘      └▶ draw, on change, at most thirty times a second
//! ```

#[cfg(unix)]
mod job;
mod options;
mod player;
mod session;
mod teller;
mod terminal;

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use super::failure::Failure;
use super::message;
use crate::source::Clock;
use crate::tui::app::{App, Effect, Message, Recording};
use crate::tui::store::Tone;
pub(super) use options::{has_terminal, options};
pub(super) use player::{Replayed, replay};
pub(super) use session::{Live, live};
pub(super) use teller::{Teller, Word};
use terminal::Screen;

/// How long a drawing stays at least.
const FRAME: Duration = Duration::from_millis(33);
/// How often times on the screen go on when nothing happens.
const HEARTBEAT: Duration = Duration::from_secs(1);
/// How many words are heard before the screen is drawn.
const AT_ONCE: usize = 512;

/// Does what is to be done outside of the UI; returns what to say about it.
pub(super) type Outside<'a> = dyn FnMut(Effect, &App) -> Option<(Tone, String)> + 'a;

/// Shows the UI until somebody quits it, or the session ends.
///
/// # Errors
/// When there is no terminal, or it is gone.
pub(super) fn run(
    app: App,
    teller: &Teller,
    heard: &Receiver<Word>,
    clock: Arc<dyn Clock>,
    outside: &mut Outside<'_>,
) -> Result<(), Failure> {
    let failed = |error: io::Error| Failure::new(format!("cannot use the terminal: {error}"));
    let screen = Screen::open(app.has_mouse).map_err(failed)?;
    message::show_on(Some(teller.clone()));
    let reader = teller.clone();
    #[cfg(unix)]
    let stops = job::hear_stops(teller.clone()).map_err(failed)?;
    let thread = Builder::new().name("terminal".to_owned()).spawn(move || listen(&reader));
    let shown = thread.and_then(|_| {
        Loop {
            app,
            screen,
            teller,
            clock,
            #[cfg(unix)]
            stops,
            has_asked_to_stop: false,
            is_over: false,
        }
        .run(heard, outside)
    });
    message::show_on(None);
    shown.map_err(failed)
}

/// Hands on what the terminal says, until it says nothing any more.
fn listen(teller: &Teller) {
    while let Ok(event) = crossterm::event::read() {
        teller.tell(Word::Terminal(event));
    }
}

/// Is the loop with all it needs.
struct Loop<'a> {
    app: App,
    screen: Screen,
    teller: &'a Teller,
    clock: Arc<dyn Clock>,
    /// What was told of being asked to stop.
    #[cfg(unix)]
    stops: Receiver<()>,
    /// Whether the program has asked its own job to stop: it hears that too.
    has_asked_to_stop: bool,
    is_over: bool,
}

impl Loop<'_> {
    fn run(mut self, heard: &Receiver<Word>, outside: &mut Outside<'_>) -> io::Result<()> {
        let (columns, lines) = self.screen.size();
        self.app.update(Message::Resize(columns, lines));
        let mut drawn: Option<Instant> = None;
        let mut is_changed = true;
        while !self.is_over {
            #[expect(
                clippy::disallowed_methods,
                reason = "how often the screen is drawn depends on real time"
            )]
            let now = Instant::now();
            let since = drawn.map_or(FRAME, |drawn| now.saturating_duration_since(drawn));
            if is_changed && since >= FRAME {
                self.app.update(Message::Tick(self.clock.realtime()));
                self.screen.draw(&self.app)?;
                drawn = Some(now);
                is_changed = false;
            }
            let wait = if is_changed { FRAME.saturating_sub(since) } else { HEARTBEAT };
            match heard.recv_timeout(wait) {
                Ok(word) => {
                    self.hear(word, outside)?;
                    for word in heard.try_iter().take(AT_ONCE) {
                        self.hear(word, outside)?;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            is_changed = true;
        }
        Ok(())
    }

    fn hear(&mut self, word: Word, outside: &mut Outside<'_>) -> io::Result<()> {
        use crossterm::event::{Event, KeyEventKind};
        let message = match word {
            Word::Terminal(Event::Key(key)) if key.kind != KeyEventKind::Release => Message::Key(key),
            Word::Terminal(Event::Mouse(mouse)) => Message::Mouse(mouse),
            Word::Terminal(Event::Paste(text)) => Message::Paste(text),
            Word::Terminal(Event::Resize(columns, lines)) => Message::Resize(columns, lines),
            Word::Terminal(_) => return Ok(()),
            Word::Grown => match self.teller.take() {
                Some((store, false)) => Message::Grown(store),
                Some((store, true)) => Message::Replaced(store),
                None => return Ok(()),
            },
            Word::Replay(replay) => Message::Replay(*replay),
            Word::Said(tone, text) => Message::Said(tone, text),
            Word::Kept(remarks) => Message::Kept(remarks),
            Word::Recording(file) => {
                let begin = || Recording { since: Some(self.clock.realtime()), ..Recording::default() };
                Message::Recording(file.map(|file| {
                    let file = file.display().to_string();
                    match self.app.recording.clone() {
                        Some(mut recording) => {
                            recording.go_on(file);
                            recording
                        }
                        None => Recording { file, ..begin() },
                    }
                }))
            }
            Word::Suspend if std::mem::take(&mut self.has_asked_to_stop) => return Ok(()),
            Word::Suspend => return self.suspend(false),
            Word::Ended => {
                self.is_over = true;
                return Ok(());
            }
        };
        self.app.update(Message::Tick(self.clock.realtime()));
        match self.app.update(message) {
            Some(effect) => self.apply(effect, outside),
            None => Ok(()),
        }
    }

    fn apply(&mut self, effect: Effect, outside: &mut Outside<'_>) -> io::Result<()> {
        match effect {
            Effect::Quit => {
                self.is_over = true;
                Ok(())
            }
            Effect::Redraw => self.screen.forget(),
            Effect::Mouse(is_ours) => self.screen.set_mouse(is_ours),
            Effect::Copy(text) => self.screen.copy(&text),
            Effect::Suspend => self.suspend(true),
            Effect::Note(..) | Effect::Record(_) | Effect::Export { .. } | Effect::Replay(_) => {
                if let Some((tone, text)) = outside(effect, &self.app) {
                    self.app.update(Message::Said(tone, text));
                }
                Ok(())
            }
        }
    }
    /// Gives the terminal back and stops until somebody says to go on, alone or with the whole job.
    ///
    /// The terminal goes first: once the shell has it, a job may not change it any more.
    #[cfg(unix)]
    fn suspend(&mut self, with_job: bool) -> io::Result<()> {
        if !job::has_shell() {
            let text = "no shell is there that could bring the program back".to_owned();
            self.app.update(Message::Said(Tone::Warn, text));
            return Ok(());
        }
        let before = self.clock.monotonic_ns();
        self.has_asked_to_stop = with_job;
        let stops = &self.stops;
        self.screen.leave_for(|| if with_job { job::stop_all(stops) } else { job::stop() })?;
        if self.app.is_live {
            let seconds = self.clock.monotonic_ns().saturating_sub(before) / 1_000_000_000;
            let text = format!("suspended for {seconds} s: what the system could not hold meanwhile is lost");
            self.app.update(Message::Said(Tone::Warn, text));
        }
        let (columns, lines) = self.screen.size();
        self.app.update(Message::Resize(columns, lines));
        Ok(())
    }

    #[cfg(not(unix))]
    fn suspend(&mut self, _with_job: bool) -> io::Result<()> {
        let text = "a program cannot be suspended on this system".to_owned();
        self.app.update(Message::Said(Tone::Warn, text));
        Ok(())
    }
}
