//! The LLVM passes of each level, in the syntax of the loaded library.
//!
//! LLVM renames parameters of passes between versions: the parameter that disables partial redundancy elimination is
//! `no-pre` up to version 22 and `no-scalar-pre` from 23 on, and `instcombine` has `no-verify-fixpoint` from 18 on. A
//! pass therefore has several spellings, and each is tried by running it on an empty module. Versions are not compared,
//! so libraries newer than this code are supported as well.
//!
//! A pass of which all spellings are rejected is omitted: code without it is slower but computes the same results.

use std::sync::OnceLock;

use crate::opt_level::OptLevel;

/// A pass with its spellings in versions of LLVM; the first that the library accepts is used.
type Pass = &'static [&'static str];

const ALWAYS_INLINE: Pass = &["always-inline"];
const SROA: Pass = &["sroa"];
const EARLY_CSE: Pass = &["early-cse"];
const EARLY_CSE_OF_MEMORY: Pass = &["early-cse<memssa>", "early-cse"];
const SIMPLIFY_CFG: Pass = &["simplifycfg"];
const SIMPLIFY_CFG_KEEPING_BRANCHES: Pass = &["simplifycfg<no-speculate-blocks>", "simplifycfg"];
const INSTCOMBINE: Pass = &["instcombine<no-verify-fixpoint>", "instcombine"];
const JUMP_THREADING: Pass = &["jump-threading"];
const OPTIMIZE_FULLY: Pass = &["default<O3>"];
/// Without partial redundancy elimination: see [`ORDINARY`].
const GVN: Pass = &[
    "gvn<no-pre;no-load-pre;no-split-backedge-load-pre>",
    "gvn<no-scalar-pre;no-load-pre;no-split-backedge-load-pre>",
    "gvn",
];

/// Passes over the module, then passes over each of its functions.
struct Pipeline {
    module: &'static [Pass],
    function: &'static [Pass],
}

/// `OptLevel::O0`.
const NONE: Pipeline = Pipeline { module: &[], function: &[] };

/// `OptLevel::O1`.
const CHEAP: Pipeline =
    Pipeline { module: &[ALWAYS_INLINE], function: &[SROA, EARLY_CSE, SIMPLIFY_CFG] };

/// `OptLevel::O2`. The single-ray IR is already folded, value-numbered and has hoisted invariants, so the remaining
/// redundancies are those of packet lowering: promotable locals, equal masks, blocks to merge, equal loads in different
/// blocks.
///
/// The passes were chosen by omitting each, over all methods of the standard library and the benchmarks, and comparing
/// the code: `licm`, `adce` and a second `simplifycfg` change nothing (one method of 77 becomes longer with `licm`);
/// `gvn` removes 5 % of the largest `intersect`, but its partial redundancy elimination adds as much code as it saves,
/// for a third of its time. `instcombine` makes code 3 % longer, since it undoes the form in which masks cross blocks,
/// and takes as long as all others. `always-inline` is for one function, that of a leaf's test, which is inlined into
/// the loop over tests. Vectorisers and unrolling never run: the code is already vectorised.
const ORDINARY: Pipeline = Pipeline {
    module: &[ALWAYS_INLINE],
    function: &[SROA, EARLY_CSE_OF_MEMORY, SIMPLIFY_CFG, GVN],
};

/// `OptLevel::O2` for a function of one ray. Its branches are uniform and mostly predictable, so none is converted to a
/// select, and a condition that is known on the path to a branch is not tested again. `instcombine` and `gvn` achieve
/// this, and there are no masks that would prevent it. Single rays in Embree are 1 percent faster.
const OF_ONE_RAY: Pipeline = Pipeline {
    module: &[],
    function: &[
        SROA,
        EARLY_CSE_OF_MEMORY,
        INSTCOMBINE,
        GVN,
        JUMP_THREADING,
        SIMPLIFY_CFG_KEEPING_BRANCHES,
    ],
};

/// `OptLevel::O3`.
const FULL: Pipeline = Pipeline { module: &[OPTIMIZE_FULLY], function: &[] };

/// The kind of a module's functions, on which the optimisation of branches depends.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Work {
    Packets,
    OneRay,
}

/// The pipelines of one loaded library, each determined at its first use.
#[derive(Default)]
pub struct Passes {
    cheap: OnceLock<String>,
    ordinary: OnceLock<String>,
    of_one_ray: OnceLock<String>,
    full: OnceLock<String>,
}

impl Passes {
    /// Returns the passes of a level in LLVM's notation, if any. `accepts` returns true if the library accepts a text.
    pub fn text(
        &self,
        level: OptLevel,
        work: Work,
        accepts: impl Fn(&str) -> bool,
    ) -> Option<&str> {
        let text = match (level, work) {
            (OptLevel::O0, _) => return None,
            (OptLevel::O1, _) => &self.cheap,
            (OptLevel::O2, Work::Packets) => &self.ordinary,
            (OptLevel::O2, Work::OneRay) => &self.of_one_ray,
            (OptLevel::O3, _) => &self.full,
        };
        let text = text.get_or_init(|| pipeline(level, work).spell(accepts));
        (!text.is_empty()).then_some(text)
    }
}

