//! The passes over a whole recording: one that makes checkpoints and the timeline, and one for each filter.

use super::super::super::bus;
use super::super::super::failure::Failure;
use super::checkpoints::{Checkpoint, Look, Shared};
use super::decoder::Decoder;
use super::reel::{Advance, Reel, Tracks};
use crate::line::LineSettings;
use crate::tui::timeline::Series;

/// After how many items rows are forgotten, and others learn of what was found.
const PUBLISH: u64 = 2048;

/// Is a pass over a recording.
struct Pass<'a, 'b> {
    tracks: &'b Tracks,
    reel: Reel<'b>,
    decoder: Decoder<'a>,
    series: Series,
    shared: &'b Shared<'a>,
}

impl<'a, 'b> Pass<'a, 'b> {
    fn new(tracks: &'b Tracks, decoder: Decoder<'a>, shared: &'b Shared<'a>) -> Result<Self, Failure> {
        Ok(Pass { tracks, reel: Reel::open(tracks)?, decoder, series: Series::default(), shared })
    }

    /// Decodes to the end; `pause` comes between items now and then, and says whether to go on.
    fn run(
        &mut self,
        line: LineSettings,
        mut pause: impl FnMut(&mut Self, bool) -> bool,
    ) -> Result<(), Failure> {
        let hold_ns = self.reel.input().adapter_hold_ns();
        let mut items = 0_u64;
        loop {
            match self.reel.advance()? {
                Advance::Item => {}
                Advance::Wait => {
                    if !pause(self, true) {
                        return Ok(());
                    }
                    bus::wait();
                    continue;
                }
                Advance::End => match self.next_part() {
                    true => continue,
                    false => break,
                },
            }
            let item = self.reel.item();
            self.decoder.take(&item, line, hold_ns)?;
            self.series.add(self.decoder.reached().elapsed_ns, &self.decoder.last());
            items += 1;
            let is_early = items.is_power_of_two();
            if (is_early || items.is_multiple_of(PUBLISH)) && !pause(self, true) {
                return Ok(());
            }
            if !pause(self, false) {
                return Ok(());
            }
        }
        self.decoder.finish()?;
        self.series.add(self.decoder.reached().elapsed_ns, &self.decoder.last());
        Ok(())
    }

    /// Finds the part that follows one that was rotated; tells whether there is one.
    fn next_part(&self) -> bool {
        let (path, facts) = self.reel.part();
        let next = facts.filter(|_| self.tracks.follows()).and_then(|facts| bus::next_part(&path, facts));
        next.map(|path| self.tracks.add(path)).is_some()
    }
}

/// Decodes a recording from its beginning to its end, and makes checkpoints and the timeline of it.
///
/// # Errors
/// When it cannot be read on.
pub(super) fn scan<'a>(
    tracks: &Tracks,
    decoder: Decoder<'a>,
    shared: &Shared<'a>,
    line: LineSettings,
) -> Result<(), Failure> {
    let mut pass = Pass::new(tracks, decoder, shared)?;
    let mut due = 0;
    let result = pass.run(line, |pass, is_time| {
        if pass.decoder.reached().bytes >= due
            && let Some(place) = pass.reel.place()
        {
            let decoder = pass.decoder.checkpoint();
            let total = (decoder.reached().bytes as f64 / pass.reel.share().max(1e-6)) as u64;
            let mut known = pass.shared.lock();
            known.checkpoints.add(Checkpoint { place, decoder });
            due = known.checkpoints.due(total);
        }
        !is_time || publish(pass)
    });
    publish(&mut pass);
    let mut known = shared.lock();
    (known.timeline.is_complete, known.timeline.is_growing) = (true, false);
    known.version += 1;
    if result.is_ok() {
        known.timeline.share = 1.0;
    }
    result
}

/// Tells others what is known by now; tells whether to go on.
fn publish(pass: &mut Pass<'_, '_>) -> bool {
    let reached = pass.decoder.reached();
    let mut known = pass.shared.lock();
    known.version += 1;
    let timeline = &mut known.timeline;
    timeline.origin = reached.origin;
    timeline.events.clone_from(&pass.series);
    timeline.decoded_ns = reached.elapsed_ns;
    timeline.share = pass.reel.share();
    !known.is_over
}

/// Decodes a recording, and counts what the decoder watches for, as long as nobody looks for something else.
///
/// # Errors
/// When it cannot be read on.
pub(super) fn look<'a>(
    tracks: &Tracks,
    decoder: Decoder<'a>,
    shared: &Shared<'a>,
    line: LineSettings,
    (what, number): (Look, u64),
) -> Result<(), Failure> {
    let mut pass = Pass::new(tracks, decoder, shared)?;
    let tell = |pass: &mut Pass<'_, '_>| {
        let until = pass.decoder.reached().elapsed_ns;
        pass.shared.lock().tell_look(what, number, &pass.series, until)
    };
    pass.run(line, |pass, is_time| {
        if !is_time {
            return true;
        }
        pass.decoder.forget();
        tell(pass)
    })?;
    tell(&mut pass);
    Ok(())
}
