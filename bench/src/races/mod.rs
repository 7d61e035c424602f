//! The races, with inputs that take both sides of every branch.

mod camera;
mod functions;
mod materials;
mod primitives;
mod textures;

use crate::race::Race;

/// All races.
pub fn races() -> Vec<Race> {
    let all = [
        primitives::races(),
        materials::races(),
        textures::races(),
        camera::races(),
        functions::races(),
    ];
    all.into_iter().flatten().collect()
}
