//! The memory of one thread for the surfaces of a chunk of paths: arrays with a number for each lane.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use rtsl::host::Host;
use rtsl::{
    CallArguments, Instances, Kernel, LaneBlock, LaneIndices, LaneMask as MaskBlock, Method,
    new_state,
};
use rtsl_bvh::lanes_of;
use rtsl_math::sampling::Sampler;

use super::instance_transforms::SurfacePoints;
use super::numbers::Numbers;
use super::wavefront::{Path, PathHit};
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::lanes::eight::eights_of;
use crate::lanes::fours::fours;

/// Lanes of a chunk: the more, the fewer calls; the fewer, the more of it stays in caches. An odd number of vectors of sixteen:
/// arrays a power of two apart fall into the same places of a cache. A thousand spheres took 8 % less time with 240 than
/// with 256.
pub const BATCH_LANES: usize = 272;

/// A number for each lane.
pub type Row = [f32; BATCH_LANES];

/// A vector or colour for each lane, component by component.
pub type Rows = [Row; 3];

/// The memory.
pub struct ShadingBatch {
    /// How many lanes are in use.
    pub count: usize,
    /// What the rays hit.
    pub hits: [PathHit; BATCH_LANES],
    /// Where the rays begin, in world space.
    pub origin: Rows,
    /// Where they go.
    pub direction: Rows,
    /// The least parameters of hits.
    pub epsilon: Row,
    /// The parameters of the hits.
    pub distance: Row,
    /// The greatest parameters that hits of the rays could have.
    limit: Row,
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
    pub keys: [u32; BATCH_LANES],
    /// Which samples of their pixels they are.
    pub samples: [u32; BATCH_LANES],
    /// The points that were hit, in world space.
    pub point: Rows,
    /// How far off them rays begin that leave the surfaces.
    pub offset: Row,
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
    /// Where the paths go on.
    pub onward: OnwardRows,
    /// Numbers in [0,1) that choose lobes of materials.
    pub lobe_seeds: Row,
    /// Those that choose lights.
    pub light_seeds: Row,
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
    pub alpha: LaneIndices,
    /// Random numbers.
    pub numbers: Numbers,
}

/// The rays of a chunk, and where what they hit stands.
pub struct ChunkRays<'a> {
    /// Where they begin, in world space.
    pub origin: &'a Rows,
    /// Where they go.
    pub direction: &'a Rows,
    /// The least parameters of hits.
    pub epsilon: &'a Row,
    /// The parameters of the hits.
    pub distance: &'a Row,
    /// The greatest parameters that hits could have.
    pub limit: &'a Row,
    /// The times within the shutter.
    pub time: &'a Row,
    /// What they hit, and when.
    pub whereabouts: SurfacePoints<'a>,
}

/// What calls for the shapes of a chunk need.
pub struct ChunkCall<'a> {
    /// State and scratch.
    pub blocks: (&'a mut LaneBlock, &'a mut LaneBlock),
    /// Where `intersect` says which lanes it accepted a hit for.
    pub accepted: &'a mut MaskBlock,
    /// The numbers of the objects that were hit.
    pub objects: &'a LaneIndices,
}

/// Samples of lights for the points of a chunk.
pub struct LightRows {
    /// The lanes to which light is scattered, if nothing is in its way.
    pub lanes: ChunkLanes,
    /// Unit vectors towards them, in world space.
    pub direction: Rows,
    /// Where rays towards them begin: off the surfaces.
    pub origin: Rows,
    /// Where those rays end, if nothing lies between.
    pub distance: Row,
    /// Radiance, or the whole contribution of a delta light, divided by the density of the sample, that of choosing the light
    /// included. Black where there is no sample. In the end what the surfaces scatter of it along the paths.
    pub color: Rows,
    /// That density, where a direction of the material could have found the light too; else 0.
    pub density: Row,
}

