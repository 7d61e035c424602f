//! Passes over the single-ray intermediate representation of RTSL, one per file.
//!
//! A pass takes a verified function and leaves a verified function. All passes except [`contract`], [`approximate`],
//! [`mod@unit`], [`placed`] and [`defer`] preserve its results to the bit (except NaN payloads) and the number and
//! order of its requests to the host; all except [`ray_weights`] also preserve the content of the requests.
//!
//! This crate does not depend on the language, on call modes or on targets: optimisations that pay on every backend are
//! done here, those that pay on one belong to that backend.

mod algebra;
pub mod approximate;
pub mod bits;
pub mod budget;
pub mod complements;
mod conditions;
pub mod contract;
pub mod dce;
pub mod dead_outputs;
pub mod defer;
pub mod differentiate;
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

/// Options of [`optimize`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Contract multiply and add to fma by the rule of [`contract`]. Changes results, on every backend alike.
    pub contract: bool,
    /// Approximate divisions and square roots by the rules of [`approximate`], unless `optimize` is off. Results then
    /// differ from machine to machine.
    pub approximate: bool,
    /// The budget of loop iterations of a ray in a call, at most [`budget::MAX_BUDGET`]; unlimited if `None`. The set
    /// of loops that count does not depend on `optimize`: see [`mod@budget`].
    pub budget: Option<u32>,
    /// Run the passes that only make the function faster. With a budget they always run.
    pub optimize: bool,
    /// Run [`if_convert`], which benefits packets but not code for one ray.
    pub select: bool,
    /// Run [`defer`]. Changes results in their last bits, on every backend alike, and needs a host that adds up light.
    pub defer: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            contract: true,
            approximate: false,
            budget: None,
            optimize: true,
            select: true,
            defer: false,
        }
    }
}

/// A pass without parameters.
pub type Pass = fn(&mut Function);

/// The passes without parameters, by name.
pub const PASSES: &[(&str, Pass)] = &[
    ("approximate", approximate::run),
    ("bits", bits::run),
    ("complements", complements::run),
    ("contract", contract::run),
    ("dce", dce::run),
    ("defer", |function| drop(defer::run(function))),
    ("differentiate", differentiate::run),
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
    let _span = tracing::debug_span!("optimize", function = function.name).entered();
    if options.contract {
        run("contract", function, contract::run);
    }
    run("mem2reg", function, mem2reg::run);
    run("dce", function, dce::run);
    if options.defer {
        run("defer", function, |function| drop(defer::run(function)));
        run("dce", function, dce::run);
    }
    run("ray_weights", function, ray_weights::run);
    // The budget counts the remaining loops, so these passes affect the result of a function with a budget.
    if options.optimize || options.budget.is_some() {
        run("simplify", function, simplify::run);
        run("gvn", function, gvn::run);
        if options.approximate && options.optimize {
            run("approximate", function, approximate::run);
            run("gvn", function, gvn::run);
        }
        run("unroll", function, unroll::run);
        // Unrolling makes indices constant, and folding turns accesses at them into accesses at constant indices.
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

/// Facts about a function's caller.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Caller {
    /// Scalars of members whose values are known.
    pub known: BTreeMap<(VariableId, u32), Constant>,
    /// For each output, true if it is read; all are read if `None`.
    pub read: Option<Vec<bool>>,
    /// Variables that hold unit vectors. Changes results.
    pub unit: Vec<VariableId>,
    /// The object is [`placed`], with products contracted or not. Changes results.
    pub placed: Option<Contract>,
}

/// The mode of contraction of multiply and add.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contract(pub bool);

/// Specialises an optimised function for this caller. Contraction and budget remain as they are: except for unit
/// vectors and placed objects, results and reports are those of the function to the bit.
pub fn specialise(function: &mut Function, caller: &Caller, optimize: bool) {
    let _span = tracing::debug_span!("specialise", function = function.name).entered();
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
        // Unrolling makes indices constant, so that more loads of known members can be replaced.
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
    let _span = tracing::trace_span!("pass", name).entered();
    pass(function);
    if cfg!(debug_assertions)
        && let Err(error) = verify(function)
    {
        panic!("after {name}: {error}\n{function}");
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rtsl_ir::class::ParameterType;
    use rtsl_ir::{Event, EventKind, EventValue, Op, OpKind, Region, ValueScope};
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

    /// Traced functions, which are not optimised, have the results of others, and the weights of rays.
    #[test]
    fn reports_change_no_results() {
        for seed in 2000..2300 {
            let function = rtsl_testing::functions::seeded_function(seed, 500);
            let mut traced = function.clone();
            add_reports(&mut traced.body);
            let mut outcomes = Vec::new();
            for (mut function, is_traced) in [(function, false), (traced, true)] {
                let options = Options { optimize: !is_traced, ..Options::default() };
                optimize(&mut function, &options);
                let mut reports = false;
                function
                    .body
                    .for_each_op(&mut |op| reports |= matches!(op.kind, OpKind::Report(..)));
                assert_eq!(reports, is_traced);
                let inputs = rtsl_testing::functions::Entropy::bytes(seed, 600);
                outcomes.push(testing::outcome_with(HashHost::default(), &function, &inputs));
            }
            assert_eq!(outcomes[0], outcomes[1], "{seed}");
        }
    }

    /// Reports the first result of each operation.
    fn add_reports(region: &mut Region) {
        let mut ops = Vec::new();
        for mut op in std::mem::take(&mut region.ops) {
            op.kind.regions_mut().for_each(add_reports);
            let value = op.results.iter().next();
            ops.push(op);
            if let Some(value) = value {
                let scalar = ParameterType::Scalar(rtsl_ir::Scalar::F32);
                let values = vec![Arc::new(EventValue::new("", scalar, ValueScope::Local))];
                let (kind, method) = (EventKind::Assignment, "".into());
                let event = Arc::new(Event { kind, method, place: None, values });
                let kind = OpKind::Report(event, vec![value]);
                ops.push(Op { results: Default::default(), precise: false, kind });
            }
        }
        region.ops = ops;
    }

    /// Other passes change neither the set of contracted operations nor their results, nor the weights of rays.
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
