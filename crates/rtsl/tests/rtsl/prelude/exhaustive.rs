//! Every float, for every function of one argument: half a minute each.
//!
//! `cargo test --release -p rtsl --test rtsl -- --ignored --nocapture prelude::exhaustive`
//!
//! A name after `exhaustive::` chooses one function.

use rtsl::Math;
use rtsl_spec::builtins::GreatestError;

use crate::prelude::errors::{PROMISES, Promise};
use crate::prelude::evaluate::{Probe, Run};

/// Magnitudes that are tried by one call; they and what is found for them stay in the first cache.
const CHUNK: u32 = 1 << 11;

/// The bits of -0, one past those of the last positive float.
const SIGN: u32 = 1 << 31;

/// One test for each function, so that they run side by side.
macro_rules! exhaustive {
    ($($function:ident)*) => {
        const TRIED: &[&str] = &[$(stringify!($function)),*];

        $(
            #[test]
            #[ignore = "takes half a minute; the manual's table of errors comes from it"]
            fn $function() {
                greatest_error_is_that_of_the_manual(stringify!($function));
            }
        )*
    };
}

exhaustive! {
    sin cos tan asin acos atan exp exp2 log log2 inversesqrt sinh cosh tanh asinh acosh atanh
}

#[test]
fn every_promise_is_tried() {
    let promised: Vec<&str> = PROMISES.iter().map(|promise| promise.name).collect();
    assert_eq!(TRIED, promised);
}

#[test]
fn some_of_all_floats_keep_the_promises() {
    for promise in PROMISES {
        let probe = probe(promise);
        let mut trial = Trial::new(promise, &probe);
        trial.try_magnitudes_from(1.5_f32.to_bits());
        let GreatestError { ulp, at } = trial.greatest;
        // The domains of three end at 1.
        let somewhere = !matches!(promise.name, "asin" | "acos" | "atanh");
        assert!(ulp <= promise.accuracy().bound, "{}({at:?}): {ulp:.3} ulp", promise.name);
        assert_eq!(ulp > 0.0, somewhere, "{}", promise.name);
    }
}

fn greatest_error_is_that_of_the_manual(name: &str) {
    let promise = PROMISES.iter().find(|promise| promise.name == name);
    let promise = promise.expect("the function has a promise");
    let probe = probe(promise);
    let mut trial = Trial::new(promise, &probe);
    for first in (0..SIGN).step_by(CHUNK as usize) {
        trial.try_magnitudes_from(first);
    }
    let GreatestError { ulp, at } = trial.greatest;
    println!("{name}: {ulp:.4} ulp at {at:?}");
    // The table rounds up to two decimals.
    let rounded = GreatestError { ulp: (ulp * 100.0).ceil() / 100.0, at };
    let accuracy = promise.accuracy();
    assert!(ulp <= accuracy.bound, "{name}({at:?}): {ulp:.3} ulp");
    assert_eq!(accuracy.greatest, Some(rounded), "{name}: the table of errors is not true");
}

fn probe(promise: &Promise) -> Probe {
    Probe::new(Math::Contract, "", &format!("{}(x)", promise.name))
}

/// A function on its way through the floats.
struct Trial<'a> {
    promise: &'a Promise,
    run: Run<'a>,
    /// So far, at the least magnitude that has it.
    greatest: GreatestError,
}

impl<'a> Trial<'a> {
    fn new(promise: &'a Promise, probe: &'a Probe) -> Trial<'a> {
        let run = Run::new(probe, CHUNK as usize);
        Trial { promise, run, greatest: GreatestError { ulp: 0.0, at: 0.0 } }
    }

    /// Tries the chunk of positive floats from these bits on, and the same with the other sign.
    fn try_magnitudes_from(&mut self, first: u32) {
        let positive = (first..first + CHUNK).map(f32::from_bits);
        let found: Vec<f32> = self.run.values(positive.clone().map(|x| [x, 0.0])).to_vec();
        let negative = positive.clone().map(|x| -x);
        let mirrored = self.run.values(negative.map(|x| [x, 0.0]));
        let domain = self.promise.accuracy().domain;
        for ((x, &found), &mirrored) in positive.zip(&found).zip(mirrored) {
            if domain.contains(x) {
                let error = self.promise.error(x, found);
                note(&mut self.greatest, error, x);
                // What is the mirror image of an odd or even function is as wrong.
                if self.promise.symmetry.mirror(found).is_some_and(|it| same(it, mirrored)) {
                    continue;
                }
            }
            if domain.contains(-x) {
                note(&mut self.greatest, self.promise.error(-x, mirrored), -x);
            }
        }
    }
}

fn note(greatest: &mut GreatestError, ulp: f64, at: f32) {
    if ulp > greatest.ulp {
        *greatest = GreatestError { ulp, at };
    }
}

fn same(one: f32, other: f32) -> bool {
    one.to_bits() == other.to_bits() || (one.is_nan() && other.is_nan())
}
