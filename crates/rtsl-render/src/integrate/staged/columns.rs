//! The scratch arrays through which stages meet the runtime.

use rtsl::{
    MAX_ANSWERS, MAX_CONTRIBUTIONS, MAX_REQUEST, MAX_SPAWNS, Port, SHADOW_LIMIT, SPAWN_SCALARS,
    StageSurface, StagedProgram,
};

/// The scratch arrays of the ports of stages, by index.
pub struct Columns {
    /// The answer to what a path waits for.
    pub answers: [usize; MAX_ANSWERS],
    /// The operands of a request.
    pub requests: [usize; MAX_REQUEST as usize],
    /// Object, instance and element of a surface that a suspension names.
    surface: [usize; 3],
    /// The next stage.
    pub next: usize,
    /// The time within the shutter.
    pub time: usize,
    /// The number of surfaces met before.
    pub depth: usize,
    /// The type of the ray searched along last.
    pub ray_type: usize,
    /// The number of searches.
    pub searches: usize,
    /// The sum of the contributions that nothing blocked.
    pub lit: [usize; 3],
    /// The weight of the path's radiance.
    pub weights: [usize; 3],
    /// The number of contributions for which stages have searched.
    pub shadow_rays: usize,
    /// The group of the surface that a search by kernel has found.
    pub group: usize,
    /// The index of that surface among those of its group.
    pub surface_index: usize,
    /// The key of the sequences of numbers.
    pub key: usize,
    /// The index of the sample.
    pub sample: usize,
    /// The counts of random sequences by purposes.
    pub counts: [usize; 2],
    /// The count of numbers that `rand()` has drawn.
    pub drawn: usize,
    /// The surface that a material shades: point, offset, geometric and shading normal.
    pub shaded: [usize; 10],
    /// The length of the shadow ray of a light sample.
    pub shadow_limit: usize,
    /// The factor of the light that a material's method defers.
    pub shade_weights: [usize; 3],
    /// The paths that a stage spawns at each of a few places.
    pub spawns: [[usize; SPAWN_SCALARS]; MAX_SPAWNS],
    /// The number of rays that the path has spawned.
    pub children: usize,
    /// The contributions of a stage at each of a few places: a ray's origin, direction and length, and the colour.
    pub contributions: [[usize; 10]; MAX_CONTRIBUTIONS],
}

impl Columns {
    /// Returns the arrays of a program.
    pub fn new(program: &StagedProgram) -> Columns {
        Columns {
            answers: std::array::from_fn(|index| program.array(Port::Answer(index as u32))),
            requests: std::array::from_fn(|index| program.array(Port::Request(index as u32))),
            surface: std::array::from_fn(|index| program.array(Port::Surface(index as u32))),
            next: program.array(Port::Next),
            time: program.time_array(),
            depth: program.depth_array(),
            ray_type: program.ray_type_array(),
            searches: program.searches_array(),
            lit: program.lit_arrays(),
            weights: program.weight_arrays(),
            shadow_rays: program.shadow_rays_array(),
            group: program.group_array(),
            surface_index: program.surface_array(),
            key: program.key_array(),
            sample: program.sample_array(),
            counts: program.count_arrays(),
            drawn: program.drawn_array(),
            shaded: program.shaded_arrays(),
            shadow_limit: program.array(SHADOW_LIMIT),
            shade_weights: program.shade_weight_arrays(),
            spawns: program.spawn_arrays(),
            children: program.children_array(),
            contributions: program.contribution_arrays(),
        }
    }

    /// Returns the arrays with object, instance and element of a stage's surface.
    pub fn surface(&self, surface: StageSurface) -> [usize; 3] {
        match surface {
            StageSurface::Answer => [self.answers[1], self.answers[2], self.answers[3]],
            StageSurface::Request | StageSurface::None => self.surface,
        }
    }
}
