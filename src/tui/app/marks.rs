//! What people mark and note: rows of live traffic, and places of a recording.

use super::replay::Order;
use super::{Action, App};
use crate::time::{SECOND, Timestamp};
use crate::tui::store::{RemarkKind, Row, Tone};
use crate::tui::timeline::Sought;

/// How long after its beginning a row is there, in nanoseconds, but for one that takes long.
const ROW: i64 = SECOND;

impl App {
    /// Marks the selected row, or takes its mark away.
    pub(super) fn toggle_mark(&mut self) {
        if self.deck.replay.is_some() {
            self.mark_place();
        }
        // A row of a recording is told by its time: it is numbered anew when what came before it becomes known.
        if self.place_of_selected().is_none() {
            self.traffic.toggle_mark(&self.store);
        }
    }

    /// Tells whether a row is marked.
    pub fn is_marked(&self, number: u64, row: &Row) -> bool {
        match self.place_of(row) {
            Some(place) => self.deck.marks.contains(&place),
            None => self.traffic.is_marked(number),
        }
    }

    /// Returns where in the recording a row is, in nanoseconds from the beginning; `None` without times, and in live
    /// traffic.
    fn place_of(&self, row: &Row) -> Option<i64> {
        let origin = self.deck.replay.as_ref()?.timeline.origin?;
        Some(row.time()? - origin)
    }

    fn place_of_selected(&self) -> Option<i64> {
        self.place_of(self.traffic.row(&self.store)?)
    }

    /// Marks the place of the selected row, or takes its mark away.
    fn mark_place(&mut self) {
        let Some(replay) = &self.deck.replay else { return };
        let at = self.place_of_selected().unwrap_or(replay.playhead);
        match self.deck.marks.iter().position(|known| *known == at) {
            Some(known) => drop(self.deck.marks.remove(known)),
            None => self.deck.marks.push(at),
        }
    }

    /// Returns the marked places, in nanoseconds from the beginning.
    pub fn marked_places(&self) -> &[i64] {
        &self.deck.marks
    }

    /// Returns the places of what was noted here, in nanoseconds from the beginning.
    pub fn noted_places(&self) -> impl Iterator<Item = i64> {
        let origin = self.deck.replay.as_ref().and_then(|replay| replay.timeline.origin);
        self.deck.notes.iter().filter_map(move |(time, _)| Some(*time - origin?))
    }

    /// Notes something about a time of the recording; it is kept until it is exported.
    pub(super) fn note_place(&mut self, time: Option<Timestamp>, text: String) {
        let Some(time) = time else {
            return self.say(Tone::Warn, "a note is of a time, and this recording has none");
        };
        self.deck.notes.push((time, text));
        (self.deck.unkept, self.deck.has_asked) = (self.deck.unkept + 1, false);
        let key = self.shown_key(Action::Export);
        self.say(Tone::Good, format!("noted; an export ({key}) to .mcap keeps it"));
    }

    /// Takes note of the marks and notes that are in a file now; others may have been made since it was begun.
    pub(super) fn keep_notes(&mut self, remarks: &[(Timestamp, String)]) {
        let since = self.deck.notes.iter().filter(|note| !remarks.contains(note)).count();
        self.deck.unkept = self.deck.unkept.min(since);
    }

    /// Tells whether quitting loses notes, which is said once.
    pub(super) fn asks_to_keep_notes(&mut self) -> bool {
        if self.deck.unkept == 0 || std::mem::replace(&mut self.deck.has_asked, true) {
            return false;
        }
        let (export, quit) = (self.shown_key(Action::Export), self.shown_key(Action::Quit));
        let count = self.deck.unkept;
        let notes = if count == 1 { "note" } else { "notes" };
        self.say(Tone::Warn, format!("{count} {notes} unkept: {export} to .mcap, {quit} quits"));
        true
    }

    /// Returns what was marked, and in a recording what was noted, in the order of time.
    pub(super) fn remarks(&self) -> Vec<(Timestamp, String)> {
        let marks = self.marked_times().into_iter().map(|time| (time, "mark".to_owned()));
        let mut remarks: Vec<_> = marks.chain(self.deck.notes.iter().cloned()).collect();
        remarks.sort_by_key(|(time, _)| *time);
        remarks
    }

    /// Returns the times that were marked, in order.
    fn marked_times(&self) -> Vec<Timestamp> {
        let mut times: Vec<Timestamp> = match &self.deck.replay {
            Some(replay) => self.deck.marks.iter().filter_map(|at| replay.timeline.time(*at)).collect(),
            None => self.traffic.marked_times().collect(),
        };
        times.sort_unstable();
        times.dedup();
        times
    }