/// Returns the passes of a level in all their spellings, of which a library determines one.
pub fn spellings(level: OptLevel, work: Work) -> String {
    let Pipeline { module, function } = pipeline(level, work);
    format!("{module:?} {function:?}")
}

fn pipeline(level: OptLevel, work: Work) -> &'static Pipeline {
    match (level, work) {
        (OptLevel::O0, _) => &NONE,
        (OptLevel::O1, _) => &CHEAP,
        (OptLevel::O2, Work::Packets) => &ORDINARY,
        (OptLevel::O2, Work::OneRay) => &OF_ONE_RAY,
        (OptLevel::O3, _) => &FULL,
    }
}

impl Pipeline {
    /// Tries the first spellings of all passes together, since most libraries accept them, then each separately.
    fn spell(&self, accepts: impl Fn(&str) -> bool) -> String {
        let preferred = self.text(|pass| pass.first().copied());
        if accepts(&preferred) {
            return preferred;
        }
        self.text(|pass| pass.iter().copied().find(|text| accepts(text)))
    }

    fn text(&self, choose: impl Fn(Pass) -> Option<&'static str>) -> String {
        let chosen = |passes: &'static [Pass]| -> Vec<&str> {
            passes.iter().filter_map(|pass| choose(pass)).collect()
        };
        let mut parts = chosen(self.module);
        let function = chosen(self.function);
        let function = format!("function({})", function.join(","));
        if function != "function()" {
            parts.push(&function);
        }
        parts.join(",")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Llvm;
    use crate::compile::accepts_passes;

    const LEVELS: [OptLevel; 3] = [OptLevel::O1, OptLevel::O2, OptLevel::O3];

    /// Returns the passes for one ray if the library rejects texts that contain one of `unknown`.
    fn of_one_ray(unknown: &[&str]) -> String {
        let accepts = |text: &str| !unknown.iter().any(|word| text.contains(word));
        let passes = Passes::default();
        passes.text(OptLevel::O2, Work::OneRay, accepts).unwrap().to_owned()
    }

    #[test]
    fn parameters_follow_the_accepted_spellings() {
        let gvn =
            |text: &str| text[text.find("gvn").unwrap()..].split(',').next().unwrap().to_owned();
        assert_eq!(
            of_one_ray(&[]),
            "function(sroa,early-cse<memssa>,instcombine<no-verify-fixpoint>,\
             gvn<no-pre;no-load-pre;no-split-backedge-load-pre>,jump-threading,\
             simplifycfg<no-speculate-blocks>)"
        );
        let renamed = of_one_ray(&["no-pre"]);
        assert_eq!(gvn(&renamed), "gvn<no-scalar-pre;no-load-pre;no-split-backedge-load-pre>");
        assert!(renamed.contains("instcombine<no-verify-fixpoint>"), "{renamed}");
        assert_eq!(gvn(&of_one_ray(&["no-pre", "no-scalar-pre"])), "gvn");
        assert!(of_one_ray(&["no-verify"]).contains(",instcombine,"));
    }

    #[test]
    fn a_pass_that_is_gone_is_left_out() {
        assert_eq!(
            of_one_ray(&["gvn", "jump-threading", "instcombine"]),
            "function(sroa,early-cse<memssa>,simplifycfg<no-speculate-blocks>)"
        );
        assert_eq!(Passes::default().text(OptLevel::O2, Work::OneRay, |_| false), None);
    }

    /// An omitted pass only costs speed, so each library used in tests must accept all of them.
    #[test]
    fn the_loaded_library_knows_every_pass() {
        let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
        for pipeline in [&CHEAP, &ORDINARY, &OF_ONE_RAY, &FULL] {
            for pass in pipeline.module.iter().chain(pipeline.function) {
                // The last of several `gvn` spellings has no parameters.
                let wanted = if *pass == GVN { &pass[..pass.len() - 1] } else { pass };
                let known = wanted.iter().any(|text| accepts_passes(&llvm, text).unwrap());
                assert!(known, "{llvm:?} knows none of {wanted:?}");
            }
        }
        assert!(!accepts_passes(&llvm, "no-such-pass").unwrap());
        for level in LEVELS {
            for work in [Work::Packets, Work::OneRay] {
                let accepts = |text: &str| accepts_passes(&llvm, text).unwrap();
                let text = Passes::default().text(level, work, accepts).unwrap().to_owned();
                assert!(accepts_passes(&llvm, &text).unwrap(), "{llvm:?} refuses {text}");
            }
        }
    }
}
