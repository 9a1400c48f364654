//! The playhead: play, step, seek and find, without threads and clocks. Who calls says what time it is and for how
//! long to work.

use std::sync::Arc;

use super::super::super::failure::Failure;
use super::checkpoints::{Checkpoint, Shared};
use super::decoder::Decoder;
use super::find::Find;
use super::reel::{Advance, Reel};
use crate::line::LineSettings;
use crate::time::{SECOND, Timestamp};
use crate::tui::app::replay::{Order, Replay, SPEEDS, Way};
use crate::tui::sieve::Sieve;
use crate::tui::store::{List, PROVISIONAL, Store};
use crate::tui::timeline::{Bucket, Series, Sought, Timeline};

/// How far playing may fall behind before it takes its time, in nanoseconds.
const BEHIND: i64 = SECOND / 2;
/// How many rows are shown at first.
const FIRST: u64 = 100;

/// Says where the playhead is to go.
#[derive(Clone, Debug)]
pub(super) enum Goal {
    /// Everything up to a place.
    Place(i64),
    /// So many rows in a list.
    Rows(List, u64),
    /// Back to no more than so many rows; the items at which there were not more, as far as it was looked.
    Back(List, u64, Option<u64>),
    /// So many items.
    Items(u64),
    /// All there is.
    End,
    /// The next or last of something.
    Find(Find),
}

/// Says why decoding stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// What was asked for is reached.
    Reached,
    /// There was no more time.
    Paused,
    /// Nothing is there yet.
    Wait,
    /// It has ended.
    Over,
}

/// Says what is to be shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Change {
    /// What is shown already.
    #[default]
    None,
    /// More.
    Grown,
    /// Another state.
    Replaced,
}

/// Is the playhead.
pub(super) struct Head<'a, 's> {
    pub(super) reel: Reel<'s>,
    pub(super) decoder: Decoder<'a>,
    /// What decodes from the beginning.
    pub(super) fresh: Decoder<'a>,
    pub(super) shared: &'s Shared<'a>,
    pub(super) line: LineSettings,
    pub(super) hold_ns: Option<i64>,
    /// Whether the reel has an item that is not decoded yet.
    is_pending: bool,
    pub(super) is_over: bool,
    goal: Option<Goal>,
    /// Whether what is shown lacks what came before, and is about to be replaced.
    pub(super) is_settling: bool,
    /// Whether the goal was tried to be shown before all on the way to it is decoded.
    pub(super) has_tried: bool,
    /// What is to be done when all before the playhead is known.
    pub(super) deferred: Option<Order>,
    /// Where the way to the goal began.
    begun: i64,
    pub(super) playhead: i64,
    is_playing: bool,
    speed: f64,
    /// From which time and place it is played.
    from: Option<(Timestamp, i64)>,
    /// Whether it stays at the end while the recording grows.
    is_at_end: bool,
    change: Change,
    /// What to say.
    said: Option<String>,
    /// The timeline as it was told last, with its version.
    timeline: (u64, Arc<Timeline>),
    told: Option<Replay>,
}

impl<'a, 's> Head<'a, 's> {
    /// Begins before the first item, on the way to the first rows.
    pub(super) fn new(
        reel: Reel<'s>,
        decoder: Decoder<'a>,
        shared: &'s Shared<'a>,
        line: LineSettings,
    ) -> Self {
        let hold_ns = reel.input().adapter_hold_ns();
        Head {
            reel,
            fresh: decoder.clone(),
            decoder,
            shared,
            line,
            hold_ns,
            is_pending: false,
            is_over: false,
            goal: Some(Goal::Rows(List::Exchanges, FIRST)),
            is_settling: false,
            has_tried: false,
            deferred: None,
            begun: 0,
            playhead: 0,
            is_playing: false,
            speed: 1.0,
            from: None,
            is_at_end: false,
            change: Change::None,
            said: None,
            timeline: (u64::MAX, Arc::default()),
            told: None,
        }
    }

