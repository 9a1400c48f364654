//! Going about in a recording: what the keys of a replay ask of the player, and what it tells.
//!
//! The store that is shown is the one at the playhead, so that nothing on the screen is later than that. Scrolling
//! beyond its rows moves the playhead.

use std::sync::Arc;

use ratatui::layout::Position;

use super::marks::is_note;
use super::prompt::{Target, time_filter};
use super::traffic::Pane;
use super::{Action, App, Effect, View};
use crate::analyze::filter::{Filter, Subject};
use crate::report;
use crate::time::{SECOND, Timestamp};
use crate::tui::sieve::Sieve;
use crate::tui::store::{List, Row, Store, Tone};
use crate::tui::timeline::{Sought, Timeline};

/// How fast a recording is played at most, and least.
pub const SPEEDS: (f64, f64) = (0.1, 1000.0);
/// The speeds that keys go through.
const STEPS: [f64; 13] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];
/// The part of a recording that a key goes on.
const PART: i64 = 50;
/// Among how many of the latest rows what was found is.
const LATEST: usize = 64;
/// Nanoseconds of a day.
const DAY: i64 = 86_400 * SECOND;

/// Says what the player is to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Play, or pause.
    Play,
    /// Play at this speed.
    Speed(f64),
    /// Go to a place, in nanoseconds from the beginning.
    Place(i64),
    /// Go to where a list has so many rows.
    Rows(List, u64),
    /// Go to the end, and stay there while the recording grows.
    End,
    /// Go to the next of something, or the last before; back, from a row if one is given, else from the playhead.
    Find {
        /// What is looked for.
        what: Sought,
        /// Which way.
        is_forward: bool,
        /// The list and number of a row before which it is looked for.
        before: Option<(List, u64)>,
    },
    /// Look what passes a filter in all of the recording; without one, stop looking.
    Look(Option<Filter>),
    /// Go to the next row with words, or the last before, as for [`Order::Find`]; look for them in all of the recording.
    Words {
        /// What is looked for.
        sieve: Sieve,
        /// Which way.
        is_forward: bool,
        /// The list and number of a row before which it is looked for.
        before: Option<(List, u64)>,
    },
    /// Pause when a row passes; without a filter, do not.
    Break(Option<Filter>),
    /// Give up what it is on the way to.
    Stay,
}

impl Order {
    /// Returns the same order from the playhead, where it was to be done from a row.
    pub fn without_row(self) -> Order {
        match self {
            Order::Find { what, is_forward, .. } => Order::Find { what, is_forward, before: None },
            Order::Words { sieve, is_forward, .. } => Order::Words { sieve, is_forward, before: None },
            order => order,
        }
    }

    /// Returns what it looks for, and whether forward.
    pub fn sought(&self) -> Option<(Sought, bool)> {
        match self {
            Order::Find { what, is_forward, .. } => Some((*what, *is_forward)),
            Order::Words { is_forward, .. } => Some((Sought::Words, *is_forward)),
            _ => None,
        }
    }
}

/// Is the state of a replay, as the player tells it.
#[derive(Clone, Debug, Default)]
pub struct Replay {
    /// The whole recording.
    pub timeline: Arc<Timeline>,
    /// Where the store is, in nanoseconds from the beginning.
    pub playhead: i64,
    /// Whether it goes on by itself.
    pub is_playing: bool,
    /// How fast.
    pub speed: f64,
    /// Whether it is at the end, and stays there while the recording grows.
    pub is_at_end: bool,
    /// What the player is on the way to, and how far it has got, from 0 to 1.
    pub way: Option<(Way, f64)>,
}

/// Says what the player is on the way to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// A place, in nanoseconds from the beginning.
    Place(i64),
    /// A row.
    Rows,
    /// The end.
    End,
    /// The next of something, or the one before.
    Find(Sought, bool),
}

impl Replay {
    /// Returns the time at the playhead; `None` without times.
    pub fn time(&self) -> Option<Timestamp> {
        self.timeline.time(self.playhead)
    }

