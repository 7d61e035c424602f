//! Options of checks.

use rtsl::{EngineOptions, OptLevel};

/// The number of loop iterations of one call after which a method counts as not terminating.
const LOOP_BUDGET: u32 = 100_000;

/// The extent of a check, and its random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Samples for each test of a distribution. Four times as many find deviations half as large.
    pub samples: u32,
    /// The seed of random numbers. The result for a correct class does not depend on it.
    pub seed: u64,
    /// True if results are compared at all widths and with the interpreter's. This compiles every method four times.
    pub compare_bits: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options { samples: 20_000, seed: 0, compare_bits: true }
    }
}

/// Returns engine options for checks, with a loop budget.
pub fn engine_options() -> EngineOptions {
    EngineOptions {
        loop_budget: Some(LOOP_BUDGET),
        optimization: OptLevel::O1,
        ..EngineOptions::default()
    }
}
