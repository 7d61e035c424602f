//! Lights in stages: samples of them, and the radiance of those without a shape for rays that leave the scene. Their
//! methods are called between the functions of `prelude/renderer/lights.rtsl`.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::{BinaryOp, CompareOp, Op, OpKind, Query, Region, Scalar, StateComponent, Value};
use rtsl_link::{LinkedMethod, Linker, Linking, default_of, find_override};
use rtsl_math::sampling::Sampler;
use rtsl_spec::{Role, lookup_state};

use crate::arithmetic::{Arithmetic, Map, Vector, vector_at};
use crate::chosen_light::{ChosenLight, LightClassLink, LightMethods};
use crate::light_selection::LightSelection;
use crate::query_columns::QueryColumns;
use crate::sequences::Purpose;
use crate::stage::{TIME_COLUMN, asks_host};
use crate::stage_linker::StageLinker;
use crate::surface::{Places, needs_only};

/// The greatest number of lights that are linked, which bounds the data of stages.
pub const MAX_LIGHTS: usize = 1 << 16;

/// The greatest number of classes of lights that are linked: each has code of its own in every stage that samples.
pub const MAX_LIGHT_CLASSES: usize = 16;

/// The lights of a scene.
#[derive(Clone, Debug, Default)]
pub struct LightLinks {
    /// The classes of lights, those that are sampled first.
    pub classes: Vec<LightClassLink>,
    /// The number of classes that are sampled.
    pub sampled: usize,
    /// True if samples of all lights are linked; else hosts sample lights.
    pub is_complete: bool,
    /// The lights that rays find when they leave the scene, by their indices.
    pub skies: Vec<usize>,
    /// The selection of lights for samples; `None` if hosts select them.
    pub selection: Option<LightSelection>,
    /// True if operations sample the lights that materials name by their indices.
    pub has_entries: bool,
    /// The numbers of these lights, in this order.
    pub entries: Vec<u32>,
}

/// The member with the numbers of the lights that materials name by their indices.
pub const ENTRIES: &str = "light.rt_Entries";

impl LightLinks {
    /// True if lights of the same programs have the same code, whatever their data.
    pub fn is_like(&self, other: &LightLinks) -> bool {
        let has_like_selection = match (&self.selection, &other.selection) {
            (Some(own), Some(others)) => own.is_like(others),
            (own, others) => own.is_none() && others.is_none(),
        };
        let mut classes = self.classes.iter().zip(&other.classes);
        self.classes.len() == other.classes.len()
            && classes.all(|(own, others)| own.is_like(others))
            && (self.sampled, self.is_complete) == (other.sampled, other.is_complete)
            && (&self.skies, &self.entries) == (&other.skies, &other.entries)
            && self.has_entries == other.has_entries
            && has_like_selection
    }

    /// Returns the numbers of lights by their indices: lights are numbered class by class.
    pub fn numbers(&self) -> BTreeMap<usize, u32> {
        self.classes.iter().flat_map(|class| class.lights.iter().copied()).zip(0..).collect()
    }

    /// Returns the class of a light, and its index there.
    fn place_of(&self, light: usize) -> Option<(&LightClassLink, usize)> {
        self.classes.iter().find_map(|class| {
            let place = class.lights.iter().position(|other| *other == light)?;
            Some((class, place))
        })
    }
}

/// A light.
#[derive(Clone, Debug)]
pub struct LightLink {
    /// The path to its members: `light.0.`.
    pub prefix: String,
    /// `illumination`, if the class has it.
    pub illumination: Option<Arc<LinkedMethod>>,
    /// `emission`, if the class has it.
    pub emission: Option<Arc<LinkedMethod>>,
    /// `evaluatePDF`, if the class has it and directions are weighed.
    pub density: Option<Arc<LinkedMethod>>,
    /// True if samples are transformed to the world.
    pub is_placed: bool,
    /// True if rays that leave the scene can find the light, so that samples at infinity have densities.
    pub is_weighed: bool,
    /// The data with the maps between the world and the light's space.
    pub places: Places,
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

    /// Loads the map from the world to the light's space, and the map back.
    fn maps(&self, code: &mut Arithmetic<'_>) -> Linking<[Map; 2]> {
        match self.places {
            Places::Members { .. } => Ok([code.map(&self.inverse())?, code.map(&self.forward())?]),
            Places::Columns { .. } => {
                let first = QueryColumns::MAPS;
                Ok([code.query_map(first)?, code.query_map(first + 12)?])
            }
        }
    }

    /// True if the methods need nothing but what queries give and, for samples, random numbers.
    pub fn is_complete(&self) -> bool {
        let is_fixed = |it: &Arc<LinkedMethod>| !it.reads_scratch && needs_only(it, &INPUTS);
        let has_inputs =
            |it: &Arc<LinkedMethod>| it.reads.iter().all(|it| INPUTS.contains(&it.name));
        self.emission.iter().chain(&self.density).all(is_fixed)
            && self.illumination.iter().all(|it| may_draw_only(it) && has_inputs(it))
    }
}

