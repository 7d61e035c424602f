//! What the prelude samples, it samples with the density that it says: chi-square tests of directions over a grid,
//! with fixed random numbers. And what the library's materials and lights give that `rtsl-contract`, which tests all
//! its classes so, cannot know of a class.

mod call;
mod distribution;
mod grid;
mod host;
mod lights;
mod materials;
mod prelude;
