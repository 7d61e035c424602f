//! Samples of lights, one for each lane of a chunk.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use rtsl::{LaneBlock, LaneIndices, Method, new_state};

use crate::compiled::variables::variables;
use crate::lanes::eight::{difference, dots, eights_of, is_lit, select};
use crate::lanes::lane_maps::LaneMaps;
use crate::sampling::Sampler;

use super::super::chunk::{CHUNK, Callee, Chunk, Row, Rows, get, set, set_numbers};
use super::super::kernels::Of;
use super::super::numbers::Numbers;
use super::super::places::Places;
use super::super::tracer::PathTracer;
use super::super::wave::PathHit;
use super::{LightClass, LightEntry, Lights, ShapeLightClass};

/// How far before a sample of a shape, relative to its distance, shadow rays end: rounding of silhouettes.
const TOLERANCE: f32 = 1e-3;

/// The memory of one thread for samples of lights: lanes of points that are lit by lights of one class.
pub struct LightMemory {
    /// For each lane of the chunk the light that is chosen, and with which probability.
    chosen: [u32; CHUNK],
    probability: Row,
    /// The lanes of the chunk that light of the class is sampled for.
    lanes: Vec<u32>,
    /// What of the lights is sampled.
    hits: [PathHit; CHUNK],
    /// Points in world space.
    point: Rows,
    time: Row,
    geometric_normal: Rows,
    shading_normal: Rows,
    direction: Rows,
    distance: Row,
    color: Rows,
    density: Row,
    keys: [u32; CHUNK],
    state: LaneBlock,
    scratch: LaneBlock,
    objects: LaneIndices,
    emitters: LaneIndices,
    numbers: Numbers,
}

impl LightMemory {
    /// For shaders with at most so many arrays of scratch.
    pub fn new(scratch_arrays: usize, sampler: Sampler) -> Box<Self> {
        const NONE: Row = [0.0; CHUNK];
        Box::new(LightMemory {
            chosen: [0; CHUNK],
            probability: NONE,
            lanes: Vec::with_capacity(CHUNK),
            hits: [PathHit::default(); CHUNK],
            point: [NONE; 3],
            time: NONE,
            geometric_normal: [NONE; 3],
            shading_normal: [NONE; 3],
            direction: [NONE; 3],
            distance: NONE,
            color: [NONE; 3],
            density: NONE,
            keys: [0; CHUNK],
            state: new_state(CHUNK),
            scratch: LaneBlock::new(scratch_arrays, CHUNK),
            objects: LaneIndices::new(CHUNK),
            emitters: LaneIndices::new(CHUNK),
            numbers: Numbers::new(sampler),
        })
    }

    fn count(&self) -> usize {
        self.lanes.len()
    }

    /// Takes the points of the chunk's lanes that are lit by lights of a class. Lanes behind the last repeat it up
    /// to a multiple of eight.
    fn load(&mut self, chunk: &Chunk, entries: &[LightEntry], with_normals: bool) {
        let LightMemory { lanes, .. } = self;
        let Some(last) = lanes.last() else { return };
        let padding = std::iter::repeat_n(last, lanes.len().next_multiple_of(8) - lanes.len());
        let lanes = lanes.iter().chain(padding).map(|lane| *lane as usize);
        let entry_of = |lane: usize| &entries[self.chosen[lane] as usize];
        set_numbers(&mut self.objects, lanes.clone().map(|lane| entry_of(lane).number));
        for (to, lane) in lanes.enumerate() {
            set(&mut self.point, to, get(&chunk.point, lane));
            self.time[to] = chunk.time[lane];
            self.keys[to] = chunk.keys[lane];
            self.numbers.samples[to] = chunk.numbers.samples[lane];
            self.hits[to] = entry_of(lane).hit;
            if with_normals {
                let side = chunk.side[lane];
                let seen = |normal: [f32; 3]| normal.map(|component| component * side);
                set(&mut self.geometric_normal, to, seen(get(&chunk.geometric_normal, lane)));
                set(&mut self.shading_normal, to, seen(get(&chunk.shading_normal, lane)));
            }
        }
    }

    /// Gives the chunk what was sampled: colours are divided by densities, and probabilities take part.
    fn store(&self, chunk: &mut Chunk, is_weighed: bool) {
        for (from, lane) in self.lanes.iter().map(|lane| *lane as usize).enumerate() {
            let probability = self.probability[lane];
            let density = self.density[from] * probability;
            let scale = if self.density[from] > 0.0 { 1.0 / density } else { 1.0 / probability };
            let color = get(&self.color, from).map(|channel| channel * scale);
            let light = &mut chunk.light;
            set(&mut light.direction, lane, get(&self.direction, from));
            light.distance[lane] = self.distance[from];
            set(&mut light.color, lane, color);
            light.density[lane] = if is_weighed { density } else { 0.0 };
        }
    }
}

/// Which sequence of a vertex's numbers lights have.
const NUMBERS_OF_LIGHTS: u32 = 0x101;

