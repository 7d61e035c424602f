//! The uses that methods and constructors reach through calls.

use std::collections::BTreeSet;

use rtsl_spec::{Method, Role};

use super::facts::Use;
use crate::hir::{ClassId, FunctionId, StateId};

/// A method or constructor of a class, together with everything that it reaches.
#[derive(Clone)]
pub(super) struct Root {
    pub(super) class: ClassId,
    pub(super) function: FunctionId,
    /// `None` for the constructor.
    pub(super) method: Option<Method>,
    /// The roles of the class that the method belongs to.
    pub(super) roles: Vec<Role>,
    /// The state variables that are written in its reach.
    pub(super) written: BTreeSet<StateId>,
}

/// A use in the reach of a root.
#[derive(Clone, Copy)]
pub(super) struct Reached {
    /// The function that contains the use.
    pub(super) function: FunctionId,
    pub(super) done: Use,
    /// True inside the body of an `illuminance`, perhaps a caller's.
    pub(super) lit: bool,
    /// The interface method that the root has called on the way, as a function; the last one.
    pub(super) within: Option<Method>,
}
