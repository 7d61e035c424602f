//! Exponentials by series.

/// Two to the power of `exponent`, which is clamped to [-64, 64]. The integer part is exact, the fraction uses Taylor's
/// series; the relative error is below 1e-15.
pub fn power_of_two(exponent: f64) -> f64 {
    let exponent = exponent.clamp(-64.0, 64.0);
    let whole = exponent.floor();
    let x = (exponent - whole) * std::f64::consts::LN_2;
    let mut term = 1.0;
    let mut sum = 1.0;
    for n in 1..18 {
        term *= x / f64::from(n);
        sum += term;
    }
    let doublings = whole.abs() as u32;
    let power = (0..doublings).fold(1.0, |power: f64, _| power * 2.0);
    if whole < 0.0 { sum / power } else { sum * power }
}

/// The exponential of a number from -44 to 44.
pub fn exponential(x: f64) -> f64 {
    power_of_two(x * std::f64::consts::LOG2_E)
}

/// The binary logarithm of a positive number; the absolute error is below 1e-15 times the result or 1.
pub fn logarithm_of_two(x: f64) -> f64 {
    let mut x = x.clamp(f64::MIN_POSITIVE, f64::MAX);
    let mut whole = 0.0;
    while x > std::f64::consts::SQRT_2 {
        x /= 2.0;
        whole += 1.0;
    }
    while x < std::f64::consts::FRAC_1_SQRT_2 {
        x *= 2.0;
        whole -= 1.0;
    }
    // The series of the inverse hyperbolic tangent, whose argument is below 0.172.
    let ratio = (x - 1.0) / (x + 1.0);
    let square = ratio * ratio;
    let sum = (0..12).rev().fold(0.0, |sum, n| sum * square + 1.0 / f64::from(2 * n + 1));
    whole + 2.0 * ratio * sum * std::f64::consts::LOG2_E
}

/// `base` to the power of `exponent`, for a base from 0 on; 0 to any power is 0. The result is clamped to
/// [2^-64, 2^64].
pub fn power(base: f64, exponent: f64) -> f64 {
    if base > 0.0 { power_of_two(exponent * logarithm_of_two(base)) } else { 0.0 }
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "the platform's functions are the reference")]
mod tests {
    use super::*;

    #[test]
    fn close_to_the_platforms_functions() {
        for step in -4000..=4000 {
            let x = f64::from(step) / 100.0;
            assert!((power_of_two(x) / x.exp2() - 1.0).abs() < 1e-15, "{x}");
            assert!((exponential(x) / x.exp() - 1.0).abs() < 1e-14, "{x}");
        }
        for step in 1..4000 {
            let x = f64::from(step * step) / 3e5;
            assert!((logarithm_of_two(x) - x.log2()).abs() < 1e-14, "{x}");
            assert!((power(x, 2.2) / x.powf(2.2) - 1.0).abs() < 1e-13, "{x}");
        }
        assert_eq!((power(0.0, 2.2), power(1.0, 1.8), logarithm_of_two(8.0)), (0.0, 1.0, 3.0));
    }
}