impl PathTracer<'_> {
    /// Samples a light for each lane of a chunk. `numbers` choose them.
    pub fn sample_lights(&self, chunk: &mut Chunk, memory: &mut LightMemory, numbers: &Row) {
        let lights = &self.scene.lights;
        for (lane, number) in numbers.iter().enumerate().take(chunk.count) {
            (memory.chosen[lane], memory.probability[lane]) =
                lights.selection.choose(get(&chunk.point, lane), *number);
        }
        self.sample_by_class(chunk, memory);
    }

    /// Samples these lights, one for each lane of a chunk, as if they were the only ones.
    pub fn sample_chosen(&self, chunk: &mut Chunk, memory: &mut LightMemory, chosen: &[u32]) {
        memory.chosen[..chosen.len()].copy_from_slice(chosen);
        memory.probability.fill(1.0);
        self.sample_by_class(chunk, memory);
    }

    /// Samples the lights that were chosen, those of a class together.
    fn sample_by_class(&self, chunk: &mut Chunk, memory: &mut LightMemory) {
        let lights = &self.scene.lights;
        for class in 0..(lights.classes.len() + lights.shapes.len()) as u32 {
            memory.lanes.clear();
            let is_of_class =
                |lane: &u32| lights.entries[memory.chosen[*lane as usize] as usize].class == class;
            memory.lanes.extend((0..chunk.count as u32).filter(is_of_class));
            if memory.lanes.is_empty() {
                continue;
            }
            let class = class as usize;
            let is_weighed = if let Some(class) = lights.classes.get(class) {
                self.sample_class(class, lights, chunk, memory);
                class.is_weighed
            } else {
                self.sample_shapes(
                    &lights.shapes[class - lights.classes.len()],
                    lights,
                    chunk,
                    memory,
                );
                true
            };
            memory.store(chunk, is_weighed);
        }
    }

    /// Samples lights without a shape.
    fn sample_class(
        &self,
        class: &LightClass,
        lights: &Lights,
        chunk: &Chunk,
        memory: &mut LightMemory,
    ) {
        memory.load(chunk, &lights.entries, class.reads_normals);
        let count = memory.count();
        let LightMemory { numbers, keys, .. } = memory;
        numbers.start(keys, NUMBERS_OF_LIGHTS, count);
        dispatch!(Level::new(), simd => self.set_points(simd, class, memory));
        let LightMemory { state, scratch, objects, numbers, .. } = memory;
        let name = &class.program.class().name;
        let callee = Callee { class: name, method: Method::Illumination, problems: self.problems };
        let instances = class.of.instances(&class.objects, objects);
        callee.call(&class.illumination, count, instances, (state, scratch), None, numbers);
        dispatch!(Level::new(), simd => self.read_samples(simd, class, memory));
    }

    /// Sets what `illumination` reads.
    #[inline(always)]
    fn set_points<S: Simd>(&self, simd: S, class: &LightClass, memory: &mut LightMemory) {
        let v = variables();
        let lights = &self.scene.compiled.lights;
        let light_of = |numbers: &LaneIndices, lane: usize| {
            let number = match class.of {
                Of::One(number) => number,
                Of::Each => numbers.as_slice()[lane],
            };
            &lights[class.lights[number as usize] as usize]
        };
        for eight in eights_of(simd, memory.count()) {
            let mut point = eight.vectors(&memory.point);
            if class.is_placed {
                let inverse = |lane: usize| light_of(&memory.objects, lane).inverse;
                point = LaneMaps::each(eight, inverse).points(&point);
            }
            eight.store_vectors(&mut memory.state, v.hit_point, &point);
            eight.store(&mut memory.state, v.time_seed, eight.numbers(&memory.time));
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

    /// Takes the samples that `illumination` left to world space.
    #[inline(always)]
    fn read_samples<S: Simd>(&self, simd: S, class: &LightClass, memory: &mut LightMemory) {
        let v = variables();
        let lights = &self.scene.compiled.lights;
        for eight in eights_of(simd, memory.count()) {
            let state = &memory.state;
            let mut direction = eight.load_vectors(state, v.light_direction);
            let mut distance = eight.load(state, v.light_distance);
            if class.is_placed {
                let maps = LaneMaps::each(eight, |lane| {
                    let number = match class.of {
                        Of::One(number) => number,
                        Of::Each => memory.objects.as_slice()[lane],
                    };
                    lights[class.lights[number as usize] as usize].forward
                });
                let world = maps.vectors(&direction);
                distance *= dots(&world, &world).sqrt();
                direction = eight.normalized_or(&world, &direction);
            }
            eight.blend_vectors(&direction, &mut memory.direction);
            eight.blend(distance - self.scene.compiled.epsilon, &mut memory.distance);
            eight.blend_vectors(&eight.load_vectors(state, v.light_color), &mut memory.color);
            eight.blend(eight.load(state, v.pdf), &mut memory.density);
        }
    }

    /// Samples shapes.
    fn sample_shapes(
        &self,
        class: &ShapeLightClass,
        lights: &Lights,
        chunk: &Chunk,
        memory: &mut LightMemory,
    ) {
        memory.load(chunk, &lights.entries, false);
        let count = memory.count();
        let shapes = &self.scene.compiled.classes[class.class as usize];
        let LightMemory { numbers, keys, .. } = memory;
        numbers.start(keys, NUMBERS_OF_LIGHTS, count);
        let sampled = SampledShapes {
            places: Places::new(&self.scene.compiled, class.class, &memory.hits[..count]),
            epsilon: self.scene.compiled.epsilon,
        };
        dispatch!(Level::new(), simd => sampled.set_origins(simd, memory));
        let LightMemory { state, scratch, objects, numbers, .. } = memory;
        let callee =
            Callee { class: &shapes.name, method: Method::GenerateSample, problems: self.problems };
        let instances = class.of.instances(&shapes.objects, objects);
        callee.call(&class.generate, count, instances, (state, scratch), None, numbers);
        dispatch!(Level::new(), simd => sampled.read_points(simd, memory));
        let (emitter, of) = class.emitter;
        let emitters = &self.scene.materials.classes[emitter as usize];
        if of == Of::Each {
            let hits = memory.hits[..count].iter();
            let numbers = hits.map(|hit| self.scene.objects[hit.object as usize].emitter);
            set_numbers(&mut memory.emitters, numbers);
        }
        let LightMemory { state, scratch, emitters: of_lanes, numbers, .. } = memory;
        let name = &emitters.program.class().name;
        let callee = Callee { class: name, method: Method::Emission, problems: self.problems };
        let instances = of.instances(&emitters.objects, of_lanes);
        callee.call(&class.emission, count, instances, (state, scratch), None, numbers);
        let v = variables();
        dispatch!(Level::new(), simd => {
            for eight in eights_of(simd, count) {
                let color = eight.load_vectors(&memory.state, v.emission_color);
                let is_usable = eight.numbers(&memory.density).simd_gt(0.0) & is_lit(&color);
                let black = eight.splat_vector([0.0; 3]);
                eight.blend_vectors(&select(is_usable, &color, &black), &mut memory.color);
            }
        });
    }
}

/// Where the shapes stand that are sampled.
struct SampledShapes<'a> {
    places: Places<'a>,
    epsilon: f32,
}

