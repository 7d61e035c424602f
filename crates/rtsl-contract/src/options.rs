//! How much is checked.

use rtsl::{EngineOptions, OptLevel};

/// Loop iterations of one call, past which a method counts as one that never ends.
const LOOP_BUDGET: u32 = 100_000;

/// How much is checked, and with which random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Samples for each test of a distribution. Four times as many find deviations half as large.
    pub samples: u32,
    /// Chooses the random numbers. With another seed a class that is right is still found so.
    pub seed: u64,
    /// Whether results are compared at all widths and with the interpreter's. It compiles every method four times.
    pub compare_bits: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options { samples: 20_000, seed: 0, compare_bits: true }
    }
}

/// An engine for checks: one that ends loops which do not end.
pub fn engine_options() -> EngineOptions {
    EngineOptions {
        loop_budget: Some(LOOP_BUDGET),
        optimization: OptLevel::O1,
        ..EngineOptions::default()
    }
}
