//! Passes over the single-ray intermediate representation of RTSL, one a file.
//!
//! A pass takes a verified function and leaves one. All but [`contract`], [`approximate`], [`mod@unit`] and [`placed`] keep its
//! results to the bit (NaN payloads aside) and its requests to the host in number and order; but for [`ray_weights`] the
//! requests also say the same.
//!
//! This crate knows no language, no shapes of kernels and no targets: what pays on
//! every backend is done here, what pays on one belongs to it.

mod algebra;
pub mod approximate;
pub mod bits;
pub mod budget;
mod conditions;
pub mod contract;
pub mod dce;
pub mod dead_outputs;
pub mod float_range;
pub mod gvn;
pub mod hoist_common;
pub mod if_convert;
pub mod licm;
pub mod loop_exit_values;
pub mod mem2reg;
pub mod merge_rare_branches;
pub mod placed;
pub mod range;
pub mod ray_weights;
pub mod simplify;
pub mod specialise;
mod substitution;
#[cfg(test)]
mod testing;
pub mod unchanged;
pub mod unit;
pub mod unroll;

use std::collections::BTreeMap;

use rtsl_ir::verify::verify;
use rtsl_ir::{Constant, Function, VariableId};

/// What [`optimize`] does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Multiply and add become fma by the rule of [`contract`]. Changes results, on every backend
    /// alike.
    pub contract: bool,
    /// Divisions and square roots are approximated by the rules of [`approximate`], unless nothing is
    /// optimised. Results then differ from machine to machine.
    pub approximate: bool,
    /// The loop iterations of a ray in a call, at most [`budget::MAX_BUDGET`]; unlimited where
    /// `None`. Which loops count does not depend on `optimize`: see [`mod@budget`].
    pub budget: Option<u32>,
    /// Run the passes that only make the function faster. With a budget they run whatever this says.
    pub optimize: bool,
    /// One of them, [`if_convert`]: packets want it, code of one ray does not.
    pub select: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options { contract: true, approximate: false, budget: None, optimize: true, select: true }
    }
}

/// A pass that needs nothing but the function.
pub type Pass = fn(&mut Function);

/// The passes that need nothing but the function, by name.
pub const PASSES: &[(&str, Pass)] = &[
    ("approximate", approximate::run),
    ("bits", bits::run),
    ("contract", contract::run),
    ("dce", dce::run),
    ("float_range", float_range::run),
    ("simplify", simplify::run),
    ("licm", licm::run),
    ("merge_rare_branches", merge_rare_branches::run),
    ("loop_exit_values", loop_exit_values::run),
    ("hoist_common", hoist_common::run),
    ("gvn", gvn::run),
    ("mem2reg", mem2reg::run),
    ("range", range::run),
    ("if_convert", if_convert::run),
    ("unchanged", unchanged::run),
    ("unroll", unroll::run),
    ("ray_weights", ray_weights::run),
];

/// Runs the passes on a verified function, in order.
pub fn optimize(function: &mut Function, options: &Options) {
    if options.contract {
        run("contract", function, contract::run);
    }
    run("mem2reg", function, mem2reg::run);
    run("dce", function, dce::run);
    run("ray_weights", function, ray_weights::run);
    // What a budget ends, and so what such a function gives, follows from the loops that are left.
    if options.optimize || options.budget.is_some() {
        run("simplify", function, simplify::run);
        run("gvn", function, gvn::run);
        if options.approximate && options.optimize {
            run("approximate", function, approximate::run);
            run("gvn", function, gvn::run);
        }
        run("unroll", function, unroll::run);
        // Unrolling makes constants of indices, and folding makes constant indices of those.
        run("simplify", function, simplify::run);
        run("mem2reg", function, mem2reg::run);
        run("simplify", function, simplify::run);
        run("range", function, range::run);
        run("float_range", function, float_range::run);
        run("simplify", function, simplify::run);
        run("dce", function, dce::run);
        run("hoist_common", function, hoist_common::run);
        if options.select {
            run("if_convert", function, if_convert::run);
        }
        run("merge_rare_branches", function, merge_rare_branches::run);
        run("bits", function, bits::run);
        run("simplify", function, simplify::run);
        run("gvn", function, gvn::run);
        run("loop_exit_values", function, loop_exit_values::run);
        run("licm", function, licm::run);
        run("unchanged", function, unchanged::run);
        run("dce", function, dce::run);
    }
    if let Some(limit) = options.budget {
        run("budget", function, |function| budget::run(function, limit));
    }
    run("renumber", function, Function::renumber);
}

