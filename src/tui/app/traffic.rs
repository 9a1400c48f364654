//! The state of the traffic view: which row is selected, what is listed, which pane has the focus.

use std::collections::BTreeMap;

use super::columns::{Column, Columns};
use super::detail::Detail;
use super::order::Order;
use crate::analyze::filter::Filter;
use crate::time::Timestamp;
use crate::tui::store::{List, Row, Store};

/// Names the panes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pane {
    /// The rows.
    #[default]
    List,
    /// The fields of the selected row.
    Tree,
    /// Its bytes.
    Hex,
}

/// Is the state of the traffic view.
#[derive(Clone, Debug)]
pub struct Traffic {
    /// Which list is shown.
    pub list: List,
    /// What of it, in what order.
    pub order: Order,
    /// The number of the selected row.
    pub selected: Option<u64>,
    /// The line of the screen it is on, from 0.
    line: usize,
    /// Whether the newest row is selected as it comes.
    pub is_following: bool,
    /// Which pane has the focus.
    pub pane: Pane,
    /// Whether the pane with the focus has the whole screen.
    pub is_zoomed: bool,
    /// The selected line of the tree.
    pub node: usize,
    /// The selected byte, counted over all frames of the row.
    pub byte: usize,
    /// Which columns are wanted.
    pub columns: Columns,
    /// By which column rows are sorted, and whether the largest comes first.
    pub sorted_by: Option<(Column, bool)>,
    /// The marked rows of each list, with their times; of a recording only those without one.
    marks: [BTreeMap<u64, Option<Timestamp>>; 2],
    /// How much of the height the list gets, in percent.
    pub share: u16,
    /// How much of the width of the detail pane the tree gets, in percent.
    pub tree_share: u16,
    /// How many rows there were when the list was let go.
    pub left_at: u64,
}

impl Default for Traffic {
    fn default() -> Self {
        Traffic {
            list: List::Exchanges,
            order: Order::default(),
            selected: None,
            line: 0,
            is_following: true,
            pane: Pane::List,
            is_zoomed: false,
            node: 0,
            byte: 0,
            columns: Columns::default(),
            sorted_by: None,
            marks: Default::default(),
            share: 60,
            tree_share: 50,
            left_at: 0,
        }
    }
}

impl Traffic {
    /// Lists rows afresh, by another filter or from another store.
    pub fn reset(&mut self, store: &Store, filter: Option<&Filter>) {
        self.order.reset(store, self.list, filter);
        self.order.sort(store, self.sorted_by);
    }

    /// Takes in what is new; `height` is how many rows are on the screen.
    pub fn update(&mut self, store: &Store, filter: Option<&Filter>, height: usize) {
        self.order.update(store, filter);
        self.settle(store, height);
    }

    /// Selects a row that there is, and keeps it on the screen.
    pub fn settle(&mut self, store: &Store, height: usize) {
        let count = self.order.len(store);
        let place = match (self.selected, self.is_following) {
            (_, true) | (None, _) => count.saturating_sub(1),
            (Some(number), false) => {
                let (Ok(place) | Err(place)) = self.order.place(store, number);
                place.min(count.saturating_sub(1))
            }
        };
        let before = self.selected;
        self.selected = self.order.number(store, place);
        if self.selected != before {
            (self.node, self.byte) = (0, 0);
        }
        self.line = if self.is_following { height.saturating_sub(1) } else { self.line };
        // No empty lines while there are rows to fill them.
        let least = height.saturating_sub(count - place.min(count)).min(place);
        self.line = self.line.clamp(least.min(height.saturating_sub(1)), height.saturating_sub(1)).min(place);
    }

    /// Returns the place of the selected row in the list.
    pub fn place(&self, store: &Store) -> Option<usize> {
        self.order.place(store, self.selected?).ok()
    }

    /// Returns the place of the first row on the screen.
    pub fn top(&self, store: &Store) -> usize {
        self.place(store).unwrap_or(0).saturating_sub(self.line)
    }

