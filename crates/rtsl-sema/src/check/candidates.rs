//! Overload resolution, by GLSL's rules: an exact match wins; else of those that conversions
//! make fit, the one that is better for some argument and worse for none.

use crate::hir::{Expression, Function, FunctionId, Passing, Type};
use rtsl_spec::Direction;
use rtsl_spec::builtins::Overload;

use super::types::{converts, from_spec};

/// Something that a call may mean.
#[derive(Clone, Copy, Debug)]
pub(super) enum Candidate<'m> {
    /// A function of the module.
    Function(FunctionId, &'m Function),
    /// A form of a built-in function.
    Builtin(&'static Overload),
}

/// What of several candidates a call means.
#[derive(Debug)]
pub(super) enum Choice<'m> {
    /// This one.
    One(Candidate<'m>),
    /// None takes the arguments.
    None,
    /// These two, and neither is better.
    Ambiguous(Candidate<'m>, Candidate<'m>),
}

impl Candidate<'_> {
    /// How many parameters it has.
    pub(super) fn parameter_count(&self) -> usize {
        match self {
            Candidate::Function(_, function) => function.parameters.len(),
            Candidate::Builtin(overload) => overload.parameters.len(),
        }
    }

    /// A parameter's type and passing.
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

    /// Whether the argument fits: `Some(true)` as it is, `Some(false)` with a conversion.
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

    /// Which arguments fit exactly; `None` where some do not fit at all.
    fn fits(&self, arguments: &[Expression]) -> Option<Vec<bool>> {
        if self.parameter_count() != arguments.len() {
            return None;
        }
        arguments.iter().enumerate().map(|(index, each)| self.fit(index, &each.ty)).collect()
    }
}

/// What a call with these arguments means.
pub(super) fn choose<'m>(
    candidates: impl IntoIterator<Item = Candidate<'m>>,
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
    // One that beats all others, if there is one, survives any sequence of duels.
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

/// Better for some argument and worse for none.
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
