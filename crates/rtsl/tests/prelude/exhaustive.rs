//! Every float, for every function of one argument: minutes on all processors.
//!
//! `cargo test --release -p rtsl --test prelude -- --ignored --nocapture exhaustive`

use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use rtsl::Math;

use crate::errors::{PROMISES, Promise};
use crate::evaluate::Probe;

/// Floats that are tried by one call.
const CHUNK: u32 = 1 << 16;

#[test]
#[ignore = "takes minutes; the manual's table of errors comes from it"]
fn exhaustive_errors_are_those_of_the_manual() {
    let mut wrong = Vec::new();
    for promise in PROMISES {
        let (ulp, at) = greatest_error(promise);
        println!("{}: {ulp:.4} ulp at {at:?}", promise.name);
        let accuracy = promise.accuracy();
        // The table rounds up to two decimals.
        let rounded = (ulp * 100.0).ceil() / 100.0;
        let is_true = accuracy.greatest.is_none_or(|greatest| greatest.ulp == rounded);
        if !is_true || ulp > accuracy.bound {
            wrong.push(promise.name);
        }
    }
    assert!(wrong.is_empty(), "the table of errors is not true of {wrong:?}");
}

#[test]
fn some_of_all_floats_keep_the_promises() {
    for promise in PROMISES {
        let probe = Probe::new(Math::Contract, "", &format!("{}(x)", promise.name));
        let (ulp, at) = greatest_error_in(promise, &probe, 1.5_f32.to_bits());
        // The domains of three end at 1.
        let somewhere = !matches!(promise.name, "asin" | "acos" | "atanh");
        assert!(ulp <= promise.accuracy().bound, "{}({at:?}): {ulp:.3} ulp", promise.name);
        assert_eq!(ulp > 0.0, somewhere, "{}", promise.name);
    }
}

/// Over all floats of the domain, with the least argument that has it.
fn greatest_error(promise: &Promise) -> (f64, f32) {
    let next = AtomicU32::new(0);
    let greatest = Mutex::new((0.0, 0.0));
    let threads = std::thread::available_parallelism().map_or(1, |count| count.get());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                let probe = Probe::new(Math::Contract, "", &format!("{}(x)", promise.name));
                loop {
                    let chunk = next.fetch_add(1, Ordering::Relaxed);
                    if chunk >= 1 << 16 {
                        return;
                    }
                    let (ulp, at) = greatest_error_in(promise, &probe, chunk * CHUNK);
                    let mut all = greatest.lock().expect("no thread panics while it has the lock");
                    if ulp > all.0 || (ulp == all.0 && at < all.1) {
                        *all = (ulp, at);
                    }
                }
            });
        }
    });
    greatest.into_inner().expect("no thread panics while it has the lock")
}

fn greatest_error_in(promise: &Promise, probe: &Probe, first: u32) -> (f64, f32) {
    let domain = promise.accuracy().domain;
    let floats = (0..CHUNK).map(|offset| f32::from_bits(first + offset));
    let inputs: Vec<[f32; 2]> = floats.filter(|x| domain.contains(*x)).map(|x| [x, 0.0]).collect();
    if inputs.is_empty() {
        return (0.0, 0.0);
    }
    let mut greatest = (0.0, 0.0);
    for (&[x, _], found) in inputs.iter().zip(probe.values(&inputs)) {
        let error = promise.error(x, found);
        if error > greatest.0 {
            greatest = (error, x);
        }
    }
    greatest
}
