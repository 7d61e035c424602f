//! Shading batches: the memory of one thread for the surfaces of a batch of paths, as arrays with an element for each
//! lane.

use rtsl::{
    LaneBlock, LaneIndices, LightSelector, QueryColumns, RayType, SURFACE_SCALARS, new_state,
};
use rtsl_math::sampling::Sampler;

use super::random_numbers::RandomNumbers;
use super::rows::{BATCH_LANES, Row, Rows, set};
use super::wavefront::{Path, PathHit};
use crate::compiled::variables::variables;

/// A shading batch.
pub struct ShadingBatch {
    /// The number of lanes in use.
    pub count: usize,
    /// The hits of the rays.
    pub hits: [PathHit; BATCH_LANES],
    /// The origins of the rays in world space.
    pub origin: Rows,
    /// The directions of the rays.
    pub direction: Rows,
    /// The least parameters of hits.
    pub epsilon: Row,
    /// The parameters of the hits.
    pub distance: Row,
    /// The greatest parameters of hits.
    pub limit: Row,
    /// The times within the shutter.
    pub time: Row,
    /// The widths of the rays at their origins.
    pub width: Row,
    /// The increase of width per unit of length.
    pub spread: Row,
    /// The keys of the paths' random sequences.
    pub keys: [u32; BATCH_LANES],
    /// The sample indices of the paths.
    pub samples: [u32; BATCH_LANES],
    /// The hit points in world space.
    pub point: Rows,
    /// The offsets of the origins of rays that leave the surfaces.
    pub offset: Row,
    /// The surfaces' normals, of unit length, in world space.
    pub geometric_normal: Rows,
    /// The normals for shading.
    pub shading_normal: Rows,
    /// -1 where the ray met the surface from behind, else 1.
    pub side: Row,
    /// The densities per solid angle with which the hits would have been sampled as lights; 0 if they cannot be.
    pub light_density: Row,
    /// The light samples.
    pub light: LightRows,
    /// Random numbers that select lights.
    pub light_seeds: Row,
    /// The arrays of calls that select lights.
    pub selection: LaneBlock,
    /// The state of all calls for the surfaces.
    pub state: LaneBlock,
    /// The scratch of the shapes' `intersect` for the hits, then the columns of queries.
    pub kept_scratch: LaneBlock,
    /// The first array of the columns of queries there.
    pub first_column: usize,
    /// The materials' scratch.
    pub scratch: LaneBlock,
    /// The indices of the objects that were hit among those of their class.
    pub objects: LaneIndices,
    /// The indices of their materials.
    pub materials: LaneIndices,
    /// The indices of their emitters.
    pub emitters: LaneIndices,
    /// The indices of their alpha textures.
    pub alpha: LaneIndices,
    /// The random numbers.
    pub random: RandomNumbers,
}

/// The data of a surface's path besides the operands of queries.
#[derive(Clone, Copy, Debug)]
pub struct RayOfSurface {
    /// The time within the shutter.
    pub time: f32,
    /// The key of the random sequence for the shape's methods.
    pub key: u32,
    /// The index of the sample.
    pub sample: u32,
}

/// Light samples for the points of a batch.
pub struct LightRows {
    /// Unit vectors towards them, in world space.
    pub direction: Rows,
    /// The distances of the sampled points.
    pub reach: Row,
    /// The lengths of shadow rays.
    pub distance: Row,
    /// Radiance, or the whole contribution of a delta light, divided by the density of the sample, including that of
    /// selecting the light. Black without a sample.
    pub color: Rows,
    /// That density, if a direction of the material could have found the light too; else 0.
    pub density: Row,
}

