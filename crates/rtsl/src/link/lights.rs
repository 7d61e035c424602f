//! Lights without a shape as operations: samples of them, and their radiance for rays that leave the scene.
//!
//! Renderers compute the same for lights that they do not link, with the same bits.

use std::sync::Arc;

use rtsl_ir::{
    BinaryOp, CompareOp, Index, Op, OpKind, Output, Query, Region, Scalar, StateComponent, UnaryOp,
    Value, Variable, VariableId, VariableKind,
};
use rtsl_math::sampling::{NUMBERS_OF_LIGHT_SAMPLES, NUMBERS_OF_LIGHTS, Sampler};
use rtsl_math::{LIGHT_MARGIN, STRETCH_ROUNDING};
use rtsl_spec::{Role, lookup_state};

use super::arithmetic::{Arithmetic, Map, Vector};
use super::linked_method::LinkedMethod;
use super::linker::{Linker, Linking, Site, default_of, find_override};
use super::numbers::{KEY_COLUMN, SAMPLE_COLUMN, has_operations};
use super::stage::{TIME_COLUMN, asks_host};

/// The scratch array that counts each path's light samples: those since its last search, from a multiple for each
/// search on.
pub(crate) const LIGHT_COLUMN: &str = "path.lights";

/// The greatest number of lights that are linked.
pub(crate) const MAX_LIGHTS: usize = 4;

/// The lights of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightLinks {
    pub lights: Vec<LightLink>,
    /// The lights that rays find when they leave the scene, by their indices among `lights`.
    pub skies: Vec<usize>,
    /// The selection of lights for samples; `None` if hosts sample them.
    pub selection: Option<LightSelection>,
}

/// The selection of lights, with probabilities that do not depend on the point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightSelection {
    /// The indices of lights at infinity.
    pub infinite: Vec<usize>,
    /// The index of the only other light.
    pub finite: Option<usize>,
    /// The probability of each light at infinity.
    pub probability: f32,
}

impl LightSelection {
    /// The lights with their probabilities, in the order in which random numbers select them.
    fn parts(&self) -> Vec<(usize, f32)> {
        let infinite = self.infinite.iter().map(|light| (*light, self.probability));
        let left = 1.0 - self.probability * self.infinite.len() as f32;
        let count = self.infinite.len() + usize::from(self.finite.is_some());
        let finite = self.finite.map(|light| (light, left));
        let parts = infinite.chain(finite);
        // The only light is always selected.
        parts.map(|(light, part)| (light, if count == 1 { 1.0 } else { part })).collect()
    }

    /// The probability of a light; 0 if it is not selected.
    fn part(&self, light: usize) -> f32 {
        let parts = self.parts();
        parts.iter().find(|(other, _)| *other == light).map_or(0.0, |(_, part)| *part)
    }
}

/// A light.
#[derive(Clone, Debug)]
pub(crate) struct LightLink {
    /// The path to its members: `light.0.`.
    pub prefix: String,
    /// `illumination`, `emission` and `evaluatePDF`, as far as the class has them.
    pub illumination: Option<Arc<LinkedMethod>>,
    pub emission: Option<Arc<LinkedMethod>>,
    pub density: Option<Arc<LinkedMethod>>,
    /// True if samples are transformed to the world.
    pub is_placed: bool,
    /// True if rays that leave the scene can find the light, so that samples have densities.
    pub is_weighed: bool,
}

/// The state that methods of lights may read.
const INPUTS: [&str; 7] = [
    "rt_HitPoint",
    "rt_GeometricNormal",
    "rt_ShadingNormal",
    "rt_TimeSeed",
    "rt_RayOrigin",
    "rt_RayDirection",
    "rt_LightDirection",
];

impl LightLink {
    /// Returns the name of the map from the world to the light's space.
    pub fn inverse(&self) -> String {
        format!("{}inverse.map", self.prefix)
    }

    /// Returns the name of the map from the light's space to the world.
    pub fn forward(&self) -> String {
        format!("{}forward.map", self.prefix)
    }

