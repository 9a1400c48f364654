//! Which rows are listed, and in what order: all, those that pass a filter, or sorted.

use std::collections::VecDeque;

use super::columns::{Column, SortKey};
use crate::analyze::filter::Filter;
use crate::tui::store::{List, RowSubject, Store};

/// The latest rows are judged again: what is known of them may still grow.
const UNSETTLED: u64 = 256;

/// Lists numbers of rows.
#[derive(Clone, Debug, Default)]
pub struct Order {
    list: List,
    /// The rows that pass, in the order of their numbers; `None` while all do.
    passing: Option<VecDeque<u64>>,
    /// Up to which number rows were judged.
    judged: u64,
    /// The rows in another order, as they were when it was made.
    sorted: Option<Vec<u64>>,
}

impl Order {
    /// Begins afresh with a list of rows, judged by a filter.
    pub fn reset(&mut self, store: &Store, list: List, filter: Option<&Filter>) {
        *self = Order { list, passing: filter.map(|_| VecDeque::new()), ..Order::default() };
        self.judged = store.list(list).first_kept();
        self.update(store, filter);
    }

    /// Takes in rows that are new, and lets go of those that are not kept any more.
    pub fn update(&mut self, store: &Store, filter: Option<&Filter>) {
        let rows = store.list(self.list);
        if let (Some(passing), Some(filter)) = (&mut self.passing, filter) {
            let from = self.judged.saturating_sub(UNSETTLED).min(rows.total()).max(rows.first_kept());
            while passing.back().is_some_and(|number| *number >= from) {
                passing.pop_back();
            }
            while passing.front().is_some_and(|number| *number < rows.first_kept()) {
                passing.pop_front();
            }
            let passes = |number: &u64| {
                rows.get(*number).is_some_and(|row| filter.matches(&RowSubject::new(store, row)))
            };
            passing.extend((from..rows.total()).filter(passes));
        }
        self.judged = rows.total();
        if let Some(sorted) = &mut self.sorted {
            sorted.retain(|number| *number >= rows.first_kept());
        }
    }

    /// Brings what is listed now into the order of a column; what comes later is not listed until it is sorted again.
    pub fn sort(&mut self, store: &Store, by: Option<(Column, bool)>) {
        self.sorted = None;
        let Some((column, is_descending)) = by else { return };
        let rows = store.list(self.list);
        let number_at = |index| self.number(store, index);
        let mut keyed: Vec<(SortKey, u64)> = (0..self.len(store))
            .filter_map(number_at)
            .filter_map(|number| Some((column.sort_key(rows.get(number)?), number)))
            .collect();
        keyed.sort();
        if is_descending {
            keyed.reverse();
        }
        self.sorted = Some(keyed.into_iter().map(|(_, number)| number).collect());
    }

    /// Tells whether rows are not in the order in which they came.
    pub fn is_sorted(&self) -> bool {
        self.sorted.is_some()
    }

    /// Returns how many rows are listed.
    pub fn len(&self, store: &Store) -> usize {
        match (&self.sorted, &self.passing) {
            (Some(sorted), _) => sorted.len(),
            (None, Some(passing)) => passing.len(),
            (None, None) => {
                let rows = store.list(self.list);
                usize::try_from(rows.total() - rows.first_kept()).unwrap_or(usize::MAX)
            }
        }
    }

    /// Returns the number of the row at a place.
    pub fn number(&self, store: &Store, index: usize) -> Option<u64> {
        match (&self.sorted, &self.passing) {
            (Some(sorted), _) => sorted.get(index).copied(),
            (None, Some(passing)) => passing.get(index).copied(),
            (None, None) => {
                let rows = store.list(self.list);
                let number = rows.first_kept().checked_add(index as u64)?;
                (number < rows.total()).then_some(number)
            }
        }
    }

    /// Returns the place of a row, or the one it would have.
    pub fn place(&self, store: &Store, number: u64) -> Result<usize, usize> {
        match (&self.sorted, &self.passing) {
            (Some(sorted), _) => sorted.iter().position(|known| *known == number).ok_or(0),
            (None, Some(passing)) => passing.binary_search(&number),
            (None, None) => {
                let rows = store.list(self.list);
                let at = |number: u64| {
                    usize::try_from(number.saturating_sub(rows.first_kept())).unwrap_or(usize::MAX)
                };
                if rows.kept().contains(&number) { Ok(at(number)) } else { Err(at(number.min(rows.total()))) }
            }
        }
    }
}
