//! Light samples, one for each lane of a batch, by kernels for each class of lights.

use std::sync::Arc;

use rtsl::{LaneBlock, LaneIndices, Method, QueryColumns, SamplerNumbers, new_state};
use rtsl_math::sampling::NUMBERS_OF_LIGHTS;

use super::lit_lanes::LitLanes;
use super::{LightClass, LightEntry, ShapeLightClass};
use crate::compiled::calls::Callee;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::kernels::Batching;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::integrate::query_block::QueryBlock;
use crate::integrate::random_numbers::RandomNumbers;
use crate::integrate::rows::{BATCH_LANES, Row};
use crate::integrate::shading_batch::{LightRows, ShadingBatch, set_indices};
use crate::integrate::wavefront::PathHit;
use crate::surfaces::{Places, SurfaceCall, SurfaceKernels};

/// The memory of one thread for light samples: the lanes whose points are lit by lights of one class.
pub struct LightMemory {
    /// For each lane of the batch the selected light, and its probability.
    chosen: [u32; BATCH_LANES],
    probability: Row,
    /// The lanes of the batch for which this class is sampled.
    lanes: LitLanes,
    /// The objects that are sampled.
    hits: [PathHit; BATCH_LANES],
    keys: [u32; BATCH_LANES],
    samples: [u32; BATCH_LANES],
    state: LaneBlock,
    /// The lit points, and the samples.
    block: QueryBlock,
    objects: LaneIndices,
    emitters: LaneIndices,
    alpha: LaneIndices,
    random: RandomNumbers,
}

/// The treatment of the densities of light that rays find as well.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Weights {
    /// Colours are divided by them.
    Divided,
    /// Colours are radiances.
    Left,
}

impl LightMemory {
    /// For shaders with at most so many scratch arrays.
    pub fn new(scratch_arrays: usize, numbers: &Arc<SamplerNumbers>) -> Box<Self> {
        Box::new(LightMemory {
            chosen: [0; BATCH_LANES],
            probability: [0.0; BATCH_LANES],
            lanes: LitLanes::default(),
            hits: [PathHit::default(); BATCH_LANES],
            keys: [0; BATCH_LANES],
            samples: [0; BATCH_LANES],
            state: new_state(BATCH_LANES),
            block: QueryBlock::new(scratch_arrays),
            objects: LaneIndices::new(BATCH_LANES),
            emitters: LaneIndices::new(BATCH_LANES),
            alpha: LaneIndices::new(BATCH_LANES),
            random: RandomNumbers::new(numbers),
        })
    }

    /// Returns the light selected for a lane of the batch.
    pub fn chosen(&self, lane: usize) -> u32 {
        self.chosen[lane]
    }

    /// Samples a light for each lane of a batch.
    pub fn sample_lights(
        &mut self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
    ) {
        let selection = &scene.lights.selection;
        let LightMemory { chosen, probability, .. } = self;
        if let Some(only) = selection.only() {
            chosen[..batch.count].fill(only);
            probability[..batch.count].fill(1.0);
        } else {
            let ShadingBatch { count, selection: arrays, surfaces, light_seeds, .. } = batch;
            let points = (QueryColumns::POINT..).take(3).map(|column| surfaces.column(column));
            for (array, row) in points.chain([&light_seeds[..]]).enumerate() {
                arrays.floats_mut(array)[..*count].copy_from_slice(&row[..*count]);
            }
            scene.lights.selector(&scene.engine).select(arrays, *count);
            chosen[..*count].copy_from_slice(&arrays.words(4)[..*count]);
            probability[..*count].copy_from_slice(&arrays.floats(5)[..*count]);
        }
        self.sample_by_class(scene, errors, batch, Weights::Divided);
    }

    /// Samples the given lights, one for each lane of a batch, as if they were the only ones.
    pub fn sample_chosen(
        &mut self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
        chosen: &[u32],
        weights: Weights,
    ) {
        self.chosen[..chosen.len()].copy_from_slice(chosen);
        self.probability.fill(1.0);
        self.sample_by_class(scene, errors, batch, weights);
    }