    /// Says where the player is to go for the next mark or note; `None` where that is in memory.
    pub(super) fn beyond_marks(&mut self, is_forward: bool) -> Option<Order> {
        let own = self.next_own(is_forward);
        if self.next_in_memory(is_forward, own).is_some() {
            return None; // as in live traffic
        }
        let replay = self.deck.replay.as_ref()?;
        let (here, series, end) = (replay.playhead, &replay.timeline.events, replay.timeline.end());
        let note = if is_forward {
            series.next_with(Sought::Note, series.index(here).saturating_add(1))
        } else {
            series.last_with(Sought::Note, series.index(self.first_place().unwrap_or(0)))
        };
        let note = note.map(|at| series.begin_of(at));
        let list = self.traffic.list;
        let before = (!is_forward).then(|| (list, self.store.list(list).first_kept()));
        let is_own_nearer = |own: &i64| note.is_none_or(|note| (*own < note) == is_forward);
        Some(match own.filter(is_own_nearer) {
            Some(own) => {
                self.deck.remark = Some(own);
                // What began there is a row only when it has ended.
                Order::Place(own.saturating_add(ROW).min(end))
            }
            None => Order::Find { what: Sought::Note, is_forward, before },
        })
    }

    /// Goes to the next mark or note in memory.
    pub(super) fn go_to_remark(&mut self, is_forward: bool) {
        let own = self.next_own(is_forward);
        match self.next_in_memory(is_forward, own) {
            Some(Next::Own(place)) => self.go_to_place(place),
            _ => self.go_to("marked row or note", is_forward, |app, number, row| {
                app.is_marked(number, row) || is_note(row)
            }),
        }
    }

    /// Returns the next mark or note if it is in memory; `own` is the next that was made here.
    fn next_in_memory(&self, is_forward: bool, own: Option<i64>) -> Option<Next> {
        let is_remark = |number: u64, row: &Row| self.is_marked(number, row) || is_note(row);
        let found =
            self.traffic.find(&self.store, is_forward, is_remark).filter(|(_, went_round)| !went_round);
        let row = found.and_then(|(number, _)| self.store.list(self.traffic.list).get(number));
        let at = row.and_then(|row| self.place_of(row));
        let is_nearer = |own: &i64| at.is_none_or(|at| if is_forward { *own <= at } else { *own >= at });
        match own.filter(|own| (row.is_none() || at.is_some()) && is_nearer(own)) {
            Some(own) => {
                let last = self.store.now()? - self.deck.replay.as_ref()?.timeline.origin?;
                (self.first_place()?..=last).contains(&own).then_some(Next::Own(own))
            }
            None => row.map(|_| Next::Row),
        }
    }

    /// Returns the place of the next mark or note that was made here; a note on the selected row itself is the next as
    /// long as nobody went there.
    fn next_own(&self, is_forward: bool) -> Option<i64> {
        let replay = self.deck.replay.as_ref()?;
        let arrived = self.deck.arrived.filter(|(number, _)| Some(*number) == self.traffic.selected);
        let here = arrived.map(|(_, place)| place).or(self.place_of_selected()).unwrap_or(replay.playhead);
        let is_here = |place: &i64| *place == here && arrived.is_none();
        if let Some(place) = self.noted_places().find(is_here) {
            return Some(place);
        }
        let own = self.deck.marks.iter().copied().chain(self.noted_places());
        if is_forward { own.filter(|at| *at > here).min() } else { own.filter(|at| *at < here).max() }
    }

    /// Returns where the first row in memory is.
    fn first_place(&self) -> Option<i64> {
        let first = self.store.list(self.traffic.list).iter().next()?;
        self.place_of(first)
    }

    /// Selects the listed row that is nearest to a place, and says what was noted there.
    pub(super) fn go_to_place(&mut self, place: i64) {
        let rows = self.store.list(self.traffic.list);
        let order = &self.traffic.order;
        let listed = (0..order.len(&self.store)).filter_map(|at| order.number(&self.store, at));
        let timed = listed.filter_map(|number| Some((number, self.place_of(rows.get(number)?)?)));
        if let Some((number, _)) = timed.min_by_key(|(_, at)| at.abs_diff(place)) {
            let height = self.page();
            self.traffic.select(&self.store, number, height);
            self.deck.arrived = Some((number, place));
        }
        let notes = self.noted_places().zip(&self.deck.notes).filter(|(at, _)| *at == place);
        let texts: Vec<&str> = notes.map(|(_, (_, text))| text.as_str()).collect();
        if !texts.is_empty() {
            self.say(Tone::Info, format!("noted: {}", texts.join(" · ")));
        }
    }
}

/// Says where the next mark or note in memory is.
enum Next {
    /// It is a row.
    Row,
    /// It was made here, of this place.
    Own(i64),
}

/// Tells whether a row is what somebody noted.
pub(super) fn is_note(row: &Row) -> bool {
    matches!(row, Row::Remark(remark) if remark.kind == RemarkKind::Note)
}