    /// True if the methods need nothing but what queries give and, for samples, random numbers of this sampler.
    pub fn is_complete(&self, sampler: &Sampler) -> bool {
        let is_plain = |method: &Arc<LinkedMethod>, may_draw: bool| {
            let mut is_plain = !method.reads_scratch;
            method.function.body.for_each_op(&mut |op| {
                is_plain &= !asks_host(&op.kind) || may_draw && op.kind == OpKind::Rand;
            });
            is_plain && method.reads.iter().all(|it| INPUTS.contains(&it.name))
        };
        let mut fixed = self.emission.iter().chain(&self.density);
        fixed.all(|method| is_plain(method, false))
            && self.illumination.iter().all(|method| is_plain(method, has_operations(sampler)))
    }
}

/// The point that a light is sampled for.
#[derive(Clone, Copy)]
struct LitPoint {
    point: Vector,
    normals: [Vector; 2],
    offset: Value,
}

/// A sample of a light, as the results of its query, without the first.
type Sample = Vec<Value>;

/// The random numbers that a copied method takes.
#[derive(Clone, Copy)]
pub(crate) struct CopiedNumbers {
    key: Value,
    sampler: Sampler,
    /// The local that counts the numbers taken.
    count: VariableId,
}

impl Linker {
    /// Computes a query about lights.
    pub(super) fn ask_lights(
        &mut self,
        caller: &Site<'_>,
        (links, sampler): (&LightLinks, &Sampler),
        query: Query,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Option<Vec<Value>>> {
        match query {
            Query::SkyCount => {
                let count = rtsl_ir::Constant::I32(links.skies.len() as i32);
                Ok(Some(vec![self.constant(to, count)?]))
            }
            Query::SampleLight => match &links.selection {
                Some(selection) => {
                    let links = (links, selection, sampler);
                    Ok(Some(self.light_sample(caller, links, operands, to)?))
                }
                None => Ok(None),
            },
            Query::SkyPdf if links.selection.is_none() => Ok(None),
            Query::SkyEmission | Query::SkyPdf => {
                let zero = Arithmetic { linker: &mut *self, to: &mut *to }.float(0.0)?;
                let mut results = vec![zero; query.result_scalars().count()];
                for (index, sky) in (0..).zip(&links.skies) {
                    let part = links.selection.as_ref().map_or(0.0, |it| it.part(*sky));
                    let light = (&links.lights[*sky], part);
                    let mut then = Region::default();
                    then.yields = self.nested(|linker| {
                        linker.sky(caller, light, query, &operands[1..], &mut then.ops)
                    })?;
                    let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
                    let index = code.linker.constant(code.to, rtsl_ir::Constant::I32(index))?;
                    let condition = code.compare(CompareOp::Equal, operands[0], index)?;
                    results = self.branch(condition, then, results, to)?;
                }
                Ok(Some(results))
            }
            _ => Ok(None),
        }
    }

    /// Adds an `if` whose other side yields these values.
    fn branch(
        &mut self,
        condition: Value,
        then: Region,
        otherwise: Vec<Value>,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let scalars: Vec<Scalar> = otherwise.iter().map(|value| self.out.scalar(*value)).collect();
        let otherwise = Region { yields: otherwise, ..Region::default() };
        let kind = OpKind::If { condition, then, otherwise };
        Ok(self.emit(to, kind, &scalars, false)?.iter().collect())
    }

    /// The radiance of a light for a ray that leaves the scene, or the density of its direction.
    fn sky(
        &mut self,
        caller: &Site<'_>,
        (light, part): (&LightLink, f32),
        query: Query,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let vector = |first: usize| [operands[first], operands[first + 1], operands[first + 2]];
        let is_density = query == Query::SkyPdf;
        let world_direction = if is_density { vector(9) } else { vector(3) };
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let inverse = code.map(&light.inverse())?;
        let up = code.vector([0.0, 0.0, 1.0])?;
        let direction = code.transformed_vector(&inverse, world_direction)?;
        let direction = code.normalized_or(direction, up)?;
        let origin = code.transformed_point(&inverse, vector(0))?;
        let mut state = Vec::new();
        set(&mut state, "rt_RayOrigin", &origin);
        set(&mut state, "rt_RayDirection", &direction);
        set(&mut state, "rt_LightDirection", &direction);
        set(&mut state, "rt_HitPoint", &origin);
        let time = code.column(TIME_COLUMN, Scalar::F32)?;
        set(&mut state, "rt_TimeSeed", &[time]);
        if !is_density {
            let Some(emission) = &light.emission else {
                return Ok(vec![code.float(0.0)?; 3]);
            };
            let set = self.light_method(caller, light, emission, state, to)?;
            return self.results(&set, "rt_EmissionColor", to);
        }
        let Some(density) = light.density.as_ref().filter(|_| part > 0.0) else {
            return Ok(vec![code.float(0.0)?]);
        };
        let forward = code.map(&light.forward())?;
        for (name, normal) in [("rt_GeometricNormal", vector(3)), ("rt_ShadingNormal", vector(6))] {
            let normal = code.transposed_vector(&forward, normal)?;
            let normal = code.normalized_or(normal, up)?;
            set(&mut state, name, &normal);
        }
        let set = self.light_method(caller, light, density, state, to)?;
        let density = self.results(&set, "rt_PDF", to)?[0];
        let code = &mut Arithmetic { linker: self, to };
        let part = code.float(part)?;
        Ok(vec![code.multiply(density, part)?])
    }

    /// Selects and samples a light.
    fn light_sample(
        &mut self,
        caller: &Site<'_>,
        (links, selection, sampler): (&LightLinks, &LightSelection, &Sampler),
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let vector = |first: usize| [operands[first], operands[first + 1], operands[first + 2]];
        let lit =
            LitPoint { point: vector(0), normals: [vector(3), vector(6)], offset: operands[9] };
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let zero = code.float(0.0)?;
        let parts = selection.parts();
        if parts.is_empty() {
            let none = code.linker.constant(code.to, rtsl_ir::Constant::Bool(false))?;
            return Ok([&[none][..], &[zero; 8]].concat());
        }
        let key = code.light_key()?;
        let (last, earlier) = parts.split_last().expect("there are some");
        let mut sample = {
            let light = (&links.lights[last.0], last.1);
            self.sample_of(caller, light, (&lit, key, sampler), to)?
        };
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let probability = code.float(selection.probability)?;
        let place = code.divide(operands[10], probability)?;
        // The last is computed for all paths; short methods become selects anyway.
        for (index, (light, part)) in earlier.iter().enumerate().rev() {
            let light = (&links.lights[*light], *part);
            let mut then = Region::default();
            then.yields = self.nested(|linker| {
                linker.sample_of(caller, light, (&lit, key, sampler), &mut then.ops)
            })?;
            let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
            let bound = code.float((index + 1) as f32)?;
            let condition = code.less(place, bound)?;
            sample = self.branch(condition, then, sample, to)?;
        }
        let code = &mut Arithmetic { linker: self, to };
        code.found_or_zeros(sample)
    }

    /// Returns direction, distance, colour and density of a sample of one light, which has been selected with a
    /// probability.
    fn sample_of(
        &mut self,
        caller: &Site<'_>,
        (light, part): (&LightLink, f32),
        (lit, key, sampler): (&LitPoint, Value, &Sampler),
        to: &mut Vec<Op>,
    ) -> Linking<Sample> {
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let Some(illumination) = &light.illumination else {
            return Ok(vec![code.float(0.0)?; 8]);
        };
        let mut state = Vec::new();
        let (mut point, mut normals) = (lit.point, lit.normals);
        let forward = if light.is_placed {
            let (inverse, forward) = (code.map(&light.inverse())?, code.map(&light.forward())?);
            point = code.transformed_point(&inverse, point)?;
            let up = code.vector([0.0, 0.0, 1.0])?;
            for normal in &mut normals {
                let local = code.transposed_vector(&forward, *normal)?;
                *normal = code.normalized_or(local, up)?;
            }
            Some(forward)
        } else {
            None
        };
        let time = code.column(TIME_COLUMN, Scalar::F32)?;
        for (name, values) in [
            ("rt_HitPoint", &point[..]),
            ("rt_GeometricNormal", &normals[0]),
            ("rt_ShadingNormal", &normals[1]),
            ("rt_TimeSeed", &[time]),
        ] {
            set(&mut state, name, values);
        }
        let numbers = code.linker.new_numbers(key, *sampler, code.to)?;
        self.copied_numbers = Some(numbers);
        let called = self.light_method(caller, light, illumination, state, to);
        self.copied_numbers = None;
        let set = called?;
        let direction = self.results(&set, "rt_LightDirection", to)?;
        let distance = self.results(&set, "rt_LightDistance", to)?[0];
        let color = self.results(&set, "rt_LightColor", to)?;
        let density = self.results(&set, "rt_PDF", to)?[0];
        let code = &mut Arithmetic { linker: self, to };
        let vector = |values: &[Value]| [values[0], values[1], values[2]];
        let sample =
            LocalSample { direction: vector(&direction), distance, color: vector(&color), density };
        code.weighed(sample, forward.as_ref(), (lit.offset, part, light.is_weighed))
    }

    /// Copies a method of a light, and returns the state that it sets.
    fn light_method(
        &mut self,
        caller: &Site<'_>,
        light: &LightLink,
        method: &LinkedMethod,
        state: Vec<(StateComponent, Value)>,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let scratch = self.scratch.replace(Vec::new());
        let set = self.copy_method(caller, &light.prefix, method, state, to);
        self.scratch = scratch;
        set
    }

    /// Returns the values of a state variable that a light's method has set.
    fn results(
        &mut self,
        set: &[(StateComponent, Value)],
        name: &str,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let Some(variable) = lookup_state(name) else { return Ok(Vec::new()) };
        let components = 0..variable.ty.components();
        components
            .map(|component| {
                let wanted = StateComponent { variable: variable.index, component };
                match find_override(set, wanted) {
                    Some(value) => Ok(value),
                    None => self.constant(to, default_of(Role::Light, wanted)),
                }
            })
            .collect()
    }

    /// Returns the local that counts a path's light samples.
    fn light_counter(&mut self) -> VariableId {
        if let Some(counter) = self.light_counter {
            return counter;
        }
        let name = LIGHT_COLUMN.to_owned();
        let local = Variable { kind: VariableKind::Local, name, scalar: Scalar::U32, len: 1 };
        let counter = self.intern_variable(local);
        self.light_counter = Some(counter);
        counter
    }

    /// Loads the counter of light samples when the stage begins, and stores it when it ends.
    pub(super) fn pass_on_light_counter(&mut self) -> Linking<()> {
        let Some(counter) = self.light_counter else { return Ok(()) };
        let mut ops = Vec::new();
        let code = &mut Arithmetic { linker: &mut *self, to: &mut ops };
        let before = code.column(LIGHT_COLUMN, Scalar::U32)?;
        code.store(counter, before)?;
        let mut body = std::mem::take(&mut self.out.body);
        ops.append(&mut body.ops);
        let kind = OpKind::Load(counter, Index::Constant(0));
        let after = self.emit(&mut ops, kind, &[Scalar::U32], false)?.get(0);
        let kind = VariableKind::Scratch;
        let name = LIGHT_COLUMN.to_owned();
        let column = self.intern_variable(Variable { kind, name, scalar: Scalar::U32, len: 1 });
        self.out.outputs.push(Output { variable: column, component: 0 });
        body.yields.push(after);
        self.out.body = Region { ops, ..body };
        Ok(())
    }

    /// Begins the random numbers of a copied method.
    fn new_numbers(
        &mut self,
        key: Value,
        sampler: Sampler,
        to: &mut Vec<Op>,
    ) -> Linking<CopiedNumbers> {
        let name = format!("numbers.{}", self.out.variables.len());
        let local = Variable { kind: VariableKind::Local, name, scalar: Scalar::U32, len: 1 };
        let count = self.intern_variable(local);
        let code = &mut Arithmetic { linker: self, to };
        let zero = code.word(0)?;
        code.store(count, zero)?;
        Ok(CopiedNumbers { key, sampler, count })
    }

    /// Returns the next random number of a method that is being copied.
    pub(super) fn next_number(
        &mut self,
        numbers: CopiedNumbers,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let CopiedNumbers { key, sampler, count } = numbers;
        let code = &mut Arithmetic { linker: self, to };
        let kind = OpKind::Load(count, Index::Constant(0));
        let dimension = code.linker.emit(code.to, kind, &[Scalar::U32], false)?.get(0);
        let one = code.word(1)?;
        let next = code.add(dimension, one)?;
        code.store(count, next)?;
        let sample = code.column(SAMPLE_COLUMN, Scalar::U32)?;
        code.number_of_stream(&sampler, key, dimension, sample)
    }
}

/// A sample in the space of its light.
struct LocalSample {
    direction: Vector,
    distance: Value,
    color: Vector,
    density: Value,
}

impl Arithmetic<'_> {
    /// Stores a scalar of a local.
    fn store(&mut self, local: VariableId, value: Value) -> Linking<()> {
        let kind = OpKind::Store(local, Index::Constant(0), value);
        self.linker.emit(self.to, kind, &[], false).map(drop)
    }

