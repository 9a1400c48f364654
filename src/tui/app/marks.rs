//! What people mark and note: rows of live traffic, and places of a recording.

use super::replay::Order;
use super::{Action, App};
use crate::time::Timestamp;
use crate::tui::store::{RemarkKind, Row, Tone};
use crate::tui::timeline::Sought;

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
        let key = self.shown_key(Action::Export);
        self.say(Tone::Good, format!("noted; an export ({key}) keeps it"));
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

    /// Says where the player is to go for the next mark or note that is not in memory.
    pub(super) fn beyond_marks(&self, is_forward: bool) -> Option<Order> {
        let is_remark = |number: u64, row: &Row| self.is_marked(number, row) || is_note(row);
        let found = self.traffic.find(&self.store, is_forward, is_remark);
        if found.is_some_and(|(_, went_round)| !went_round) {
            return None; // as in live traffic
        }
        let replay = self.deck.replay.as_ref()?;
        let (here, series) = (replay.playhead, &replay.timeline.events);
        let marks = self.deck.marks.iter().copied().chain(self.noted_places());
        let (mark, note) = if is_forward {
            let note = series.next_with(Sought::Note, series.index(here).saturating_add(1));
            (marks.filter(|at| *at > here).min(), note.map(|at| series.begin_of(at)))
        } else {
            let begin = self.store.list(self.traffic.list).iter().next().and_then(Row::time);
            let from = begin.zip(replay.timeline.origin).map_or(0, |(begin, origin)| begin - origin);
            let note = series.last_with(Sought::Note, series.index(from));
            (marks.filter(|at| *at < from).max(), note.map(|at| series.begin_of(at)))
        };
        let list = self.traffic.list;
        let before = (!is_forward).then(|| (list, self.store.list(list).first_kept()));
        let is_mark_nearer = match (mark, note) {
            (Some(mark), Some(note)) => (mark < note) == is_forward,
            (mark, _) => mark.is_some(),
        };
        Some(match mark.filter(|_| is_mark_nearer) {
            Some(mark) => Order::Place(mark),
            None => Order::Find { what: Sought::Note, is_forward, before },
        })
    }
}

/// Tells whether a row is what somebody noted.
pub(super) fn is_note(row: &Row) -> bool {
    matches!(row, Row::Remark(remark) if remark.kind == RemarkKind::Note)
}
