//! A whole recording in a bounded number of buckets: how busy the bus was, errors, findings, hits of a filter.

use crate::time::{MILLISECOND, Timestamp};

/// How many buckets there are at most; then two become one.
const MOST: usize = 2048;
/// How long a bucket is at first, in nanoseconds.
const LEAST: i64 = 100 * MILLISECOND;

/// Is what happened in a stretch of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bucket {
    /// How long bytes were on the wire, in nanoseconds, all buses together.
    pub busy_ns: i64,
    /// Transactions, and what belongs to none.
    pub rows: u64,
    /// Damaged runs, and transactions that went wrong.
    pub errors: u64,
    /// Single findings.
    pub findings: u64,
    /// Rows that pass the filter.
    pub matches: u64,
    /// Rows with the words that are searched for.
    pub words: u64,
    /// Rows at which playing is to pause.
    pub breaks: u64,
    /// What people noted.
    pub notes: u64,
}

impl Bucket {
    fn add(&mut self, other: &Bucket) {
        self.busy_ns = self.busy_ns.saturating_add(other.busy_ns);
        self.rows = self.rows.saturating_add(other.rows);
        self.errors = self.errors.saturating_add(other.errors);
        self.findings = self.findings.saturating_add(other.findings);
        self.matches = self.matches.saturating_add(other.matches);
        self.words = self.words.saturating_add(other.words);
        self.breaks = self.breaks.saturating_add(other.breaks);
        self.notes = self.notes.saturating_add(other.notes);
    }

    /// Returns how often something is in it.
    pub fn count(&self, what: Sought) -> u64 {
        match what {
            Sought::Error => self.errors,
            Sought::Finding => self.findings,
            Sought::Match => self.matches,
            Sought::Words => self.words,
            Sought::Note => self.notes,
        }
    }
}

/// Names what a recording is searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sought {
    /// A damaged run, or a transaction that went wrong.
    Error,
    /// A finding.
    Finding,
    /// A row that passes the filter.
    Match,
    /// A row with the words that are searched for.
    Words,
    /// What somebody noted.
    Note,
}

impl Sought {
    /// Returns what it is called.
    pub fn name(self) -> &'static str {
        match self {
            Sought::Error => "error",
            Sought::Finding => "finding",
            Sought::Match => "row that passes the filter",
            Sought::Words => "row with that",
            Sought::Note => "note",
        }
    }
}

/// Holds buckets of one width, from the beginning of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Series {
    width_ns: i64,
    buckets: Vec<Bucket>,
}

impl Default for Series {
    fn default() -> Self {
        Series { width_ns: LEAST, buckets: Vec::new() }
    }
}

impl Series {
    /// Returns how long a bucket is, in nanoseconds.
    pub fn width_ns(&self) -> i64 {
        self.width_ns
    }

    /// Returns the buckets.
    pub fn buckets(&self) -> &[Bucket] {
        &self.buckets
    }

    /// Returns the bucket of a place, counted in nanoseconds from the beginning.
    pub fn index(&self, elapsed_ns: i64) -> usize {
        usize::try_from(elapsed_ns.max(0) / self.width_ns).unwrap_or(usize::MAX)
    }

    /// Returns where a bucket begins.
    pub fn begin_of(&self, index: usize) -> i64 {
        i64::try_from(index).unwrap_or(i64::MAX).saturating_mul(self.width_ns)
    }

    /// Counts what happened at a place.
    pub fn add(&mut self, elapsed_ns: i64, what: &Bucket) {
        while self.index(elapsed_ns) >= MOST {
            self.halve();
        }
        let index = self.index(elapsed_ns);
        if self.buckets.len() <= index {
            self.buckets.resize(index + 1, Bucket::default());
        }
        self.buckets[index].add(what); // made just now
    }

    /// Makes one bucket of two.
    fn halve(&mut self) {
        let pair = |pair: &[Bucket]| {
            let mut sum = pair[0]; // a pair has at least one
            pair.iter().skip(1).for_each(|bucket| sum.add(bucket));
            sum
        };
        self.buckets = self.buckets.chunks(2).map(pair).collect();
        self.width_ns = self.width_ns.saturating_mul(2);
    }

    /// Returns the first bucket from `index` on in which something is.
    pub fn next_with(&self, what: Sought, index: usize) -> Option<usize> {
        (index..self.buckets.len()).find(|at| self.buckets[*at].count(what) > 0)
    }

    /// Returns the last bucket up to `index` in which something is.
    pub fn last_with(&self, what: Sought, index: usize) -> Option<usize> {
        (0..self.buckets.len().min(index.saturating_add(1)))
            .rev()
            .find(|at| self.buckets[*at].count(what) > 0)
    }

