//! Samples of lights that are shapes: their `generateSample` and `emission`, between the functions of
//! `prelude/renderer/lights.rtsl`.

use std::sync::Arc;

use rtsl_ir::{Constant, Op, Query, Scalar, StateComponent, Value};
use rtsl_link::{LinkedMethod, Linking};
use rtsl_spec::{Role, StateVariable};

use crate::arithmetic::{Arithmetic, Vector, vector_at};
use crate::lights::{LitPoint, SampledColor, may_draw_only, set};
use crate::stage::{Input, TIME_COLUMN, input};
use crate::stage_linker::StageLinker;
use crate::surface::ShapeLinks;

/// The member with the least distance of hits.
pub const EPSILON: &str = "light.rt_Epsilon";

/// The state that emitters and alpha textures may read of a sampled point without methods of its shape.
pub const PROVIDED_BY_LIGHT_SAMPLES: [&str; 8] = [
    "rt_RayOrigin",
    "rt_RayDirection",
    "rt_HitPoint",
    "rt_HitDistance",
    "rt_GeometricNormal",
    "rt_ShadingNormal",
    "rt_Epsilon",
    "rt_TimeSeed",
];

/// The state that `generateSample` may read.
const INPUTS: [&str; 3] = ["rt_RayOrigin", "rt_Epsilon", "rt_TimeSeed"];
/// The state that it must set.
const OUTPUTS: [&str; 3] = ["rt_HitPoint", "rt_GeometricNormal", "rt_PDF"];

/// A shape with an emitter.
#[derive(Clone, Debug)]
pub struct AreaLightLink {
    /// The shape, with its path to members: `light.0.shape.`.
    pub shape: ShapeLinks,
    /// `generateSample`.
    pub generate: Arc<LinkedMethod>,
    /// The path to the emitter's members.
    pub emitter: String,
    /// `emission`.
    pub emission: Arc<LinkedMethod>,
    /// The texture that cuts the shape out, if there is one.
    pub alpha: Option<AlphaLink>,
    /// True if rays can hit the shape, so that samples have densities.
    pub is_weighed: bool,
}

/// A texture that cuts a shape out.
#[derive(Clone, Debug)]
pub struct AlphaLink {
    /// The path to its members.
    pub prefix: String,
    /// `lookup`.
    pub lookup: Arc<LinkedMethod>,
}

impl AreaLightLink {
    /// True if the methods need nothing but the lit point and random numbers.
    pub fn is_complete(&self) -> bool {
        let AreaLightLink { shape, generate, .. } = self;
        let sets = |name: &str| generate.writes.iter().any(|it| it.name == name);
        let is_readable =
            |it: &StateVariable| input(Query::LightEmission, it).is_some_and(Input::is_of_surface);
        may_draw_only(generate)
            && self.readers().all(may_draw_only)
            && generate.reads.iter().all(|it| INPUTS.contains(&it.name))
            && OUTPUTS.into_iter().all(sets)
            && self.reads().all(is_readable)
            && (!self.needs_surface() || shape.is_complete())
    }

    /// The methods that read sampled points.
    fn readers(&self) -> impl Iterator<Item = &LinkedMethod> {
        let lookup = self.alpha.iter().map(|alpha| &*alpha.lookup);
        std::iter::once(&*self.emission).chain(lookup)
    }

    /// The state that they read.
    fn reads(&self) -> impl Iterator<Item = &'static StateVariable> {
        self.readers().flat_map(|method| method.reads.iter().copied())
    }

    /// True if any of it is computed by methods of the shape.
    fn needs_surface(&self) -> bool {
        !self.reads().all(|it| PROVIDED_BY_LIGHT_SAMPLES.contains(&it.name))
    }
}

/// A sampled point of a shape, in the world.
pub(crate) struct SampledPoint {
    pub point: Vector,
    pub normal: Vector,
    /// Without colour.
    pub sample: SampledColor,
}

impl StageLinker {
    /// Returns a sample of a light as seen from a point.
    pub(crate) fn area_light_sample(
        &mut self,
        light: &AreaLightLink,
        lit: &LitPoint,
        to: &mut Vec<Op>,
    ) -> Linking<SampledColor> {
        let moment = Arithmetic { linker: &mut *self, to: &mut *to }.moment()?;
        let sampled = self.sampled_point(&light.shape, &light.generate, lit, &moment, to)?;
        let state = self.sampled_state(light, lit, &sampled, to)?;
        let set = self.light_method(&light.emitter, &light.emission, state.clone(), to)?;
        let emission = self.results(&set, Role::Material, "rt_EmissionColor", to)?;
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let operands = [&emission[..], &[sampled.sample.density]].concat();
        let mut color = code.call("rt_usableEmission", &operands)?;
        if let Some(AlphaLink { prefix, lookup }) = &light.alpha {
            let set = self.light_method(prefix, lookup, state, to)?;
            color.extend(self.results(&set, Role::Texture, "rt_FloatTextureValue", to)?);
            color = Arithmetic { linker: self, to }.call("rt_emissionWithAlpha", &color)?;
        }
        Ok(SampledColor { color: vector_at(&color, 0), ..sampled.sample })
    }