    /// Begins a path's sequence of numbers for a light sample, and returns its key.
    fn light_key(&mut self) -> Linking<Value> {
        let counter = self.linker.light_counter();
        let kind = OpKind::Load(counter, Index::Constant(0));
        let count = self.linker.emit(self.to, kind, &[Scalar::U32], false)?.get(0);
        let one = self.word(1)?;
        let count = self.add(count, one)?;
        self.store(counter, count)?;
        let key = self.column(KEY_COLUMN, Scalar::U32)?;
        let key = self.hash_with(key, NUMBERS_OF_LIGHT_SAMPLES)?;
        let key = self.hash(key, count)?;
        self.hash_with(key, NUMBERS_OF_LIGHTS)
    }

    /// Transforms a sample to the world, and divides its colour by its density, the probability of the light included.
    fn weighed(
        &mut self,
        sample: LocalSample,
        forward: Option<&Map>,
        (offset, part, is_weighed): (Value, f32, bool),
    ) -> Linking<Sample> {
        let LocalSample { mut direction, mut distance, mut color, density: own } = sample;
        if let Some(forward) = forward {
            let world = self.transformed_vector(forward, direction)?;
            let stretch = self.products(world, world)?;
            let scale = self.delta_scale(stretch, distance, own)?;
            color = self.scaled(color, scale)?;
            let length = self.root(stretch)?;
            distance = self.multiply(distance, length)?;
            direction = self.normalized_or(world, direction)?;
        }
        let reach = self.float(1.0 - LIGHT_MARGIN)?;
        let end = self.multiply(distance, reach)?;
        let end = self.binary(BinaryOp::Subtract, end, offset)?;
        let (zero, one, part) = (self.float(0.0)?, self.float(1.0)?, self.float(part)?);
        let density = self.multiply(own, part)?;
        // With a NaN density the sample is NaN, not a delta.
        let is_delta = self.compare(CompareOp::LessEqual, own, zero)?;
        let divisor = self.select(is_delta, part, density)?;
        let scale = self.divide(one, divisor)?;
        let color = self.scaled(color, scale)?;
        let density = if is_weighed { density } else { zero };
        Ok([&direction[..], &[end], &color, &[density]].concat())
    }