    /// Returns how often something is in all of it.
    pub fn total(&self, what: Sought) -> u64 {
        self.buckets.iter().map(|bucket| bucket.count(what)).fold(0, u64::saturating_add)
    }

    /// Sums up what is from `from` to `to`, in nanoseconds; a bucket counts where it begins, or to all of a stretch that
    /// is shorter than it.
    fn sum(&self, from: i64, to: i64) -> Bucket {
        let (first, last) = (self.index(from), self.index(to.saturating_sub(1).max(from)));
        let mut sum = Bucket::default();
        let whole =
            self.buckets.get(first..self.buckets.len().min(last.saturating_add(1))).unwrap_or_default();
        let begins = |index: usize| self.begin_of(first.saturating_add(index)) >= from;
        for (index, bucket) in whole.iter().enumerate() {
            if whole.len() == 1 || begins(index) {
                sum.add(bucket);
            }
        }
        sum
    }

    /// Brings the first `end_ns` nanoseconds into so many columns.
    pub fn columns(&self, end_ns: i64, count: usize) -> Vec<Bucket> {
        let count = count.max(1);
        let edge = |column: usize| {
            let at = i128::from(end_ns.max(1)) * column as i128 / count as i128;
            i64::try_from(at).unwrap_or(i64::MAX)
        };
        // What is at the very end is in the last column.
        let until = |column: usize| if column + 1 == count { i64::MAX } else { edge(column + 1) };
        (0..count).map(|column| self.sum(edge(column), until(column))).collect()
    }
}

/// Holds a whole recording, as far as it is known.
///
/// Places are nanoseconds from its beginning: by the times of its reads, or without those by how long its bytes take at
/// line speed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    /// When it begins; `None` without times.
    pub origin: Option<Timestamp>,
    /// What happened in it.
    pub events: Series,
    /// What passes the filter, and up to where that was looked for; `None` without a filter.
    pub hits: Option<(Series, i64)>,
    /// The same for the words that are searched for.
    pub words: Option<(Series, i64)>,
    /// Up to where it was decoded.
    pub decoded_ns: i64,
    /// Where it ends, as far as that is known.
    pub end_ns: i64,
    /// How much of the file was decoded, from 0 to 1.
    pub share: f64,
    /// Whether all of it was decoded.
    pub is_complete: bool,
    /// Whether it is still being written.
    pub is_growing: bool,
    /// Whether it cannot be read on.
    pub is_broken: bool,
}

impl Timeline {
    /// Returns where it ends: where it was decoded, or what its index says, whichever is later.
    pub fn end(&self) -> i64 {
        self.end_ns.max(self.decoded_ns)
    }

    /// Returns the time of a place; `None` without times.
    pub fn time(&self, elapsed_ns: i64) -> Option<Timestamp> {
        Some(self.origin? + elapsed_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::SECOND;

    const ERROR: Bucket =
        Bucket { busy_ns: 1, rows: 1, errors: 1, findings: 0, matches: 0, words: 0, breaks: 0, notes: 0 };

    #[test]
    fn a_year_fits_and_nothing_is_lost_in_it() {
        let mut series = Series::default();
        let day = 86_400 * SECOND;
        (0..365).for_each(|at| series.add(at * day, &ERROR));
        assert!(series.buckets().len() <= MOST && series.total(Sought::Error) == 365);
        for columns in [20, 80, 140] {
            let sum: u64 = series.columns(365 * day, columns).iter().map(|bucket| bucket.errors).sum();
            assert_eq!(sum, 365, "{columns} columns");
        }
        series.add(365 * day, &ERROR);
        let last = series.columns(365 * day, 10).pop().map(|column| column.errors);
        assert_eq!(last, Some(37), "what is at the very end is in the last column");
    }

    #[test]
    fn the_next_and_the_last_bucket_with_something_are_found() {
        let mut series = Series::default();
        series.add(5 * SECOND, &ERROR);
        series.add(9 * SECOND, &ERROR);
        let (five, nine) = (series.index(5 * SECOND), series.index(9 * SECOND));
        assert_eq!(series.next_with(Sought::Error, 0), Some(five));
        assert_eq!(series.next_with(Sought::Error, five + 1), Some(nine));
        assert_eq!(series.last_with(Sought::Error, nine - 1), Some(five));
        assert_eq!(series.next_with(Sought::Finding, 0), None);
        assert_eq!(series.last_with(Sought::Error, five - 1), None);
    }

    #[test]
    fn a_short_recording_fills_all_columns() {
        let mut series = Series::default();
        series.add(0, &ERROR);
        assert!(series.columns(50 * MILLISECOND, 10).iter().all(|bucket| bucket.errors == 1));
    }
}
