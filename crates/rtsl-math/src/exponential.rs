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
    }
}
