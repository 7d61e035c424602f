//! Light samples, one for each lane of a batch.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use rtsl::{LaneBlock, LaneIndices, Method, SurfaceColumns, new_state};
use rtsl_math::sampling::{NUMBERS_OF_LIGHTS, Sampler};
use rtsl_math::{MAX_SHAPE_MARGIN, SURFACE_ERROR};

use super::lit_lanes::LitLanes;
use super::{LightClass, LightEntry, Lights, ShapeLightClass};
use crate::compiled::calls::Callee;
use crate::compiled::kernels::Batching;
use crate::compiled::variables::variables;
use crate::integrate::path_tracer::PathTracer;
use crate::integrate::random_numbers::RandomNumbers;
use crate::integrate::rows::{BATCH_LANES, Row, Rows, get, set};
use crate::integrate::shading_batch::{LightRows, ShadingBatch, set_indices};
use crate::integrate::wavefront::PathHit;
use crate::lanes::delta_light::delta_scale;
use crate::lanes::eight::{difference, dots, eights_of, is_lit, scaled, select};
use crate::lanes::lane_maps::LaneMaps;
use crate::lanes::surface_offset::{distance_to_light, sizes, sums, surface_offsets};
use crate::surfaces::{HitLanes, ObjectHit, SurfaceTransforms};

/// The memory of one thread for light samples: the lanes whose points are lit by lights of one class.
pub struct LightMemory {
    /// For each lane of the batch the selected light, and its probability.
    chosen: [u32; BATCH_LANES],
    probability: Row,
    /// The lanes of the batch for which this class is sampled.
    pub(super) lanes: LitLanes,
    /// The selection probabilities of their lights.
    part: Row,
    /// The objects that are sampled.
    pub(super) hits: [PathHit; BATCH_LANES],
    /// Points in world space.
    pub(super) point: Rows,
    /// The offsets of the origins of rays that leave the surfaces.
    offset: Row,
    pub(super) time: Row,
    geometric_normal: Rows,
    shading_normal: Rows,
    pub(super) direction: Rows,
    /// The distances of the sampled points.
    pub(super) reach: Row,
    /// The lengths of shadow rays.
    distance: Row,
    color: Rows,
    density: Row,
    keys: [u32; BATCH_LANES],
    samples: [u32; BATCH_LANES],
    pub(super) state: LaneBlock,
    pub(super) scratch: LaneBlock,
    pub(crate) objects: LaneIndices,
    emitters: LaneIndices,
    alpha: LaneIndices,
    pub(super) random: RandomNumbers,
}

impl LightMemory {
    /// For shaders with at most so many scratch arrays.
    pub fn new(scratch_arrays: usize, sampler: Sampler) -> Box<Self> {
        const NONE: Row = [0.0; BATCH_LANES];
        Box::new(LightMemory {
            chosen: [0; BATCH_LANES],
            probability: NONE,
            lanes: LitLanes::default(),
            part: NONE,
            hits: [PathHit::default(); BATCH_LANES],
            point: [NONE; 3],
            offset: NONE,
            time: NONE,
            geometric_normal: [NONE; 3],
            shading_normal: [NONE; 3],
            direction: [NONE; 3],
            reach: NONE,
            distance: NONE,
            color: [NONE; 3],
            density: NONE,
            keys: [0; BATCH_LANES],
            samples: [0; BATCH_LANES],
            state: new_state(BATCH_LANES),
            scratch: LaneBlock::new(scratch_arrays + SurfaceColumns::COUNT, BATCH_LANES),
            objects: LaneIndices::new(BATCH_LANES),
            emitters: LaneIndices::new(BATCH_LANES),
            alpha: LaneIndices::new(BATCH_LANES),
            random: RandomNumbers::new(sampler),
        })
    }