/// What is known of a function's caller.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Caller {
    /// Scalars of members whose values are always these.
    pub known: BTreeMap<(VariableId, u32), Constant>,
    /// For each output whether it is read; all are where `None`.
    pub read: Option<Vec<bool>>,
    /// Places that hold vectors of unit length. Changes results.
    pub unit: Vec<VariableId>,
    /// The object is [`placed`], and whether products are contracted. Changes results.
    pub placed: Option<Contract>,
}

/// Whether multiply and add become fma.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contract(pub bool);

/// Makes an optimised function one for this caller. Contraction and budget stay as they are: but for
/// vectors of unit length and placed objects the results are those of the function to the bit, and so is what it
/// reports.
pub fn specialise(function: &mut Function, caller: &Caller, optimize: bool) {
    if let Some(read) = &caller.read {
        run("dead_outputs", function, |function| dead_outputs::run(function, read));
    }
    if let Some(Contract(contract)) = caller.placed {
        run("placed", function, |function| placed::run(function, contract));
        if optimize {
            run("gvn", function, gvn::run);
        }
    }
    run("specialise", function, |function| specialise::run(function, &caller.known));
    if optimize && !caller.unit.is_empty() {
        run("unit", function, |function| unit::run(function, &caller.unit));
    }
    if optimize && !(caller.known.is_empty() && caller.unit.is_empty()) {
        run("simplify", function, simplify::run);
        run("unroll", function, unroll::run);
        run("simplify", function, simplify::run);
        // Unrolling makes constants of indices, and with them more of the members known.
        run("specialise", function, |function| specialise::run(function, &caller.known));
        run("mem2reg", function, mem2reg::run);
        run("simplify", function, simplify::run);
        run("range", function, |function| range::run_knowing(function, &caller.known));
        run("float_range", function, float_range::run);
        run("simplify", function, simplify::run);
        run("dce", function, dce::run);
        run("hoist_common", function, hoist_common::run);
        run("if_convert", function, if_convert::run);
        run("merge_rare_branches", function, merge_rare_branches::run);
        run("bits", function, bits::run);
        run("simplify", function, simplify::run);
        run("gvn", function, gvn::run);
        run("loop_exit_values", function, loop_exit_values::run);
        run("licm", function, licm::run);
    }
    run("dce", function, dce::run);
    run("renumber", function, Function::renumber);
}

/// Runs a pass and, in debug builds, the verifier after it.
fn run(name: &str, function: &mut Function, pass: impl FnOnce(&mut Function)) {
    pass(function);
    if cfg!(debug_assertions)
        && let Err(error) = verify(function)
    {
        panic!("after {name}: {error}\n{function}");
    }
}

#[cfg(test)]
mod tests {
    use rtsl_testing::functions::HashHost;

    use super::*;
    use crate::testing::check_preserves;

    #[test]
    fn all_passes_keep_results() {
        for select in [true, false] {
            let budget = Some(1 << 20);
            let options = Options { contract: false, budget, select, ..Options::default() };
            check_preserves(|function| optimize(function, &options));
        }
    }

    #[test]
    fn short_branches_become_selects_where_packets_want_them() {
        let text = "
            %c: bool = load scratch:b@0 %x: f32 = load scratch:f@0
            %r: f32 = if %c { %a: f32 = sqrt %x yield %a } else { yield %x }
            return scratch:f@0 = %r";
        for select in [true, false] {
            let options = Options { select, ..Options::default() };
            let after = testing::transformed(text, |function| optimize(function, &options));
            assert_eq!((after.contains("select"), after.contains("if")), (select, !select));
        }
    }

    /// Other passes neither change what is contracted nor what that gives, nor the weights of rays.
    #[test]
    fn results_do_not_depend_on_how_much_is_optimized() {
        for seed in 1000..1200 {
            let function = rtsl_testing::functions::seeded_function(seed, 500);
            let outcomes = [false, true].map(|optimized| {
                let mut function = function.clone();
                let options = Options { optimize: optimized, ..Options::default() };
                optimize(&mut function, &options);
                let inputs = rtsl_testing::functions::Entropy::bytes(seed, 600);
                testing::outcome_with(HashHost::default(), &function, &inputs)
            });
            assert_eq!(outcomes[0], outcomes[1], "{seed}");
        }
    }
}