    /// Takes an order; it is done by [`Head::work`].
    pub(super) fn order(&mut self, order: Order) {
        if let Order::Words { sieve, .. } = &order {
            self.decoder.watched.words = Some(Arc::new(sieve.clone()));
        }
        let Some(order) = self.understand(order) else { return };
        let goal = match order {
            Order::Play => {
                self.is_playing = !self.is_playing && !self.is_at_end;
                (self.from, self.deferred) = (None, None);
                return;
            }
            Order::Speed(speed) => {
                self.speed = speed.clamp(SPEEDS.0, SPEEDS.1);
                self.from = None;
                return;
            }
            Order::Look(filter) => {
                self.decoder.watched.filter = filter.map(|filter| Arc::new(Sieve::Filter(filter)));
                self.goal.take_if(|goal| matches!(goal, Goal::Find(find) if find.what == Sought::Match));
                return;
            }
            Order::Break(filter) => {
                self.decoder.watched.breaks = filter.map(|filter| Arc::new(Sieve::Filter(filter)));
                return;
            }
            Order::Stay => {
                self.stay();
                return;
            }
            Order::Place(place) => Goal::Place(place.max(0)),
            Order::Rows(list, count) if count < self.decoder.rows(list) => Goal::Back(list, count, None),
            Order::Rows(list, count) => Goal::Rows(list, count),
            Order::End => Goal::End,
            Order::Words { is_forward, before, .. } => {
                self.is_playing = false;
                Goal::Find(Find::new(Sought::Words, is_forward, before, self))
            }
            Order::Find { what, is_forward, before } => {
                self.is_playing = false;
                Goal::Find(Find::new(what, is_forward, before, self))
            }
        };
        if !matches!(goal, Goal::Place(_)) {
            self.is_playing = false;
        }
        (self.is_at_end, self.is_settling, self.has_tried, self.deferred) = (false, false, false, None);
        self.begun = self.decoder.reached().elapsed_ns;
        (self.goal, self.from) = (Some(goal), None);
    }

    /// Stays where it is, and goes on with what it is on the way to.
    pub(super) fn pause(&mut self) {
        (self.is_playing, self.is_at_end, self.from) = (false, false, None);
    }

    /// Gives up the way to a goal: what was decoded for it is shown.
    fn stay(&mut self) {
        // Nobody asked for that, and what is half known is not to be seen.
        if self.is_settling {
            return;
        }
        if self.goal.take().is_some() {
            self.arrive();
        }
    }

    /// Tells whether there is something to do at once.
    pub(super) fn is_busy(&self) -> bool {
        self.goal.is_some() || self.can_settle() || self.is_due()
    }

    /// Tells whether what waited until all before the playhead is known can be done.
    fn is_due(&self) -> bool {
        self.deferred.is_some() && self.goal.is_none() && !self.is_cold()
    }

    /// Tells whether there is something to do before long.
    pub(super) fn is_moving(&self) -> bool {
        self.is_playing || self.is_at_end
    }

    /// Goes on at a time, as long as `more` says so. Tells whether it waits for others.
    ///
    /// # Errors
    /// When the recording cannot be read on.
    pub(super) fn work(&mut self, now: Timestamp, more: &mut dyn FnMut() -> bool) -> Result<bool, Failure> {
        if self.goal.is_none() && self.can_settle() {
            self.settle()?;
        } else if self.is_due()
            && let Some(order) = self.deferred.take()
        {
            // Only now: on the way to what is looked for, nothing is shown, so what is known was shown before.
            self.order(order);
        }
        let stop = match self.goal.take() {
            Some(Goal::Find(find)) => self.find(find, more)?,
            Some(goal) => self.go(goal, more)?,
            None if self.is_playing => self.play(now, more)?,
            None if self.is_at_end => self.follow(more)?,
            None => Stop::Reached,
        };
        Ok(stop == Stop::Wait)
    }