    fn speed_after(&self, is_faster: bool) -> f64 {
        let next = STEPS.iter().copied().find(|step| *step > self.speed * 1.001);
        let before = STEPS.iter().rev().copied().find(|step| *step < self.speed * 0.999);
        if is_faster { next.unwrap_or(SPEEDS.1) } else { before.unwrap_or(SPEEDS.0) }
    }
}

/// Is the part of the UI that a replay has beside a live session.
#[derive(Clone, Debug, Default)]
pub(super) struct Deck {
    /// What the player told last.
    pub(super) replay: Option<Replay>,
    /// The filter that is looked for in all of the recording.
    looked: Option<Filter>,
    /// Marked places.
    pub(super) marks: Vec<i64>,
    /// What was noted here, with the time of the traffic.
    pub(super) notes: Vec<(Timestamp, String)>,
    /// How many notes are in no file yet.
    pub(super) unkept: usize,
    /// Whether it was said that quitting loses them.
    pub(super) has_asked: bool,
    /// Whether the playhead is dragged.
    is_dragged: bool,
    /// What is to be selected when the player has arrived.
    awaited: Option<Awaited>,
    /// The place of the mark or note that the player is sent to.
    pub(super) remark: Option<i64>,
    /// The row that was gone to for a mark or note, and the place of that.
    pub(super) arrived: Option<(u64, i64)>,
}

/// Says what is to be selected when the player has arrived.
#[derive(Clone, Debug)]
enum Awaited {
    /// The last row of what was found; it is one of the latest.
    Hit(Sought, Option<Sieve>),
    /// The row so many after the one that is selected.
    Step(isize),
    /// The row nearest to a place that was marked or noted.
    Remark(i64),
}

impl App {
    /// Returns the state of the replay; `None` for live traffic.
    pub fn replay(&self) -> Option<&Replay> {
        self.deck.replay.as_ref()
    }

    /// Takes what the player tells.
    pub(super) fn set_replay(&mut self, replay: Replay) {
        self.deck.replay = Some(replay);
    }

    /// Returns the order to look for another filter, if it is another.
    pub(super) fn look(&mut self) -> Option<Effect> {
        if self.deck.replay.is_none() || self.deck.looked == self.filter {
            return None;
        }
        self.deck.looked = self.filter.clone();
        Some(Effect::Replay(Order::Look(self.filter.clone())))
    }

    /// Tells whether an action goes about in a recording, and what the player is to do.
    pub(super) fn replay_order(&mut self, action: Action) -> Option<Effect> {
        let order = self.order(action)?;
        let page = isize::try_from(self.page().saturating_sub(1).max(1)).unwrap_or(1);
        let step = match action {
            Action::Down => Some(1),
            Action::PageDown => Some(page),
            _ => None,
        };
        let effect = self.effect(order);
        // Who moves the playhead wants to see what is there, wherever in the rows one was.
        let moves_playhead = matches!(
            action,
            Action::StepForward
                | Action::StepBack
                | Action::SeekForward
                | Action::SeekBack
                | Action::SeekBegin
                | Action::SeekEnd
        );
        if moves_playhead && self.view == View::Traffic {
            let height = self.page();
            self.traffic.follow(&self.store, height);
        }
        if let Some(step) = step.filter(|_| !self.traffic.is_following && self.filter.is_none()) {
            self.deck.awaited = Some(Awaited::Step(step));
        }
        if let Some(place) = self.deck.remark.take() {
            self.deck.awaited = Some(Awaited::Remark(place));
        }
        Some(effect)
    }

    /// Asks the player for something; what it comes to is selected.
    pub(super) fn effect(&mut self, order: Order) -> Effect {
        // What is pressed twice counts twice, even before the player has told of the first.
        if let Some(replay) = &mut self.deck.replay {
            match order {
                Order::Speed(speed) => replay.speed = speed,
                Order::Place(place) => replay.playhead = place,
                _ => {}
            }
        }
        self.deck.awaited = match &order {
            Order::Find { what, .. } => Some(Awaited::Hit(*what, None)),
            Order::Words { sieve, .. } => Some(Awaited::Hit(Sought::Words, Some(sieve.clone()))),
            _ => None,
        };
        Effect::Replay(order)
    }

