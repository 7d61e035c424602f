//! Queries about surfaces.

use rtsl::host::{LaneSet, LaneWords, MAX_LANES};
use rtsl::{
    Kernel, LightSelection, MAX_ATTRIBUTE_SCALARS, Method, Query, QueryColumns, SURFACE_SCALARS,
};
use rtsl_math::sampling::NUMBERS_OF_SHAPES;

use super::host::{SceneHost, number, store, vector};
use super::memory::ThreadMemory;
use super::numbers::Purpose;
use super::path_tracer::PathTracer;
use super::shading_batch::{ShadingBatch, selection_probabilities};
use super::wavefront::{Path, PathHit};
use crate::compiled::RenderScene;
use crate::compiled::calls::Callee;
use crate::compiled::surface_group::SurfaceGroup;
use crate::compiled::variables::{variables, vector as vector_of};

/// A lane whose surface is asked about.
#[derive(Clone, Copy)]
struct Asking {
    lane: usize,
    /// The index of its ray.
    ray: usize,
    hit: PathHit,
}

/// A query with its operands.
#[derive(Clone, Copy)]
struct Question<'q> {
    query: Query,
    operands: &'q [LaneWords],
}

impl SceneHost<'_> {
    /// Answers a query about surfaces, one group of surfaces after another. The results stay zero where the scene has
    /// no such surface.
    pub fn ask_surfaces(
        &mut self,
        lanes: LaneSet,
        query: Query,
        operands: &[LaneWords],
        results: &mut [LaneWords],
    ) {
        match query {
            Query::Shade => return self.shade(lanes, operands, results),
            Query::OwnShade => return self.own_shade(lanes, operands, results),
            _ => {}
        }
        let mut asking = Vec::with_capacity(MAX_LANES);
        for lane in lanes.iter() {
            let ray = self.ray_of(lanes, lane);
            let [object, instance, element] = [0, 1, 2].map(|index: usize| operands[index][lane]);
            let hit = self.tracer.scene.hit_of(object, instance, element);
            asking.extend(hit.map(|hit| Asking { lane, ray, hit }));
        }
        let objects = &self.tracer.scene.objects;
        let group = |asking: &Asking| objects[asking.hit.object as usize].group;
        asking.sort_by_key(group);
        let question = Question { query, operands };
        for asking in asking.chunk_by(|one, other| group(one) == group(other)) {
            let is_shaded = |group: &SurfaceGroup| group.material.is_shaded;
            if query == Query::Emission
                && self.tracer.groups.get(group(&asking[0]) as usize).is_some_and(is_shaded)
            {
                let active = asking.iter().fold(0, |set, asking| set | 1 << asking.lane);
                self.shade(LaneSet { active, ..lanes }, operands, results);
                continue;
            }
            self.ask_group(group(&asking[0]), asking, question, results);
        }
    }

    /// Answers a query about surfaces of one group.
    fn ask_group(
        &mut self,
        group: u32,
        asking: &[Asking],
        question: Question<'_>,
        results: &mut [LaneWords],
    ) {
        let Some(group) = self.tracer.groups.get(group as usize) else { return };
        self.prepare(group, asking, question);
        let (v, Question { query, operands }) = (variables(), question);
        match query {
            Query::SurfaceProperties => self.store_properties(asking, results),
            Query::Emission => {
                let Some(kernel) = &group.material.emission else { return };
                self.call_material(asking, group, Method::Emission, kernel);
                self.store_vectors(asking, results, v.emission_color);
            }
            Query::LightEmission => self.light_emission(asking, group, results),
            Query::LightPdf => self.light_densities(asking, group, operands, results),
            Query::Bsdf | Query::BsdfPdf => {
                let scattering = group.material.scattering.as_ref();
                let Some(evaluate) = scattering.and_then(|it| it.evaluate.as_ref()) else { return };
                self.set_vectors(asking, v.light_direction, operands);
                self.set_regularization(asking, operands);
                if query == Query::Bsdf {
                    self.call_material(asking, group, Method::Bsdf, &evaluate.bsdf);
                    self.store_vectors(asking, results, v.bsdf_value);
                } else {
                    self.call_material(asking, group, Method::EvaluatePdf, &evaluate.density);
                    self.store_numbers(asking, &mut results[0], v.pdf, |density| density);
                }
            }
            Query::SampleBsdf => {
                let Some(scattering) = &group.material.scattering else { return };
                self.set_vectors(asking, v.bsdf_seed, operands);
                self.set_regularization(asking, operands);
                self.call_material(asking, group, Method::SampleBsdf, &scattering.sample);
                self.store_vectors(asking, results, v.light_direction);
                self.store_vectors(asking, &mut results[3..], v.bsdf_value);
                let at_least_zero = |density: f32| if density > 0.0 { density } else { 0.0 };
                self.store_numbers(asking, &mut results[6], v.pdf, at_least_zero);
                self.store_numbers(asking, &mut results[7], v.relative_index, |index| index);
            }
            _ => {}
        }
    }

    /// Computes the properties of surfaces, as inputs of methods, or the densities of light samples for the points of the
    /// query.
    fn prepare(&mut self, group: &SurfaceGroup, asking: &[Asking], question: Question<'_>) {
        let Question { query, operands } = question;
        let mut paths = Vec::with_capacity(MAX_LANES);
        let mut hits = Vec::with_capacity(MAX_LANES);
        for (place, Asking { lane, ray, hit }) in asking.iter().enumerate() {
            let state = &self.rays[*ray];
            let (origin, direction) = (vector(operands, 6, *lane), vector(operands, 9, *lane));
            let calls = &mut self.queries.shading_calls;
            let origin = calls.leave(state.surface.as_ref(), origin, direction);
            paths.push(Path {
                origin,
                direction,
                epsilon: number(operands, 4, *lane),
                distance: number(operands, 3, *lane),
                limit: number(operands, 5, *lane),
                time: state.time,
                width: number(operands, 12, *lane),
                spread: number(operands, 13, *lane),
                sample: state.numbers.sample,
                ..Path::NOWHERE
            });
            hits.push(PathHit { path: place as u32, ..*hit });
        }
        let PathTracer { scene, errors, .. } = self.tracer;
        let ThreadMemory { batch, .. } = &mut *self.queries;
        batch.load(&paths, &hits, NUMBERS_OF_SHAPES);
        if query == Query::LightPdf {
            for (place, Asking { lane, .. }) in asking.iter().enumerate() {
                let point = vector(operands, SURFACE_SCALARS, *lane);
                batch.surfaces.set_vector(QueryColumns::POINT, place, point);
            }
            group.prepare_densities(scene, errors, batch);
        } else {
            group.prepare_surfaces(scene, errors, batch);
        }
        let before = asking.iter().map(|asking| self.rays[asking.ray].surfaces_before());
        batch.set_depths(before.map(|before| (self.depth, before)));
    }

    fn store_properties(&self, asking: &[Asking], results: &mut [LaneWords]) {
        let rows = property_rows(&self.queries.batch);
        for (result, row) in results.iter_mut().zip(rows) {
            for (Asking { lane, .. }, value) in asking.iter().zip(row) {
                result[*lane] = value.to_bits();
            }
        }
    }

    /// Calls a method of the surfaces' materials.
    fn call_material(
        &mut self,
        asking: &[Asking],
        group: &SurfaceGroup,
        method: Method,
        kernel: &Kernel,
    ) {
        if group.drawing.contains(&method) {
            self.start_random_numbers(asking);
        }
        let PathTracer { scene, errors, .. } = self.tracer;
        group.call_material(scene, errors, method, kernel, &mut self.queries.batch);
    }

    /// Begins the sequences of the next call, from which it takes its random numbers.
    fn start_random_numbers(&mut self, asking: &[Asking]) {
        let batch = &mut *self.queries.batch;
        for (key, Asking { ray, .. }) in batch.keys.iter_mut().zip(asking) {
            *key = self.rays[*ray].numbers.begin(Purpose::MaterialCall);
        }
        batch.start_random_numbers(NUMBERS_OF_SHAPES);
    }

    fn light_emission(
        &mut self,
        asking: &[Asking],
        group: &SurfaceGroup,
        results: &mut [LaneWords],
    ) {
        let Some((kernel, (class, of))) = group.emitter.as_ref().zip(group.key.emitter) else {
            return;
        };
        let emitters = &self.tracer.scene.materials[class];
        let name = &emitters.program.class().name;
        let callee = Callee { class: name, method: Method::Emission, errors: self.tracer.errors };
        if group.emitter_draws {
            self.start_random_numbers(asking);
        }
        let ShadingBatch { count, state, scratch, emitters: of_lanes, random, .. } =
            &mut *self.queries.batch;
        let instances = of.instances(&emitters.objects, of_lanes);
        callee.call_for_first(kernel, *count, instances, state, scratch, random);
        self.store_vectors(asking, results, variables().emission_color);
    }

    /// The densities with which the surfaces are chosen by light samples at points.
    fn light_densities(
        &mut self,
        asking: &[Asking],
        group: &SurfaceGroup,
        operands: &[LaneWords],
        results: &mut [LaneWords],
    ) {
        let RenderScene { lights, engine, .. } = self.tracer.scene;
        let way = |asking: &Asking| Some(lights.way_to_entry(lights.entry_of(&asking.hit)?));
        let ways: [Option<u32>; MAX_LANES] =
            std::array::from_fn(|place| way(asking.get(place)?).filter(|_| group.key.is_sampled));
        if ways.iter().all(Option::is_none) {
            return;
        }
        let ShadingBatch { surfaces, selection, .. } = &mut *self.queries.batch;
        let light = |place: usize| {
            let way = ways[place].unwrap_or(LightSelection::INFINITE);
            (way, vector(operands, SURFACE_SCALARS, asking[place].lane))
        };
        let selector = lights.selector(engine);
        let probabilities = selection_probabilities(selection, selector, asking.len(), light);
        let densities = surfaces.column(QueryColumns::DENSITY).iter().zip(probabilities);
        for (place, (density, probability)) in densities.enumerate() {
            if ways[place].is_some() {
                store(results, asking[place].lane, &[density * probability]);
            }
        }
    }

    /// Sets a state variable to the query's first operands after those of the surface.
    fn set_vectors(&mut self, asking: &[Asking], first: usize, operands: &[LaneWords]) {
        for axis in 0..3 {
            self.set_numbers(asking, first + axis, &operands[SURFACE_SCALARS + axis]);
        }
    }

    /// Sets the regularization to the last operand of a query about scattering.
    fn set_regularization(&mut self, asking: &[Asking], operands: &[LaneWords]) {
        if let Some(last) = operands.last() {
            self.set_numbers(asking, variables().regularization, last);
        }
    }

    /// Sets a component of state to an operand.
    fn set_numbers(&mut self, asking: &[Asking], component: usize, operand: &LaneWords) {
        let floats = self.queries.batch.state.floats_mut(component);
        for (to, Asking { lane, .. }) in floats.iter_mut().zip(asking) {
            *to = f32::from_bits(operand[*lane]);
        }
    }

    fn store_vectors(&self, asking: &[Asking], results: &mut [LaneWords], first: usize) {
        for (place, Asking { lane, .. }) in asking.iter().enumerate() {
            store(results, *lane, &vector_of(&self.queries.batch.state, first, place));
        }
    }

    fn store_numbers(
        &self,
        asking: &[Asking],
        result: &mut LaneWords,
        component: usize,
        map: impl Fn(f32) -> f32,
    ) {
        let floats = self.queries.batch.state.floats(component);
        for (Asking { lane, .. }, value) in asking.iter().zip(floats) {
            result[*lane] = map(*value).to_bits();
        }
    }
}

