//! Compiled kernels against the interpreter: the same bits for every width and shape, with and
//! without masks.

mod oracle_support;

use oracle_support::Case;
use rtsl_ir::generate::seeded_function;

/// Functions of about `size / 3` operations each, from these seeds.
fn check_generated(seeds: std::ops::Range<u64>, size: usize) {
    for seed in seeds {
        let function = seeded_function(seed, size);
        if let Err(difference) = Case::new(function.clone(), seed).check() {
            panic!("seed {seed}, size {size}: {difference}\n{function}");
        }
    }
}

/// `RTSL_ORACLE` multiplies the number of functions.
fn scaled(count: u64) -> u64 {
    let factor = std::env::var("RTSL_ORACLE").ok().and_then(|text| text.parse().ok());
    count * factor.unwrap_or(1_u64)
}

#[test]
fn short_functions() {
    check_generated(0..scaled(40), 60);
}

#[test]
fn long_functions() {
    check_generated(1000..1000 + scaled(8), 700);
}
