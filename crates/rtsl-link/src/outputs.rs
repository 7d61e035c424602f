//! The outputs of a method that a caller reads.

use rtsl_spec::{StateVariable, state_variables};

use crate::linked_method::LinkedMethod;

/// The outputs of a method that a caller reads. The kernel does not store the others: their arrays do not change. The
/// mask of accepted hits is always stored, and kernels of the call mode `leaf` always store the distance, by which they
/// find the closest hit.
///
/// ```
/// use rtsl_link::Outputs;
/// use rtsl_spec::lookup_state;
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

// One bit for each variable.
const _: () = assert!(u128::BITS as usize >= rtsl_spec::MAX_STATE_VARIABLES);

impl Outputs {
    /// All outputs.
    pub const ALL: Outputs = Outputs { state: u128::MAX, scratch: true };
    /// No outputs except the mask of accepted hits.
    pub const NONE: Outputs = Outputs { state: 0, scratch: false };

    /// These state variables, and no scratch.
    pub fn state<'a>(variables: impl IntoIterator<Item = &'a StateVariable>) -> Outputs {
        let bits = variables.into_iter().map(|variable| 1 << variable.index);
        Outputs { state: bits.fold(0, |all, bit: u128| all | bit), scratch: false }
    }

    /// Adds scratch.
    #[must_use]
    pub const fn with_scratch(self) -> Outputs {
        Outputs { scratch: true, ..self }
    }

    /// Removes scratch.
    #[must_use]
    pub const fn without_scratch(self) -> Outputs {
        Outputs { scratch: false, ..self }
    }

    /// Returns the outputs that are in either.
    #[must_use]
    pub const fn union(self, other: Outputs) -> Outputs {
        Outputs { state: self.state | other.state, scratch: self.scratch || other.scratch }
    }

    /// Returns the outputs that are in both.
    #[must_use]
    pub const fn intersection(self, other: Outputs) -> Outputs {
        Outputs { state: self.state & other.state, scratch: self.scratch && other.scratch }
    }

    /// True if the caller reads the variable.
    pub const fn has_state(self, variable: &StateVariable) -> bool {
        self.state >> variable.index & 1 != 0
    }

    /// True if the caller reads scratch.
    pub const fn has_scratch(self) -> bool {
        self.scratch
    }

    /// Returns the variables that the caller reads, in the order of the table of state variables.
    pub fn variables(self) -> impl Iterator<Item = &'static StateVariable> {
        state_variables().iter().filter(move |variable| self.has_state(variable))
    }

    /// Returns those of these that the method sets; [`Outputs::ALL`] if the caller reads all that it sets.
    pub fn of_method(self, method: &LinkedMethod) -> Outputs {
        let set = Outputs::state(method.writes.iter().copied());
        let set = Outputs { scratch: method.sets_scratch, ..set };
        let read = self.intersection(set);
        if read == set { Outputs::ALL } else { read }
    }
}
