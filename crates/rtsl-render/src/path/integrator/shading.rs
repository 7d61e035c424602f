//! Calls of `shade` for surfaces, and of what shades surfaces of materials without it.
//!
//! The method of a material that traces is a function of its own for each surface, with its own random numbers: it is
//! split like an integrator, or runs on the interpreter. Its rays are integrated one level deeper.

use std::ops::Range;

use rtsl::host::{LaneSet, LaneWords};
use rtsl::{Instances, Kernel, LaneBlock, LaneIndices, SURFACE_SCALARS, new_state};
use rtsl_math::sampling::NUMBERS_OF_SHAPES;

use super::super::path_tracer::PathTracer;
use super::super::rows::{BATCH_LANES, are_finite};
use super::super::scene::BatchScene;
use super::super::shading_batch::{ShadingBatch, set_indices};
use super::super::shading_methods::{ShadingCode, ShadingMethod};
use super::super::wavefront::{Path, PathHit};
use super::host::{Further, RayOfCall, SceneHost, store};
use super::numbers::Purpose;
use super::shaded_surface::ShadedSurface;
use super::staged::{Blocks, PathSet, StagedMethod};
use super::tracing::IntegratorMemory;
use crate::compiled::calls::Callee;
use crate::compiled::variables::vector;
use crate::statistics::RayCounts;

/// A surface to be shaded.
#[derive(Clone, Copy, Debug)]
pub struct Shading {
    /// The surface.
    hit: PathHit,
    /// The ray that found it, with the random sequence of the call.
    path: Path,
    /// The number of surfaces that the path has met before.
    depth: u32,
    /// The depth of the ray of the integrator that shades it, and the number of surfaces found before.
    place: (u32, u32),
    /// The radiance towards the ray's origin.
    pub color: [f32; 3],
}

impl Shading {
    /// Returns what a query with these operands asks for, of a ray of this depth; `None` if the scene has no such
    /// surface.
    pub fn new(
        scene: &BatchScene,
        operands: &[u32; SURFACE_SCALARS],
        ray: &mut RayOfCall,
        depth: u32,
    ) -> Option<Shading> {
        let number = |index: usize| f32::from_bits(operands[index]);
        let key = ray.numbers.begin(Purpose::Shade);
        let hit = scene.hit_of(operands[0], operands[1], operands[2])?;
        let path = Path {
            distance: number(3),
            epsilon: number(4),
            limit: number(5),
            origin: [6, 7, 8].map(number),
            direction: [9, 10, 11].map(number),
            width: number(12),
            spread: number(13),
            time: ray.time,
            key,
            sample: ray.numbers.sample,
            importance: ray.importance,
            ..Path::NOWHERE
        };
        let place = (depth, ray.surfaces_before());
        Some(Shading { hit, path, depth: place.0 + place.1, place, color: [0.0; 3] })
    }
}

impl SceneHost<'_> {
    /// Answers queries for the light of shaded surfaces.
    pub fn shade(&mut self, lanes: LaneSet, operands: &[LaneWords], results: &mut [LaneWords]) {
        let mut shadings = Vec::new();
        let mut places = Vec::new();
        for lane in lanes.iter() {
            let ray = self.ray_of(lanes, lane);
            let words = std::array::from_fn(|index| operands[index][lane]);
            let ray = &mut self.rays[ray];
            let shading = Shading::new(self.tracer.scene, &words, ray, self.depth);
            places.extend(shading.is_some().then_some(lane));
            shadings.extend(shading);
        }
        let further = Further { tracer: &self.tracer, free: self.free };
        self.queries.rays += further.shade(&mut shadings);
        for (lane, shading) in places.into_iter().zip(shadings) {
            store(results, lane, &shading.color);
        }
    }
}

