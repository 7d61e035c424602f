//! Roots by Newton's method, for the transfer function of sRGB.

/// The fifth root of a number from 0 to 4, within a few units in the last place.
pub fn fifth_root(x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    // Started from above, Newton's steps decrease until rounding stops them.
    let mut root = x.max(1.0);
    loop {
        let fourth = root * root * (root * root);
        let next = (4.0 * root + x / fourth) / 5.0;
        if next >= root {
            return root;
        }
        root = next;
    }
}

/// `x` to the power of 2.4, that is 12/5, for `x` from 0 to 2.
pub fn power_12_5(x: f64) -> f64 {
    let square = x * x;
    square * fifth_root(square)
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "the platform's functions are the reference")]
mod tests {
    use super::*;

    #[test]
    fn close_to_the_platforms_power() {
        for step in 0..=1000 {
            let x = f64::from(step) / 1000.0;
            assert!((power_12_5(x) - x.powf(2.4)).abs() < 1e-14, "{x}");
        }
    }
}
