//! The spread of repeated measurements.

use serde::Serialize;

/// The median and percentiles of measurements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The 10th percentile.
    pub tenth_percentile: f64,
    /// The 90th percentile.
    pub ninetieth_percentile: f64,
}

impl Spread {
    /// Computes the spread of measurements in any order; NaN without measurements.
    pub fn of(measurements: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = measurements.collect();
        sorted.sort_by(f64::total_cmp);
        let at = |tenths: usize| {
            let index = (sorted.len().saturating_sub(1) * tenths + 5) / 10;
            sorted.get(index).copied().unwrap_or(f64::NAN)
        };
        Spread { median: at(5), tenth_percentile: at(1), ninetieth_percentile: at(9) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_the_sorted_measurements() {
        let spread =
            Spread::of([5.0, 1.0, 4.0, 2.0, 3.0, 6.0, 11.0, 7.0, 8.0, 10.0, 9.0].into_iter());
        let expected = Spread { median: 6.0, tenth_percentile: 2.0, ninetieth_percentile: 10.0 };
        assert_eq!(spread, expected);
        assert_eq!(Spread::of([3.0].into_iter()).ninetieth_percentile, 3.0);
        assert!(Spread::of(std::iter::empty()).median.is_nan());
    }
}