impl Further<'_> {
    /// Shades surfaces, and returns the number of rays traced.
    pub fn shade(&self, shadings: &mut [Shading]) -> RayCounts {
        let scene = self.tracer.scene;
        let group = |shading: &Shading| scene.objects[shading.hit.object as usize].group;
        let method = |shading: &Shading| scene.shading_methods.of_group(group(shading));
        let kind = |index: usize| {
            let shading = &shadings[index];
            (method(shading), shading.depth, group(shading), index)
        };
        let mut order: Vec<_> = (0..shadings.len()).map(kind).collect();
        order.sort_unstable();
        let mut counts = RayCounts::default();
        for call in order.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
            let chosen: Vec<Shading> = call.iter().map(|it| shadings[it.3]).collect();
            let Some(method) = call[0].0 else { continue };
            let mut colors = vec![[0.0; 3]; chosen.len()];
            counts += self.call(scene.shading_methods.method(method), &chosen, &mut colors);
            call.iter().zip(colors).for_each(|(it, color)| shadings[it.3].color = color);
        }
        counts
    }

    /// Calls one method for surfaces that are sorted by group, at one depth.
    fn call(
        &self,
        method: &ShadingMethod,
        shadings: &[Shading],
        colors: &mut [[f32; 3]],
    ) -> RayCounts {
        let taken = self.free.borrow_mut().pop();
        let mut memory = taken.unwrap_or_else(|| IntegratorMemory::new(self.tracer.scene));
        let call = ShadingCall { further: self, method, shadings };
        match &method.code {
            ShadingCode::Staged(staged) => call.run_stages(staged, &mut memory, colors),
            ShadingCode::Interpreted(kernel) => call.interpret(kernel, &mut memory, colors),
        }
        let counts = memory.take_ray_counts();
        self.free.borrow_mut().push(memory);
        counts
    }
}

/// A call of a method for surfaces of one depth, which are sorted by group.
struct ShadingCall<'a> {
    further: &'a Further<'a>,
    method: &'a ShadingMethod,
    shadings: &'a [Shading],
}

