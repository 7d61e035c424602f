//! Shading batches: the memory of one thread for the surfaces of a batch of paths, as arrays with an element for each
//! lane.

use std::sync::Arc;

use rtsl::{
    LaneBlock, LaneIndices, LightSelector, QueryColumns, RayType, SURFACE_SCALARS, SamplerNumbers,
    new_state,
};

use super::query_block::QueryBlock;
use super::random_numbers::RandomNumbers;
use super::rows::{BATCH_LANES, Row, Rows};
use super::wavefront::{Path, PathHit};
use crate::compiled::variables::variables;

/// A shading batch.
pub struct ShadingBatch {
    /// The number of lanes in use.
    pub count: usize,
    /// The hits of the rays.
    pub hits: [PathHit; BATCH_LANES],
    /// The keys of the paths' random sequences.
    pub keys: [u32; BATCH_LANES],
    /// The sample indices of the paths.
    pub samples: [u32; BATCH_LANES],
    /// -1 where the ray met the surface from behind, else 1.
    pub side: Row,
    /// The light samples.
    pub light: LightRows,
    /// Random numbers that select lights.
    pub light_seeds: Row,
    /// The arrays of calls that select lights.
    pub selection: LaneBlock,
    /// The state of all calls for the surfaces.
    pub state: LaneBlock,
    /// The rays, and the surfaces that they hit. The scratch is that which `intersect` has left at the hits.
    pub surfaces: QueryBlock,
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
    pub fn new(scratch_arrays: usize, numbers: &Arc<SamplerNumbers>) -> Box<Self> {
        const NONE: Row = [0.0; BATCH_LANES];
        Box::new(ShadingBatch {
            count: 0,
            hits: [PathHit::default(); BATCH_LANES],
            keys: [0; BATCH_LANES],
            samples: [0; BATCH_LANES],
            side: NONE,
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
            surfaces: QueryBlock::new(scratch_arrays),
            scratch: LaneBlock::new(scratch_arrays, BATCH_LANES),
            objects: LaneIndices::new(BATCH_LANES),
            materials: LaneIndices::new(BATCH_LANES),
            emitters: LaneIndices::new(BATCH_LANES),
            alpha: LaneIndices::new(BATCH_LANES),
            random: RandomNumbers::new(numbers),
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
            self.surfaces.set_vector(QueryColumns::ORIGIN, lane, path.origin);
            self.surfaces.set_vector(QueryColumns::DIRECTION, lane, path.direction);
            for (column, number) in [
                (QueryColumns::EPSILON, path.epsilon),
                (QueryColumns::DISTANCE, path.distance),
                (QueryColumns::LIMIT, path.limit),
                (QueryColumns::TIME, path.time),
                (QueryColumns::WIDTH, path.width),
                (QueryColumns::SPREAD, path.spread),
            ] {
                self.surfaces.column_mut(column)[lane] = number;
            }
            (self.keys[lane], self.samples[lane]) = (path.key, path.sample);
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
        // The first three operands are the hit.
        let limits = [QueryColumns::DISTANCE, QueryColumns::EPSILON, QueryColumns::LIMIT];
        let ends = QueryColumns::ORIGIN..QueryColumns::DIRECTION + 3;
        let footprint = [QueryColumns::WIDTH, QueryColumns::SPREAD];
        const { assert!(SURFACE_SCALARS == 3 + 11) };
        for (index, column) in (3..).zip(limits.into_iter().chain(ends).chain(footprint)) {
            let numbers = self.surfaces.column_mut(column)[..self.count].iter_mut();
            for (lane, number) in numbers.enumerate() {
                *number = f32::from_bits(operand(index, lane));
            }
        }
        for lane in 0..self.count {
            let RayOfSurface { time, key, sample } = ray(lane);
            self.surfaces.column_mut(QueryColumns::TIME)[lane] = time;
            (self.keys[lane], self.samples[lane]) = (key, sample);
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
        self.random.start(&self.keys, &self.samples, purpose, self.count);
    }
}

/// Computes the probabilities with which lights are selected for points, one for each lane, in these arrays. `light`
/// returns the [way](rtsl::LightSelection::way) to a lane's light, and the point.
pub fn selection_probabilities<'a>(
    arrays: &'a mut LaneBlock,
    selector: &LightSelector,
    count: usize,
    light: impl Fn(usize) -> (u32, [f32; 3]),
) -> &'a [f32] {
    for lane in 0..count {
        let (way, point) = light(lane);
        arrays.words_mut(0)[lane] = way;
        (0..3).for_each(|axis| arrays.floats_mut(1 + axis)[lane] = point[axis]);
    }
    selector.probabilities(arrays, count);
    &arrays.floats(4)[..count]
}

/// Sets the objects of lanes by their indices. After them come valid ones, because kernels read whole vectors.
pub fn set_indices(indices: &mut LaneIndices, values: impl Iterator<Item = u32>) {
    const WIDEST_VECTOR: usize = 16;
    let mut indices = indices.as_mut_slice().iter_mut();
    values.zip(&mut indices).for_each(|(value, index)| *index = value);
    indices.take(WIDEST_VECTOR).for_each(|index| *index = 0);
}
