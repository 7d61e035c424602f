//! The memory of one thread for the surfaces of a chunk of paths: arrays with a number for each lane.

use rtsl::{
    CallArguments, Instances, Kernel, LaneBlock, LaneIndices, LaneMask as MaskBlock, Method,
    new_state,
};

use crate::compiled::problems::Problems;
use crate::sampling::Sampler;

use super::numbers::Numbers;
use super::places::Whereabouts;
use super::wave::{Path, PathHit};

/// Lanes of a chunk: the more, the fewer calls; the fewer, the more of it stays in caches.
pub const CHUNK: usize = 256;

/// A number for each lane.
pub type Row = [f32; CHUNK];

/// A vector or colour for each lane, component by component.
pub type Rows = [Row; 3];

/// The memory.
pub struct Chunk {
    /// How many lanes are in use.
    pub count: usize,
    /// What the rays hit.
    pub hits: [PathHit; CHUNK],
    /// Where the rays begin, in world space.
    pub origin: Rows,
    /// Where they go.
    pub direction: Rows,
    /// The least parameters of hits.
    pub epsilon: Row,
    /// The parameters of the hits.
    pub distance: Row,
    /// The times within the shutter.
    pub time: Row,
    /// How wide the rays are where they hit.
    pub width: Row,
    /// How much wider after a unit of length.
    pub spread: Row,
    /// What radiance along the rays is multiplied with.
    pub throughput: Rows,
    /// The densities of the directions; 0 if they were not chosen by one.
    pub density: Row,
    /// Which sequences of numbers the paths have.
    pub keys: [u32; CHUNK],
    /// The points that were hit, in world space.
    pub point: Rows,
    /// The surfaces' normals, of unit length, in world space.
    pub geometric_normal: Rows,
    /// The normals for shading.
    pub shading_normal: Rows,
    /// -1 where the ray met the surface from behind, else 1.
    pub side: Row,
    /// With which density per solid angle the hits would have been chosen as samples of lights; 0 where they would not.
    pub light_density: Row,
    /// Samples of lights.
    pub light: LightRows,
    /// The state of all calls for the surfaces.
    pub state: LaneBlock,
    /// What the shapes' `intersect` left for the hits.
    pub kept_scratch: LaneBlock,
    /// The materials' scratch.
    pub scratch: LaneBlock,
    /// Which lanes `intersect` accepted a hit for, where it is called again.
    pub accepted: MaskBlock,
    /// The numbers of the objects that were hit among those of their class.
    pub objects: LaneIndices,
    /// Those of their materials.
    pub materials: LaneIndices,
    /// Those of their emitters.
    pub emitters: LaneIndices,
    /// Those of the textures that cut them out.
    pub cut_outs: LaneIndices,
    /// Random numbers.
    pub numbers: Numbers,
}

/// Samples of lights for the points of a chunk.
pub struct LightRows {
    /// Unit vectors towards them, in world space.
    pub direction: Rows,
    /// Their distances.
    pub distance: Row,
    /// Radiance, or the whole contribution of a delta light, divided by the density of the sample, that of choosing the light
    /// included. Black where there is no sample.
    pub color: Rows,
    /// That density, where a direction of the material could have found the light too; else 0.
    pub density: Row,
}

