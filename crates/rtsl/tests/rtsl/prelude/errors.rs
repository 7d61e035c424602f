//! Errors in units in the last place, against binary64.

#![allow(clippy::disallowed_methods, reason = "references for a comparison with a tolerance")]

use rtsl::Math;
use rtsl_spec::builtins::{self, Accuracy};

use crate::prelude::evaluate::{evaluate_in, thinning};
use crate::prelude::references;

/// A function of one argument and what is promised of it.
pub struct Promise {
    pub name: &'static str,
    pub reference: fn(f64) -> f64,
    pub symmetry: Symmetry,
    /// Results below the smallest normal number are 0.
    pub flushed: bool,
}

/// The relation between a function's values for x and for -x.
#[derive(Clone, Copy, PartialEq)]
pub enum Symmetry {
    None,
    Odd,
    Even,
}

pub const PROMISES: &[Promise] = &[
    promise("sin", references::sin, Symmetry::Odd),
    promise("cos", references::cos, Symmetry::Even),
    promise("tan", references::tan, Symmetry::Odd),
    promise("asin", references::asin, Symmetry::Odd),
    promise("acos", f64::acos, Symmetry::None),
    promise("atan", references::atan, Symmetry::Odd),
    Promise { flushed: true, ..promise("exp", references::exp, Symmetry::None) },
    Promise { flushed: true, ..promise("exp2", references::exp2, Symmetry::None) },
    promise("log", f64::ln, Symmetry::None),
    promise("log2", f64::log2, Symmetry::None),
    promise("inversesqrt", references::inversesqrt, Symmetry::None),
    promise("sinh", references::sinh, Symmetry::Odd),
    promise("cosh", references::cosh, Symmetry::Even),
    promise("tanh", references::tanh, Symmetry::Odd),
    promise("asinh", references::asinh, Symmetry::Odd),
    promise("acosh", references::acosh, Symmetry::None),
    promise("atanh", references::atanh, Symmetry::Odd),
];

const fn promise(name: &'static str, reference: fn(f64) -> f64, symmetry: Symmetry) -> Promise {
    Promise { name, reference, symmetry, flushed: false }
}

impl Symmetry {
    /// The value of -x, where x has the value `found`.
    pub fn mirror(self, found: f32) -> Option<f32> {
        match self {
            Symmetry::None => None,
            Symmetry::Odd => Some(-found),
            Symmetry::Even => Some(found),
        }
    }
}

impl Promise {
    /// The manual's bounds.
    pub fn accuracy(&self) -> &'static Accuracy {
        builtins::accuracy(self.name, 1).expect("the function has a bound")
    }

    /// Of what was found for `x`, in ulp.
    pub fn error(&self, x: f32, found: f32) -> f64 {
        error_of(found, (self.reference)(f64::from(x)), self.flushed)
    }
}

#[test]
fn functions_of_one_argument_keep_their_promises() {
    for promise in PROMISES {
        let accuracy = promise.accuracy();
        keeps_within(promise, accuracy.bound, |x| accuracy.domain.contains(x), Math::Contract);
    }
}

#[test]
fn approximation_breaks_no_promise_but_that_of_inversesqrt() {
    for promise in PROMISES {
        let accuracy = promise.accuracy();
        if promise.name == "inversesqrt" {
            keeps_within(promise, 6.0, f32::is_normal, Math::Fast);
        } else {
            keeps_within(promise, accuracy.bound, |x| accuracy.domain.contains(x), Math::Fast);
        }
    }
}

fn keeps_within(promise: &Promise, bound: f64, domain: impl Fn(f32) -> bool, math: Math) {
    let inputs = floats(16_381 * thinning() as u64, domain);
    let outputs = evaluate_in(math, &format!("{}(x)", promise.name), &inputs);
    for (&[x, _], found) in inputs.iter().zip(outputs) {
        let error = promise.error(x, found);
        assert!(error <= bound, "{}({x:e}) is {found:e}: {error:.3} ulp", promise.name);
    }
}

#[test]
fn pow_is_within_four() {
    for math in [Math::Contract, Math::Fast] {
        pow_is_within_four_in(math);
    }
}