    /// Samples a point of a shape by `generateSample`, which has the state of all methods.
    pub(crate) fn sampled_point(
        &mut self,
        shape: &ShapeLinks,
        generate: &LinkedMethod,
        lit: &LitPoint,
        moment: &[(&str, Vec<Value>)],
        to: &mut Vec<Op>,
    ) -> Linking<SampledPoint> {
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let place = shape.place(code)?;
        let origin = code.call("rt_pointInShape", &[&place[..], &lit.point].concat())?;
        let mut state = Vec::new();
        moment.iter().for_each(|(name, values)| set(&mut state, name, values));
        set(&mut state, "rt_RayOrigin", &origin);
        let set = self.light_method(&shape.prefix, generate, state, to)?;
        let mut operands = [&place[..], &lit.point, &[lit.offset]].concat();
        for name in OUTPUTS {
            operands.extend(self.results(&set, Role::Primitive, name, to)?);
        }
        let seen = Arithmetic { linker: self, to }.call("rt_seenFrom", &operands)?;
        let (point, normal) = (vector_at(&seen, 0), vector_at(&seen, 3));
        Ok(SampledPoint { point, normal, sample: SampledColor::of_scalars(&seen[6..]) })
    }

    /// Returns the state that emitter and alpha texture may read of a sampled point, seen from the lit point.
    fn sampled_state(
        &mut self,
        light: &AreaLightLink,
        lit: &LitPoint,
        sampled: &SampledPoint,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let SampledPoint { point, normal, sample } = sampled;
        let SampledColor { direction, distance, .. } = sample;
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let mut state = Vec::new();
        for (name, values) in code.moment()? {
            set(&mut state, name, &values);
        }
        if light.needs_surface() {
            let operands = code.operands_of_ray(lit.point, *direction, *distance)?;
            let properties = self.surface_properties(&light.shape, &operands, to)?;
            let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
            state.extend(code.inputs_of_emission(light.reads(), &operands, &properties)?);
        } else {
            for (name, values) in [
                ("rt_RayOrigin", &lit.point[..]),
                ("rt_RayDirection", direction),
                ("rt_HitDistance", &[*distance]),
                ("rt_HitPoint", point),
                ("rt_GeometricNormal", normal),
                ("rt_ShadingNormal", normal),
            ] {
                set(&mut state, name, values);
            }
        }
        Ok(state)
    }
}

impl Arithmetic<'_> {
    /// The state of all methods.
    fn moment(&mut self) -> Linking<[(&'static str, Vec<Value>); 2]> {
        let epsilon = self.load_member(EPSILON, Scalar::F32)?;
        let time = self.column(TIME_COLUMN, Scalar::F32)?;
        Ok([("rt_Epsilon", vec![epsilon]), ("rt_TimeSeed", vec![time])])
    }

    /// The operands of queries about the surface that a ray without a footprint hits.
    fn operands_of_ray(
        &mut self,
        origin: Vector,
        direction: Vector,
        distance: Value,
    ) -> Linking<Vec<Value>> {
        let (zero, limit) = (self.float(0.0)?, self.float(f32::INFINITY)?);
        let none = self.linker.constant(self.to, Constant::I32(0))?;
        let epsilon = self.load_member(EPSILON, Scalar::F32)?;
        let mut operands = Vec::new();
        for (name, scalar, count) in Query::SurfaceProperties.operands() {
            match name {
                "origin" => operands.extend(origin),
                "direction" => operands.extend(direction),
                "distance" => operands.push(distance),
                "epsilon" => operands.push(epsilon),
                "limit" => operands.push(limit),
                _ => {
                    let none = if scalar == Scalar::F32 { zero } else { none };
                    operands.extend(std::iter::repeat_n(none, count as usize));
                }
            }
        }
        Ok(operands)
    }

    /// The state that is read of a surface, given operands of queries and the properties. The time is known, and paths of
    /// light samples have no depth.
    fn inputs_of_emission(
        &mut self,
        reads: impl Iterator<Item = &'static StateVariable>,
        operands: &[Value],
        properties: &[Value],
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let query = Query::LightEmission;
        let is_footprint = |variable: &StateVariable| ["rt_du", "rt_dv"].contains(&variable.name);
        let is_column = |variable| matches!(input(query, variable), Some(Input::Column(_)));
        let (footprint, others): (Vec<_>, Vec<_>) = reads
            .filter(|variable| !is_column(variable))
            .partition(|variable| is_footprint(variable));
        let mut state = self.inputs(query, &others, operands, properties)?;
        for variable in footprint {
            let zero = self.float(0.0)?;
            state.push((StateComponent { variable: variable.index, component: 0 }, zero));
        }
        Ok(state)
    }
}