impl Chunk {
    /// For shaders with at most so many arrays of scratch.
    pub fn new(scratch_arrays: usize, sampler: Sampler) -> Box<Self> {
        const NONE: Row = [0.0; CHUNK];
        Box::new(Chunk {
            count: 0,
            hits: [PathHit::default(); CHUNK],
            origin: [NONE; 3],
            direction: [NONE; 3],
            epsilon: NONE,
            distance: NONE,
            time: NONE,
            width: NONE,
            spread: NONE,
            throughput: [NONE; 3],
            density: NONE,
            keys: [0; CHUNK],
            point: [NONE; 3],
            geometric_normal: [NONE; 3],
            shading_normal: [NONE; 3],
            side: NONE,
            light_density: NONE,
            light: LightRows {
                direction: [NONE; 3],
                distance: NONE,
                color: [NONE; 3],
                density: NONE,
            },
            state: new_state(CHUNK),
            kept_scratch: LaneBlock::new(scratch_arrays, CHUNK),
            scratch: LaneBlock::new(scratch_arrays, CHUNK),
            accepted: MaskBlock::new(CHUNK),
            objects: LaneIndices::new(CHUNK),
            materials: LaneIndices::new(CHUNK),
            emitters: LaneIndices::new(CHUNK),
            cut_outs: LaneIndices::new(CHUNK),
            numbers: Numbers::new(sampler),
        })
    }

    /// Takes paths and what they hit. Lanes behind the last repeat it up to a multiple of eight, so that eights are
    /// whole.
    pub fn load(&mut self, paths: &[Path], hits: &[PathHit]) {
        self.count = hits.len().min(CHUNK);
        let Some(last) = hits.last() else { return };
        let padding = std::iter::repeat_n(last, self.count.next_multiple_of(8) - self.count);
        for (lane, hit) in hits.iter().chain(padding).take(CHUNK).enumerate() {
            let path = &paths[hit.path as usize];
            self.hits[lane] = *hit;
            set(&mut self.origin, lane, path.origin);
            set(&mut self.direction, lane, path.direction);
            set(&mut self.throughput, lane, path.throughput);
            self.epsilon[lane] = path.epsilon;
            self.distance[lane] = path.distance;
            self.time[lane] = path.time;
            self.width[lane] = path.width + path.spread * path.distance;
            self.spread[lane] = path.spread;
            self.density[lane] = path.density;
            self.keys[lane] = path.key;
            self.numbers.samples[lane] = path.sample;
        }
    }

    /// What the lanes in use hit.
    pub fn hits(&self) -> &[PathHit] {
        &self.hits[..self.count]
    }

    /// Which objects the lanes hit, and when.
    pub fn whereabouts(&self) -> Whereabouts<'_> {
        (&self.hits, &self.time)
    }
}

/// Sets the numbers by which a kernel knows the objects of lanes. Lanes behind the last get one that is in every table: kernels want
/// all to be.
pub fn set_numbers(indices: &mut LaneIndices, numbers: impl Iterator<Item = u32>) {
    let mut indices = indices.as_mut_slice().iter_mut();
    numbers.zip(&mut indices).for_each(|(number, index)| *index = number);
    indices.for_each(|index| *index = 0);
}

/// Sets a vector of one lane.
#[inline(always)]
pub fn set(rows: &mut Rows, lane: usize, [x, y, z]: [f32; 3]) {
    (rows[0][lane], rows[1][lane], rows[2][lane]) = (x, y, z);
}

/// The vector of one lane.
#[inline(always)]
pub fn get(rows: &Rows, lane: usize) -> [f32; 3] {
    [rows[0][lane], rows[1][lane], rows[2][lane]]
}

/// Whose kernel is called, for messages.
#[derive(Clone, Copy)]
pub struct Callee<'a> {
    /// The class.
    pub class: &'a str,
    /// Its method.
    pub method: Method,
    /// Where problems go.
    pub problems: &'a Problems,
}

impl Callee<'_> {
    /// Calls a kernel for the first `count` lanes.
    pub fn call(
        &self,
        kernel: &Kernel,
        count: usize,
        instances: Instances<'_>,
        (state, scratch): (&mut LaneBlock, &mut LaneBlock),
        accepted: Option<&mut MaskBlock>,
        numbers: &mut Numbers,
    ) {
        let status = kernel.call(CallArguments {
            state,
            scratch,
            count,
            mask: None,
            accepted,
            instances,
            host: numbers,
        });
        if status.budget_exhausted {
            self.problems.report(self.class, self.method);
        }
    }
}