    /// Returns the selected row.
    pub fn row<'a>(&self, store: &'a Store) -> Option<&'a Row> {
        store.list(self.list).get(self.selected?)
    }

    /// Returns what there is to know of the selected row.
    pub fn detail(&self, store: &Store) -> Detail {
        self.selected.map(|number| Detail::of(store, self.list, number)).unwrap_or_default()
    }

    /// Selects the row at a place; lets go of the newest unless it is that.
    pub fn go(&mut self, store: &Store, place: usize, height: usize) {
        let count = self.order.len(store);
        let place = place.min(count.saturating_sub(1));
        let top = self.top(store);
        let was_following = self.is_following;
        self.is_following = false;
        let number = self.order.number(store, place);
        if number != self.selected {
            (self.node, self.byte) = (0, 0);
        }
        if was_following {
            self.left_at = store.list(self.list).total();
        }
        self.selected = number;
        self.line = match place.checked_sub(top) {
            Some(line) => line.min(height.saturating_sub(1)),
            None => 0,
        };
        self.settle(store, height);
    }

    /// Moves by so many rows.
    pub fn step(&mut self, store: &Store, by: isize, height: usize) {
        let place = self.place(store).unwrap_or(0);
        self.go(store, place.saturating_add_signed(by), height);
    }

    /// Selects a row by its number, in the middle of the screen where it was not on it.
    pub fn select(&mut self, store: &Store, number: u64, height: usize) {
        let (Ok(place) | Err(place)) = self.order.place(store, number);
        let top = self.top(store);
        self.go(store, place, height);
        if !(top..top.saturating_add(height)).contains(&place) {
            self.line = height / 2;
            self.settle(store, height);
        }
    }

    /// Returns the number that the selected row has in another store, which ends where this one does.
    pub fn same_row(&self, store: &Store, other: &Store) -> Option<u64> {
        let time = self.row(store)?.time();
        let (rows, others) = (store.list(self.list), other.list(self.list));
        // Rows of the same time are told apart by how many come after them.
        let after = rows.total() - self.selected?;
        let likely = others.total().saturating_sub(after);
        let is_same = |number: &u64| others.get(*number).is_some_and(|row| row.time() == time);
        others.kept().filter(is_same).min_by_key(|number| number.abs_diff(likely))
    }

    /// Stays on the selected row, and what is looked at of it, now that it has another number.
    pub fn renumber(&mut self, number: u64) {
        self.selected = Some(number);
    }

    /// Follows the newest row.
    pub fn follow(&mut self, store: &Store, height: usize) {
        if self.sorted_by.take().is_some() {
            self.order.sort(store, None);
        }
        self.is_following = true;
        self.settle(store, height);
    }

    /// Finds the next row for which something holds, going round at the end; tells whether it went round.
    pub fn find(
        &self,
        store: &Store,
        is_forward: bool,
        holds: impl Fn(u64, &Row) -> bool,
    ) -> Option<(u64, bool)> {
        let count = self.order.len(store);
        let from = self.place(store).unwrap_or(0);
        let rows = store.list(self.list);
        (1..=count).find_map(|step| {
            let (place, went_round) = if is_forward {
                ((from + step) % count, from + step >= count)
            } else {
                ((from + count - step) % count, step > from)
            };
            let number = self.order.number(store, place)?;
            holds(number, rows.get(number)?).then_some((number, went_round))
        })
    }

    /// Shows frames instead of transactions, or the other way round; stays at the same place of the traffic.
    pub fn toggle_frames(&mut self, store: &Store, filter: Option<&Filter>, height: usize) {
        let same = match self.row(store) {
            Some(Row::Exchange(exchange)) => exchange.sides.into_iter().flatten().next(),
            Some(Row::Run(run)) if self.list == List::Frames => run.exchange,
            Some(Row::Run(run)) => store.frame_row(run.id),
            Some(Row::Remark(_)) | None => None,
        };
        let time = self.row(store).and_then(Row::time);
        self.list = if self.list == List::Frames { List::Exchanges } else { List::Frames };
        self.reset(store, filter);
        if self.is_following {
            return self.settle(store, height);
        }
        let near = same.or_else(|| {
            let rows = store.list(self.list);
            rows.kept().find(|number| rows.get(*number).is_some_and(|row| row.time() >= time))
        });
        self.line = height / 2;
        self.selected = None;
        if let Some(number) = near {
            let (Ok(place) | Err(place)) = self.order.place(store, number);
            self.go(store, place, height);
        }
    }

    fn marks_of(&self) -> &BTreeMap<u64, Option<Timestamp>> {
        &self.marks[usize::from(self.list == List::Frames)] // two lists, two sets
    }

    /// Tells whether a row is marked.
    pub fn is_marked(&self, number: u64) -> bool {
        self.marks_of().contains_key(&number)
    }

    /// Returns the times of all rows that are marked.
    pub fn marked_times(&self) -> impl Iterator<Item = Timestamp> {
        self.marks.iter().flat_map(|marks| marks.values().copied().flatten())
    }

    /// Marks the selected row, or takes its mark away; tells which.
    pub fn toggle_mark(&mut self, store: &Store) -> Option<bool> {
        let number = self.selected?;
        let time = self.row(store).and_then(Row::time);
        let marks = &mut self.marks[usize::from(self.list == List::Frames)]; // two lists, two sets
        if marks.remove(&number).is_some() {
            return Some(false);
        }
        marks.insert(number, time);
        Some(true)
    }

    /// Forgets which rows are marked: they are numbered anew.
    pub fn forget_marks(&mut self) {
        self.marks = Default::default();
    }

    /// Selects the line of the tree that the selected byte belongs to, or the first byte of the selected line.
    pub fn match_panes(&mut self, detail: &Detail) {
        match self.pane {
            Pane::Hex => {
                let byte = detail.bytes().nth(self.byte);
                self.node = byte.and_then(|(side, offset)| detail.node_at(side, offset)).unwrap_or(self.node);
            }
            Pane::List | Pane::Tree => {
                let Some(node) = detail.nodes.get(self.node).filter(|node| !node.span.is_empty()) else {
                    return;
                };
                let place = detail.bytes().position(|byte| byte == (node.side, node.span.start));
                self.byte = place.unwrap_or(self.byte);
            }
        }
    }
}