fn pow_is_within_four_in(math: Math) {
    let inputs = powers(200_000 / thinning());
    let outputs = evaluate_in(math, "pow(x, y)", &inputs);
    for (&[x, y], found) in inputs.iter().zip(outputs) {
        let wanted = f64::from(x).powf(f64::from(y));
        let error = error_of(found, wanted, true);
        assert!(error <= 4.0, "pow({x:e}, {y:e}) is {found:e}, wanted {wanted:e}: {error:.3} ulp");
    }
}

#[test]
fn atan_of_two_arguments_is_within_three() {
    for math in [Math::Contract, Math::Fast] {
        atan_of_two_arguments_is_within_three_in(math);
    }
}

fn atan_of_two_arguments_is_within_three_in(math: Math) {
    let mut random = Random(1);
    let inputs: Vec<[f32; 2]> =
        (0..200_000 / thinning()).map(|_| [random.float(), random.float()]).collect();
    let outputs = evaluate_in(math, "atan(x, y)", &inputs);
    for (&[y, x], found) in inputs.iter().zip(outputs) {
        let wanted = f64::from(y).atan2(f64::from(x));
        let error = error_of(found, wanted, false);
        assert!(error <= 3.0, "atan({y:e}, {x:e}) is {found:e}, wanted {wanted:e}: {error:.3} ulp");
    }
}

/// Every `stride`-th float of the domain, by its bits, and the special ones.
fn floats(stride: u64, domain: impl Fn(f32) -> bool) -> Vec<[f32; 2]> {
    let special =
        [0.0, -0.0, 1.0, -1.0, 0.5, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-40, -1e-40];
    let dense = (0..1u64 << 32).step_by(stride as usize).map(|bits| f32::from_bits(bits as u32));
    special.into_iter().chain(dense).filter(|x| domain(*x)).map(|x| [x, 0.0]).collect()
}

/// Pairs whose power is mostly a finite number: any bases, exponents of the fitting size, bases near 1, and
/// powers where the range ends.
fn powers(count: usize) -> Vec<[f32; 2]> {
    let mut random = Random(2);
    (0..count)
        .map(|index| {
            let x = if index % 4 == 0 {
                1.0 + (random.unit() as f32 - 0.5) * 0.05
            } else {
                f32::from_bits(random.next() as u32 & 0x7f7f_ffff).max(f32::MIN_POSITIVE)
            };
            let exponent = match index % 8 {
                1 => 128.0 + (random.unit() - 0.5) * 1e-4,
                2 => -126.0 + (random.unit() - 0.5) * 1e-4,
                _ => random.unit() * 260.0 - 130.0,
            };
            [x, (exponent / f64::from(x).log2()).clamp(-1e30, 1e30) as f32]
        })
        .filter(|[x, _]| *x != 1.0)
        .collect()
}

/// The distance in units in the last place of the wanted value.
fn error_of(found: f32, wanted: f64, flushed: bool) -> f64 {
    let smallest = f64::from(f32::MIN_POSITIVE);
    if wanted.is_nan() || found.is_nan() {
        return if wanted.is_nan() && found.is_nan() { 0.0 } else { f64::INFINITY };
    }
    if flushed && wanted.abs() < smallest {
        // Just below the smallest normal number either neighbour will do.
        let near = found == f32::MIN_POSITIVE && wanted > smallest * (1.0 - 1e-6);
        return if found == 0.0 || near { 0.0 } else { f64::INFINITY };
    }
    // Infinity stands one step beyond the greatest number.
    let beyond = 2f64.powi(128);
    let finite = |value: f64| value.clamp(-beyond, beyond);
    let exponent = (wanted.abs().clamp(smallest, f64::from(f32::MAX)).to_bits() >> 52) - 23;
    (finite(f64::from(found)) - finite(wanted)).abs() / f64::from_bits(exponent << 52)
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 32 ^ self.0 << 13
    }

    fn unit(&mut self) -> f64 {
        (self.next() & 0xffff_ffff) as f64 / 4_294_967_296.0
    }

    /// A finite float of any size.
    fn float(&mut self) -> f32 {
        let float = f32::from_bits(self.next() as u32);
        if float.is_finite() { float } else { 1.0 }
    }
}