    /// The factor that converts the colour of a delta light's sample to the world.
    fn delta_scale(&mut self, stretch: Value, distance: Value, density: Value) -> Linking<Value> {
        let (zero, one) = (self.float(0.0)?, self.float(1.0)?);
        let (rounding, infinity) = (self.float(STRETCH_ROUNDING)?, self.float(f32::INFINITY)?);
        let difference = self.binary(BinaryOp::Subtract, stretch, one)?;
        let difference = self.unary(UnaryOp::Abs, difference)?;
        let is_scaled = self.compare(CompareOp::Greater, difference, rounding)?;
        let has_no_density = self.compare(CompareOp::LessEqual, density, zero)?;
        let is_near = self.less(distance, infinity)?;
        let is_delta = self.and(has_no_density, is_near)?;
        let is_changed = self.and(is_scaled, is_delta)?;
        let scale = self.divide(one, stretch)?;
        self.select(is_changed, scale, one)
    }

    /// Returns the results of the query: zeros for black samples.
    fn found_or_zeros(&mut self, sample: Sample) -> Linking<Vec<Value>> {
        let zero = self.float(0.0)?;
        let mut found = None;
        for channel in &sample[4..7] {
            let is_lit = self.compare(CompareOp::NotEqual, *channel, zero)?;
            found = Some(match found {
                Some(found) => self.binary(BinaryOp::Or, found, is_lit)?,
                None => is_lit,
            });
        }
        let found = found.expect("colours have channels");
        let mut results = vec![found];
        for value in sample {
            results.push(self.select(found, value, zero)?);
        }
        Ok(results)
    }
}

fn set(state: &mut Vec<(StateComponent, Value)>, name: &str, values: &[Value]) {
    let Some(variable) = lookup_state(name) else { return };
    state.extend((0..).zip(values).map(|(component, value)| {
        (StateComponent { variable: variable.index, component }, *value)
    }));
}
