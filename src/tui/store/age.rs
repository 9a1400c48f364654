//! Series that know less of what is longer ago, so that an hour and a month take about the same memory.
//!
//! What happened within a bucket becomes one. Buckets are the wider the longer ago they are: so many of them for each
//! time the age doubles. Their widths are powers of two and their edges multiples of them, so that what was thinned once
//! can be thinned again later.

/// Returns which bucket a time is in: its width, and its number among those of that width.
///
/// Width and age are in the unit of the time; `per_doubling` is a power of two.
pub(super) fn bucket(at: i64, now: i64, per_doubling: u64) -> (i64, i64) {
    let age = now.saturating_sub(at).max(0).unsigned_abs();
    let below = age.checked_ilog2().map_or(1, |doublings| 1_u64 << doublings);
    let width = i64::try_from((below / per_doubling).max(1)).unwrap_or(i64::MAX);
    (width, at.div_euclid(width))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buckets_are_wider_the_longer_ago_and_lie_within_those_of_later() {
        let now = 1_000_000;
        assert_eq!(bucket(now - 15, now, 8), (1, now - 15));
        assert_eq!(bucket(now - 16, now, 8).0, 2);
        assert_eq!(bucket(now - 1024, now, 8).0, 128);
        for (one, other) in (0..now).zip(1..) {
            let later = [one, other].map(|at| bucket(at, 2 * now, 8));
            if bucket(one, now, 8) == bucket(other, now, 8) && later[0].0 == later[1].0 {
                assert_eq!(later[0].1, later[1].1, "{one}");
            }
        }
        let count = (0..now).map(|at| bucket(at, now, 8)).collect::<std::collections::BTreeSet<_>>().len();
        assert!(count < 8 * 20, "{count}");
    }
}