    /// Loads the points of the lanes that are lit.
    fn load(&mut self, batch: &ShadingBatch) {
        let LightMemory {
            lanes,
            point,
            offset,
            time,
            keys,
            samples,
            random,
            part,
            probability,
            ..
        } = self;
        for (from, to) in batch.point.iter().zip(point) {
            lanes.gather(from, to);
        }
        lanes.gather(&batch.offset, offset);
        lanes.gather(&batch.time, time);
        lanes.gather(&batch.keys, keys);
        lanes.gather(&batch.samples, samples);
        random.start((keys, samples), NUMBERS_OF_LIGHTS, lanes.count());
        lanes.gather(probability, part);
    }

    /// Loads their normals, on the side from which their rays come.
    fn load_normals(&mut self, batch: &ShadingBatch) {
        for (to, lane) in self.lanes.padded().enumerate() {
            let side = batch.side[lane];
            let seen = |normal: [f32; 3]| normal.map(|component| component * side);
            set(&mut self.geometric_normal, to, seen(get(&batch.geometric_normal, lane)));
            set(&mut self.shading_normal, to, seen(get(&batch.shading_normal, lane)));
        }
    }

    /// Sets the indices of their lights among those of the class.
    fn set_light_indices(&mut self, entries: &[LightEntry]) {
        let LightMemory { lanes, chosen, objects, .. } = self;
        set_indices(objects, lanes.padded().map(|lane| entries[chosen[lane] as usize].index));
    }

    /// Sets the objects to be sampled.
    fn load_hits(&mut self, entries: &[LightEntry]) {
        let LightMemory { lanes, chosen, hits, .. } = self;
        for (hit, lane) in hits.iter_mut().zip(lanes.padded()) {
            *hit = entries[chosen[lane] as usize].hit;
        }
    }

    /// Divides colours by densities, and includes the selection probabilities in both; samples that no ray finds have no
    /// density then. `weights` tells whether samples that rays find as well are divided, too.
    #[inline(always)]
    fn weigh<S: Simd>(&mut self, simd: S, found: Found, weights: Weights) {
        for eight in eights_of(simd, self.lanes.count()) {
            let (own, part) = (eight.floats(&self.density), eight.floats(&self.part));
            let density = own * part;
            // With a NaN density the sample is NaN, not a delta.
            let is_delta = own.simd_le(0.0);
            let scale = 1.0 / is_delta.select(part, density);
            let radiance = eight.vectors(&self.color);
            let divided = scaled(&radiance, scale);
            let none = eight.splat(0.0);
            let (color, density) = match (found, weights) {
                (Found::All, Weights::Left) => (radiance, density),
                (Found::All, Weights::Divided) => (divided, density),
                (Found::None, _) => (divided, none),
                (Found::AtInfinity, _) => {
                    let is_found = eight.floats(&self.reach).simd_eq(f32::INFINITY);
                    let color = match weights {
                        Weights::Left => select(is_found, &radiance, &divided),
                        Weights::Divided => divided,
                    };
                    (color, is_found.select(density, none))
                }
            };
            eight.put_vectors(&color, &mut self.color);
            eight.put(density, &mut self.density);
        }
    }

    /// Returns the light selected for a lane of the batch.
    pub fn chosen(&self, lane: usize) -> u32 {
        self.chosen[lane]
    }

    /// Stores the samples in the batch.
    fn store(&self, light: &mut LightRows) {
        let vectors = [(&self.direction, &mut light.direction), (&self.color, &mut light.color)];
        for (from, to) in vectors.into_iter().flat_map(|(from, to)| from.iter().zip(to)) {
            self.lanes.scatter(from, to);
        }
        self.lanes.scatter(&self.distance, &mut light.distance);
        self.lanes.scatter(&self.reach, &mut light.reach);
        self.lanes.scatter(&self.density, &mut light.density);
    }
}

/// The treatment of the densities of light that rays find as well.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Weights {
    /// Colours are divided by them.
    Divided,
    /// Colours are radiances.
    Left,
}

