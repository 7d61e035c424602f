//! Lowers the typed tree of `rtsl_sema` to functions of the single-ray IR.
//!
//! [`lower_class`] makes one function for each method of a class. In short:
//!
//! - A variable is a list of scalars (`layout`). Each scalar is a cell that holds an SSA value
//!   (`cells`). Where control flow joins, the cells that differ become results of the `if` or
//!   carried values of the loop. Arrays with dynamic indices are IR locals.
//! - Calls are inlined (`calls`).
//! - `break`, `continue` and `return` set flags in cells; statements that they skip are guarded
//!   (`control`). If a branch of an `if` ends with such a jump, the statements after the `if`
//!   become its other branch, and no flag is needed.
//! - Evaluation is from left to right. The target of a compound assignment is read before its right
//!   side is evaluated. `out` arguments are copied out from left to right when the call returns.
//! - Writes outside the function's outputs are local: a member written by a method keeps its value
//!   for that call.
//! - `precise` covers all operations of the expressions that contribute to the variable within its
//!   function, through other variables, and all operations of functions called in them.
//!
//! The tree is trusted. The only errors are exceeded limits on size: see `limits`. This crate does
//! not depend on the syntax, masks or targets.

mod access;
mod addresses;
mod builtins;
mod calls;
mod cells;
mod class;
mod construct;
mod control;
mod expressions;
mod facts;
mod filter;
mod function;
mod gradient;
mod illuminance;
mod layout;
mod leaf_part;
mod limits;
mod loops;
mod members;
mod operators;
mod parameters;
mod queries;
mod references;
mod reports;
mod state;
mod state_table;
mod statements;
mod switch;
mod textured;
mod variables;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{Builder, Place, Value};
use rtsl_sema::hir::{self, MemberId, Module, StateId};
use rtsl_spec::Method;

use self::calls::Frame;
use self::cells::{Cell, Cells};
use self::facts::{FactTable, Root};
use self::layout::Layouts;
use self::members::ConstantTables;
use self::variables::{LocalPool, SourceVariable, SourceVariableId};

pub use self::class::lower_class;
pub use self::function::{LoweredFunction, lower_function};
pub use self::reports::Tracing;

/// The kind of IR function that is generated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    /// Computes the initial values of members and parameters.
    Initializer,
    Constructor,
    Method(Method),
    /// A function of no class, whose parameters and results are scratch.
    Function,
}

/// The state of the lowering of one function.
struct Lowering<'m> {
    module: &'m Module,
    class: &'m hir::Class,
    layouts: &'m Layouts<'m>,
    facts: &'m FactTable,
    tables: &'m RefCell<ConstantTables>,
    /// The references that the code tests with `isSet`.
    tested: &'m RefCell<BTreeSet<String>>,
    purpose: Purpose,
    /// The variables that the whole function may write.
    writes: BTreeSet<Root>,
    /// The members that have to be in memory because of dynamic indices.
    indexed: BTreeSet<Root>,
    builder: Builder,
    cells: Cells,
    variables: Vec<SourceVariable>,
    members: BTreeMap<MemberId, SourceVariableId>,
    states: BTreeMap<StateId, SourceVariableId>,
    locals: LocalPool,
    /// The flag that `hit` has accepted a hit.
    accepted: Cell,
    /// The call whose body is being lowered.
    frame: Frame<'m>,
    /// The textured members that have been looked up on the way to here, with their values.
    looked_up: Vec<(MemberId, Vec<Value>)>,
    /// The number of statements and expressions visited.
    visits: u32,
    /// The nesting of statements, expressions and calls that are being visited.
    depth: u32,
    /// The order of the derivatives that may be taken of the code being lowered: 0 for none.
    order: u32,
    /// The steps along both sides of the filter, if the function asks how values change by them.
    filter: Option<filter::Steps>,
    /// The texts, if the class is traced.
    tracing: Option<&'m Tracing>,
    /// The places of the statements, expressions and calls around the one that is being visited.
    outer_places: Vec<Option<Place>>,
}