/// True if a method asks nothing of a host but random numbers.
pub(crate) fn may_draw_only(method: &LinkedMethod) -> bool {
    let mut is_plain = !method.reads_scratch;
    method.function.body.for_each_op(&mut |op| {
        is_plain &= !asks_host(&op.kind) || op.kind == OpKind::Rand;
    });
    is_plain
}

/// The point that a light is sampled for.
#[derive(Clone, Copy)]
pub(crate) struct LitPoint {
    pub point: Vector,
    pub normals: [Vector; 2],
    /// The offset of the origins of rays that leave it.
    pub offset: Value,
}

/// A sample of a light in the world, which is not weighed: an `rt_SampleOfLight`.
pub(crate) struct SampledColor {
    pub direction: Vector,
    /// The distance of the sampled point.
    pub distance: Value,
    /// The length of the shadow ray.
    pub end: Value,
    pub color: Vector,
    /// The density, without the probability of the light; 0 or less for deltas.
    pub density: Value,
}

impl SampledColor {
    pub fn of_scalars(scalars: &[Value]) -> SampledColor {
        SampledColor {
            direction: vector_at(scalars, 0),
            distance: scalars[3],
            end: scalars[4],
            color: vector_at(scalars, 5),
            density: scalars[8],
        }
    }
}

/// The properties of a sample that decide its weight.
#[derive(Clone, Copy)]
pub(crate) struct SampleWeight {
    /// True if radiances are divided by densities with which rays find the light, too.
    pub divides: Value,
    /// True if rays find the sample.
    pub is_found: Value,
    /// The probability with which its light was selected.
    pub probability: Value,
}

/// A sample of a light, as the results of its query, without the first.
type Sample = Vec<Value>;

/// Adds the operations for a sample of a light of a class, whose members are chosen.
pub(crate) type ClassSample<'a> =
    dyn FnMut(&mut StageLinker, &LightClassLink, &mut Vec<Op>) -> Linking<Sample> + 'a;

