//! Places that are not decoded yet: what can be told of them at once, until what came before is known.
//!
//! The index of a recording says where a place is in the file, so that what leads up to it is decoded without the rest.
//! That tells the rows, but neither their numbers nor what was known of devices and the bus: the store says so, and as
//! soon as the background has passed the place, what is shown is replaced by what is known.

use std::ops::Range;

use super::super::super::failure::Failure;
use super::decoder::Decoder;
use super::head::{Goal, Head};
use super::reel::{Advance, Reel};
use crate::capture::Item;
use crate::time::Timestamp;
use crate::tui::app::replay::Order;
use crate::tui::store::{List, PROVISIONAL};

/// From how many bytes of files on the way to a place takes too long to wait for.
const FAR: u64 = 384 * 1024;
/// From how many bytes of buses between checkpoints on the way from one of them takes too long.
const FAR_APART: u64 = 160 * 1024;
/// How many bytes of messages are read before a place, at least.
const READ: u64 = 192 * 1024;
/// How many bytes of buses before a place are decoded at most.
const DECODED: u64 = 16 * 1024;
/// What part of these only shows where frames begin, and is not shown.
const LEAD: u64 = 16;
/// The counts of rows where nobody knows how many came before; a step back from none is one less.
const NUMBERS: Range<u64> = PROVISIONAL - 1..2 * PROVISIONAL;

impl<'a, 's> Head<'a, 's> {
    /// Tells whether what is shown lacks what came before.
    pub(super) fn is_cold(&self) -> bool {
        self.decoder.rows(List::Frames) >= PROVISIONAL
    }

    /// Tells whether what is shown lacks what came before, and that is known by now.
    pub(super) fn can_settle(&self) -> bool {
        let timeline = &self.shared.lock().timeline;
        let is_passed = !self.is_over && timeline.decoded_ns >= self.playhead;
        self.is_cold() && (is_passed || timeline.is_complete)
    }

    /// Begins to replace what is shown by what is known.
    pub(super) fn settle(&mut self) -> Result<(), Failure> {
        let goal = if self.is_over { Goal::End } else { Goal::Place(self.playhead) };
        self.warm_up()?;
        self.is_settling = true;
        self.set_goal(goal);
        Ok(())
    }

    /// Goes back to the beginning, from where all that came before is known.
    pub(super) fn warm_up(&mut self) -> Result<(), Failure> {
        let reel = Reel::open(self.reel.tracks())?;
        self.replace(reel, self.fresh.clone(), false);
        Ok(())
    }

    /// Shows what leads up to a place, if the way there is long, and the recording says where it is; tells whether.
    pub(super) fn leap(&mut self, place: i64) -> Result<bool, Failure> {
        if self.is_settling || self.has_tried || !self.is_far(place) {
            return Ok(false);
        }
        self.has_tried = true;
        let Some(origin) = self.decoder.reached().origin else { return Ok(false) };
        self.start_at(origin, place)
    }

    /// Tells whether the way to a place takes longer than somebody looks at what was there before.
    fn is_far(&self, place: i64) -> bool {
        let known = self.shared.lock();
        let timeline = &known.timeline;
        let is_long = |ns: i64| {
            let share = ns as f64 / timeline.end().max(1) as f64;
            share * self.reel.size().unwrap_or(0) as f64 > FAR as f64
        };
        let reached = self.decoder.reached().elapsed_ns;
        let here = (!self.is_cold() && reached <= place).then_some(reached);
        if timeline.is_complete || place <= timeline.decoded_ns {
            let elapsed = |decoder: &Decoder<'_>| decoder.reached().elapsed_ns;
            let is_apart = known.checkpoints.apart(&elapsed, place) > FAR_APART;
            return is_apart && here.is_none_or(|here| is_long(place - here));
        }
        is_long(place.saturating_sub(here.unwrap_or(0).max(timeline.decoded_ns)))
    }

    /// Decodes what leads up to a place, and nothing before; tells whether there is something.
    fn start_at(&mut self, origin: Timestamp, place: i64) -> Result<bool, Failure> {
        let tracks = self.reel.tracks();
        let near = || Reel::near(tracks, origin + place, READ);
        let mut decoder = self.fresh.provisional(origin);
        let Some(mut reel) = near()? else { return Ok(false) };
        let mut bytes = 0;
        while reel.advance()? == Advance::Item && decoder.elapsed_after(&reel.item()) <= place {
            bytes += length(&reel.item());
        }
        if bytes == 0 {
            return Ok(false);
        }
        let skipped = bytes.saturating_sub(DECODED);
        let lead = skipped + bytes.min(DECODED) / LEAD;
        let Some(mut reel) = near()? else { return Ok(false) };
        let (mut seen, mut is_shown, mut is_pending) = (0, false, false);
        while reel.advance()? == Advance::Item {
            let item = reel.item();
            is_pending = decoder.elapsed_after(&item) > place;
            if is_pending {
                break;
            }
            if seen >= skipped || matches!(item, Item::Line(_)) {
                decoder.take(&item, self.line, self.hold_ns)?;
            }
            seen += length(&item);
            // Before the first bytes it is not known when they are.
            if !is_shown && seen > 0 && seen >= lead {
                decoder.begin_here();
                is_shown = true;
            }
        }
        self.replace(reel, decoder, is_pending);
        Ok(true)
    }

    /// Makes of an order what it means where numbers of rows say nothing; `None` where it has to wait, or comes too late.
    pub(super) fn understand(&mut self, order: Order) -> Option<Order> {
        let is_cold = self.is_cold();
        match order {
            Order::Rows(_, count) if NUMBERS.contains(&count) && !is_cold => None,
            Order::Rows(list, count) if NUMBERS.contains(&count) && count < self.decoder.rows(list) => {
                let rows = self.decoder.store().list(list);
                let row = rows.get(count).or(rows.iter().next());
                let origin = self.decoder.reached().origin;
                let (time, origin) = row.and_then(|row| row.time()).zip(origin)?;
                Some(Order::Place((time - origin).saturating_sub(1).max(0)))
            }
            Order::Find { .. } | Order::Words { .. } if is_cold || self.is_settling => {
                // It is looked for from here, so here is where it stays.
                self.pause();
                self.deferred = Some(order.without_row());
                None
            }
            Order::Stay if self.deferred.take().is_some() => None,
            _ => Some(order),
        }
    }
}

/// Returns how many bytes of a bus an item has.
fn length(item: &Item<'_>) -> u64 {
    if let Item::Chunk { chunk, .. } = item { chunk.bytes.len() as u64 } else { 0 }
}
