//! Overload resolution by GLSL's rules: an exact match wins; otherwise, among the candidates that
//! conversions make applicable, one that is better for some argument and worse for none.

use crate::hir::{Expression, Function, FunctionId, Passing, Type};
use rtsl_spec::Direction;
use rtsl_spec::builtins::Overload;

use super::types::{converts, from_spec};

/// A function that a call may refer to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Candidate<'m> {
    /// A function of the module.
    Function(FunctionId, &'m Function),
    /// A form of a built-in function.
    Builtin(&'static Overload),
}

/// The result of overload resolution.
#[derive(Debug)]
pub(super) enum Choice<'m> {
    /// The candidate that was chosen.
    One(Candidate<'m>),
    /// No candidate accepts the arguments.
    None,
    /// Two candidates apply, and neither is better.
    Ambiguous(Candidate<'m>, Candidate<'m>),
}

impl Candidate<'_> {
    /// The number of parameters.
    pub(super) fn parameter_count(&self) -> usize {
        match self {
            Candidate::Function(_, function) => function.parameters.len(),
            Candidate::Builtin(overload) => overload.parameters.len(),
        }
    }

    /// The type and passing mode of a parameter.
    pub(super) fn parameter(&self, index: usize) -> (Type, Passing) {
        match self {
            Candidate::Function(_, function) => {
                (function.locals[index].ty.clone(), function.parameters[index])
            }
            Candidate::Builtin(overload) => {
                let parameter = &overload.parameters[index];
                let passing = match parameter.direction {
                    Direction::In => Passing::In,
                    Direction::Out => Passing::Out,
                    Direction::InOut => Passing::InOut,
                };
                (from_spec(parameter.ty), passing)
            }
        }
    }

    /// Returns `Some(true)` if the argument has the parameter's type, `Some(false)` if it can be
    /// converted, `None` if it does not fit.
    fn fit(&self, index: usize, argument: &Type) -> Option<bool> {
        let (ty, passing) = self.parameter(index);
        if ty == *argument {
            return Some(true);
        }
        let fits = match passing {
            Passing::In => converts(argument, &ty),
            Passing::Out => converts(&ty, argument),
            Passing::InOut => false,
        };
        fits.then_some(false)
    }

    /// True if a call may leave out the parameters after the first so many, at least one.
    fn may_leave_out(&self, given: usize) -> bool {
        match self {
            Candidate::Function(_, function) => {
                let count = function.parameters.len();
                (count - function.defaults.len()..count).contains(&given)
            }
            Candidate::Builtin(_) => false,
        }
    }

    /// For each argument, true if it fits without conversion; `None` if some argument does not fit.
    fn fits(&self, arguments: &[Expression]) -> Option<Vec<bool>> {
        arguments.iter().enumerate().map(|(index, each)| self.fit(index, &each.ty)).collect()
    }
}

/// Chooses the candidate for a call with these arguments. Default values only count if no candidate accepts the call
/// without them.
pub(super) fn choose<'m>(
    candidates: impl IntoIterator<Item = Candidate<'m>> + Clone,
    arguments: &[Expression],
) -> Choice<'m> {
    let given = arguments.len();
    let all = candidates.clone().into_iter().filter(|it| it.parameter_count() == given);
    match choose_among(all, arguments) {
        Choice::None => {
            let some = candidates.into_iter().filter(|it| it.may_leave_out(given));
            choose_among(some, arguments)
        }
        chosen => chosen,
    }
}

/// Chooses among candidates for so many arguments.
fn choose_among<'m>(
    candidates: impl Iterator<Item = Candidate<'m>>,
    arguments: &[Expression],
) -> Choice<'m> {
    let mut viable: Vec<(Candidate<'m>, Vec<bool>)> = Vec::new();
    for candidate in candidates {
        let Some(fits) = candidate.fits(arguments) else { continue };
        if fits.iter().all(|exact| *exact) {
            return Choice::One(candidate);
        }
        viable.push((candidate, fits));
    }
    // A candidate that beats all others survives any sequence of pairwise comparisons.
    let mut best: Option<usize> = None;
    for index in 0..viable.len() {
        best = match best {
            Some(best) if !is_better(&viable[index].1, &viable[best].1) => Some(best),
            _ => Some(index),
        };
    }
    let Some(best) = best else { return Choice::None };
    let rival = (0..viable.len())
        .find(|other| *other != best && !is_better(&viable[best].1, &viable[*other].1));
    match rival {
        None => Choice::One(viable[best].0),
        Some(rival) => Choice::Ambiguous(viable[best.min(rival)].0, viable[best.max(rival)].0),
    }
}

/// True if `a` is better for some argument and worse for none.
fn is_better(a: &[bool], b: &[bool]) -> bool {
    let mut better = false;
    for (a, b) in a.iter().zip(b) {
        if *b && !*a {
            return false;
        }
        better |= *a && !*b;
    }
    better
}