impl StageLinker {
    /// Computes a query about lights.
    pub(crate) fn ask_lights(
        &mut self,
        links: &LightLinks,
        sampler: &Sampler,
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
                Some(selection) if links.is_complete => {
                    Ok(Some(self.light_sample(links, selection, sampler, operands, to)?))
                }
                _ => Ok(None),
            },
            Query::SkyPdf if links.selection.is_none() => Ok(None),
            Query::SkyEmission | Query::SkyPdf => {
                let zero = Arithmetic { linker: &mut *self, to: &mut *to }.float(0.0)?;
                let mut results = vec![zero; query.result_scalars().count()];
                for (index, sky) in (0..).zip(&links.skies) {
                    let mut then = Region::default();
                    then.yields = self.nested(|linker| {
                        linker.sky(links, *sky, query, &operands[1..], &mut then.ops)
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
    pub(crate) fn branch(
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
        links: &LightLinks,
        index: usize,
        query: Query,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let Some((class, place)) = links.place_of(index) else { return Ok(Vec::new()) };
        let LightMethods::Shapeless(light) = &class.methods else { return Ok(Vec::new()) };
        let place = self.constant(to, rtsl_ir::Constant::I32(place as i32))?;
        self.chosen_light = Some(Arc::new(ChosenLight::of(class, place)));
        let results = self.shapeless_sky(links, light, index, query, operands, to);
        self.chosen_light = None;
        results
    }

    /// As [`StageLinker::sky`], of a light whose members are chosen.
    fn shapeless_sky(
        &mut self,
        links: &LightLinks,
        light: &LightLink,
        index: usize,
        query: Query,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let vector = |first: usize| vector_at(operands, first);
        if query == Query::SkyEmission {
            return self.sky_emission(light, [vector(0), vector(3)], to);
        }
        let part = match &links.selection {
            Some(selection) => self.probability_of(selection, index, vector(0), to)?,
            None => None,
        };
        let Some(part) = part.filter(|_| light.density.is_some()) else {
            return Ok(vec![self.constant(to, rtsl_ir::Constant::F32(0.0))?]);
        };
        let (ray, normals) = ([vector(0), vector(9)], [vector(3), vector(6)]);
        let density = self.sky_density(light, ray, normals, to)?;
        Ok(vec![Arithmetic { linker: self, to }.multiply(density, part)?])
    }

    /// The radiance of a light for a ray that leaves the scene.
    pub(crate) fn sky_emission(
        &mut self,
        light: &LightLink,
        ray: [Vector; 2],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let Some(emission) = &light.emission else {
            return Ok(vec![self.constant(to, rtsl_ir::Constant::F32(0.0))?; 3]);
        };
        let state = Arithmetic { linker: &mut *self, to: &mut *to }.sky_state(light, ray)?;
        let set = self.light_method(&light.prefix, emission, state, to)?;
        self.results(&set, Role::Light, "rt_EmissionColor", to)
    }

    /// The density with which samples of a light find a ray that leaves the scene, for a surface with these normals at its
    /// origin.
    pub(crate) fn sky_density(
        &mut self,
        light: &LightLink,
        ray: [Vector; 2],
        normals: [Vector; 2],
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let Some(density) = &light.density else {
            return self.constant(to, rtsl_ir::Constant::F32(0.0));
        };
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let mut state = code.sky_state(light, ray)?;
        let [_, forward] = light.maps(code)?;
        let up = code.vector([0.0, 0.0, 1.0])?;
        for (name, normal) in ["rt_GeometricNormal", "rt_ShadingNormal"].into_iter().zip(normals) {
            let normal = code.transposed_vector(&forward, normal)?;
            let normal = code.normalized_or(normal, up)?;
            set(&mut state, name, &normal);
        }
        let set = self.light_method(&light.prefix, density, state, to)?;
        Ok(self.results(&set, Role::Light, "rt_PDF", to)?[0])
    }

    /// Selects and samples a light.
    fn light_sample(
        &mut self,
        links: &LightLinks,
        selection: &LightSelection,
        sampler: &Sampler,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let vector = |first: usize| [operands[first], operands[first + 1], operands[first + 2]];
        let lit =
            LitPoint { point: vector(0), normals: [vector(3), vector(6)], offset: operands[9] };
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        if selection.infinite.is_empty() && selection.nodes.is_empty() {
            let zero = code.float(0.0)?;
            let none = code.linker.constant(code.to, rtsl_ir::Constant::Bool(false))?;
            return Ok([&[none][..], &[zero; 8]].concat());
        }
        let key = code.begin_sequence(Purpose::LightSample)?;
        let selected = self.choose_light(selection, lit.point, operands[10], to)?;
        let sample =
            self.sample_by_class(links, selected.number, to, &mut |linker, class, to| {
                let (sample, is_found) = linker.sampled_color(class, &lit, key, sampler, to)?;
                let code = &mut Arithmetic { linker, to };
                let (divides, probability) = (code.boolean(true)?, selected.probability);
                let weight = SampleWeight { divides, is_found, probability };
                let (color, density) = code.weighed(sample.color, sample.density, weight)?;
                Ok([&sample.direction[..], &[sample.end], &color, &[density]].concat())
            })?;
        let code = &mut Arithmetic { linker: self, to };
        code.found_or_zeros(sample)
    }

    /// Returns what `sample` computes for the class of the light with a number, whose members are chosen.
    pub(crate) fn sample_by_class(
        &mut self,
        links: &LightLinks,
        number: Value,
        to: &mut Vec<Op>,
        sample: &mut ClassSample<'_>,
    ) -> Linking<Sample> {
        let classes = &links.classes[..links.sampled];
        let mut end = classes.iter().map(|class| class.lights.len() as u32).sum();
        let mut sampled: Option<Sample> = None;
        // The last class is computed for all paths; short methods become selects anyway.
        for class in classes.iter().rev() {
            let first = end - class.lights.len() as u32;
            let mut then = Region::default();
            then.yields = self.nested(|linker| {
                let code = &mut Arithmetic { linker, to: &mut then.ops };
                let chosen = ChosenLight::new(code, class, number, first)?;
                linker.chosen_light = Some(Arc::new(chosen));
                let sampled = sample(linker, class, &mut then.ops);
                linker.chosen_light = None;
                sampled
            })?;
            sampled = Some(match sampled {
                None => {
                    to.append(&mut then.ops);
                    then.yields
                }
                Some(later) => {
                    let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
                    let end = code.word(end)?;
                    let condition = code.less(number, end)?;
                    self.branch(condition, then, later, to)?
                }
            });
            end = first;
        }
        Ok(sampled.expect("there are lights"))
    }

    /// Returns a sample of one light for a point, with numbers of the sequence with a key, and whether rays find it, too.
    pub(crate) fn sampled_color(
        &mut self,
        class: &LightClassLink,
        lit: &LitPoint,
        key: Value,
        sampler: &Sampler,
        to: &mut Vec<Op>,
    ) -> Linking<(SampledColor, Value)> {
        let outer = self.copied_numbers;
        self.begin_numbers(key, *sampler, to)?;
        let sampled = match &class.methods {
            LightMethods::Shapeless(light) => {
                let sample = self.shapeless_sample(light, lit, to)?;
                let code = &mut Arithmetic { linker: &mut *self, to };
                let is_found = code.is_found_sample(light, &sample)?;
                (sample, is_found)
            }
            LightMethods::Area(light) => {
                let sample = self.area_light_sample(light, lit, to)?;
                let code = &mut Arithmetic { linker: &mut *self, to };
                (sample, code.boolean(light.is_weighed)?)
            }
        };
        self.copied_numbers = outer;
        Ok(sampled)
    }

    /// Returns a sample of a light without a shape.
    pub(crate) fn shapeless_sample(
        &mut self,
        light: &LightLink,
        lit: &LitPoint,
        to: &mut Vec<Op>,
    ) -> Linking<SampledColor> {
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let Some(illumination) = &light.illumination else {
            let zero = code.float(0.0)?;
            let nothing = [zero; 3];
            return Ok(SampledColor {
                direction: nothing,
                distance: zero,
                end: zero,
                color: nothing,
                density: zero,
            });
        };
        let mut state = Vec::new();
        let (mut point, mut normals) = (lit.point, lit.normals);
        let forward = if light.is_placed {
            let [inverse, forward] = light.maps(code)?;
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
        let set = self.light_method(&light.prefix, illumination, state, to)?;
        let mut result = |name: &str| self.results(&set, Role::Light, name, to);
        let (direction, color) = (result("rt_LightDirection")?, result("rt_LightColor")?);
        let (distance, density) = (result("rt_LightDistance")?[0], result("rt_PDF")?[0]);
        let code = &mut Arithmetic { linker: self, to };
        let mut operands = vec![code.boolean(forward.is_some())?];
        let map = forward.unwrap_or([[code.float(0.0)?; 3]; 4]);
        operands.extend(map.as_flattened().iter().chain(&direction).copied());
        operands.extend([&[distance], &color[..], &[density, lit.offset]].concat());
        Ok(SampledColor::of_scalars(&code.call("rt_lightInWorld", &operands)?))
    }

    /// Copies a method of a light's part with this path to members, and returns the state that it sets.
    pub(crate) fn light_method(
        &mut self,
        prefix: &str,
        method: &LinkedMethod,
        state: Vec<(StateComponent, Value)>,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let scratch = self.scratch.replace(Vec::new());
        let set = self.copy_method(prefix, method, state, to);
        self.scratch = scratch;
        set
    }

    /// Returns the values of a state variable that a method of a light's part with this role has set.
    pub(crate) fn results(
        &mut self,
        set: &[(StateComponent, Value)],
        role: Role,
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
                    None => self.constant(to, default_of(role, wanted)),
                }
            })
            .collect()
    }
}

impl Arithmetic<'_> {
    /// The state that methods of a light have of a ray that leaves the scene.
    fn sky_state(
        &mut self,
        light: &LightLink,
        [origin, direction]: [Vector; 2],
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let [inverse, _] = light.maps(self)?;
        let up = self.vector([0.0, 0.0, 1.0])?;
        let direction = self.transformed_vector(&inverse, direction)?;
        let direction = self.normalized_or(direction, up)?;
        let origin = self.transformed_point(&inverse, origin)?;
        let time = self.column(TIME_COLUMN, Scalar::F32)?;
        let mut state = Vec::new();
        for (name, values) in [
            ("rt_RayOrigin", &origin[..]),
            ("rt_RayDirection", &direction),
            ("rt_LightDirection", &direction),
            ("rt_HitPoint", &origin),
            ("rt_TimeSeed", &[time]),
        ] {
            set(&mut state, name, values);
        }
        Ok(state)
    }

    /// Weighs a sample with this radiance and this density, and returns both.
    pub fn weighed(
        &mut self,
        color: Vector,
        density: Value,
        SampleWeight { divides, is_found, probability }: SampleWeight,
    ) -> Linking<(Vector, Value)> {
        let operands = [&[divides, is_found][..], &color, &[density, probability]].concat();
        let weighed = self.call("rt_weighSample", &operands)?;
        Ok((vector_at(&weighed, 0), weighed[3]))
    }

    /// True if rays that leave the scene find a sample of a light without a shape: those at infinity.
    pub fn is_found_sample(&mut self, light: &LightLink, sample: &SampledColor) -> Linking<Value> {
        if !light.is_weighed {
            return self.boolean(false);
        }
        let infinity = self.float(f32::INFINITY)?;
        self.compare(CompareOp::Equal, sample.distance, infinity)
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

/// Adds the values of a state variable.
pub(crate) fn set(state: &mut Vec<(StateComponent, Value)>, name: &str, values: &[Value]) {
    let Some(variable) = lookup_state(name) else { return };
    state.extend((0..).zip(values).map(|(component, value)| {
        (StateComponent { variable: variable.index, component }, *value)
    }));
}