    /// Samples the selected lights, class by class.
    fn sample_by_class(
        &mut self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
        weights: Weights,
    ) {
        let lights = &scene.lights;
        for class in 0..(lights.classes.len() + lights.shapes.len()) as u32 {
            let LightMemory { lanes, chosen, .. } = self;
            let entry_of = |lane: u32| &lights.entries[chosen[lane as usize] as usize];
            lanes.select(batch.count, |lane| entry_of(lane).class == class);
            if lanes.count() == 0 {
                continue;
            }
            self.load(batch, weights);
            let class = class as usize;
            match lights.classes.get(class) {
                Some(class) => self.sample_class(class, scene, errors),
                None => {
                    let shapes = &lights.shapes[class - lights.classes.len()];
                    self.sample_shapes(shapes, scene, errors);
                }
            }
            self.store(&mut batch.light);
        }
    }

    /// Samples lights without a shape.
    fn sample_class(&mut self, class: &LightClass, scene: &RenderScene, errors: &RuntimeErrors) {
        if class.of == Batching::Each {
            self.set_light_indices(&scene.lights.entries);
        }
        if class.is_placed {
            self.store_maps(class, &scene.compiled);
        }
        let LightMemory { lanes, state, block, objects, random, .. } = self;
        let name = &class.program.class().name;
        let callee = Callee { class: name, method: Method::Illumination, errors };
        let instances = class.of.instances(&class.objects, objects);
        let (kernel, scratch) = (&class.illumination, &mut block.block);
        callee.call_for_first(kernel, lanes.count(), instances, state, scratch, random);
    }

    /// Stores the maps between the world and the spaces of lights.
    fn store_maps(&mut self, class: &LightClass, scene: &CompiledScene) {
        let LightMemory { lanes, objects, block, .. } = self;
        for lane in 0..lanes.count() {
            let index = match class.of {
                Batching::One(index) => index,
                Batching::Each => objects.as_slice()[lane],
            };
            let light = &scene.lights[class.lights[index as usize] as usize];
            block.set_map(QueryColumns::MAPS, lane..lane + 1, &light.inverse);
            block.set_map(QueryColumns::MAPS + 12, lane..lane + 1, &light.forward);
        }
    }

    /// Samples area lights.
    fn sample_shapes(
        &mut self,
        class: &ShapeLightClass,
        scene: &RenderScene,
        errors: &RuntimeErrors,
    ) {
        self.load_hits(&scene.lights.entries);
        if class.of == Batching::Each {
            self.set_light_indices(&scene.lights.entries);
        }
        self.block.column_mut(QueryColumns::EPSILON).fill(scene.compiled.epsilon);
        let count = self.lanes.count();
        let shapes = scene.compiled.class(class.class);
        let LightMemory { hits, state, block, objects, random, .. } = self;
        let places = Places::new(&scene.compiled, class.class);
        places.store(&hits[..count], block);
        let callee = Callee { class: &shapes.name, method: Method::GenerateSample, errors };
        let instances = class.of.instances(&shapes.objects, objects);
        let scratch = &mut block.block;
        callee.call_for_first(&class.generate, count, instances, state, scratch, random);
        if let Some(surfaces) = &class.surface {
            self.prepare_surfaces(surfaces, class.of, &scene.compiled, errors);
        }
        self.sample_emission(class, scene, errors);
        self.cut_out(class, scene, errors);
    }

    /// Computes what emitters and alpha textures read of sampled points besides points and normals, such as the texture
    /// coordinates that an image on a light needs: as for hits of rays towards the points.
    fn prepare_surfaces(
        &mut self,
        surfaces: &SurfaceKernels,
        of: Batching,
        scene: &CompiledScene,
        errors: &RuntimeErrors,
    ) {
        self.block.column_mut(QueryColumns::LIMIT).fill(f32::INFINITY);
        // Light samples have no footprint.
        self.block.column_mut(QueryColumns::WIDTH).fill(0.0);
        self.block.column_mut(QueryColumns::SPREAD).fill(0.0);
        let shapes = scene.class(surfaces.class());
        let LightMemory { lanes, hits, state, block, objects, random, .. } = self;
        let call = SurfaceCall {
            hits: &hits[..lanes.count()],
            instances: of.instances(&shapes.objects, objects),
            state,
            columns: block,
            host: random,
        };
        surfaces.call(surfaces.surface(), scene, errors, call);
    }

