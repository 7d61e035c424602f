//! The single-ray intermediate representation: structured SSA on scalars.
//!
//! # Semantics of a function
//!
//! A [`Function`] computes one method for ONE ray and ONE object. It reads named [variables](Variable) (state
//! variables, members, scratch, buffers) and computes scalar values. At its end, its body yields one value for each of
//! its [outputs](Function::outputs), which the caller stores. Nothing is stored before the end, except to locals, the
//! function's private memory for arrays with dynamic indices. So a variable read anywhere in the body has the value it
//! had before the call.
//!
//! A function with an output to the [`VariableKind::Accepted`] variable is an `intersect`: all its other outputs are
//! stored only if that output is true.
//!
//! # Values and control
//!
//! Values are scalars of type f32, i32, u32 or bool. Each is defined once and used only after its definition, in the
//! region that defines it or in regions nested in that one. Vectors, matrices, colours and structs have been split into
//! scalars. Control is structured: [`OpKind::If`] and [`OpKind::Loop`] hold regions that yield values; there is no
//! jump. There are no masks and no vector width: the representation describes one ray.
//!
//! # Exactness
//!
//! Every operation has one defined result for all operands, see [`UnaryOp`], [`BinaryOp`] and [`CompareOp`]; passes and
//! backends preserve it to the bit. `mul` followed by `add` is rounded twice; only [`OpKind::Fma`] rounds once, and
//! only one pass forms it from the two.
//!
//! This crate does not depend on syntax, types of the language, packets or targets.

mod builder;
pub mod class;
mod constants;
pub mod evaluate;
mod event;
mod float_interval;
mod function;
pub mod host;
mod index_vec;
mod interpreter;
mod interval;
mod names;
mod observer;
mod op;
mod place;
mod plain_host;
mod query;
mod reported_value;
mod signature;
pub mod text;
mod variable;
pub mod verify;
mod visit;

pub use builder::Builder;
pub use constants::ConstantPool;
pub use event::{Event, EventKind, EventValue, ValueScope};
pub use float_interval::FloatInterval;
pub use function::{Function, MAX_NESTING, Output, Region, Value, Values};
pub use index_vec::{Id, IndexVec};
pub use interpreter::{Interpreter, Outcome, PrepareError, Storage};
pub use interval::Interval;
pub use names::{Name, NameText, Names};
pub use observer::{Observer, Spoilt};
pub use op::{
    BinaryOp, CompareOp, Constant, Index, Op, OpKind, ReferenceCall, ReferencePath, Scalar,
    StateComponent, UnaryOp,
};
pub use place::{Place, Places, Source};
pub use query::{PROPERTIES_OF_MATERIALS, Query, SURFACE, SURFACE_SCALARS, Scalars};
pub use reported_value::{MAX_REPORTED_SCALARS, ReportedValue, scalar_count, shown};
pub use variable::{Variable, VariableId, VariableKind};
pub use visit::Effect;