impl ShadingCall<'_> {
    fn tracer(&self) -> &PathTracer<'_> {
        self.further.tracer
    }

    /// Runs the method's stages.
    fn run_stages(
        &self,
        staged: &StagedMethod,
        memory: &mut IntegratorMemory,
        colors: &mut [[f32; 3]],
    ) {
        let (tracer, count) = (self.tracer(), self.shadings.len());
        let place = (count, self.shadings[0].depth);
        let Some(mut run) = tracer.begin_stages((staged, tracer.errors), memory, place) else {
            return;
        };
        let Blocks { state, scratch } = &mut run.frames.paths;
        self.arrays().for_each(|array| scratch.words_mut(array)[..count].fill(0));
        let color = self.method.color();
        (color..color + 3).for_each(|component| state.words_mut(component)[..count].fill(0));
        for surfaces in self.batches() {
            let batch = &mut *run.queries.batch;
            self.prepare(&surfaces, batch);
            let copy = |from: &[u32], to: &mut [u32]| {
                to[surfaces.clone()].copy_from_slice(&from[..surfaces.len()]);
            };
            for component in staged.first_reads() {
                copy(batch.state.words(*component), state.words_mut(*component));
            }
            if self.method.shares_scratch() {
                let kept = &batch.kept_scratch;
                self.arrays().for_each(|it| copy(kept.words(it), scratch.words_mut(it)));
            }
            run.wave.rays.extend(self.rays(&surfaces, batch));
        }
        run.wave.objects.extend(self.objects(0..count));
        let all = PathSet::all(count);
        run.run(&all);
        run.wave.radiance((&run.frames.paths.state, color), all.paths(), colors);
        for (ray, color) in run.wave.rays.iter().zip(&*colors) {
            self.report_lost(ray, *color);
        }
    }

    /// Runs the whole method on the interpreter.
    fn interpret(&self, kernel: &Kernel, memory: &mut IntegratorMemory, colors: &mut [[f32; 3]]) {
        let mut scratch = LaneBlock::new(self.arrays().len(), BATCH_LANES);
        let mut objects = LaneIndices::new(BATCH_LANES);
        for surfaces in self.batches() {
            let batch = &mut *memory.queries.batch;
            self.prepare(&surfaces, batch);
            for array in self.arrays() {
                let to = scratch.words_mut(array);
                match self.method.shares_scratch() {
                    true => to.copy_from_slice(batch.kept_scratch.words(array)),
                    false => to.fill(0),
                }
            }
            let mut rays: Vec<RayOfCall> = self.rays(&surfaces, batch).collect();
            // Queries of the method use the batch again.
            let mut state = std::mem::replace(&mut batch.state, new_state(BATCH_LANES));
            set_indices(&mut objects, self.objects(surfaces.clone()));
            let IntegratorMemory { queries, free, .. } = &mut *memory;
            let host = &mut SceneHost {
                tracer: *self.tracer(),
                rays: &mut rays,
                slots: None,
                queries,
                free,
                depth: self.shadings[0].depth,
                notes_suspects: false,
            };
            let instances = Instances::Many(&self.method.objects, &objects);
            let (count, blocks) = (surfaces.len(), (&mut state, &mut scratch));
            self.callee().call_for_first(kernel, count, instances, blocks, None, host);
            for (lane, color) in colors[surfaces].iter_mut().enumerate() {
                *color = vector(&state, self.method.color(), lane);
                self.report_lost(&rays[lane], *color);
            }
        }
    }

    /// Returns the surfaces that are prepared together, of one group each.
    fn batches(&self) -> Vec<Range<usize>> {
        let mut batches = Vec::new();
        let mut start = 0;
        let same = |one: &Shading, other: &Shading| self.group(one) == self.group(other);
        for group in self.shadings.chunk_by(same) {
            for batch in group.chunks(BATCH_LANES) {
                batches.push(start..start + batch.len());
                start += batch.len();
            }
        }
        batches
    }

    /// Computes the properties of surfaces, as inputs of the method.
    fn prepare(&self, surfaces: &Range<usize>, batch: &mut ShadingBatch) {
        let shadings = &self.shadings[surfaces.clone()];
        let paths: Vec<Path> = shadings.iter().map(|shading| shading.path).collect();
        let hits = (0..).zip(shadings).map(|(path, shading)| PathHit { path, ..shading.hit });
        batch.load(&paths, &hits.collect::<Vec<_>>(), NUMBERS_OF_SHAPES);
        let Some(group) = self.tracer().groups.get(self.group(&shadings[0]) as usize) else {
            return;
        };
        self.tracer().prepare_surfaces(group, batch);
        batch.set_depths(shadings.iter().map(|shading| shading.place));
    }

    /// Returns what a host knows of the calls for the surfaces of a prepared batch.
    fn rays(
        &self,
        surfaces: &Range<usize>,
        batch: &ShadingBatch,
    ) -> impl Iterator<Item = RayOfCall> {
        let shadings = self.shadings[surfaces.clone()].iter().enumerate();
        shadings.map(|(lane, shading)| {
            let mut ray = RayOfCall::of_path(&shading.path);
            ray.surface = Some(ShadedSurface::of_lane(batch, lane));
            ray
        })
    }

    /// Returns the index of the object that shades each surface.
    fn objects(&self, surfaces: Range<usize>) -> impl Iterator<Item = u32> {
        let scene = self.tracer().scene;
        self.shadings[surfaces].iter().map(|it| self.method.object_of(scene, &it.hit))
    }

    /// The scratch arrays of the class.
    fn arrays(&self) -> Range<usize> {
        0..self.method.program.layout().scratch_arrays as usize
    }

    fn group(&self, shading: &Shading) -> u32 {
        self.tracer().scene.objects[shading.hit.object as usize].group
    }

    fn callee(&self) -> Callee<'_> {
        let (program, method) = (&self.method.program, self.method.method);
        Callee { class: &program.class().name, method, errors: self.tracer().errors }
    }

    /// Reports the method if its colour is not finite, though all light that it received is.
    fn report_lost(&self, ray: &RayOfCall, color: [f32; 3]) {
        if self.tracer().finds_causes && !ray.is_spoilt && !are_finite(&color) {
            self.callee().report_not_finite(1);
        }
    }
}
