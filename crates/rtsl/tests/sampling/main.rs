//! What the standard library samples, it samples with the density that it says: chi-square tests
//! of directions over a grid, with fixed random numbers.

mod call;
mod chart;
mod distribution;
mod grid;
mod host;
mod lights;
mod materials;
mod prelude;
mod primitives;
