//! Chi-square tests of the directions that the prelude samples against their densities, over a grid, with fixed random
//! numbers; and those properties of the library's materials and lights that `rtsl-contract`, which tests samples of all
//! classes, cannot know.

mod call;
mod distribution;
mod grid;
mod host;
mod lights;
mod materials;
mod open_pbr;
mod prelude;
