//! The prelude against references: errors of the mathematics over dense samples of all floats,
//! GLSL's formulas at the edges of their domains, noise and sampling by what they promise.

mod approximation;
mod errors;
mod evaluate;
mod exhaustive;
mod formulas;
mod noise;
mod references;
mod registry;
mod sampling;