/// Where a chunk's paths go.
pub struct OnwardRows {
    /// Which of them go on.
    pub lanes: ChunkLanes,
    /// Which of them would bring back what is not finite.
    pub lost: ChunkLanes,
    /// The directions.
    pub direction: Rows,
    /// Where their rays begin: off the surfaces.
    pub origin: Rows,
    /// What radiance along the rays is multiplied with.
    pub throughput: Rows,
    /// The densities of the directions; 0 for deltas.
    pub density: Row,
    /// How much wider the rays become after a unit of length.
    pub spread: Row,
    /// Which sequences of numbers the paths have from there on.
    pub keys: [u32; BATCH_LANES],
}

/// Some of the lanes of a chunk: bits, eight by eight.
pub struct ChunkLanes([u8; BATCH_LANES / 8]);

impl ChunkLanes {
    /// None.
    pub const NONE: ChunkLanes = ChunkLanes([0; BATCH_LANES / 8]);

    /// Says which of the eight lanes from `start` on are among them.
    #[inline(always)]
    pub fn set_eight(&mut self, start: usize, bits: u8) {
        self.0[start / 8] = bits;
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|bits| *bits == 0)
    }

    /// Those of the first `count` lanes.
    #[inline(always)]
    pub fn among(&self, count: usize) -> impl Iterator<Item = usize> {
        let eights = self.0.iter().zip((0..count).step_by(8));
        eights.flat_map(move |(bits, start)| {
            let in_use = 0xFF_u8 >> 8_usize.saturating_sub(count - start);
            lanes_of(u64::from(*bits & in_use)).map(move |lane| start + lane)
        })
    }
}

impl ShadingBatch {
    /// For shaders with at most so many arrays of scratch.
    pub fn new(scratch_arrays: usize, sampler: Sampler) -> Box<Self> {
        const NONE: Row = [0.0; BATCH_LANES];
        Box::new(ShadingBatch {
            count: 0,
            hits: [PathHit::default(); BATCH_LANES],
            origin: [NONE; 3],
            direction: [NONE; 3],
            epsilon: NONE,
            distance: NONE,
            limit: NONE,
            time: NONE,
            width: NONE,
            spread: NONE,
            throughput: [NONE; 3],
            density: NONE,
            keys: [0; BATCH_LANES],
            samples: [0; BATCH_LANES],
            point: [NONE; 3],
            offset: NONE,
            geometric_normal: [NONE; 3],
            shading_normal: [NONE; 3],
            side: NONE,
            light_density: NONE,
            light: LightRows {
                lanes: ChunkLanes::NONE,
                direction: [NONE; 3],
                origin: [NONE; 3],
                distance: NONE,
                color: [NONE; 3],
                density: NONE,
            },
            onward: OnwardRows {
                lanes: ChunkLanes::NONE,
                lost: ChunkLanes::NONE,
                direction: [NONE; 3],
                origin: [NONE; 3],
                throughput: [NONE; 3],
                density: NONE,
                spread: NONE,
                keys: [0; BATCH_LANES],
            },
            lobe_seeds: NONE,
            light_seeds: NONE,
            state: new_state(BATCH_LANES),
            kept_scratch: LaneBlock::new(scratch_arrays, BATCH_LANES),
            scratch: LaneBlock::new(scratch_arrays, BATCH_LANES),
            accepted: MaskBlock::new(BATCH_LANES),
            objects: LaneIndices::new(BATCH_LANES),
            materials: LaneIndices::new(BATCH_LANES),
            emitters: LaneIndices::new(BATCH_LANES),
            alpha: LaneIndices::new(BATCH_LANES),
            numbers: Numbers::new(sampler),
        })
    }

    /// Takes paths and what they hit, with the numbers that `purpose` chooses. Lanes behind the last repeat it up to a
    /// multiple of eight, so that eights are whole.
    pub fn load(&mut self, paths: &[Path], hits: &[PathHit], purpose: u32) {
        self.count = hits.len().min(BATCH_LANES);
        if let Some(last) = hits.last() {
            self.hits[..self.count].copy_from_slice(&hits[..self.count]);
            self.hits[self.count..self.count.next_multiple_of(8)].fill(*last);
            dispatch!(Level::new(), simd => self.load_in_vectors(simd, paths));
        }
        self.start_numbers(purpose);
    }

