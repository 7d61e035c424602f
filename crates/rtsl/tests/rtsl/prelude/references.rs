//! The functions in binary64, exact enough to judge binary32 by: within a few of binary64's own units.
//!
//! Where a few terms of a series or a limit are as exact they take the place of the platform's
//! function, which is slow for such arguments. All floats are tried in minutes, not hours.

#![allow(clippy::disallowed_methods, reason = "references for a comparison with a tolerance")]

use std::f64::consts::LN_2;

/// Below this x + c x^3 stands for each odd function here: the next term is less than x^5 / 5, 2^-54 of
/// the value.
const SMALL: f64 = 1.0 / 8192.0;

pub fn sin(x: f64) -> f64 {
    odd(x, -1.0 / 6.0, f64::sin)
}

/// The term after the square is less than 2^-56.
pub fn cos(x: f64) -> f64 {
    if x.abs() < SMALL { 1.0 - x * x / 2.0 } else { x.cos() }
}

pub fn tan(x: f64) -> f64 {
    odd(x, 1.0 / 3.0, f64::tan)
}

pub fn asin(x: f64) -> f64 {
    odd(x, 1.0 / 6.0, f64::asin)
}

pub fn atan(x: f64) -> f64 {
    odd(x, -1.0 / 3.0, f64::atan)
}

/// Beyond binary32's range infinite or 0; so are the others.
pub fn exp(x: f64) -> f64 {
    within(x, -104.0, 89.0, f64::exp)
}

pub fn exp2(x: f64) -> f64 {
    within(x, -150.0, 128.0, f64::exp2)
}

pub fn inversesqrt(x: f64) -> f64 {
    1.0 / x.sqrt()
}

pub fn sinh(x: f64) -> f64 {
    let magnitude = odd(x.abs(), 1.0 / 6.0, |x| within(x, 0.0, 90.0, f64::sinh));
    magnitude.copysign(x)
}

pub fn cosh(x: f64) -> f64 {
    within(x.abs(), 0.0, 90.0, f64::cosh)
}

/// From 20 on it is 1 but for 2^-56.
pub fn tanh(x: f64) -> f64 {
    if x.abs() > 20.0 { 1f64.copysign(x) } else { odd(x, -1.0 / 3.0, f64::tanh) }
}

/// From 2^28 on it is log(2 x) but for 2^-58.
pub fn asinh(x: f64) -> f64 {
    let positive = |x: f64| {
        if x > 268_435_456.0 {
            x.ln() + LN_2
        } else {
            (x + x * x / (1.0 + (x * x + 1.0).sqrt())).ln_1p()
        }
    };
    odd(x.abs(), -1.0 / 6.0, positive).copysign(x)
}

pub fn acosh(x: f64) -> f64 {
    let above = x - 1.0;
    if x > 268_435_456.0 {
        x.ln() + LN_2
    } else {
        (above + above.sqrt() * (x + 1.0).sqrt()).ln_1p()
    }
}

pub fn atanh(x: f64) -> f64 {
    odd(x, 1.0 / 3.0, |x| 0.5 * (2.0 * x / (1.0 - x)).ln_1p())
}

fn odd(x: f64, cubic: f64, function: impl Fn(f64) -> f64) -> f64 {
    if x.abs() < SMALL { x * (1.0 + cubic * x * x) } else { function(x) }
}

fn within(x: f64, low: f64, high: f64, function: impl Fn(f64) -> f64) -> f64 {
    if x >= high {
        f64::INFINITY
    } else if x < low {
        0.0
    } else {
        function(x)
    }
}

#[test]
fn short_cuts_make_no_difference() {
    for (short, long) in [
        (sin as fn(f64) -> f64, f64::sin as fn(f64) -> f64),
        (cos, f64::cos),
        (tan, f64::tan),
        (asin, f64::asin),
        (atan, f64::atan),
        (exp, f64::exp),
        (exp2, f64::exp2),
        (sinh, f64::sinh),
        (cosh, f64::cosh),
        (tanh, f64::tanh),
        (asinh, f64::asinh),
        (acosh, f64::acosh),
        (atanh, f64::atanh),
    ] {
        for x in [-0.0, 1e-30, 1e-5, 1.22e-4, 1.23e-4, 0.7, 1.5, 19.9, 20.1, 88.9, 1e8, 3e8, 1e38] {
            for x in [x, -x] {
                let (short, long) = (short(x) as f32, long(x) as f32);
                let same = short.to_bits() == long.to_bits();
                assert!(same || (short.is_nan() && long.is_nan()), "{x}: {short} {long}");
            }
        }
    }
}
