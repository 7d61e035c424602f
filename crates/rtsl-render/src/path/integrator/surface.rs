//! Queries about surfaces.

use rtsl::{Kernel, Method, Query, SURFACE_SCALARS};
use rtsl_math::SIMD_LANES;

use super::super::memory::BatchMemory;
use super::super::rows::get;
use super::super::scatter::NUMBERS_OF_SHAPES;
use super::super::shading_batch::ShadingBatch;
use super::super::surface_group::SurfaceGroup;
use super::super::wavefront::{NO_INSTANCE, Path, PathHit};
use super::host::{Further, RayOfCall, SceneHost, number, store, vector};
use crate::compiled::calls::Callee;
use crate::compiled::variables::{variables, vector as vector_of};

impl SceneHost<'_> {
    /// Answers a query about a surface. The results stay zero if the scene has no such surface.
    pub fn ask_surface(&mut self, ray: usize, query: Query, operands: &[u32], results: &mut [u32]) {
        let Some(hit) = self.hit_of(operands) else { return };
        let scene = self.tracer.scene;
        let group = &scene.groups[scene.objects[hit.object as usize].group as usize];
        let argument = &operands[SURFACE_SCALARS..];
        let seen_from = (query == Query::LightPdf).then(|| vector(argument, 0));
        self.prepare(ray, group, hit, operands, seen_from);
        let v = variables();
        match query {
            Query::SurfaceProperties => self.store_properties(results),
            Query::Emission => {
                if group.material.shade.is_some() {
                    return self.shade(ray, hit, results);
                }
                let Some(kernel) = &group.material.emission else { return };
                self.call_material(ray, group, Method::Emission, kernel);
                self.store_vector(results, v.emission_color);
            }
            Query::LightEmission => self.light_emission(ray, group, results),
            Query::LightPdf => store(results, &[self.light_density(group, hit, argument)]),
            Query::Bsdf | Query::BsdfPdf => {
                let scattering = group.material.scattering.as_ref();
                let Some(evaluate) = scattering.and_then(|it| it.evaluate.as_ref()) else { return };
                self.set_vector(v.light_direction, vector(argument, 0));
                if query == Query::Bsdf {
                    self.call_material(ray, group, Method::Bsdf, &evaluate.bsdf);
                    self.store_vector(results, v.bsdf_value);
                } else {
                    self.call_material(ray, group, Method::EvaluatePdf, &evaluate.density);
                    store(results, &[self.queries.batch.state.floats(v.pdf)[0]]);
                }
            }
            Query::SampleBsdf => {
                let Some(scattering) = &group.material.scattering else { return };
                self.set_vector(v.bsdf_seed, vector(argument, 0));
                self.call_material(ray, group, Method::SampleBsdf, &scattering.sample);
                self.store_vector(results, v.light_direction);
                self.store_vector(&mut results[3..], v.bsdf_value);
                let density = self.queries.batch.state.floats(v.pdf)[0].max(0.0);
                store(&mut results[6..], &[density]);
            }
            Query::Shade => self.shade(ray, hit, results),
            _ => {}
        }
    }

    /// Returns the hit that operands identify, if the scene has such a surface.
    fn hit_of(&self, operands: &[u32]) -> Option<PathHit> {
        let (object, instance, element) = (operands[0], operands[1], operands[2]);
        let scene = self.tracer.scene;
        let entry = scene.objects.get(object as usize)?;
        scene.compiled.class(entry.class).index_of(object, element)?;
        let instances = scene.compiled.geometry.instances.len();
        let is_placed = instance == NO_INSTANCE || (instance as usize) < instances;
        is_placed.then_some(PathHit { path: 0, object, element, instance })
    }

    /// Computes the properties of the surface, as inputs of methods. If a point is given, the surface is prepared as
    /// seen from there.
    fn prepare(
        &mut self,
        ray: usize,
        group: &SurfaceGroup,
        hit: PathHit,
        operands: &[u32],
        seen_from: Option<[f32; 3]>,
    ) {
        let state = &self.rays[ray];
        let (origin, direction) = (vector(operands, 6), vector(operands, 9));
        let distance = number(operands, 3);
        let mut path = Path {
            origin,
            direction,
            epsilon: number(operands, 4),
            distance,
            limit: number(operands, 5),
            time: state.time,
            width: number(operands, 12),
            spread: number(operands, 13),
            sample: state.numbers.sample,
            ..Path::NOWHERE
        };
        if let Some(point) = seen_from.filter(|point| *point != origin) {
            let axes = [0, 1, 2];
            path.origin = point;
            path.direction =
                axes.map(|axis| origin[axis] + distance * direction[axis] - point[axis]);
            path.distance = 1.0;
        }
        let BatchMemory { batch, .. } = &mut *self.queries;
        batch.load(&[path], &[hit], NUMBERS_OF_SHAPES);
        self.tracer.prepare_surfaces(group, batch);
        batch.set_depth(self.depth + state.surfaces_before());
    }

    fn store_properties(&mut self, results: &mut [u32]) {
        let v = variables();
        let batch = &self.queries.batch;
        let vectors = [&batch.point, &batch.geometric_normal, &batch.shading_normal];
        let mut values: Vec<f32> = vectors.iter().flat_map(|rows| get(rows, 0)).collect();
        let components = [(v.texture_uv, 2), (v.texture_uvw, 3), (v.dpdu, 3), (v.dpdv, 3)];
        let components = components.into_iter().chain([(v.du, 1), (v.dv, 1)]);
        let components = components.flat_map(|(first, count)| first..first + count);
        values.extend(components.map(|component| batch.state.floats(component)[0]));
        values.push(batch.offset[0]);
        store(results, &values);
    }

    /// Calls a method of the surface's material, with random numbers of its own.
    fn call_material(&mut self, ray: usize, group: &SurfaceGroup, method: Method, kernel: &Kernel) {
        self.start_random_numbers(ray);
        self.tracer.call_material(group, method, kernel, &mut self.queries.batch);
    }

    /// Begins the sequence of the next call, from which it takes its random numbers.
    fn start_random_numbers(&mut self, ray: usize) {
        let key = self.rays[ray].numbers.begin_call();
        let batch = &mut *self.queries.batch;
        batch.keys[..SIMD_LANES].fill(key);
        batch.start_random_numbers(NUMBERS_OF_SHAPES);
    }

    fn light_emission(&mut self, ray: usize, group: &SurfaceGroup, results: &mut [u32]) {
        let Some((kernel, (class, of))) = group.emitter.as_ref().zip(group.key.emitter) else {
            return;
        };
        let emitters = &self.tracer.scene.materials[class];
        let name = &emitters.program.class().name;
        let callee = Callee { class: name, method: Method::Emission, errors: self.tracer.errors };
        self.start_random_numbers(ray);
        let batch = &mut *self.queries.batch;
        let instances = of.instances(&emitters.objects, &batch.emitters);
        let blocks = (&mut batch.state, &mut batch.scratch);
        callee.call_for_first(kernel, 1, instances, blocks, None, &mut batch.random);
        self.store_vector(results, variables().emission_color);
    }

    /// The density with which the surface is chosen by light samples at a point.
    fn light_density(&self, group: &SurfaceGroup, hit: PathHit, argument: &[u32]) -> f32 {
        let lights = &self.tracer.scene.lights;
        match lights.entry_of(&hit).filter(|_| group.key.is_sampled) {
            Some(entry) => {
                let probability = lights.probability(entry, vector(argument, 0));
                self.queries.batch.light_density[0] * probability
            }
            None => 0.0,
        }
    }

    fn shade(&mut self, ray: usize, hit: PathHit, results: &mut [u32]) {
        let SceneHost { tracer, integrator, free, depth, .. } = self;
        let further = Further { tracer, integrator, free };
        let depth = *depth + self.rays[ray].surfaces_before();
        let path = shaded_path(&self.queries.batch, &mut self.rays[ray]);
        let BatchMemory { shade, rays, .. } = &mut *self.queries;
        let Some(shade) = shade else { return };
        let colors = tracer.shading(&[hit], depth, &[path], &mut shade.workspace, &further);
        *rays += std::mem::take(&mut shade.workspace.rays);
        store(results, &colors.map(|lanes| lanes[0]));
    }

    fn set_vector(&mut self, first: usize, [x, y, z]: [f32; 3]) {
        for (axis, value) in [x, y, z].into_iter().enumerate() {
            self.queries.batch.state.floats_mut(first + axis)[..SIMD_LANES].fill(value);
        }
    }

    fn store_vector(&self, results: &mut [u32], first: usize) {
        store(results, &vector_of(&self.queries.batch.state, first, 0));
    }
}

/// Returns the path of a ray whose surface is prepared in a batch, with random numbers for `shade`.
fn shaded_path(batch: &ShadingBatch, ray: &mut RayOfCall) -> Path {
    Path {
        origin: get(&batch.origin, 0),
        direction: get(&batch.direction, 0),
        epsilon: batch.epsilon[0],
        distance: batch.distance[0],
        limit: batch.limit[0],
        time: ray.time,
        key: ray.numbers.begin_call(),
        sample: ray.numbers.sample,
        ..Path::NOWHERE
    }
}