/// The samples of a class of lights that rays find as well.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Found {
    None,
    AtInfinity,
    All,
}

impl PathTracer<'_> {
    /// Samples a light for each lane of a batch.
    pub fn sample_lights(&self, batch: &mut ShadingBatch, memory: &mut LightMemory) {
        let selection = &self.scene.lights.selection;
        let LightMemory { chosen, probability, .. } = memory;
        if let Some(only) = selection.only() {
            chosen[..batch.count].fill(only);
            probability[..batch.count].fill(1.0);
        } else {
            let ShadingBatch { count, selection: arrays, point, light_seeds, .. } = batch;
            for (array, row) in point.iter().chain([&*light_seeds]).enumerate() {
                arrays.floats_mut(array)[..*count].copy_from_slice(&row[..*count]);
            }
            self.scene.lights.selector(&self.scene.engine).select(arrays, *count);
            chosen[..*count].copy_from_slice(&arrays.words(4)[..*count]);
            probability[..*count].copy_from_slice(&arrays.floats(5)[..*count]);
        }
        self.sample_by_class(batch, memory, Weights::Divided);
    }

    /// Samples the given lights, one for each lane of a batch, as if they were the only ones.
    pub fn sample_chosen(
        &self,
        batch: &mut ShadingBatch,
        memory: &mut LightMemory,
        chosen: &[u32],
    ) {
        self.choose(memory, chosen);
        self.sample_by_class(batch, memory, Weights::Divided);
    }

    /// The same, but the colours of light that rays find as well are not divided by their densities.
    pub fn sample_undivided(
        &self,
        batch: &mut ShadingBatch,
        memory: &mut LightMemory,
        chosen: &[u32],
    ) {
        self.choose(memory, chosen);
        self.sample_by_class(batch, memory, Weights::Left);
    }

    fn choose(&self, memory: &mut LightMemory, chosen: &[u32]) {
        memory.chosen[..chosen.len()].copy_from_slice(chosen);
        memory.probability.fill(1.0);
    }

    /// Samples the selected lights, class by class.
    fn sample_by_class(
        &self,
        batch: &mut ShadingBatch,
        memory: &mut LightMemory,
        weights: Weights,
    ) {
        let lights = &self.scene.lights;
        for class in 0..(lights.classes.len() + lights.shapes.len()) as u32 {
            let LightMemory { lanes, chosen, .. } = memory;
            let entry_of = |lane: u32| &lights.entries[chosen[lane as usize] as usize];
            lanes.select(batch.count, |lane| entry_of(lane).class == class);
            if lanes.count() == 0 {
                continue;
            }
            memory.load(batch);
            let class = class as usize;
            let found = if let Some(class) = lights.classes.get(class) {
                self.sample_class(class, lights, batch, memory);
                if class.is_weighed { Found::AtInfinity } else { Found::None }
            } else {
                let shapes = &lights.shapes[class - lights.classes.len()];
                self.sample_shapes(shapes, lights, memory);
                if shapes.is_invisible { Found::None } else { Found::All }
            };
            dispatch!(Level::new(), simd => memory.weigh(simd, found, weights));
            memory.store(&mut batch.light);
        }
    }

    /// Samples lights without a shape.
    fn sample_class(
        &self,
        class: &LightClass,
        lights: &Lights,
        batch: &ShadingBatch,
        memory: &mut LightMemory,
    ) {
        if class.of == Batching::Each {
            memory.set_light_indices(&lights.entries);
        }
        if class.reads_normals {
            memory.load_normals(batch);
        }
        let count = memory.lanes.count();
        dispatch!(Level::new(), simd => self.set_points(simd, class, memory));
        let LightMemory { state, scratch, objects, random, .. } = memory;
        let name = &class.program.class().name;
        let callee = Callee { class: name, method: Method::Illumination, errors: self.errors };
        let instances = class.of.instances(&class.objects, objects);
        callee.call_for_first(
            &class.illumination,
            count,
            instances,
            (state, scratch),
            None,
            random,
        );
        dispatch!(Level::new(), simd => self.read_samples(simd, class, memory));
    }

    /// Sets the inputs of `illumination`.
    #[inline(always)]
    fn set_points<S: Simd>(&self, simd: S, class: &LightClass, memory: &mut LightMemory) {
        let v = variables();
        let lights = &self.scene.compiled.lights;
        let light_of = |indices: &LaneIndices, lane: usize| {
            let index = match class.of {
                Batching::One(index) => index,
                Batching::Each => indices.as_slice()[lane],
            };
            &lights[class.lights[index as usize] as usize]
        };
        for eight in eights_of(simd, memory.lanes.count()) {
            let mut point = eight.vectors(&memory.point);
            if class.is_placed {
                let inverse = |lane: usize| light_of(&memory.objects, lane).inverse;
                point = LaneMaps::each(eight, inverse).points(&point);
            }
            eight.store_vectors(&mut memory.state, v.hit_point, &point);
            eight.store(&mut memory.state, v.time_seed, eight.floats(&memory.time));
            if class.reads_normals {
                let up = eight.splat_vector([0.0, 0.0, 1.0]);
                let mut normals =
                    [&memory.geometric_normal, &memory.shading_normal].map(|it| eight.vectors(it));
                if class.is_placed {
                    let forward = |lane: usize| light_of(&memory.objects, lane).forward;
                    let maps = LaneMaps::each(eight, forward);
                    normals = normals.map(|normals| {
                        eight.normalized_or(&maps.transposed_vectors(&normals), &up)
                    });
                }
                eight.store_vectors(&mut memory.state, v.geometric_normal, &normals[0]);
                eight.store_vectors(&mut memory.state, v.shading_normal, &normals[1]);
            }
        }
    }

    /// Transforms the samples of `illumination` to world space.
    #[inline(always)]
    fn read_samples<S: Simd>(&self, simd: S, class: &LightClass, memory: &mut LightMemory) {
        let v = variables();
        let lights = &self.scene.compiled.lights;
        for eight in eights_of(simd, memory.lanes.count()) {
            let state = &memory.state;
            let mut direction = eight.load_vectors(state, v.light_direction);
            let mut distance = eight.load(state, v.light_distance);
            let mut color = eight.load_vectors(state, v.light_color);
            let density = eight.load(state, v.pdf);
            if class.is_placed {
                let maps = LaneMaps::each(eight, |lane| {
                    let index = match class.of {
                        Batching::One(index) => index,
                        Batching::Each => memory.objects.as_slice()[lane],
                    };
                    lights[class.lights[index as usize] as usize].forward
                });
                let world = maps.vectors(&direction);
                let stretch2 = dots(&world, &world);
                color = scaled(&color, delta_scale(eight, stretch2, distance, density));
                distance *= stretch2.sqrt();
                direction = eight.normalized_or(&world, &direction);
            }
            eight.put_vectors(&direction, &mut memory.direction);
            eight.put(distance, &mut memory.reach);
            let end = distance_to_light(eight, distance, eight.floats(&memory.offset));
            eight.put(end, &mut memory.distance);
            eight.put_vectors(&color, &mut memory.color);
            eight.put(density, &mut memory.density);
        }
    }

    /// Samples area lights.
    fn sample_shapes(&self, class: &ShapeLightClass, lights: &Lights, memory: &mut LightMemory) {
        memory.load_hits(&lights.entries);
        if class.of == Batching::Each {
            memory.set_light_indices(&lights.entries);
        }
        let count = memory.lanes.count();
        let shapes = self.scene.compiled.class(class.class);
        let sampled = SampledShapes {
            transforms: SurfaceTransforms::new(
                &self.scene.compiled,
                class.class,
                memory.hits[..count].iter().map(PathHit::object_hit),
            ),
            epsilon: self.scene.compiled.epsilon,
        };
        dispatch!(Level::new(), simd => sampled.set_origins(simd, memory));
        let LightMemory { state, scratch, objects, random, .. } = memory;
        let callee =
            Callee { class: &shapes.name, method: Method::GenerateSample, errors: self.errors };
        let instances = class.of.instances(&shapes.objects, objects);
        callee.call_for_first(&class.generate, count, instances, (state, scratch), None, random);
        dispatch!(Level::new(), simd => sampled.read_points(simd, memory));
        if let Some(surface) = &class.surface {
            self.prepare_sampled_surfaces(surface, class.of, memory);
        }
        self.sample_emission(class, memory);
        self.apply_alpha(class, memory);
    }

    /// Calls `emission` for sampled points of area lights.
    fn sample_emission(&self, class: &ShapeLightClass, memory: &mut LightMemory) {
        let count = memory.lanes.count();
        let (emitter, of) = class.emitter;
        let emitters = &self.scene.materials[emitter];
        if of == Batching::Each {
            let hits = memory.hits[..count].iter();
            let indices = hits.map(|hit| self.scene.objects[hit.object as usize].emitter);
            set_indices(&mut memory.emitters, indices);
        }
        let LightMemory { state, scratch, emitters: of_lanes, random, .. } = memory;
        let name = &emitters.program.class().name;
        let callee = Callee { class: name, method: Method::Emission, errors: self.errors };
        let instances = of.instances(&emitters.objects, of_lanes);
        callee.call_for_first(&class.emission, count, instances, (state, scratch), None, random);
        let v = variables();
        dispatch!(Level::new(), simd => {
            for eight in eights_of(simd, count) {
                let color = eight.load_vectors(&memory.state, v.emission_color);
                let is_usable = eight.floats(&memory.density).simd_gt(0.0) & is_lit(&color);
                let black = eight.splat_vector([0.0; 3]);
                eight.put_vectors(&select(is_usable, &color, &black), &mut memory.color);
            }
        });
    }

    /// Multiplies the emission of sampled points by their alpha, the part of rays that hit the surface there.
    fn apply_alpha(&self, class: &ShapeLightClass, memory: &mut LightMemory) {
        let Some((alpha, of, kernel)) = &class.alpha else { return };
        let count = memory.lanes.count();
        let textures = &self.scene.alpha[*alpha];
        if *of == Batching::Each {
            let hits = memory.hits[..count].iter();
            let indices = hits.map(|hit| self.scene.objects[hit.object as usize].alpha);
            set_indices(&mut memory.alpha, indices);
        }
        let LightMemory { state, scratch, alpha: of_lanes, random, .. } = memory;
        let name = &textures.program.class().name;
        let callee = Callee { class: name, method: Method::Lookup, errors: self.errors };
        let instances = of.instances(&textures.objects, of_lanes);
        callee.call_for_first(kernel, count, instances, (state, scratch), None, random);
        let v = variables();
        dispatch!(Level::new(), simd => {
            for eight in eights_of(simd, count) {
                let (zero, one) = (eight.splat(0.0), eight.splat(1.0));
                let alpha = eight.load(&memory.state, v.float_texture_value);
                // As for hits, NaN is opaque.
                let alpha = alpha.simd_lt(one).select(alpha.simd_gt(zero).select(alpha, zero), one);
                let color = scaled(&eight.vectors(&memory.color), alpha);
                eight.put_vectors(&color, &mut memory.color);
            }
        });
    }
}

