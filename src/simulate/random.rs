//! Random numbers that stay the same for ever: sample files and thresholds of tests depend on them.

/// Draws numbers by SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014).
///
/// Only integer steps and exact floating-point steps are used, so every platform draws the same.
#[derive(Clone, Debug)]
pub(super) struct Random {
    state: u64,
}

impl Random {
    /// Starts one of several independent streams of a seed.
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        let start = Random { state: seed }.next();
        Random { state: start ^ stream.wrapping_mul(0xD134_2543_DE82_EF95) }
    }

    /// Draws 64 bits.
    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Draws a whole number from `low` to `high`, both included; `low` if the range is empty.
    pub(super) fn range(&mut self, low: i64, high: i64) -> i64 {
        let width = high.saturating_sub(low).max(0) as u128 + 1;
        low.saturating_add(((u128::from(self.next()) * width) >> 64) as i64)
    }

    /// Draws a fraction from 0, included, to 1, excluded.
    pub(super) fn fraction(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Draws a fraction of a length of time, from `low` to `high` times `ns`.
    pub(super) fn times(&mut self, ns: i64, low: f64, high: f64) -> i64 {
        (ns as f64 * (low + (high - low) * self.fraction())) as i64
    }

    /// Tells whether something of this probability happens; draws nothing where it never does.
    pub(super) fn chance(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.fraction() < probability
    }

    /// Draws a byte.
    pub(super) fn byte(&mut self) -> u8 {
        (self.next() >> 56) as u8
    }

    /// Picks one of a few.
    pub(super) fn pick<T: Copy, const N: usize>(&mut self, from: [T; N]) -> T {
        from[self.range(0, N as i64 - 1) as usize] // arrays of this crate have one element at least
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_is_splitmix64() {
        // The first numbers for seed 1234567, as printed by the reference implementation.
        let mut random = Random { state: 1_234_567 };
        assert_eq!(random.next(), 6_457_827_717_110_365_317);
        assert_eq!(random.next(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn ranges_reach_both_ends_and_chances_are_fair() {
        let mut random = Random::new(1, 0);
        let drawn: Vec<i64> = (0..1000).map(|_| random.range(-1, 2)).collect();
        assert_eq!((drawn.iter().min(), drawn.iter().max()), (Some(&-1), Some(&2)));
        let hits = (0..100_000).filter(|_| random.chance(0.1)).count();
        assert!((9_600..10_400).contains(&hits), "{hits}"); // four standard deviations
        assert_eq!(random.range(i64::MIN, i64::MIN), i64::MIN);
    }
}
