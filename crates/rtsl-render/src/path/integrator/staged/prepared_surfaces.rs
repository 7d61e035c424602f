//! Properties of surfaces with whose shapes a stage is not linked, for all paths of a call together.

use rtsl::{PreparedOperand, PreparedSurface, SURFACE_SCALARS, StageKernel};
use rtsl_math::sampling::NUMBERS_OF_SHAPES;

use super::super::super::memory::BatchMemory;
use super::super::super::rows::BATCH_LANES;
use super::super::super::shading_batch::ShadingBatch;
use super::super::super::wavefront::PathHit;
use super::super::surface::property_rows;
use super::frames::{CALL_PATHS, Frames};
use super::run::{Place, StagedPaths};
use crate::compiled::variables::variables;

const _: () = assert!(CALL_PATHS <= BATCH_LANES);

/// An operand of paths.
#[derive(Clone, Copy)]
enum Operand<'a> {
    Array(&'a [u32]),
    Constant(u32),
}

impl Operand<'_> {
    fn of(self, path: u32) -> u32 {
        match self {
            Operand::Array(words) => words[path as usize],
            Operand::Constant(bits) => bits,
        }
    }
}

/// A path of a call.
#[derive(Clone, Copy)]
struct Called {
    /// Its lane in the arrays of the call.
    lane: u32,
    path: u32,
    hit: PathHit,
}

impl StagedPaths<'_> {
    /// Stores the properties that a kernel reads of the surfaces of these paths in the arrays of its call.
    pub fn prepare_surfaces(&mut self, kernel: &StageKernel, place: Place<'_>, paths: &[u32]) {
        let Some(surface) = &kernel.prepared else { return };
        let mut called = Vec::with_capacity(paths.len().min(CALL_PATHS));
        for paths in paths.chunks(CALL_PATHS) {
            called.clear();
            self.find_hits_of(surface, place, paths, &mut called);
            let objects = &self.tracer.scene.objects;
            let group = |called: &Called| objects[called.hit.object as usize].group;
            called.sort_by_key(group);
            for called in called.chunk_by(|one, other| group(one) == group(other)) {
                self.load_surfaces(surface, called);
                let group = &self.tracer.groups[group(&called[0]) as usize];
                self.tracer.prepare_surfaces(group, &mut self.queries.batch);
                self.store_properties(surface, place, called);
            }
        }
    }

    /// Returns in `called` the surfaces of paths.
    fn find_hits_of(
        &self,
        surface: &PreparedSurface,
        place: Place<'_>,
        paths: &[u32],
        called: &mut Vec<Called>,
    ) {
        let [object, instance, element] = [0, 1, 2].map(|index| self.operand(surface, index));
        called.extend((0..).zip(paths).map(|(index, path)| {
            let lane = match place {
                Place::All { .. } => *path,
                Place::Copied(_) => index,
            };
            let (object, element, instance) =
                (object.of(*path), element.of(*path), instance.of(*path));
            Called { lane, path: *path, hit: PathHit { path: 0, object, element, instance } }
        }));
    }

    /// Loads surfaces of one group as a batch, with the rays that hit them.
    fn load_surfaces(&mut self, surface: &PreparedSurface, called: &[Called]) {
        let operands: [Operand<'_>; SURFACE_SCALARS] =
            std::array::from_fn(|index| operand_of(self.frames, surface.operands[index]));
        let Frames { paths, .. } = &*self.frames;
        let times = paths.scratch.words(self.staged.columns.time);
        let samples = paths.scratch.words(self.staged.columns.sample);
        let BatchMemory { batch, .. } = &mut *self.queries;
        batch.set_hits(called.iter().map(|called| called.hit));
        let ShadingBatch {
            origin, direction, epsilon, limit, distance, width, spread, time, ..
        } = &mut **batch;
        let [_, _, _, t, least, greatest, ox, oy, oz, dx, dy, dz, w, s] = operands;
        let [x, y, z] = origin;
        let [u, v, n] = direction;
        let rows = [distance, epsilon, limit, x, y, z, u, v, n, width, spread, time];
        let operands = [t, least, greatest, ox, oy, oz, dx, dy, dz, w, s, Operand::Array(times)];
        for (row, operand) in rows.into_iter().zip(operands) {
            for (number, called) in row.iter_mut().zip(called) {
                *number = f32::from_bits(operand.of(called.path));
            }
            // The last vector is complete.
            let (count, last) = (called.len(), row[called.len() - 1]);
            row[count..count.next_multiple_of(8)].fill(last);
        }
        for lane in 0..called.len().next_multiple_of(8) {
            batch.width[lane] += batch.spread[lane] * batch.distance[lane];
            batch.keys[lane] = 0;
            batch.samples[lane] = samples[called[lane.min(called.len() - 1)].path as usize];
        }
        batch.start_random_numbers(NUMBERS_OF_SHAPES);
        let searches = self.frames.paths.scratch.words(self.staged.columns.searches);
        let depths = batch.state.floats_mut(variables().ray_depth);
        for (depth, called) in depths.iter_mut().zip(called) {
            let before = searches[called.path as usize].saturating_sub(1);
            *depth = (self.depth + before) as f32;
        }
    }

    /// Stores what the kernel reads of the properties in a batch.
    fn store_properties(&mut self, surface: &PreparedSurface, place: Place<'_>, called: &[Called]) {
        let Frames { paths, call, .. } = &mut *self.frames;
        let scratch = match place {
            Place::All { .. } => &mut paths.scratch,
            Place::Copied(_) => &mut call.scratch,
        };
        let mut rows = property_rows(&self.queries.batch).enumerate();
        for (property, array) in &surface.properties {
            let Some((_, row)) = rows.find(|(index, _)| index == property) else { return };
            let column = scratch.floats_mut(*array);
            for (called, number) in called.iter().zip(row) {
                column[called.lane as usize] = *number;
            }
        }
    }

    fn operand(&self, surface: &PreparedSurface, index: usize) -> Operand<'_> {
        operand_of(self.frames, surface.operands[index])
    }
}

fn operand_of(frames: &Frames, operand: PreparedOperand) -> Operand<'_> {
    match operand {
        PreparedOperand::Array(array) => Operand::Array(frames.paths.scratch.words(array)),
        PreparedOperand::Constant(bits) => Operand::Constant(bits),
    }
}
