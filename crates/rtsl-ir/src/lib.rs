//! The single-ray intermediate representation: structured SSA on scalars.
//!
//! # What a function means
//!
//! A [`Function`] is what one method does for ONE ray and ONE object. It reads named
//! [places](Variable) (state variables, members, scratch, buffers), computes scalar values, and at its
//! end its body yields one value for each of its [outputs](Function::outputs), which the caller
//! stores. Nothing is stored before the end, except into slots, which are the function's own memory
//! for arrays with dynamic indices. So a place read anywhere in the body has the value it had
//! before the call.
//!
//! A function with an output to the [`VariableKind::Accepted`] place is an `intersect`: all its other
//! outputs are stored only where that output is true.
//!
//! # Values and control
//!
//! Values are scalars of type f32, i32, u32 or bool, each defined once, used only in the region
//! that defines it or in regions inside that one, after its definition. Vectors, matrices, colours and structs
//! have been taken apart. Control is structured: [`OpKind::If`] and [`OpKind::Loop`] hold regions
//! that yield values; there is no jump. There are no masks: this representation speaks of
//! one ray, and of nothing that has a width.
//!
//! # Exactness
//!
//! Every operation has one defined result for all operands, see [`UnaryOp`], [`BinaryOp`] and
//! [`CompareOp`]; passes and backends keep it to the bit. `mul` followed by `add` is rounded
//! twice; only [`OpKind::Fma`] rounds once, and only one pass makes it of the two.
//!
//! This crate knows nothing of syntax, types of the language, packets or targets.

mod builder;
pub mod class;
mod constants;
pub mod evaluate;
mod float_interval;
mod function;
pub mod host;
mod interpreter;
mod interval;
mod names;
mod op;
mod signature;
pub mod text;
mod variable;
pub mod verify;
mod visit;

pub use builder::Builder;
pub use constants::ConstantPool;
pub use float_interval::FloatInterval;
pub use function::{Function, MAX_NESTING, Output, Region, Value, Values};
pub use interpreter::{Interpreter, Outcome, PrepareError, Storage};
pub use interval::Interval;
pub use names::{Name, NameText, Names};
pub use op::{
    BinaryOp, CompareOp, Constant, Index, Op, OpKind, ReferenceCall, ReferencePath, Scalar,
    StateComponent, UnaryOp,
};
pub use variable::{Variable, VariableId, VariableKind};
pub use visit::Effect;
