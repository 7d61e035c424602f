//! Linking of a stage of an integrator with the methods of one class of surfaces.
//!
//! The bodies of these methods replace the queries about the stage's surface. They were optimised and contracted by
//! themselves before, and are not contracted again, so each has the bits of a call.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::{
    Constant, Function, Op, OpKind, Query, SURFACE_SCALARS, Scalar, StateComponent, Value,
};
use rtsl_link::{Linked, LinkedMethod, Linker, Linking, Site, default_of, find_override};
use rtsl_math::sampling::Sampler;
use rtsl_source::Diagnostic;
use rtsl_spec::{ATTRIBUTES, Role, StateVariable, TO_OBJECT, TO_WORLD, lookup_state};
use rtsl_stages::Port;

use crate::arithmetic::Arithmetic;
use crate::contribution::Contributions;
use crate::lights::LightLinks;
use crate::sequences::Purpose;
use crate::stage_linker::StageLinker;
use crate::stage_search::StageSearch;
use crate::surface::ShapeLinks;

/// The scratch array with the time of each path within the shutter.
pub const TIME_COLUMN: &str = "path.time";
/// The scratch array with the number of surfaces that each path has met before.
pub const DEPTH_COLUMN: &str = "path.depth";
/// The scratch array with the type of the ray that each path has searched along last.
pub const RAY_TYPE_COLUMN: &str = "path.ray_type";

/// The answers to queries about the surfaces of one class.
#[derive(Debug, Default)]
pub struct SurfaceLinks {
    /// The answers that are not requested of the host.
    pub answers: BTreeMap<Query, Answer>,
    /// The answer of the search that resumes the stage, if it is the same for all paths.
    pub found: Option<bool>,
    /// The shapes that compute properties of surfaces.
    pub shape: Option<ShapeLinks>,
    /// The sampler of paths, if its numbers are computed by operations.
    pub sampler: Option<Sampler>,
    /// The lights, if operations compute their samples.
    pub lights: Option<Arc<LightLinks>>,
    /// True if the stage begins right after a search of the path.
    pub follows_search: bool,
    /// The method of a material that the stages are of, unless they are of an integrator.
    pub material: Option<MaterialStages>,
    /// The use of the stage's contributions.
    pub contributions: Contributions,
    /// The searches that the stage makes at its end; without, it stores its contribution and its request.
    pub search: Option<Arc<StageSearch>>,
}

/// The stages of a method of materials.
#[derive(Clone, Copy, Debug)]
pub struct MaterialStages {
    /// True if the light of lights is added to the radiance of the path that asks for the colour, instead of the colour.
    pub adds_to_path: bool,
}

/// An answer to a query.
#[derive(Debug)]
pub enum Answer {
    /// Zeros.
    Zeros,
    /// The results of a method.
    Method(SurfaceMethod),
}

impl Answer {
    /// The method that answers.
    pub fn method(&self) -> Option<&Arc<LinkedMethod>> {
        match self {
            Answer::Method(answer) => Some(&answer.method),
            Answer::Zeros => None,
        }
    }
}

/// A linked method of a surface's part.
#[derive(Debug)]
pub struct SurfaceMethod {
    /// The path to the part's members: `material.`.
    pub prefix: &'static str,
    /// The method.
    pub method: Arc<LinkedMethod>,
    /// The state with its results.
    results: &'static [&'static str],
}

