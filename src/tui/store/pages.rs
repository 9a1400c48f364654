//! A list that grows at its end, forgets its front, and is cheap to copy.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// How many elements a page holds.
pub(super) const PAGE: usize = 256;

/// Holds elements by their absolute number, from 0 for the first ever; copies share what is full.
#[derive(Clone, Debug)]
pub struct Pages<T> {
    pages: VecDeque<Arc<Vec<T>>>,
    /// Number of the first element that is kept; all pages but the last are full.
    first: u64,
    total: u64,
}

impl<T> Default for Pages<T> {
    fn default() -> Self {
        Pages { pages: VecDeque::new(), first: 0, total: 0 }
    }
}

impl<T> Pages<T> {
    /// Begins with nothing; the first element will have this number.
    pub(super) fn from_number(number: u64) -> Self {
        Pages { pages: VecDeque::new(), first: number, total: number }
    }

    /// Returns the number of the first element that is still kept.
    pub fn first_kept(&self) -> u64 {
        self.first
    }

    /// Returns how many elements there ever were.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Returns the numbers of what is kept.
    pub fn kept(&self) -> Range<u64> {
        self.first..self.total
    }

    /// Returns how many are kept.
    pub fn len(&self) -> usize {
        usize::try_from(self.total - self.first).unwrap_or(usize::MAX)
    }

    /// Tells whether nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.first == self.total
    }

    /// Returns an element by its number.
    pub fn get(&self, number: u64) -> Option<&T> {
        let at = usize::try_from(number.checked_sub(self.first)?).ok()?;
        self.pages.get(at / PAGE)?.get(at % PAGE)
    }

    /// Returns the last element.
    pub fn last(&self) -> Option<&T> {
        self.get(self.total.checked_sub(1)?)
    }

    /// Iterates over the elements with these numbers, as far as they are kept.
    pub fn range(&self, numbers: Range<u64>) -> impl DoubleEndedIterator<Item = &T> {
        let numbers = numbers.start.max(self.first)..numbers.end.min(self.total);
        numbers.filter_map(|number| self.get(number))
    }

    /// Iterates over all that is kept.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &T> {
        self.range(self.kept())
    }

    /// Forgets the oldest page, unless it is the only one.
    pub fn drop_oldest(&mut self) {
        if self.pages.len() > 1 {
            self.pages.pop_front();
            self.first += PAGE as u64;
        }
    }

    /// Forgets pages until at most so many elements are kept, and a page more.
    pub fn keep(&mut self, most: u64) {
        while self.pages.len() > 1 && self.total - self.first >= most.saturating_add(PAGE as u64) {
            self.drop_oldest();
        }
    }
}

impl<T: Clone> Pages<T> {
    /// Adds an element; returns its number.
    pub fn push(&mut self, element: T) -> u64 {
        if self.pages.back().is_none_or(|page| page.len() == PAGE) {
            self.pages.push_back(Arc::new(Vec::with_capacity(PAGE)));
        }
        if let Some(page) = self.pages.back_mut() {
            Arc::make_mut(page).push(element);
        }
        self.total += 1;
        self.total - 1
    }

    /// Forgets all elements before this one, to the element.
    pub fn forget_before(&mut self, number: u64) {
        let number = number.clamp(self.first, self.total);
        let kept: Vec<T> = self.range(number..self.total).cloned().collect();
        self.replace(&kept);
    }

    /// Keeps these elements instead of all there are; they get the last numbers.
    pub fn replace(&mut self, kept: &[T]) {
        let total = self.total.max(kept.len() as u64);
        let pages = kept.chunks(PAGE).map(|page| Arc::new(page.to_vec())).collect();
        *self = Pages { pages, first: total - kept.len() as u64, total };
    }

    /// Returns an element to be changed; copies its page where others have it.
    pub fn get_mut(&mut self, number: u64) -> Option<&mut T> {
        let at = usize::try_from(number.checked_sub(self.first)?).ok()?;
        Arc::make_mut(self.pages.get_mut(at / PAGE)?).get_mut(at % PAGE)
    }

    /// Returns the last element to be changed.
    pub fn last_mut(&mut self) -> Option<&mut T> {
        self.get_mut(self.total.checked_sub(1)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_when_the_front_is_forgotten() {
        let mut pages = Pages::default();
        for value in 0..10_000_u64 {
            assert_eq!(pages.push(value), value);
            pages.keep(1000);
        }
        assert!((1000..1000 + 2 * PAGE as u64).contains(&(pages.total() - pages.first_kept())));
        assert_eq!(pages.get(9_500), Some(&9_500));
        assert_eq!(pages.get(0), None);
        assert_eq!(pages.range(0..u64::MAX).count() as u64, pages.total() - pages.first_kept());
        assert_eq!(pages.iter().next_back(), Some(&9_999));
    }

    #[test]
    fn what_is_forgotten_to_the_element_leaves_the_rest_in_place() {
        let mut pages = Pages::default();
        (0..1000).for_each(|value| _ = pages.push(value));
        pages.forget_before(990);
        assert_eq!((pages.kept(), pages.get(989), pages.get(990)), (990..1000, None, Some(&990)));
        (1000..3000).for_each(|value| _ = pages.push(value));
        assert!((990..3000).all(|number| pages.get(number) == Some(&(number as i32))));
        pages.forget_before(u64::MAX);
        assert!(pages.is_empty() && pages.push(3000) == 3000);
    }

    #[test]
    fn a_copy_does_not_see_what_comes_later() {
        let mut pages = Pages::default();
        for value in 0..300 {
            pages.push(value);
        }
        let copy = pages.clone();
        pages.push(300);
        *pages.get_mut(299).expect("kept") = -1;
        assert_eq!((copy.total(), copy.get(299), copy.get(300)), (300, Some(&299), None));
        assert_eq!(pages.get(299), Some(&-1));
    }
}