    /// Goes to a place that can be told when it is reached.
    fn go(&mut self, mut goal: Goal, more: &mut dyn FnMut() -> bool) -> Result<Stop, Failure> {
        let count = |count: u64| i64::try_from(count).unwrap_or(i64::MAX);
        let target = match goal {
            Goal::Place(place) => place,
            Goal::Rows(_, rows) | Goal::Back(_, rows, _) => count(rows),
            Goal::Items(items) => count(items),
            Goal::End | Goal::Find(_) => i64::MAX,
        };
        let kind = goal.clone();
        let measure = |decoder: &Decoder<'_>| match kind {
            Goal::Place(_) => decoder.reached().elapsed_ns,
            Goal::Rows(list, _) | Goal::Back(list, ..) => count(decoder.rows(list)),
            Goal::Items(_) | Goal::End | Goal::Find(_) => count(decoder.reached().items),
        };
        let place = match goal {
            Goal::Place(place) => Some(place),
            Goal::End => Some(self.shared.lock().timeline.end()),
            _ => None,
        };
        let has_leapt = place.map_or(Ok(false), |place| self.leap(place))?;
        let is_beyond = self.is_cold() && matches!(goal, Goal::Rows(_, rows) if rows >= PROVISIONAL);
        if !has_leapt && !is_beyond {
            if self.is_cold() {
                self.warm_up()?;
            }
            self.approach(&measure, target)?;
        }
        // What follows a place that was leapt to is little, and the end of it all at most.
        let mut always = || true;
        let more: &mut dyn FnMut() -> bool = if has_leapt { &mut always } else { more };
        let stop = self.run(more, |head, next| match &mut goal {
            Goal::Back(list, count, items) => {
                let is_beyond = head.decoder.rows(*list) > *count;
                if !is_beyond {
                    *items = Some(head.decoder.reached().items);
                }
                is_beyond
            }
            Goal::Place(place) => next > *place,
            Goal::Rows(list, count) => head.decoder.rows(*list) >= *count,
            Goal::Items(items) => head.decoder.reached().items >= *items,
            Goal::End | Goal::Find(_) => false,
        })?;
        match (stop, &goal) {
            (Stop::Paused, _) => {
                self.goal = Some(goal);
                return Ok(stop);
            }
            (Stop::Reached | Stop::Over, Goal::Back(_, _, Some(items))) => {
                self.goal = Some(Goal::Items(*items));
                return Ok(Stop::Reached);
            }
            (Stop::Over | Stop::Wait, Goal::End) => self.is_at_end = stop == Stop::Wait,
            (Stop::Over, Goal::Rows(..)) => self.said = Some("the recording ends here".to_owned()),
            _ => {}
        }
        self.arrive();
        if let Goal::Place(place) = goal
            && stop == Stop::Reached
        {
            self.playhead = place;
        }
        self.is_settling = false;
        Ok(Stop::Reached)
    }

    /// Goes on with another decoder, from where its reel is.
    pub(super) fn replace(&mut self, reel: Reel<'s>, decoder: Decoder<'a>, is_pending: bool) {
        let watched = std::mem::take(&mut self.decoder.watched);
        (self.reel, self.decoder) = (reel, decoder);
        self.decoder.watched = watched;
        (self.is_pending, self.is_over, self.change) = (is_pending, false, Change::Replaced);
    }

    /// Takes the state to what will be shown.
    pub(super) fn arrive(&mut self) {
        self.playhead = self.decoder.reached().elapsed_ns;
        self.change = self.change.max_of(Change::Grown);
        self.from = None;
    }

    /// Restores a checkpoint from which it is nearer to where `measure` is `target` than from here.
    pub(super) fn approach(
        &mut self,
        measure: &dyn Fn(&Decoder<'a>) -> i64,
        target: i64,
    ) -> Result<(), Failure> {
        let nearest = self.shared.lock().checkpoints.near(measure, target);
        let is_past = measure(&self.decoder) > target;
        let Some(nearest) = nearest else { return Ok(()) };
        if !is_past && nearest.decoder.reached().items <= self.decoder.reached().items {
            return Ok(());
        }
        self.go_on_from(&nearest)
    }

    /// Restores the last checkpoint for which something holds, or the first.
    pub(super) fn restore(&mut self, is_before: &dyn Fn(&Decoder<'a>) -> bool) -> Result<(), Failure> {
        let checkpoint = {
            let known = self.shared.lock();
            known.checkpoints.last(is_before).or_else(|| known.checkpoints.first())
        };
        match checkpoint {
            Some(checkpoint) => self.go_on_from(&checkpoint),
            None => Ok(()),
        }
    }

    fn go_on_from(&mut self, nearest: &Checkpoint<'a>) -> Result<(), Failure> {
        let watched = std::mem::take(&mut self.decoder.watched);
        self.reel.go(&nearest.place)?;
        self.decoder = nearest.decoder.clone();
        self.decoder.watched = watched;
        (self.is_pending, self.is_over, self.change) = (false, false, Change::Replaced);
        Ok(())
    }

    /// Decodes on until something is reached; asked before each item, with its place.
    pub(super) fn run(
        &mut self,
        more: &mut dyn FnMut() -> bool,
        mut is_reached: impl FnMut(&Self, i64) -> bool,
    ) -> Result<Stop, Failure> {
        loop {
            if self.is_over {
                return Ok(Stop::Over);
            }
            if !self.is_pending {
                match self.reel.advance()? {
                    Advance::Item => self.is_pending = true,
                    Advance::Wait => return Ok(Stop::Wait),
                    Advance::End => {
                        self.decoder.finish()?;
                        self.is_over = true;
                        return Ok(Stop::Over);
                    }
                }
            }
            let item = self.reel.item();
            let next = self.decoder.elapsed_after(&item);
            if is_reached(self, next) {
                return Ok(Stop::Reached);
            }
            if !more() {
                return Ok(Stop::Paused);
            }
            let item = self.reel.item();
            self.decoder.take(&item, self.line, self.hold_ns)?;
            self.is_pending = false;
        }
    }

    /// Plays on up to where it should be by now.
    fn play(&mut self, now: Timestamp, more: &mut dyn FnMut() -> bool) -> Result<Stop, Failure> {
        let (since, from) = *self.from.get_or_insert((now, self.playhead));
        let ahead = (now - since) as f64 * self.speed;
        let target = from.saturating_add(ahead.clamp(0.0, i64::MAX as f64) as i64);
        let items = self.decoder.reached().items;
        let mut is_break = false;
        let stop = self.run(more, |head, next| {
            is_break = head.decoder.reached().items > items && head.decoder.last().breaks > 0;
            is_break || next > target
        })?;
        // The last item of all is followed by none that could ask.
        is_break |=
            stop == Stop::Over && self.decoder.reached().items > items && self.decoder.last().breaks > 0;
        if self.decoder.reached().items > items || stop == Stop::Over {
            self.change = self.change.max_of(Change::Grown);
        }
        self.playhead = match stop {
            Stop::Reached if !is_break => target,
            _ => self.decoder.reached().elapsed_ns,
        };
        match stop {
            _ if is_break => self.is_playing = false,
            Stop::Over => {
                self.is_playing = false;
                self.said = Some("the recording ends here".to_owned());
            }
            Stop::Wait => (self.is_playing, self.is_at_end) = (false, true),
            // What cannot keep up goes on from where it is.
            Stop::Paused if target - self.playhead > BEHIND => self.from = None,
            Stop::Paused | Stop::Reached => {}
        }
        Ok(Stop::Reached)
    }

    /// Takes in what was written since.
    fn follow(&mut self, more: &mut dyn FnMut() -> bool) -> Result<Stop, Failure> {
        let items = self.decoder.reached().items;
        let stop = self.run(more, |_, _| false)?;
        if self.decoder.reached().items > items || stop == Stop::Over {
            self.change = self.change.max_of(Change::Grown);
            self.playhead = self.decoder.reached().elapsed_ns;
        }
        if stop == Stop::Over {
            self.is_at_end = false;
            self.said = Some("the recording has ended".to_owned());
        }
        Ok(Stop::Reached)
    }

    /// Returns what is to be shown, and how it differs from what was shown before.
    pub(super) fn take_change(&mut self) -> Option<(Change, Store)> {
        match std::mem::take(&mut self.change) {
            Change::None => None,
            // On the way nothing is shown.
            change if self.goal.is_some() => {
                self.change = change;
                None
            }
            change => Some((change, self.decoder.store_at(self.playhead))),
        }
    }

    /// Returns what there is to say.
    pub(super) fn take_said(&mut self) -> Option<String> {
        self.said.take()
    }

    /// Says that something was not found, and goes back to where it was looked for.
    pub(super) fn give_up(&mut self, find: &Find) {
        let way = if find.is_forward { "after" } else { "before" };
        self.said = Some(format!("there is no {} {way} this", find.what.name()));
        self.goal = Some(if find.was_over { Goal::End } else { Goal::Items(find.from.items) });
    }

    /// Goes to a place found.
    pub(super) fn set_goal(&mut self, goal: Goal) {
        self.goal = Some(goal);
    }

    /// Tells whether this is what is looked for.
    pub(super) fn is_hit(last: &Bucket, what: Sought) -> bool {
        last.count(what) > 0
    }

    /// Returns the counts by which something is looked for, up to where they are known, and whether that is all.
    pub(super) fn series<T>(&self, what: Sought, look: impl FnOnce(&Series, i64, bool) -> T) -> Option<T> {
        let known = self.shared.lock();
        let timeline = &known.timeline;
        match what {
            Sought::Match | Sought::Words => {
                let hits = if what == Sought::Match { &timeline.hits } else { &timeline.words };
                let (series, until) = hits.as_ref()?;
                Some(look(series, *until, timeline.is_complete && *until >= timeline.decoded_ns))
            }
            Sought::Error | Sought::Finding | Sought::Note => {
                Some(look(&timeline.events, timeline.decoded_ns, timeline.is_complete))
            }
        }
    }

    /// Returns the state as it is to be shown, if that is not what was told last.
    pub(super) fn take_state(&mut self) -> Option<Replay> {
        let state = self.state();
        let is_same = self.told.as_ref().is_some_and(|told| {
            let same_timeline = Arc::ptr_eq(&told.timeline, &state.timeline);
            same_timeline
                && (told.playhead, told.is_playing, told.speed, told.is_at_end, told.way)
                    == (state.playhead, state.is_playing, state.speed, state.is_at_end, state.way)
        });
        self.told = Some(state.clone());
        (!is_same).then_some(state)
    }

    /// Returns the state as it is shown.
    pub(super) fn state(&mut self) -> Replay {
        {
            let known = self.shared.lock();
            if known.version != self.timeline.0 {
                self.timeline = (known.version, Arc::new(known.timeline.clone()));
            }
        }
        let timeline = Arc::clone(&self.timeline.1);
        let here = self.decoder.reached().elapsed_ns;
        let share = |to: i64| (here - self.begun) as f64 / (to - self.begun).max(1) as f64;
        let deferred = self.deferred.as_ref().and_then(Order::sought);
        let way = self.goal.as_ref().filter(|_| !self.is_settling).map(|goal| match goal {
            Goal::Place(place) => (Way::Place(*place), share(*place)),
            Goal::End => (Way::End, share(timeline.end())),
            Goal::Rows(..) | Goal::Back(..) | Goal::Items(_) => (Way::Rows, 0.0),
            Goal::Find(find) => {
                let hits = match find.what {
                    Sought::Match => timeline.hits.as_ref(),
                    Sought::Words => timeline.words.as_ref(),
                    Sought::Error | Sought::Finding | Sought::Note => None,
                };
                let until = hits.map_or(timeline.decoded_ns, |(_, until)| *until);
                (Way::Find(find.what, find.is_forward), until as f64 / timeline.end().max(1) as f64)
            }
        });
        let way = deferred.map_or(way, |(what, is_forward)| {
            Some((Way::Find(what, is_forward), timeline.decoded_ns as f64 / timeline.end().max(1) as f64))
        });
        Replay {
            timeline,
            playhead: self.playhead,
            is_playing: self.is_playing,
            speed: self.speed,
            is_at_end: self.is_at_end,
            way,
        }
    }
}

impl Change {
    /// Returns the larger change.
    fn max_of(self, other: Change) -> Change {
        if self == Change::Replaced { self } else { other }
    }
}