    /// Selects what was asked for, as far as it has come.
    pub(super) fn select_awaited(&mut self) {
        let is_on_the_way = self.deck.replay.as_ref().is_some_and(|replay| replay.way.is_some());
        let Some(awaited) = self.deck.awaited.take_if(|_| !is_on_the_way) else { return };
        let height = self.page();
        match awaited {
            Awaited::Step(by) => self.traffic.step(&self.store, by, height),
            Awaited::Remark(place) => self.go_to_place(place),
            Awaited::Hit(what, sieve) => {
                let is_hit = |row: &Row| is_hit(&self.store, row, what, sieve.as_ref());
                let count = self.traffic.order.len(&self.store);
                let rows = self.store.list(self.traffic.list);
                let numbers = (0..count).rev().take(LATEST);
                let mut numbers = numbers.filter_map(|place| self.traffic.order.number(&self.store, place));
                if let Some(number) = numbers.find(|number| rows.get(*number).is_some_and(is_hit)) {
                    self.traffic.select(&self.store, number, height);
                }
            }
        }
    }

    fn order(&mut self, action: Action) -> Option<Order> {
        let replay = self.deck.replay.as_ref()?;
        let end = replay.timeline.end();
        let part = (end / PART).max(1);
        Some(match action {
            Action::Freeze | Action::Play => Order::Play,
            Action::Faster => Order::Speed(replay.speed_after(true)),
            Action::Slower => Order::Speed(replay.speed_after(false)),
            Action::SeekBack => Order::Place(replay.playhead.saturating_sub(part).max(0)),
            Action::SeekForward => Order::Place(replay.playhead.saturating_add(part).min(end)),
            Action::SeekBegin => Order::Rows(self.traffic.list, self.page() as u64),
            Action::SeekEnd => Order::End,
            Action::StepForward => Order::Rows(List::Frames, self.store.list(List::Frames).total() + 1),
            Action::StepBack => {
                Order::Rows(List::Frames, self.store.list(List::Frames).total().saturating_sub(1))
            }
            Action::Back if replay.way.is_some() && self.traffic.pane == Pane::List => Order::Stay,
            _ if self.view == View::Traffic => return self.order_in_traffic(action),
            _ => return None,
        })
    }

    pub(super) fn page(&self) -> usize {
        self.regions().rows()
    }

    /// Returns what the player is to do when one goes beyond the rows there are.
    fn order_in_traffic(&mut self, action: Action) -> Option<Order> {
        let (list, rows) = (self.traffic.list, self.store.list(self.traffic.list));
        match action {
            Action::NextError | Action::PreviousError => {
                let is_forward = action == Action::NextError;
                let is_hit = |row: &Row| row.tone() >= Tone::Warn;
                return self.beyond(Sought::Error, is_forward, &is_hit);
            }
            Action::NextMark | Action::PreviousMark => return self.beyond_marks(action == Action::NextMark),
            Action::NextFinding | Action::PreviousFinding => {
                let store = self.store.clone();
                let is_hit = |row: &Row| store.findings().of_row(row).next().is_some();
                return self.beyond(Sought::Finding, action == Action::NextFinding, &is_hit);
            }
            _ => {}
        }
        if self.traffic.pane != Pane::List || self.traffic.order.is_sorted() {
            return None;
        }
        let count = self.traffic.order.len(&self.store);
        let place = self.traffic.place(&self.store).unwrap_or(0);
        let (is_first, is_last) = (place == 0, place + 1 >= count);
        let page = self.page().saturating_sub(1).max(1) as u64;
        let is_filtered = self.filter.is_some();
        let find = |is_forward, before| Order::Find { what: Sought::Match, is_forward, before };
        let has_older = rows.first_kept() > 0;
        match action {
            Action::Up | Action::PageUp | Action::Top if is_first && has_older => Some(match is_filtered {
                true => find(false, Some((list, rows.first_kept()))),
                false if action == Action::Top => Order::Rows(list, page),
                false => Order::Rows(list, rows.first_kept()),
            }),
            Action::Down | Action::PageDown if is_last && is_filtered => Some(find(true, None)),
            Action::Down if is_last => Some(Order::Rows(list, rows.total() + 1)),
            Action::PageDown if is_last => Some(Order::Rows(list, rows.total() + page)),
            Action::Bottom if is_last => Some(Order::End),
            _ => None,
        }
    }