impl SampledShapes<'_> {
    /// Sets what `generateSample` reads.
    #[inline(always)]
    fn set_origins<S: Simd>(&self, simd: S, memory: &mut LightMemory) {
        let v = variables();
        for eight in eights_of(simd, memory.count()) {
            let lanes = (&memory.hits, &memory.time);
            let point = eight.vectors(&memory.point);
            let origin = self.places.local_points(eight, lanes, &point);
            let state = &mut memory.state;
            eight.store_vectors(state, v.ray_origin, &origin);
            eight.store(state, v.epsilon, eight.splat(self.epsilon));
            eight.store(state, v.time_seed, eight.numbers(&memory.time));
        }
    }

    /// Takes points to world space, with their densities as seen from there, and sets what `emission` reads of
    /// rays towards them.
    #[inline(always)]
    fn read_points<S: Simd>(&self, simd: S, memory: &mut LightMemory) {
        let v = variables();
        for eight in eights_of(simd, memory.count()) {
            let (state, lanes) = (&memory.state, (&memory.hits, &memory.time));
            let local = eight.load_vectors(state, v.hit_point);
            let local_way = difference(&local, &eight.load_vectors(state, v.ray_origin));
            let point = self.places.points(eight, lanes, &local);
            let normal = eight.load_vectors(state, v.geometric_normal);
            let [normal] = self.places.normals(eight, lanes, [normal]);
            let normal = eight.normalized_or(&normal, &eight.splat_vector([0.0, 0.0, 1.0]));
            let origin = eight.vectors(&memory.point);
            let way = difference(&point, &origin);
            let (square, local_square) = (dots(&way, &way), dots(&local_way, &local_way));
            let distance = square.sqrt();
            let nowhere = eight.splat_vector([0.0; 3]);
            let direction = eight.normalized_or(&way, &nowhere);
            // The Jacobian of directions under a linear map: its stretch along them, cubed, over its determinant.
            let stretch = square / local_square;
            let scale = stretch * stretch.sqrt() / self.places.volume_scales(eight, lanes);
            let density = eight.load(state, v.pdf) * scale;
            let is_usable = density.simd_gt(0.0)
                & density.simd_lt(f32::INFINITY)
                & distance.simd_gt(0.0)
                & distance.simd_lt(f32::INFINITY);
            let density = is_usable.select(density, eight.splat(0.0));
            eight.blend(density, &mut memory.density);
            eight.blend_vectors(&direction, &mut memory.direction);
            eight.blend(distance * (1.0 - TOLERANCE), &mut memory.distance);
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
