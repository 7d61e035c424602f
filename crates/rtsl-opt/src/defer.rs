//! Deferral of traced rays and light samples: what they bring is added to the colour by the host, so that a method does
//! not wait for it.
//!
//! # The rule
//!
//! A request is deferred if the colour, the state variable `rt_SampleColor`, is affine in its answer: component `c` of
//! the colour is `F_c` times component `c` of the answer, plus a part of its own. Then
//!
//! | request | becomes |
//! |---|---|
//! | `trace` | `spawn` with the weight `F` |
//! | `shade`, asked by an integrator | `own_shade` with the weight `F`; its answer is a part of the method's own |
//! | `light_sample` | `unshadowed_light`, and a `contribute` in the branch that is executed for the light |
//!
//! An answer may be added, subtracted, negated, multiplied by a value, divided by one, selected by a bool, yielded by a
//! branch, and added to a carried value of a loop that only adds to it. The value of a light is what the branch adds to
//! carried values: the sum of `F` times that over the carried values, in the order of the branch's results. The branch
//! may do nothing else. Everything else keeps its request, for a [`Reason`].
//!
//! The answer is removed from the method's own part by its structure, not multiplied by 0: a sum loses an operand, a
//! product vanishes. A constant 0 to which only answers are added vanishes with them.
//!
//! # Factors
//!
//! `F` is computed along the way of the answer, the innermost factor first: `(f1 * f2) * f3` for
//! `((answer * f1) * f2) * f3`. Where ways of an answer meet, factors are added in the order of the operands. Where a
//! branch or `select` chooses, `F` is chosen by the same bool, unless a branch around the request decides it. Its
//! operations are `precise`.
//!
//! A factor must be known where the request is made. Operations that compute it behind the request move to before it,
//! or to before the operation around it in their region. From within other branches they are copied, for which
//! [`gvn`](crate::gvn) leaves one. A ray waits behind operations of its own region that can do neither. No factor may
//! depend on what is deferred.
//!
//! This pass runs before those that only make a function faster, and at every level, so that what is deferred depends
//! on the source alone. Before it [`mem2reg`] and [`dce`] leave only the uses that count. Values that only reports need
//! do not count; they report the method's own part.

mod factors;
mod flow;
mod placing;
mod plan;
#[cfg(test)]
mod properties;
mod reason;
mod rewrite;
mod spread;
#[cfg(test)]
mod tests;

use rtsl_ir::Function;

use crate::{dce, mem2reg};
use plan::Plan;
pub use reason::{Kept, Reason, Request};

/// The requests that the pass would change in a function, and those that it would not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Examination {
    /// The requests that are deferred.
    pub deferred: Vec<Request>,
    /// Those that are not.
    pub kept: Vec<Kept>,
}

/// Examines a function that no pass has changed, and that need not be linked: calls of other objects count as
/// computations, except those of `shade`.
pub fn examine(function: &Function) -> Examination {
    let mut function = function.clone();
    mem2reg::run(&mut function);
    dce::run(&mut function);
    let Plan { deferred, kept, .. } = Plan::of(&function);
    Examination { deferred, kept }
}

/// Defers the requests of `function` that can be, and returns the others.
pub fn run(function: &mut Function) -> Vec<Kept> {
    let mut plan = Plan::of(function);
    let kept = std::mem::take(&mut plan.kept);
    if !plan.edits.is_empty() {
        rewrite::rewrite(function, plan);
    }
    kept
}