/// The source of a state variable that a method reads.
#[derive(Clone, Copy)]
pub(crate) enum Input {
    /// Operands of the query from this one on.
    Operand(usize),
    /// Properties of the surface from this one on.
    Property(usize),
    /// An operand that is an index, as a float.
    Number(usize),
    /// The reciprocal components of the ray's direction.
    InverseDirection,
    /// A scratch array.
    Column(&'static str),
    /// 0 for all paths.
    Zero,
}

impl Input {
    /// True if it depends on the ray and its hit only, and not on which object of the scene the ray hit.
    pub fn is_of_surface(self) -> bool {
        match self {
            Input::Column(name) => name == TIME_COLUMN,
            Input::Number(_) => false,
            Input::Operand(_) | Input::Property(_) | Input::InverseDirection | Input::Zero => true,
        }
    }
}

/// Links a stage.
///
/// # Errors
/// If linking passes a limit.
pub fn link_stage(function: &Function, surface: SurfaceLinks) -> Result<Linked, Diagnostic> {
    let mut linker = StageLinker::new(function.name.clone());
    let search = surface.search.clone();
    linker.surface = Some(Arc::new(surface));
    linker.root(None, function)?;
    linker.pass_on_values()?;
    if let Some(search) = search {
        linker.search_at_end(&search)?;
    }
    Ok(linker.finish())
}

impl SurfaceLinks {
    /// The lights and the sampler of paths, if materials sample lights by operations.
    fn linked_lights(&self) -> Option<(&Arc<LightLinks>, &Sampler)> {
        let lights = self.lights.as_ref().filter(|lights| lights.has_entries);
        lights.zip(self.sampler.as_ref())
    }
}

impl SurfaceMethod {
    /// Returns the method as the answer to a query; `None` if it needs more than random numbers and what the query
    /// and the surface give.
    pub fn answering(
        query: Query,
        method: &Arc<LinkedMethod>,
        prefix: &'static str,
    ) -> Option<SurfaceMethod> {
        let may_ask = |kind: &OpKind| *kind == OpKind::Rand;
        Self::asking(query, method, prefix, may_ask, results_of(query))
    }

    /// Returns the method as the answer to a query for the colour of a shaded surface, which is this state; `None` if it
    /// waits for light, or needs more than the query and the surface give.
    pub fn shading(
        method: &Arc<LinkedMethod>,
        prefix: &'static str,
        color: &'static [&'static str],
    ) -> Option<SurfaceMethod> {
        let may_ask = |kind: &OpKind| match kind {
            OpKind::Rand | OpKind::LightCount | OpKind::Ambient => true,
            OpKind::Query(query, _) => {
                matches!(query, Query::Spawn | Query::Contribute | Query::UnshadowedLight)
            }
            _ => false,
        };
        Self::asking(Query::OwnShade, method, prefix, may_ask, color)
    }

    /// Returns the method as an answer, if it asks a host only for what it may, and has its inputs.
    fn asking(
        query: Query,
        method: &Arc<LinkedMethod>,
        prefix: &'static str,
        may_ask: fn(&OpKind) -> bool,
        results: &'static [&'static str],
    ) -> Option<SurfaceMethod> {
        let mut is_plain = true;
        method.function.body.for_each_op(&mut |op| {
            is_plain &= !asks_host(&op.kind) || may_ask(&op.kind);
        });
        let has_inputs = method.reads.iter().all(|variable| input(query, variable).is_some());
        (is_plain && has_inputs).then(|| SurfaceMethod { prefix, method: method.clone(), results })
    }
}

impl StageLinker {
    /// Returns the results of an operation that a stage's surface answers; `None` for others.
    pub(crate) fn answer_stage(
        &mut self,
        site: &Site<'_>,
        op: &Op,
        to: &mut Vec<Op>,
    ) -> Linking<Option<Vec<Value>>> {
        let Some(links) = self.surface.clone() else { return Ok(None) };
        match &op.kind {
            OpKind::Load(variable, _) if site.is_root => {
                let is_found = Port::of(site.function.variable(*variable)) == Some(Port::Answer(0));
                let Some(found) = links.found.filter(|_| is_found) else { return Ok(None) };
                Ok(Some(vec![self.constant(to, Constant::Bool(found))?]))
            }
            OpKind::Rand => match (self.copied_numbers, &links.sampler) {
                (Some(numbers), _) => Ok(Some(vec![self.next_number(numbers, to)?])),
                (None, Some(sampler)) => {
                    let code = &mut Arithmetic { linker: self, to };
                    Ok(Some(vec![code.drawn_number(sampler)?]))
                }
                (None, _) => Ok(None),
            },
            OpKind::LightCount => match links.linked_lights() {
                Some((lights, _)) => {
                    let count = Constant::I32(lights.entries.len() as i32);
                    Ok(Some(vec![self.constant(to, count)?]))
                }
                None => Ok(None),
            },
            OpKind::Query(query, operands) => match links.answers.get(query) {
                None => {
                    let operands: Vec<Value> = operands.iter().map(|it| site.value(*it)).collect();
                    self.computed_answer(&links, *query, &operands, to)
                }
                Some(Answer::Zeros) => {
                    let zeros = query.result_scalars();
                    let zeros = zeros.map(|scalar| self.constant(to, Constant::zero(scalar)));
                    Ok(Some(zeros.collect::<Linking<_>>()?))
                }
                Some(Answer::Method(method)) => {
                    let operands: Vec<Value> = operands.iter().map(|it| site.value(*it)).collect();
                    Ok(Some(self.surface_method(&links, *query, method, &operands, to)?))
                }
            },
            _ => Ok(None),
        }
    }