    /// Calls `emission` for sampled points of area lights.
    fn sample_emission(
        &mut self,
        class: &ShapeLightClass,
        scene: &RenderScene,
        errors: &RuntimeErrors,
    ) {
        let count = self.lanes.count();
        let (emitter, of) = class.emitter;
        let emitters = &scene.materials[emitter];
        if of == Batching::Each {
            let hits = self.hits[..count].iter();
            let indices = hits.map(|hit| scene.objects[hit.object as usize].emitter);
            set_indices(&mut self.emitters, indices);
        }
        let LightMemory { state, block, emitters: of_lanes, random, .. } = self;
        let name = &emitters.program.class().name;
        let callee = Callee { class: name, method: Method::Emission, errors };
        let instances = of.instances(&emitters.objects, of_lanes);
        let scratch = &mut block.block;
        callee.call_for_first(&class.emission, count, instances, state, scratch, random);
    }

    /// Multiplies the emission of sampled points by their alpha, the part of rays that hit the surface there.
    fn cut_out(&mut self, class: &ShapeLightClass, scene: &RenderScene, errors: &RuntimeErrors) {
        let Some((alpha, of, kernel)) = &class.alpha else { return };
        let count = self.lanes.count();
        let textures = &scene.alpha[*alpha];
        if *of == Batching::Each {
            let hits = self.hits[..count].iter();
            let indices = hits.map(|hit| scene.objects[hit.object as usize].alpha);
            set_indices(&mut self.alpha, indices);
        }
        let LightMemory { state, block, alpha: of_lanes, random, .. } = self;
        let name = &textures.program.class().name;
        let callee = Callee { class: name, method: Method::Lookup, errors };
        let instances = of.instances(&textures.objects, of_lanes);
        callee.call_for_first(kernel, count, instances, state, &mut block.block, random);
    }

    /// Loads the points of the lanes that are lit, with their normals on the side from which their rays come.
    fn load(&mut self, batch: &ShadingBatch, weights: Weights) {
        let LightMemory { lanes, block, .. } = self;
        let points = (QueryColumns::POINT..).zip(QueryColumns::ORIGIN..).take(3);
        let others = [QueryColumns::OFFSET, QueryColumns::TIME].map(|column| (column, column));
        for (from, to) in points.chain(others) {
            lanes.gather(batch.surfaces.column(from), block.column_mut(to));
        }
        lanes.gather(&self.probability, block.column_mut(QueryColumns::PROBABILITY));
        let divides = if weights == Weights::Divided { 1.0 } else { 0.0 };
        block.column_mut(QueryColumns::DIVIDES).fill(divides);
        for column in QueryColumns::GEOMETRIC_NORMAL..QueryColumns::SHADING_NORMAL + 3 {
            let normals = batch.surfaces.column(column);
            for (to, lane) in block.column_mut(column).iter_mut().zip(lanes.iter()) {
                *to = normals[lane] * batch.side[lane];
            }
        }
        lanes.gather(&batch.keys, &mut self.keys);
        lanes.gather(&batch.samples, &mut self.samples);
        self.random.start(&self.keys, &self.samples, NUMBERS_OF_LIGHTS, lanes.count());
    }

    /// Sets the indices of their lights among those of the class.
    fn set_light_indices(&mut self, entries: &[LightEntry]) {
        let LightMemory { lanes, chosen, objects, .. } = self;
        set_indices(objects, lanes.iter().map(|lane| entries[chosen[lane] as usize].index));
    }

    /// Sets the objects to be sampled.
    fn load_hits(&mut self, entries: &[LightEntry]) {
        let LightMemory { lanes, chosen, hits, .. } = self;
        for (hit, lane) in hits.iter_mut().zip(lanes.iter()) {
            *hit = entries[chosen[lane] as usize].hit;
        }
    }

    /// Stores the samples in the batch.
    fn store(&self, light: &mut LightRows) {
        let column = |column: usize| self.block.column(column);
        for axis in 0..3 {
            let direction = column(QueryColumns::DIRECTION + axis);
            self.lanes.scatter(direction, &mut light.direction[axis]);
            self.lanes.scatter(column(QueryColumns::RADIANCE + axis), &mut light.color[axis]);
        }
        self.lanes.scatter(column(QueryColumns::REACH), &mut light.distance);
        self.lanes.scatter(column(QueryColumns::DISTANCE), &mut light.reach);
        self.lanes.scatter(column(QueryColumns::DENSITY), &mut light.density);
    }
}
