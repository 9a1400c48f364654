//! How a series of numbers looks: the ground on which types are guessed.

/// Describes the values that bytes have under one type, in the order of time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    pub(super) count: usize,
    /// Values that differ.
    pub(super) distinct: usize,
    pub(super) low: f64,
    pub(super) high: f64,
    /// Differences of neighbours against the spread of all: 1 for noise, near 0 for what changes slowly.
    ///
    /// Half of von Neumann's ratio; `None` with fewer than 8 values or 4 different ones, which show no course.
    pub(super) roughness: Option<f64>,
    /// Whether it never falls, and grows.
    pub(super) grows: bool,
}

impl Series {
    /// Describes finite values; `None` when there are none.
    pub(super) fn new(values: &[f64]) -> Option<Self> {
        let &first = values.first()?;
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted.dedup();
        let grows = sorted.len() > 1 && values.is_sorted();
        Some(Series {
            count: values.len(),
            distinct: sorted.len(),
            low: sorted.first().copied().unwrap_or(first),
            high: sorted.last().copied().unwrap_or(first),
            roughness: roughness(values).filter(|_| values.len() >= 8 && sorted.len() >= 4),
            grows,
        })
    }

    /// Tells whether neighbours are close, as what is measured often is.
    pub(super) fn is_smooth(&self) -> bool {
        self.roughness.is_some_and(|roughness| roughness < 0.3)
    }

    /// Tells whether all values lie close together, seen from zero.
    pub(super) fn is_narrow(&self) -> bool {
        let centre = (self.high + self.low).abs() / 2.0;
        self.distinct > 1 && self.high - self.low < centre / 2.0
    }
}

fn roughness(values: &[f64]) -> Option<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let spread: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let steps: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum(); // windows of two
    (spread > 0.0 && spread.is_finite()).then(|| steps / spread / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_slowly_is_smooth_and_noise_is_not() {
        let slow: Vec<f64> = (0..50).map(|at| (f64::from(at) / 10.0).sin()).collect();
        assert!(Series::new(&slow).expect("values").is_smooth());
        let noise: Vec<f64> = (0..50_u32).map(|at| f64::from(at.wrapping_mul(2_654_435_761) % 97)).collect();
        let noise = Series::new(&noise).expect("values");
        assert!(!noise.is_smooth() && noise.roughness.is_some_and(|it| it > 0.7), "{noise:?}");
        assert_eq!(
            Series::new(&[1.0, 2.0, 3.0]).expect("values").roughness,
            None,
            "too few to show a course"
        );
        assert_eq!(Series::new(&[]), None);
    }
}