    /// Gives the lanes other numbers: those that `purpose` chooses.
    pub fn start_numbers(&mut self, purpose: u32) {
        self.numbers.start((&self.keys, &self.samples), purpose, self.count);
    }

    #[inline(always)]
    fn load_in_vectors<S: Simd>(&mut self, simd: S, paths: &[Path]) {
        for eight in eights_of(simd, self.count) {
            let start = eight.start();
            let paths: [&Path; 8] =
                std::array::from_fn(|lane| &paths[self.hits[start + lane].path as usize]);
            let [x, y, z, epsilon] =
                fours(simd, |lane| with(paths[lane].origin, paths[lane].epsilon));
            eight.blend_vectors(&[x, y, z], &mut self.origin);
            eight.blend(epsilon, &mut self.epsilon);
            let [x, y, z, distance] =
                fours(simd, |lane| with(paths[lane].direction, paths[lane].distance));
            eight.blend_vectors(&[x, y, z], &mut self.direction);
            eight.blend(distance, &mut self.distance);
            let [red, green, blue, density] =
                fours(simd, |lane| with(paths[lane].throughput, paths[lane].density));
            eight.blend_vectors(&[red, green, blue], &mut self.throughput);
            eight.blend(density, &mut self.density);
            let [time, width, spread, keys] = fours(simd, |lane| {
                let Path { time, width, spread, key, .. } = *paths[lane];
                [time, width, spread, f32::from_bits(key)]
            });
            eight.blend(time, &mut self.time);
            eight.blend(width + spread * distance, &mut self.width);
            eight.blend(spread, &mut self.spread);
            let keys = keys.to_array();
            for lane in 0..8 {
                self.keys[start + lane] = keys[lane].to_bits();
                self.samples[start + lane] = paths[lane].sample;
                self.limit[start + lane] = paths[lane].limit;
            }
        }
    }

    /// What the lanes in use hit.
    pub fn hits(&self) -> &[PathHit] {
        &self.hits[..self.count]
    }

    /// The rays, and what calls for what they hit need.
    pub fn rays_and_call(&mut self) -> (ChunkRays<'_>, ChunkCall<'_>) {
        let ShadingBatch { hits, origin, direction, epsilon, distance, limit, time, .. } = self;
        let whereabouts = (&*hits, &*time);
        let rays = ChunkRays { origin, direction, epsilon, distance, limit, time, whereabouts };
        let ShadingBatch { state, kept_scratch, accepted, objects, .. } = self;
        (rays, ChunkCall { blocks: (state, kept_scratch), accepted, objects })
    }

    /// Which objects the lanes hit, and when.
    pub fn whereabouts(&self) -> SurfacePoints<'_> {
        (&self.hits, &self.time)
    }
}

/// Sets the numbers by which a kernel knows the objects of lanes. Lanes behind the last that are in one vector with it get
/// one that is in every table.
pub fn set_numbers(indices: &mut LaneIndices, numbers: impl Iterator<Item = u32>) {
    const WIDEST_VECTOR: usize = 16;
    let mut indices = indices.as_mut_slice().iter_mut();
    numbers.zip(&mut indices).for_each(|(number, index)| *index = number);
    indices.take(WIDEST_VECTOR).for_each(|index| *index = 0);
}

#[inline(always)]
fn with([x, y, z]: [f32; 3], last: f32) -> [f32; 4] {
    [x, y, z, last]
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

/// Whether all components of a vector are finite.
#[inline(always)]
pub fn are_finite(vector: &[f32; 3]) -> bool {
    vector.iter().all(|component| component.is_finite())
}

/// Whose kernel is called, for messages.
#[derive(Clone, Copy)]
pub struct Callee<'a> {
    /// The class.
    pub class: &'a str,
    /// Its method.
    pub method: Method,
    /// Where problems go.
    pub problems: &'a RuntimeErrors,
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
        host: &mut dyn Host,
    ) {
        let status = kernel.call(CallArguments {
            state,
            scratch,
            count,
            mask: None,
            accepted,
            instances,
            host,
        });
        if status.budget_exhausted {
            self.problems.report(self.class, self.method);
        }
    }
}