impl ShadingBatch {
    /// For shaders with at most so many scratch arrays.
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
            keys: [0; BATCH_LANES],
            samples: [0; BATCH_LANES],
            point: [NONE; 3],
            offset: NONE,
            geometric_normal: [NONE; 3],
            shading_normal: [NONE; 3],
            side: NONE,
            light_density: NONE,
            light: LightRows {
                direction: [NONE; 3],
                reach: NONE,
                distance: NONE,
                color: [NONE; 3],
                density: NONE,
            },
            light_seeds: NONE,
            selection: LaneBlock::new(LightSelector::ARRAYS, BATCH_LANES),
            state: new_state(BATCH_LANES),
            kept_scratch: LaneBlock::new(scratch_arrays + QueryColumns::COUNT, BATCH_LANES),
            first_column: scratch_arrays,
            scratch: LaneBlock::new(scratch_arrays, BATCH_LANES),
            objects: LaneIndices::new(BATCH_LANES),
            materials: LaneIndices::new(BATCH_LANES),
            emitters: LaneIndices::new(BATCH_LANES),
            alpha: LaneIndices::new(BATCH_LANES),
            random: RandomNumbers::new(sampler),
        })
    }

    /// Sets what methods of materials know of the rays: for each lane the depth of the integrator's own ray, and the number
    /// of surfaces that its path has met since.
    pub fn set_depths(&mut self, places: impl Iterator<Item = (u32, u32)>) {
        let v = variables();
        for (lane, (depth, before)) in places.enumerate() {
            self.state.floats_mut(v.ray_depth)[lane] = (depth + before) as f32;
            self.state.floats_mut(v.ray_type)[lane] = RayType::of(depth, before).value();
        }
    }

    /// Loads paths and their hits, with the random numbers that `purpose` selects.
    pub fn load(&mut self, paths: &[Path], hits: &[PathHit], purpose: u32) {
        self.set_hits(hits.iter().copied());
        for lane in 0..self.count {
            let path = &paths[self.hits[lane].path as usize];
            let Path { epsilon, distance, limit, time, width, spread, key, sample, .. } = *path;
            set(&mut self.origin, lane, path.origin);
            set(&mut self.direction, lane, path.direction);
            (self.epsilon[lane], self.distance[lane]) = (epsilon, distance);
            (self.limit[lane], self.time[lane]) = (limit, time);
            (self.width[lane], self.spread[lane]) = (width, spread);
            (self.keys[lane], self.samples[lane]) = (key, sample);
        }
        self.start_random_numbers(purpose);
    }

    /// Loads surfaces by the operands of queries about them: `operand` returns the operand at an index for a lane, and
    /// `ray` what the path of a lane has besides.
    pub fn load_operands(
        &mut self,
        hits: impl Iterator<Item = PathHit>,
        operand: impl Fn(usize, usize) -> u32,
        ray: impl Fn(usize) -> RayOfSurface,
        purpose: u32,
    ) {
        self.set_hits(hits);
        let count = self.count;
        let ShadingBatch { origin, direction, epsilon, limit, distance, width, spread, .. } = self;
        let [x, y, z] = origin;
        let [u, v, n] = direction;
        // The first three operands are the hit.
        let rows = [distance, epsilon, limit, x, y, z, u, v, n, width, spread];
        const { assert!(SURFACE_SCALARS == 3 + 11) };
        for (index, row) in (3..).zip(rows) {
            for (lane, number) in row[..count].iter_mut().enumerate() {
                *number = f32::from_bits(operand(index, lane));
            }
        }
        for lane in 0..count {
            let RayOfSurface { time, key, sample } = ray(lane);
            (self.time[lane], self.keys[lane], self.samples[lane]) = (time, key, sample);
        }
        self.start_random_numbers(purpose);
    }

    /// Sets the hits.
    pub fn set_hits(&mut self, hits: impl Iterator<Item = PathHit>) {
        self.count = 0;
        for (to, hit) in self.hits.iter_mut().zip(hits) {
            *to = hit;
            self.count += 1;
        }
    }

    /// Restarts the lanes' random numbers with those that `purpose` selects.
    pub fn start_random_numbers(&mut self, purpose: u32) {
        self.random.start((&self.keys, &self.samples), purpose, self.count);
    }

    /// Computes the probabilities with which lights are selected for points, one for each lane. `light` returns the
    /// [way](rtsl::LightSelection::way) to a lane's light, and the point.
    pub fn selection_probabilities(
        &mut self,
        selector: &LightSelector,
        count: usize,
        light: impl Fn(usize) -> (u32, [f32; 3]),
    ) -> &[f32] {
        let arrays = &mut self.selection;
        for lane in 0..count {
            let (way, point) = light(lane);
            arrays.words_mut(0)[lane] = way;
            (0..3).for_each(|axis| arrays.floats_mut(1 + axis)[lane] = point[axis]);
        }
        selector.probabilities(arrays, count);
        &arrays.floats(4)[..count]
    }

    /// Returns the numbers of the lanes in use in a [column](QueryColumns) of a query.
    pub fn column(&self, column: usize) -> &[f32] {
        &self.kept_scratch.floats(self.first_column + column)[..self.count]
    }
}

/// Sets the objects of lanes by their indices. After them come valid ones, because kernels read whole vectors.
pub fn set_indices(indices: &mut LaneIndices, values: impl Iterator<Item = u32>) {
    const WIDEST_VECTOR: usize = 16;
    let mut indices = indices.as_mut_slice().iter_mut();
    values.zip(&mut indices).for_each(|(value, index)| *index = value);
    indices.take(WIDEST_VECTOR).for_each(|index| *index = 0);
}
