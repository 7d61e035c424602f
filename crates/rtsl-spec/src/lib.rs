//! The RTSL language as data: the table of roles, methods and state variables, and the registry of
//! built-in functions.
//!
//! Every stage reads these tables: the checker for its rules, the lowering for defaults, hosts for
//! the layout of state, the manual for its tables. A new state variable is one row, a new built-in
//! function one entry.
//!
//! This crate does not depend on the syntax, the IR or any host.

mod annotations;
pub mod builtins;
mod ray_type;
mod roles;
mod state;
mod types;

pub use annotations::{ANNOTATION_KEYS, AnnotationKey, AnnotationKind, ELEMENT, STRIDE, UNUSED};
pub use ray_type::RayType;
pub use roles::{Method, Role};
pub use state::{
    ATTRIBUTES, Access, Default, Direction, MAX_ATTRIBUTE_SCALARS, MAX_STATE_VARIABLES, Origin,
    Row, StateVariable, TO_OBJECT, TO_WORLD, lookup_state, rows, state_component_count,
    state_variables,
};
pub use types::{COLOR_COMPONENTS, StateType};
