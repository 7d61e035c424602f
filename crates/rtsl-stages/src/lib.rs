//! Splits the function of an integrator, or of a material that traces rays, into *stages*, at the points where a path
//! waits for the renderer.
//!
//! An integrator computes the light that one path brings back: one function, which asks for the nearest hit of a ray,
//! for the visibility along another, for what a material does at a surface. A renderer of a wavefront advances
//! thousands of paths together, so it can't wait inside the function. [`split`] takes the function apart at these
//! *suspension points*. A stage is an ordinary function: it runs from where a path is resumed to the next points, with
//! no operation in it that waits, so that every backend for functions compiles it, at any width.
//!
//! # Suspension points
//!
//! - A search for the nearest hit, a shadow ray with an answer, and radiance along another ray
//!   ([`ResumedBy::NearestHit`], [`ResumedBy::Occluded`], [`ResumedBy::Trace`]); a sample of a light, which includes a
//!   shadow ray, and the light that `shade` of a surface computes, which may trace rays ([`ResumedBy::LightSample`],
//!   [`ResumedBy::Shade`]). The path suspends *at* the operation and is resumed with its results, the *answer*.
//! - A query about a surface whose classes the code does not know ([`ResumedBy::Dispatch`]). A stage with a [`Surface`]
//!   is linked once for each pair of primitive class and material class, and queries about it are then inlined. About
//!   any other surface, a path suspends *before* the query and is resumed by the stage that has that one. A stage that
//!   a search resumes has the surface that was found. To save a dispatch, the other suspensions name the surface of the
//!   first query that follows in the text, if it is visible already; their stage then has that surface.
//!
//! # Frames
//!
//! What is alive across a suspension is the path's *frame*, stored as a structure of arrays: a column for each
//! [`Slot`]. Frames are live sets, as in the coroutines of LuisaCompute, which are split with the same aims (Zheng et
//! al., "GPU Coroutines for Flexible Splitting and Scheduling of Rendering Tasks", 2024). Control is structured here,
//! so liveness needs no iteration, and neither SSA form nor loops have to be repaired. The file `live.rs` has the rule
//! by which values are computed again instead of kept, `slots.rs` the one by which values share a column.
//!
//! # An example
//!
//! The function searches in a loop until a ray escapes:
//!
//! ```text
//! function Count.radiance
//! {
//!   n = loop (i = 0) {
//!     found, object, .. = query nearest_hit ..
//!     next = add i, 1
//!     repeat found, next
//!   }
//!   return state:rt_Radiance@0 = n
//! }
//! ```
//!
//! It becomes two stages. `i` has slot 0; the code after the search, the loop's next iteration up to the search, and
//! what follows the loop are the second stage. Since an iteration always suspends, no loop is left:
//!
//! ```text
//! stage 0: start                            stage 1: nearest_hit, live 0
//! {                                         {
//!                                             found = load scratch:answer.0@0
//!                                             i = load scratch:frame.0@0
//!                                             next = add i, 1
//!   frame.0 = 0, request = .., next = 1       if found { frame.0 = next, request = .., next = 1 }
//!                                             else { rt_Radiance = next, next = -1 }
//! }                                         }
//! ```
//!
//! # How a stage is written
//!
//! From the point outwards: what follows it in its region, then for each region around it what follows the operation
//! that holds it. An `if` passes the yields of the region on as its results. A loop is continued by a copy of the whole
//! loop, with the yields as its initial values, if the yielded bool is true. In such copies there are points again. An
//! operation with points in its regions yields one more bool, true for paths that have left; what follows it in its
//! region is executed unless that is true, and a loop ends when it is. If all paths of one side of an `if` leave, what
//! follows becomes a part of the other side, and no bool is needed.
//!
//! If the first iteration of a loop would find the stage's surface in the loop's parameters, it is written by itself in
//! front of the loop: parameters are then the very values of the surface, and its queries need no dispatch. This is
//! done for at most two loops one in another and 32 one after another, with bodies of at most 4,096 operations. A stage
//! holds what follows its point, so all stages together may grow with the square of the function; [`MAX_POINTS`],
//! [`MAX_OPERATIONS`] and the representation's limit on nesting bound it, with a [`SplitError`] beyond.
//!
//! # The interface of a stage
//!
//! Stages meet the runtime in scratch variables of fixed names, all of length 1:
//!
//! | name | contents |
//! |---|---|
//! | `frame.N` | slot `N` |
//! | `answer.N` | result `N` of the operation that suspended |
//! | `request.N` | an operand of the operation that suspends ([`ResumedBy::request`]), f32; from 11 on i32 |
//! | `surface.N` | object, instance and element of the surface that a suspension names, i32; its stage reads them |
//! | `next` | the index of the next stage, or [`END`] |
//!
//! A slot that a stage does not store keeps its value. A stage where the integrator's function ends for some paths
//! stores the outputs of the function; for paths that go on they keep the values that they had. Requests of paths that
//! do not ask, and slots that are not live in the next stage, are arbitrary. Members, parameters and buffers can be
//! read in every stage; state and scratch of the function only in the first, so what is read of them later passes
//! through the frame. A local with dynamic indices passes through it as a whole if it may be read later.

mod choices;
mod code;
mod common_queries;
pub mod drive;
mod emit;
mod flow;
mod late_loads;
mod live;
mod points;
mod slots;
mod split;
mod stages;
mod stored;
mod text;
mod undefined;
pub mod verify;

pub use live::MAX_COST;
pub use split::{MAX_OPERATIONS, MAX_POINTS, MAX_SLOTS, SplitError, split};
pub use stages::{
    END, MAX_ANSWERS, MAX_REQUEST, Port, ResumedBy, Sizes, Slot, SlotId, Stage, StageSizes, Stages,
    Surface,
};
pub use text::ParseError;

use rtsl_ir::Function;

/// True if a function waits for the light of a ray, a light or a surface, or for a search.
pub fn waits(function: &Function) -> bool {
    let mut waits = false;
    function.body.for_each_op(&mut |op| waits |= ResumedBy::of(&op.kind).is_some());
    waits
}