/// Returns the properties of the surfaces in a batch, as the results of their query.
pub fn property_rows(batch: &ShadingBatch) -> impl Iterator<Item = &[f32]> {
    let v = variables();
    let vectors =
        [QueryColumns::POINT, QueryColumns::GEOMETRIC_NORMAL, QueryColumns::SHADING_NORMAL];
    let components = [(v.texture_uv, 2), (v.texture_uvw, 3), (v.dpdu, 3), (v.dpdv, 3)];
    let components = components.into_iter().chain([(v.du, 1), (v.dv, 1)]);
    let components = components.flat_map(|(first, count)| first..first + count);
    let maps = [v.to_object, v.to_world].map(|first| first..first + 12);
    let attributes = v.attributes..v.attributes + MAX_ATTRIBUTE_SCALARS as usize;
    let of_materials = [v.dsdu, v.dsdv, v.dtdu, v.dtdv].into_iter();
    let of_materials = of_materials.chain(attributes).chain(maps.into_iter().flatten());
    let vectors = vectors.into_iter().flat_map(|first| first..first + 3);
    let rows = vectors.map(|column| batch.surfaces.column(column));
    let rows = rows.chain(components.map(|component| batch.state.floats(component)));
    let rows = rows.chain([batch.surfaces.column(QueryColumns::OFFSET)]);
    rows.chain(of_materials.map(|component| batch.state.floats(component)))
}
