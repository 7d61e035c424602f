//! The RTSL language as data: the one table of roles, methods and state variables, and the
//! registry of built-in functions.
//!
//! Every stage reads these: the checker its rules, the lowering its defaults, the hosts the layout
//! of state, the manual its tables. A new state variable is one row, a new built-in one entry.
//!
//! This crate knows no syntax, no representation of programs and no host.

pub mod builtins;
mod roles;
mod state;
mod types;

pub use roles::{Method, Role};
pub use state::{
    Access, Default, Direction, MAX_STATE_VARIABLES, Origin, Row, StateVariable, lookup_state,
    rows, state_component_count, state_variables,
};
pub use types::{COLOR_COMPONENTS, StateType};