    /// Returns the results of a query that operations compute; `None` for others.
    fn computed_answer(
        &mut self,
        links: &SurfaceLinks,
        query: Query,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Option<Vec<Value>>> {
        match query {
            Query::Sample | Query::SamplePair => {
                let Some(sampler) = links.sampler else { return Ok(None) };
                let code = &mut Arithmetic { linker: self, to };
                Ok(Some(code.numbers(&sampler, query, operands[0])?))
            }
            Query::Contribute => self.contribute(links, operands, to).map(Some),
            Query::Spawn => {
                self.spawn(operands, to)?;
                Ok(Some(Vec::new()))
            }
            Query::UnshadowedLight => {
                let Some((lights, sampler)) = links.linked_lights() else { return Ok(None) };
                let Some(call) = self.shade_call(to)? else { return Ok(None) };
                let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
                let key = call.begin_light_sample(code)?;
                let surface = &call.surface;
                Ok(Some(self.light_with_limit(lights, sampler, surface, key, operands, to)?))
            }
            Query::SurfaceProperties => Ok(Some(self.properties(links, operands, to)?)),
            Query::LightPdf => {
                let selection = links.lights.iter().find_map(|lights| lights.selection.as_ref());
                let (Some(shape), Some(selection)) = (&links.shape, selection) else {
                    return Ok(None);
                };
                self.light_density(shape, selection, operands, to)
            }
            _ => match (&links.lights, &links.sampler) {
                (Some(lights), Some(sampler)) => {
                    self.ask_lights(lights, sampler, query, operands, to)
                }
                _ => Ok(None),
            },
        }
    }

    /// Adds light to the radiance of a path, if nothing is on its ray.
    fn contribute(
        &mut self,
        links: &SurfaceLinks,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let mut contribution = operands.to_vec();
        if let Some(call) = self.shade_call(to)? {
            let [ox, oy, oz, dx, dy, dz, _, color @ ..] = operands else { unreachable!() };
            let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
            let origin = code.leave(&call.surface, [*ox, *oy, *oz], [*dx, *dy, *dz])?;
            contribution[..3].copy_from_slice(&origin);
            // Light that is a part of the colour is weighted with it.
            if links.material.is_none_or(|it| it.adds_to_path) {
                let weighted =
                    code.each(|it, channel| it.multiply(call.weight[channel], color[channel]))?;
                contribution[7..].copy_from_slice(&weighted);
            }
        }
        match (links.contributions, &links.search) {
            (Contributions::Kept, Some(_)) => self.keep_contribution(&contribution, to)?,
            (Contributions::Searched, Some(search)) => {
                self.add_light_at_once(&search.links, &contribution, to)?;
            }
            _ => {
                let kind = OpKind::Query(Query::Contribute, contribution);
                self.emit(to, kind, &[], false)?;
            }
        }
        Ok(Vec::new())
    }

    /// Copies the body of a method that answers a query.
    fn surface_method(
        &mut self,
        links: &SurfaceLinks,
        query: Query,
        callee: &SurfaceMethod,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let SurfaceMethod { prefix, method, results } = callee;
        let overrides = self.inputs(links, query, &method.reads, operands, to)?;
        if query == Query::OwnShade {
            let properties = self.properties(links, operands, to)?;
            self.shade_call = Some(self.begin_shade_call(operands, &properties, to)?);
        }
        // The scratch of a call is zero when it begins, and no one reads it afterwards.
        let scratch = self.scratch.replace(Vec::new());
        if let Some(sampler) = links.sampler.filter(|_| method.draws_numbers()) {
            let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
            let key = match code.linker.shade_call {
                Some(call) => call.key_of_rand(code)?,
                None => code.begin_sequence(Purpose::MaterialCall)?,
            };
            self.begin_numbers(key, sampler, to)?;
        }
        let set = self.copy_method(prefix, method, overrides, to);
        self.copied_numbers = None;
        self.shade_call = None;
        self.scratch = scratch;
        let set = set?;
        let wanted = outputs(results);
        let mut results = Vec::new();
        for (variable, component) in wanted {
            let wanted = StateComponent { variable: variable.index, component };
            results.push(match find_override(&set, wanted) {
                Some(value) => value,
                None => self.constant(to, default_of(Role::Material, wanted))?,
            });
        }
        if query == Query::SampleBsdf {
            // NaN is no density either.
            let density = &mut results[first_of(query.results(), "density")];
            let code = &mut Arithmetic { linker: self, to };
            let zero = code.float(0.0)?;
            *density = code.larger(*density, zero)?;
        }
        Ok(results)
    }

    /// Returns the values of the state that a method reads.
    fn inputs(
        &mut self,
        links: &SurfaceLinks,
        query: Query,
        reads: &[&'static StateVariable],
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let is_property =
            |variable: &&&StateVariable| matches!(input(query, variable), Some(Input::Property(_)));
        let properties = match reads.iter().find(is_property) {
            Some(_) => self.properties(links, operands, to)?,
            None => Vec::new(),
        };
        Arithmetic { linker: self, to }.inputs(query, reads, operands, &properties)
    }

    /// Returns the properties of the surface that operands name.
    fn properties(
        &mut self,
        links: &SurfaceLinks,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let surface = &operands[..SURFACE_SCALARS];
        if let Some((_, known)) = self.known_properties.iter().find(|(of, _)| of == surface) {
            return Ok(known.clone());
        }
        let properties = match &links.shape {
            Some(shape) => self.surface_properties(shape, surface, to)?,
            None => {
                let query = Query::SurfaceProperties;
                let scalars: Vec<Scalar> = query.result_scalars().collect();
                let kind = OpKind::Query(query, surface.to_vec());
                self.emit(to, kind, &scalars, false)?.iter().collect()
            }
        };
        self.known_properties.push((surface.to_vec(), properties.clone()));
        Ok(properties)
    }
}

impl Arithmetic<'_> {
    /// Returns the values of the state that a method reads which answers a query, given the query's operands and the
    /// properties of the surface.
    pub(crate) fn inputs(
        &mut self,
        query: Query,
        reads: &[&'static StateVariable],
        operands: &[Value],
        properties: &[Value],
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let mut inputs = Vec::new();
        for variable in reads {
            let Some(input) = input(query, variable) else { continue };
            for component in 0..variable.ty.components() {
                let at = component as usize;
                let value = match input {
                    Input::Operand(first) => operands[first + at],
                    Input::Property(first) => properties[first + at],
                    Input::Number(index) => self.convert(Scalar::F32, operands[index])?,
                    Input::InverseDirection => {
                        let direction = operands[first_of(query.operands(), "direction") + at];
                        let one = self.float(1.0)?;
                        self.divide(one, direction)?
                    }
                    Input::Column(name) => self.column(name, Scalar::F32)?,
                    Input::Zero => self.float(0.0)?,
                };
                inputs.push((StateComponent { variable: variable.index, component }, value));
            }
        }
        Ok(inputs)
    }
}

/// True for operations that only a host with the path's state can answer.
pub fn asks_host(kind: &OpKind) -> bool {
    matches!(
        kind,
        OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightCount
            | OpKind::LightSample { .. }
            | OpKind::Ambient
            | OpKind::Rand
            | OpKind::Query(..)
    )
}

/// Returns the source of a state variable that a method reads when it answers a query.
pub(crate) fn input(query: Query, variable: &StateVariable) -> Option<Input> {
    let operand = |name| Some(Input::Operand(first_of(query.operands(), name)));
    let property = |name| Some(Input::Property(first_of(Query::SurfaceProperties.results(), name)));
    match variable.name {
        "rt_RayOrigin" => operand("origin"),
        // The ray's direction comes before that of scattered light.
        "rt_RayDirection" => operand("direction"),
        "rt_HitDistance" => operand("distance"),
        "rt_Epsilon" => operand("epsilon"),
        "rt_HitPoint" => property("point"),
        "rt_GeometricNormal" => property("geometric_normal"),
        "rt_ShadingNormal" => property("shading_normal"),
        "rt_TextureUV" => property("uv"),
        "rt_TextureUVW" => property("uvw"),
        "rt_dPdu" => property("dpdu"),
        "rt_dPdv" => property("dpdv"),
        "rt_du" => property("du"),
        "rt_dv" => property("dv"),
        "rt_dsdu" => property("dsdu"),
        "rt_dsdv" => property("dsdv"),
        "rt_dtdu" => property("dtdu"),
        "rt_dtdv" => property("dtdv"),
        ATTRIBUTES => property("attributes"),
        TO_OBJECT => property("to_object"),
        TO_WORLD => property("to_world"),
        "rt_ObjectNumber" => Some(Input::Number(0)),
        "rt_InstanceNumber" => Some(Input::Number(1)),
        "rt_ElementNumber" => Some(Input::Number(2)),
        "rt_InverseRayDirection" => Some(Input::InverseDirection),
        "rt_TimeSeed" => Some(Input::Column(TIME_COLUMN)),
        "rt_RayDepth" => Some(Input::Column(DEPTH_COLUMN)),
        "rt_RayType" => Some(Input::Column(RAY_TYPE_COLUMN)),
        "rt_LightDirection" if matches!(query, Query::Bsdf | Query::BsdfPdf) => {
            Some(Input::Operand(SURFACE_SCALARS))
        }
        "rt_Regularization" if query.is_of_scattering() => {
            Some(Input::Operand(first_of(query.operands(), "regularization")))
        }
        // Highlights are widened on rough paths only, of which `shade` knows nothing.
        "rt_Regularization" if query == Query::OwnShade => Some(Input::Zero),
        "rt_BSDFSeed" if query == Query::SampleBsdf => Some(Input::Operand(SURFACE_SCALARS)),
        _ => None,
    }
}

/// Returns the index of the first scalar of a group of operands or results.
pub(crate) fn first_of(groups: impl Iterator<Item = rtsl_ir::Scalars>, name: &str) -> usize {
    groups.take_while(|(group, ..)| *group != name).map(|(_, _, count)| count as usize).sum()
}

/// Returns the components of these state variables.
fn outputs(names: &[&str]) -> impl Iterator<Item = (&'static StateVariable, u32)> {
    let variables = names.iter().filter_map(|name| lookup_state(name));
    variables.flat_map(|it| (0..it.ty.components()).map(move |component| (it, component)))
}

/// Returns the names of the state that is the result of a query.
fn results_of(query: Query) -> &'static [&'static str] {
    match query {
        Query::Emission | Query::LightEmission => &["rt_EmissionColor"],
        Query::Bsdf => &["rt_BSDFValue"],
        Query::BsdfPdf => &["rt_PDF"],
        Query::SampleBsdf => &["rt_LightDirection", "rt_BSDFValue", "rt_PDF", "rt_RelativeIndex"],
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use rtsl_ir::PROPERTIES_OF_MATERIALS;

    use super::*;

    #[test]
    fn the_outputs_of_methods_are_the_results_of_their_queries() {
        for query in
            [Query::Emission, Query::LightEmission, Query::Bsdf, Query::BsdfPdf, Query::SampleBsdf]
        {
            assert_eq!(
                outputs(results_of(query)).count(),
                query.result_scalars().count(),
                "{query:?}"
            );
        }
    }

    #[test]
    fn groups_are_found() {
        assert_eq!(first_of(Query::Bsdf.operands(), "origin"), 6);
        let properties = Query::SurfaceProperties.results();
        let count = Query::SurfaceProperties.result_scalars().count();
        assert_eq!(first_of(properties, "dsdu"), count - PROPERTIES_OF_MATERIALS);
    }
}
