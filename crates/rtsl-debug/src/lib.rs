//! A debugger of shaders that walks over recordings.
//!
//! A [`Replay`] is made of a [`Recording`](rtsl::Recording) of [`TraceDetail::Steps`](rtsl::TraceDetail::Steps). Its
//! position is a statement that is about to run. It moves from statement to statement, forwards and backwards, and
//! shows the calls around the position, and the values of variables there. Nothing runs again while it moves, so that
//! what it shows is what has run, and a step back costs no more than one forwards.
//!
//! - `timeline`: the calls and the stops of a recording.
//! - `replay`: the position, and what moves it; `breakpoint` has what ends a run.
//! - `frame`: the calls around the position; `scopes` the values of their variables; `lines` those beside the text.
//! - `path`: parts of values, such as `hits[2].normal.x`; `expression`: expressions of values, which the compiler
//!   evaluates.
//!
//! This crate knows neither terminals nor protocols.

mod breakpoint;
mod expression;
mod frame;
mod lines;
mod path;
mod replay;
mod scopes;
mod timeline;

pub use breakpoint::{Breakpoint, BreakpointId, Location, Pauses};
pub use frame::Frame;
pub use lines::{Effect, LineEffects, LineValues};
pub use replay::{Granularity, NothingRecorded, Reason, Replay, Stopped};
pub use scopes::Scopes;
pub use timeline::NotFinite;
