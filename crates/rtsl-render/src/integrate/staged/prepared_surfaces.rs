//! Properties of surfaces with whose shapes a stage is not linked, for all paths of a call together.

use rtsl::{PreparedOperand, PreparedSurface, QueryColumns, SURFACE_SCALARS, StageKernel};
use rtsl_math::sampling::NUMBERS_OF_SHAPES;

use super::frames::Frames;
use super::path_set::PathSet;
use super::requests::Requested;
use super::run::StagedPaths;
use crate::integrate::memory::ThreadMemory;
use crate::integrate::path_tracer::PathTracer;
use crate::integrate::rows::BATCH_LANES;
use crate::integrate::shading_batch::RayOfSurface;
use crate::integrate::surface::property_rows;
use crate::integrate::wavefront::PathHit;

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

impl StagedPaths<'_> {
    /// Stores the properties that a kernel reads of the surfaces of these paths.
    pub fn prepare_surfaces(&mut self, kernel: &StageKernel, paths: &PathSet) {
        let Some(surface) = &kernel.prepared else { return };
        let mut called = Vec::with_capacity(paths.len().min(BATCH_LANES));
        for paths in paths.paths().chunks(BATCH_LANES) {
            called.clear();
            self.find_hits_of(surface, paths, &mut called);
            if self.staged.is_of_material() {
                self.clear_missing(surface, &mut called);
            }
            let PathTracer { scene, errors, groups, .. } = self.tracer;
            let group = |hit: &PathHit| scene.objects[hit.object as usize].group;
            called.sort_by_key(group);
            for called in called.chunk_by(|one, other| group(one) == group(other)) {
                self.load_surfaces(surface, called);
                if self.staged.is_of_material() {
                    self.leave_shaded_surfaces(called);
                }
                let group = &groups[group(&called[0]) as usize];
                group.prepare_surfaces(scene, errors, &mut self.queries.batch);
                self.store_properties(surface, called);
            }
        }
    }

    /// Returns in `called` the surfaces of paths.
    fn find_hits_of(&self, surface: &PreparedSurface, paths: &[u32], called: &mut Vec<PathHit>) {
        let [object, instance, element] = [0, 1, 2].map(|index| self.operand(surface, index));
        called.extend(paths.iter().map(|path| {
            let (object, element, instance) =
                (object.of(*path), element.of(*path), instance.of(*path));
            PathHit { path: *path, object, element, instance }
        }));
    }

    /// Removes paths that have found no surface, and stores zeros as its properties.
    fn clear_missing(&mut self, surface: &PreparedSurface, called: &mut Vec<PathHit>) {
        let scene = self.tracer.scene;
        let scratch = &mut self.frames.paths.scratch;
        called.retain(|hit| {
            let is_found = scene.hit_of(hit.object, hit.instance, hit.element).is_some();
            if !is_found {
                let arrays = surface.properties.iter().map(|(_, array)| *array);
                arrays.for_each(|array| scratch.words_mut(array)[hit.path as usize] = 0);
            }
            is_found
        });
    }

    /// Moves the origins of the rays of a batch off the surfaces that materials shade, as those of their searches.
    fn leave_shaded_surfaces(&mut self, called: &[PathHit]) {
        let requested = Requested::of(&self.frames.paths.scratch, self.staged);
        let ThreadMemory { batch, shading_calls, .. } = &mut *self.queries;
        let surfaces = &mut batch.surfaces;
        for (lane, called) in called.iter().enumerate() {
            let origin = surfaces.vector(QueryColumns::ORIGIN, lane);
            let direction = surfaces.vector(QueryColumns::DIRECTION, lane);
            let shaded = requested.shaded(called.path);
            let left = shading_calls.leave(shaded.as_ref(), origin, direction);
            surfaces.set_vector(QueryColumns::ORIGIN, lane, left);
        }
    }

    /// Loads surfaces of one group as a batch, with the rays that hit them.
    fn load_surfaces(&mut self, surface: &PreparedSurface, called: &[PathHit]) {
        let operands: [Operand<'_>; SURFACE_SCALARS] =
            std::array::from_fn(|index| operand_of(self.frames, surface.operands[index]));
        let Frames { paths, .. } = &*self.frames;
        let times = paths.scratch.floats(self.staged.columns.time);
        let samples = paths.scratch.words(self.staged.columns.sample);
        let path = |lane: usize| called[lane].path;
        let ThreadMemory { batch, .. } = &mut *self.queries;
        batch.load_operands(
            called.iter().copied(),
            |index, lane| operands[index].of(path(lane)),
            |lane| {
                let path = path(lane) as usize;
                RayOfSurface { time: times[path], key: 0, sample: samples[path] }
            },
            NUMBERS_OF_SHAPES,
        );
        let searches = paths.scratch.words(self.staged.columns.searches);
        let before = called.iter().map(|it| searches[it.path as usize].saturating_sub(1));
        batch.set_depths(before.map(|before| (self.depth, before)));
    }

    /// Stores what the kernel reads of the properties in a batch.
    fn store_properties(&mut self, surface: &PreparedSurface, called: &[PathHit]) {
        let scratch = &mut self.frames.paths.scratch;
        let mut rows = property_rows(&self.queries.batch).enumerate();
        for (property, array) in &surface.properties {
            let Some((_, row)) = rows.find(|(index, _)| index == property) else { return };
            let column = scratch.floats_mut(*array);
            for (called, number) in called.iter().zip(row) {
                column[called.path as usize] = *number;
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
