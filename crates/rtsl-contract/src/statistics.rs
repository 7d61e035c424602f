//! How far chance may go.

/// The probability with which a class that keeps all its contracts is found to break one, for each check of an
/// instance.
const FALSE_ALARMS: f64 = 1e-6;

/// The probability for each of `tests` tests that, all together, give a false alarm as seldom as is
/// allowed (Sidak).
pub fn significance(tests: usize) -> f64 {
    // The contracts that use chance share what is allowed.
    const CONTRACTS: f64 = 8.0;
    -libm::expm1(libm::log1p(-FALSE_ALARMS) / (CONTRACTS * tests.max(1) as f64))
}

/// How many standard deviations a normal variable exceeds with this probability, less than a half.
pub fn normal_quantile(probability: f64) -> f64 {
    let exceeds = |deviations: f64| 0.5 * libm::erfc(deviations * std::f64::consts::FRAC_1_SQRT_2);
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if exceeds(middle) > probability { low = middle } else { high = middle }
    }
    high
}

/// What chi-square with this many degrees of freedom exceeds with this probability (Wilson and Hilferty: its cube
/// root is nearly normal).
pub fn chi_square_quantile(freedom: f64, probability: f64) -> f64 {
    let variance = 2.0 / (9.0 * freedom);
    let root = 1.0 - variance + normal_quantile(probability) * variance.sqrt();
    freedom * root * root * root
}

/// Mean and its standard deviation of numbers that come one by one (Welford).
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

    /// The standard deviation of the mean.
    pub fn deviation(&self) -> f64 {
        if self.count < 2.0 { 0.0 } else { (self.squares / (self.count - 1.0) / self.count).sqrt() }
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