    /// Selects the next row in memory, if there is one; else says where the player is to look.
    fn beyond(&mut self, what: Sought, is_forward: bool, is_hit: &dyn Fn(&Row) -> bool) -> Option<Order> {
        let found = self.traffic.find(&self.store, is_forward, |_, row| is_hit(row));
        if found.is_some_and(|(_, went_round)| !went_round) {
            return None; // as in live traffic
        }
        let list = self.traffic.list;
        let before = (!is_forward).then(|| (list, self.store.list(list).first_kept()));
        Some(Order::Find { what, is_forward, before })
    }

    /// Goes where the timeline was pressed or dragged to.
    pub(super) fn seek_by_mouse(&mut self, at: Position, is_press: bool) -> Option<Effect> {
        let area = self.regions().timeline?;
        let replay = self.deck.replay.as_ref()?;
        self.deck.is_dragged = if is_press { area.contains(at) } else { self.deck.is_dragged };
        if !self.deck.is_dragged {
            return None;
        }
        let column = at.x.clamp(area.x, area.right().saturating_sub(1)) - area.x;
        let share = i128::from(column) * i128::from(replay.timeline.end());
        let place = share / i128::from(area.width.saturating_sub(1).max(1));
        Some(Effect::Replay(Order::Place(i64::try_from(place).unwrap_or(0))))
    }

    /// Lets go of the playhead.
    pub(super) fn release_playhead(&mut self) {
        self.deck.is_dragged = false;
    }

    /// Returns where a time that was typed is: a time of day is the one on the day of the playhead.
    pub(super) fn order_of_time(&self, text: &str) -> Option<Order> {
        let replay = self.deck.replay.as_ref()?;
        let seconds = |seconds: f64| (seconds * SECOND as f64).clamp(0.0, i64::MAX as f64) as i64;
        match (time_filter(text), replay.time()) {
            (Ok(Target::Seconds(at)), _) => Some(Order::Place(seconds(at))),
            (Ok(Target::Filter(filter)), Some(now)) => {
                let origin = replay.timeline.origin?;
                let at = first_passing(&filter, now)?;
                Some(Order::Place((at - origin).clamp(0, replay.timeline.end())))
            }
            _ => None,
        }
    }
}

/// Tells whether a row is what was looked for.
fn is_hit(store: &Store, row: &Row, what: Sought, sieve: Option<&Sieve>) -> bool {
    match what {
        Sought::Error => row.tone() >= Tone::Warn,
        Sought::Finding => store.findings().of_row(row).next().is_some(),
        Sought::Match => true, // only those that pass are listed
        Sought::Words => sieve.is_some_and(|sieve| sieve.passes(store, row)),
        Sought::Note => is_note(row),
    }
}

/// Asks a filter about nothing but a time.
struct Moment(Timestamp);

impl Subject for Moment {
    fn start_ns(&self) -> Option<i64> {
        Some(self.0.as_ns())
    }

    fn time_of_day_ns(&self) -> Option<i64> {
        Some(report::time_of_day_ns(self.0))
    }
}

/// Returns the first moment that passes `time >= …`: by a date any, by a time of day one on the day of `now`.
fn first_passing(filter: &Filter, now: Timestamp) -> Option<Timestamp> {
    let passes = |at: i64| filter.matches(&Moment(Timestamp::from_ns(at)));
    let midnight = |time: Timestamp| time.as_ns().saturating_sub(report::time_of_day_ns(time));
    // The last moment of a day passes whatever time of day is meant, but no date later than the day.
    let is_of_day = passes(midnight(Timestamp::from_ns(0)).saturating_add(DAY - 1));
    let midnight = midnight(now);
    let (mut low, mut high) = match is_of_day {
        true => (midnight, midnight.saturating_add(DAY - 1)),
        false => (i64::MIN / 2, i64::MAX / 2),
    };
    if !passes(high) {
        return None;
    }
    while low < high {
        let middle = low + (high - low) / 2;
        if passes(middle) { high = middle } else { low = middle + 1 }
    }
    Some(Timestamp::from_ns(high))
}
