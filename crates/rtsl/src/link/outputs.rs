//! Which results of a method a caller reads.

use rtsl_spec::{StateVariable, state_variables};

use super::linked_method::LinkedMethod;

/// What a caller reads of what a method leaves. The kernel does not store the rest: there the
/// blocks stay as they are. The mask of accepted hits is always stored, and kernels of the call mode `leaf` always
/// store the distance, by which they find the closest hit.
///
/// ```
/// use rtsl::{Outputs, lookup_state};
///
/// let normal = lookup_state("rt_GeometricNormal").expect("the table has it");
/// let outputs = Outputs::state([normal]).with_scratch();
/// assert!(outputs.has_state(normal) && outputs.has_scratch());
/// assert_eq!(outputs.variables().count(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Outputs {
    /// State variables, by their index.
    state: u128,
    scratch: bool,
}

// A variable each bit.
const _: () = assert!(u128::BITS as usize >= rtsl_spec::MAX_STATE_VARIABLES);

impl Outputs {
    /// All there is.
    pub const ALL: Outputs = Outputs { state: u128::MAX, scratch: true };
    /// Nothing but which rays accepted a hit.
    pub const NONE: Outputs = Outputs { state: 0, scratch: false };

    /// These state variables, and no scratch.
    pub fn state<'a>(variables: impl IntoIterator<Item = &'a StateVariable>) -> Outputs {
        let bits = variables.into_iter().map(|variable| 1 << variable.index);
        Outputs { state: bits.fold(0, |all, bit: u128| all | bit), scratch: false }
    }

    /// The same with scratch.
    #[must_use]
    pub const fn with_scratch(self) -> Outputs {
        Outputs { scratch: true, ..self }
    }

    /// The same without scratch.
    #[must_use]
    pub const fn without_scratch(self) -> Outputs {
        Outputs { scratch: false, ..self }
    }

    /// What either has.
    #[must_use]
    pub const fn union(self, other: Outputs) -> Outputs {
        Outputs { state: self.state | other.state, scratch: self.scratch || other.scratch }
    }

    /// What both have.
    #[must_use]
    pub const fn intersection(self, other: Outputs) -> Outputs {
        Outputs { state: self.state & other.state, scratch: self.scratch && other.scratch }
    }

    /// Whether the variable is read.
    pub const fn has_state(self, variable: &StateVariable) -> bool {
        self.state >> variable.index & 1 != 0
    }

    /// Whether scratch is read.
    pub const fn has_scratch(self) -> bool {
        self.scratch
    }

    /// The variables that are read, in the order of the one table.
    pub fn variables(self) -> impl Iterator<Item = &'static StateVariable> {
        state_variables().iter().filter(move |variable| self.has_state(variable))
    }

    /// Of these the ones that the method sets; all there is where that is all that it sets.
    pub(crate) fn of_method(self, method: &LinkedMethod) -> Outputs {
        let set = Outputs::state(method.writes.iter().copied());
        let set = Outputs { scratch: method.sets_scratch, ..set };
        let read = self.intersection(set);
        if read == set { Outputs::ALL } else { read }
    }
}
