//! Statistical bounds.

/// The probability with which a correct class is reported as broken, for each check of an instance.
const FALSE_ALARMS: f64 = 1e-6;

/// Returns the probability for each of `tests` tests that gives this false alarm rate for all of them (Sidak).
pub fn significance(tests: usize) -> f64 {
    // The number of statistical contracts, which share the false alarm rate.
    const CONTRACTS: f64 = 8.0;
    -libm::expm1(libm::log1p(-FALSE_ALARMS) / (CONTRACTS * tests.max(1) as f64))
}

/// Returns the number of standard deviations that a normal variable exceeds with this probability, less than a half.
pub fn normal_quantile(probability: f64) -> f64 {
    let exceeds = |deviations: f64| 0.5 * libm::erfc(deviations * std::f64::consts::FRAC_1_SQRT_2);
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if exceeds(middle) > probability { low = middle } else { high = middle }
    }
    high
}

/// Returns the value that chi-square with this many degrees of freedom exceeds with this probability (Wilson and
/// Hilferty: its cube root is nearly normal).
pub fn chi_square_quantile(freedom: f64, probability: f64) -> f64 {
    let variance = 2.0 / (9.0 * freedom);
    let root = 1.0 - variance + normal_quantile(probability) * variance.sqrt();
    freedom * root * root * root
}

/// Returns a bound of the error of the mean of independent numbers from 0 to 1, which holds except with this
/// probability for any distribution (Maurer and Pontil, "Empirical Bernstein Bounds and Sample Variance Penalization",
/// 2009).
pub fn bernstein_bound(mean: &Mean, probability: f64) -> f64 {
    if mean.count() < 2.0 {
        return 1.0;
    }
    // In either direction.
    let logarithm = libm::log(4.0 / probability);
    (2.0 * mean.variance() * logarithm / mean.count()).sqrt()
        + 7.0 * logarithm / (3.0 * (mean.count() - 1.0))
}

/// The mean of a stream of numbers with its standard deviation (Welford).
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Mean {
    pub fn add(&mut self, value: f64) {
        self.count += 1.0;
        let difference = value - self.mean;
        self.mean += difference / self.count;
        self.squares += difference * (value - self.mean);
    }

    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Returns the count of numbers.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// Returns the variance of the numbers.
    pub fn variance(&self) -> f64 {
        if self.count < 2.0 { 0.0 } else { self.squares / (self.count - 1.0) }
    }

    /// Returns the standard deviation of the mean.
    pub fn deviation(&self) -> f64 {
        if self.count < 2.0 { 0.0 } else { (self.variance() / self.count).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        for (probability, expected) in [(0.025, 1.959_964), (1e-4, 3.719_016), (1e-7, 5.199_338)] {
            assert!((normal_quantile(probability) - expected).abs() < 1e-5);
        }
        for (freedom, probability, expected) in
            [(10.0, 1e-4, 35.56), (100.0, 1e-4, 161.32), (200.0, 0.05, 233.99)]
        {
            let found = chi_square_quantile(freedom, probability);
            assert!((found / expected - 1.0).abs() < 0.02, "{found}, not {expected}");
        }
    }

    #[test]
    fn bounds_of_means_hold_for_rare_events() {
        // Each number is 1 with this probability, else 0.
        for part in [0.5, 0.01, 0.001] {
            for seed in 0..200 {
                let stream = crate::random::Stream::new(seed);
                let mut mean = Mean::default();
                (0..500).for_each(|it| mean.add(f64::from(u8::from(stream.number(it, 0) < part))));
                let bound = bernstein_bound(&mean, 1e-4);
                assert!((mean.mean() - f64::from(part)).abs() <= bound, "{part}, {seed}");
            }
        }
        assert_eq!(bernstein_bound(&Mean::default(), 0.1), 1.0);
    }

    #[test]
    fn many_tests_share_one_probability() {
        assert!((significance(10) * 80.0 / FALSE_ALARMS - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_mean_knows_how_far_it_may_be_off() {
        let mut mean = Mean::default();
        [1.0, 2.0, 3.0, 4.0].iter().for_each(|it| mean.add(*it));
        assert!((mean.mean() - 2.5).abs() < 1e-12);
        assert!((mean.deviation() - (5.0_f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12);
    }
}