/// The objects that are sampled, and the times.
struct SampledHits<'a> {
    hits: &'a [PathHit; BATCH_LANES],
    time: &'a Row,
}

impl HitLanes for SampledHits<'_> {
    #[inline(always)]
    fn hit(&self, lane: usize) -> ObjectHit {
        self.hits[lane].object_hit()
    }

    #[inline(always)]
    fn time(&self, lane: usize) -> f32 {
        self.time[lane]
    }
}

/// The shapes that are sampled, with their transforms.
struct SampledShapes<'a> {
    transforms: SurfaceTransforms<'a>,
    epsilon: f32,
}

impl SampledShapes<'_> {
    /// Sets the inputs of `generateSample`.
    #[inline(always)]
    fn set_origins<S: Simd>(&self, simd: S, memory: &mut LightMemory) {
        let v = variables();
        for eight in eights_of(simd, memory.lanes.count()) {
            let lanes = SampledHits { hits: &memory.hits, time: &memory.time };
            let point = eight.vectors(&memory.point);
            let origin = self.transforms.local_points(eight, &lanes, &point);
            let state = &mut memory.state;
            eight.store_vectors(state, v.ray_origin, &origin);
            eight.store(state, v.epsilon, eight.splat(self.epsilon));
            eight.store(state, v.time_seed, eight.floats(&memory.time));
        }
    }

    /// Transforms the sampled points to world space, with their densities as seen from the lit points, and sets the
    /// inputs of `emission` for rays towards them.
    #[inline(always)]
    fn read_points<S: Simd>(&self, simd: S, memory: &mut LightMemory) {
        let v = variables();
        for eight in eights_of(simd, memory.lanes.count()) {
            let (state, lanes) =
                (&memory.state, SampledHits { hits: &memory.hits, time: &memory.time });
            let local = eight.load_vectors(state, v.hit_point);
            let local_way = difference(&local, &eight.load_vectors(state, v.ray_origin));
            let point = self.transforms.points(eight, &lanes, &local);
            let normal = eight.load_vectors(state, v.geometric_normal);
            let [normal] = self.transforms.normals(eight, &lanes, [normal]);
            let normal = eight.normalized_or(&normal, &eight.splat_vector([0.0, 0.0, 1.0]));
            let origin = eight.vectors(&memory.point);
            let way = difference(&point, &origin);
            let (square, local_square) = (dots(&way, &way), dots(&local_way, &local_way));
            let distance = square.sqrt();
            let nowhere = eight.splat_vector([0.0; 3]);
            let direction = eight.normalized_or(&way, &nowhere);
            // The Jacobian of directions under a linear map: its stretch along them, cubed, over its determinant.
            let stretch = square / local_square;
            let scale = stretch * stretch.sqrt() / self.transforms.volume_scales(eight, &lanes);
            let density = eight.load(state, v.pdf) * scale;
            let is_usable = density.simd_gt(0.0)
                & density.simd_lt(f32::INFINITY)
                & distance.simd_gt(0.0)
                & distance.simd_lt(f32::INFINITY);
            let density = is_usable.select(density, eight.splat(0.0));
            eight.put(density, &mut memory.density);
            eight.put_vectors(&direction, &mut memory.direction);
            eight.put(distance, &mut memory.reach);
            let sizes = sums(&sizes(&origin), &sizes(&way));
            let sizes = self.transforms.sizes_of_points(eight, &lanes, &sizes, true);
            let height = surface_offsets(eight, &normal, (&sizes, SURFACE_ERROR))
                + eight.floats(&memory.offset);
            // The ray ends before the light's surface by the error bound of both ends, measured along the normal; at
            // grazing angles this is a longer distance along the ray.
            let margin = height / dots(&normal, &direction).abs();
            let most = distance * MAX_SHAPE_MARGIN;
            let margin = margin.simd_lt(most).select(margin, most);
            eight.put(distance - margin, &mut memory.distance);
            let state = &mut memory.state;
            eight.store_vectors(state, v.ray_origin, &origin);
            eight.store_vectors(state, v.ray_direction, &direction);
            eight.store(state, v.hit_distance, distance);
            eight.store_vectors(state, v.hit_point, &point);
            eight.store_vectors(state, v.geometric_normal, &normal);
            eight.store_vectors(state, v.shading_normal, &normal);
        }
    }
}
