//! Points and stretches of time, in nanoseconds; nothing here reads a clock.

use std::ops::{Add, Sub};

/// Nanoseconds in a millisecond.
pub const MILLISECOND: i64 = 1_000_000;
/// Nanoseconds in a second.
pub const SECOND: i64 = 1_000_000_000;

/// Counts nanoseconds since the Unix epoch; arithmetic saturates, so absurd input cannot overflow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Timestamp(i64);

impl Timestamp {
    /// The earliest time there is.
    pub const MIN: Timestamp = Timestamp(i64::MIN);
    /// The latest time there is.
    pub const MAX: Timestamp = Timestamp(i64::MAX);

    /// Makes a timestamp from nanoseconds since the Unix epoch.
    pub const fn from_ns(ns: i64) -> Self {
        Timestamp(ns)
    }

    /// Returns the nanoseconds since the Unix epoch.
    pub const fn as_ns(self) -> i64 {
        self.0
    }
}

impl Add<i64> for Timestamp {
    type Output = Timestamp;
    /// Moves the timestamp by nanoseconds.
    fn add(self, ns: i64) -> Timestamp {
        Timestamp(self.0.saturating_add(ns))
    }
}

impl Sub<i64> for Timestamp {
    type Output = Timestamp;
    /// Moves the timestamp back by nanoseconds.
    fn sub(self, ns: i64) -> Timestamp {
        Timestamp(self.0.saturating_sub(ns))
    }
}

impl Sub for Timestamp {
    type Output = i64;
    /// Returns the nanoseconds from `other` to `self`.
    fn sub(self, other: Timestamp) -> i64 {
        self.0.saturating_sub(other.0)
    }
}

/// Bounds a point in time: the truth lies between `earliest` and `latest`, both included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Interval {
    /// The event cannot have been before this.
    pub earliest: Timestamp,
    /// The event cannot have been after this.
    pub latest: Timestamp,
}

impl Interval {
    /// Makes an interval; the bounds are taken in either order.
    pub fn new(a: Timestamp, b: Timestamp) -> Self {
        Interval { earliest: a.min(b), latest: a.max(b) }
    }

    /// Returns the middle, the best single estimate.
    pub fn midpoint(self) -> Timestamp {
        self.earliest + self.half_width()
    }

    /// Returns half the width in nanoseconds, rounded up: the `±` of the midpoint.
    pub fn half_width(self) -> i64 {
        let width = self.latest - self.earliest;
        (width >> 1) + (width & 1) // not negative
    }

    /// Bounds the nanoseconds from `self` to `later`.
    pub fn until(self, later: Interval) -> Span {
        Span { least: later.earliest - self.latest, most: later.latest - self.earliest }
    }
}

/// Bounds a length of time in nanoseconds, such as a gap or a latency.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// It cannot be shorter than this; negative when the ends may have overlapped.
    pub least: i64,
    /// It cannot be longer than this.
    pub most: i64,
}

impl Span {
    /// Returns the middle in nanoseconds, the best single estimate.
    pub fn midpoint(self) -> i64 {
        self.least.saturating_add(self.half_width())
    }

    /// Returns half the width in nanoseconds, rounded up: the `±` of the midpoint.
    pub fn half_width(self) -> i64 {
        let width = self.most.saturating_sub(self.least);
        width / 2 + width % 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic_saturates_at_both_ends() {
        assert_eq!(Timestamp::MAX + 1, Timestamp::MAX);
        assert_eq!(Timestamp::MIN - 1, Timestamp::MIN);
        assert_eq!(Timestamp::MAX - Timestamp::MIN, i64::MAX);
    }

    #[test]
    fn midpoint_and_half_width_cover_the_interval() {
        let odd = Interval::new(Timestamp::from_ns(13), Timestamp::from_ns(10));
        assert_eq!((odd.midpoint().as_ns(), odd.half_width()), (12, 2));
        let gap = odd.until(Interval::new(Timestamp::from_ns(20), Timestamp::from_ns(21)));
        assert_eq!(gap, Span { least: 7, most: 11 });
    }
}
