//! The lights of a scene, for the stages of integrators.

use std::sync::Arc;

use rtsl_abi::{InstanceBlock, Layout};
use rtsl_spec::Method;

use super::light_part::{LightPart, have_same_programs, light_classes};
use super::program::Program;
use super::staged_program::{ParameterValues, joined};
use super::surface_class::{ShapeClass, ShapeObject, add_members, add_part};
use crate::instance::instance::Instance;
use crate::link::area_light::{AreaLightLink, EPSILON};
use crate::link::chosen_light::light_prefix;
use crate::link::light_selection::{LightSelection, NODES};
use crate::link::lights::{LightLink, LightLinks, MAX_LIGHTS};

/// The lights of a scene.
#[derive(Clone, Default)]
pub struct StageLights<'a> {
    /// The lights without a shape.
    pub lights: Vec<StageLight<'a>>,
    /// The lights that are shapes, whose indices follow; `None` if hosts sample lights.
    pub areas: Option<Vec<StageAreaLight<'a>>>,
    /// The lights that rays find when they leave the scene, by their indices, in the order of queries.
    pub skies: Vec<usize>,
    /// The selection of lights for samples; `None` if hosts select them.
    pub selection: Option<LightSelection>,
    /// The least distance of hits of rays from sampled lights.
    pub epsilon: f32,
    /// The lights that materials name by their indices, in this order; `None` if hosts sample them.
    pub entries: Option<Vec<usize>>,
}

/// A shape in the world with an emitter.
#[derive(Clone)]
pub struct StageAreaLight<'a> {
    /// The program of the shape.
    pub program: Arc<Program>,
    /// The shape.
    pub shape: ShapeObject,
    /// True if shapes of its class have a space of their own.
    pub is_placed: bool,
    /// The program of the emitter.
    pub emitter_program: Arc<Program>,
    /// The emitter.
    pub emitter: &'a Instance,
    /// True if rays can hit the shape, so that samples have densities.
    pub is_weighed: bool,
}

/// A light without a shape.
#[derive(Clone)]
pub struct StageLight<'a> {
    /// Its program.
    pub program: Arc<Program>,
    /// The light.
    pub light: &'a Instance,
    /// The map from the world to its space, by columns: the images of the axes, then that of the origin.
    pub inverse: [f32; 12],
    /// The map from its space to the world.
    pub forward: [f32; 12],
    /// True if samples are transformed to the world.
    pub is_placed: bool,
    /// True if rays that leave the scene can find it, so that samples have densities.
    pub is_weighed: bool,
}

/// The lights of a scene, linked and with their data.
#[derive(Clone, Debug)]
pub(crate) struct LinkedLights {
    pub links: Arc<LightLinks>,
    /// The programs of the lights' parts.
    programs: Vec<Arc<Program>>,
    /// The members of the lights.
    layouts: Vec<Layout>,
    /// The data of each light, then what all share.
    pub blocks: Vec<InstanceBlock>,
}

impl LinkedLights {
    /// Returns the lights if their methods need nothing of a host.
    pub fn new(lights: &StageLights<'_>, values: ParameterValues) -> Option<LinkedLights> {
        if lights.lights.len() > MAX_LIGHTS {
            return None;
        }
        let links = lights.lights.iter().enumerate().map(|(index, it)| it.link(index));
        let links: Vec<LightLink> = links.collect();
        if !links.iter().all(|light| light.is_complete()) {
            return None;
        }
        let areas = lights.linked_areas();
        let shapeless = lights.lights.iter().zip(&links).map(|(light, link)| light.part(link));
        let of_areas = lights.areas.iter().flatten().zip(areas.iter().flatten());
        let parts =
            shapeless.chain(of_areas.map(|(light, (shapes, link))| light.part(shapes, link)));
        let parts: Vec<LightPart> = parts.collect();
        let is_sampled = areas.is_some();
        let selected = lights.selection.as_ref().filter(|_| is_sampled);
        let classes =
            selected.map_or_else(Vec::new, |it| light_classes(&parts, &it.lights(), values));
        let entries = lights.entries.clone().filter(|_| is_sampled).unwrap_or_default();
        let entry_classes = light_classes(&parts, &entries, values);
        let programs = parts.iter().flat_map(|part| part.programs.iter().cloned()).collect();
        let (layouts, mut blocks): (Vec<_>, Vec<_>) =
            parts.into_iter().map(|part| (part.layout, part.block)).unzip();
        blocks.push(lights.shared_block());
        let links = LightLinks {
            lights: links,
            areas: areas.map(|areas| areas.into_iter().map(|(_, link)| link).collect()),
            skies: lights.skies.clone(),
            selection: lights.selection.clone(),
            classes,
            has_entries: lights.entries.is_some() && is_sampled,
            entries,
            entry_classes,
        };
        Some(LinkedLights { links: Arc::new(links), programs, layouts, blocks })
    }

    /// True if the lights that materials name by their indices are linked.
    pub fn has_indices(&self) -> bool {
        self.links.has_entries
    }

    /// True if the lights have the same code, whatever their data.
    pub fn is_like(&self, other: &LinkedLights) -> bool {
        have_same_programs(&self.programs, &other.programs) && self.links.is_like(&other.links)
    }

    /// Adds the members of the lights to the layout of an integrator.
    pub fn add_to(&self, layout: &mut Layout) {
        self.layouts.iter().for_each(|of_light| add_part(layout, "", of_light));
        let selection = self.links.selection.as_ref();
        let nodes = selection.map_or(0, |selection| selection.scalars().len() as u32);
        // No two members begin at the same word.
        let shared = [(EPSILON, 1), (NODES, nodes)].into_iter().filter(|(_, scalars)| *scalars > 0);
        add_members(layout, shared.map(|(name, scalars)| (name.to_owned(), scalars)));
    }
}

impl StageLights<'_> {
    /// Returns the area lights if their methods need nothing of a host.
    fn linked_areas(&self) -> Option<Vec<(ShapeClass, AreaLightLink)>> {
        let areas = (self.lights.len()..).zip(self.areas.as_ref()?);
        let linked = areas.map(|(index, light)| light.link(index));
        linked.map(|linked| linked.filter(|(_, link)| link.is_complete())).collect()
    }

    /// Returns the data that lights share, in the order of the layout.
    fn shared_block(&self) -> InstanceBlock {
        let nodes = self.selection.as_ref().map_or_else(Vec::new, LightSelection::scalars);
        let words: Vec<u32> = [self.epsilon].into_iter().chain(nodes).map(f32::to_bits).collect();
        InstanceBlock::new(&words, Vec::new())
    }
}

impl StageAreaLight<'_> {
    /// Returns the shape's class, and the methods.
    fn link(&self, index: usize) -> Option<(ShapeClass, AreaLightLink)> {
        let prefix = light_prefix(index);
        let of_shape = format!("{prefix}shape.");
        let shapes = ShapeClass::with_prefix(&self.program, of_shape, (self.is_placed, true))?;
        let link = AreaLightLink {
            shape: shapes.links().clone(),
            generate: self.program.method(Method::GenerateSample).ok()?,
            emitter: format!("{prefix}emitter."),
            emission: self.emitter_program.method(Method::Emission).ok()?,
            is_weighed: self.is_weighed,
            prefix,
        };
        Some((shapes, link))
    }

    fn part(&self, shapes: &ShapeClass, link: &AreaLightLink) -> LightPart {
        let mut layout = Layout::default();
        shapes.add_to(&mut layout);
        add_part(&mut layout, &link.emitter, self.emitter_program.layout());
        let [shape, place] = shapes.blocks(&self.shape);
        let emitter = self.emitter_program.block(self.emitter);
        LightPart {
            prefix: link.prefix.clone(),
            programs: vec![self.program.clone(), self.emitter_program.clone()],
            is_placed: self.is_placed,
            is_weighed: self.is_weighed,
            layout,
            block: joined(&[shape, place, emitter]),
        }
    }
}

impl StageLight<'_> {
    fn link(&self, index: usize) -> LightLink {
        let method = |method: Method| self.program.method(method).ok();
        let illumination = method(Method::Illumination);
        let emission = method(Method::Emission);
        // The directions of rays that leave the scene are weighed against samples of the same light.
        let density = method(Method::EvaluatePdf).filter(|_| self.is_weighed);
        LightLink {
            prefix: light_prefix(index),
            illumination,
            emission,
            density,
            is_placed: self.is_placed,
            is_weighed: self.is_weighed,
        }
    }

    fn part(&self, link: &LightLink) -> LightPart {
        let mut layout = Layout::default();
        add_part(&mut layout, &link.prefix, self.program.layout());
        add_members(&mut layout, [link.inverse(), link.forward()].map(|name| (name, 12)));
        let maps = [self.inverse, self.forward].concat();
        let words: Vec<u32> = maps.into_iter().map(f32::to_bits).collect();
        let maps = InstanceBlock::new(&words, Vec::new());
        LightPart {
            prefix: link.prefix.clone(),
            programs: vec![self.program.clone()],
            is_placed: self.is_placed,
            is_weighed: self.is_weighed,
            layout,
            block: joined(&[self.program.block(self.light), maps]),
        }
    }
}

#[cfg(test)]
mod tests {
    use rtsl_abi::CallMode;
    use rtsl_ir::class::Class;
    use rtsl_ir::{OpKind, Query};
    use rtsl_math::sampling::{Sampler, SamplerKind};

    use super::*;
    use crate::codegen::kernel_compiler::KernelCompiler;
    use crate::link::light_selection::{LightContent, LightNode};
    use crate::link::stage::asks_host;
    use crate::program::staged_program::{StageRequest, StageScene, StagedProgram};
    use crate::program::surface_class::{SurfaceClass, SurfaceObject};
    use crate::{Backend, Compiler, CompilerOptions, Engine, EngineOptions, Value, library};

    const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

    /// A class of the library.
    fn class(name: &str) -> Arc<Class> {
        let compiler = Compiler::new(CompilerOptions::default());
        let unit = library::unit_of_class(&compiler, name).unwrap();
        unit.class(name).unwrap().clone()
    }

    fn options() -> EngineOptions {
        EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() }
    }

    fn object(shape: InstanceBlock, light: u32) -> ShapeObject {
        ShapeObject {
            shape,
            inverse: IDENTITY,
            forward: IDENTITY,
            sizes: IDENTITY,
            extents: [1.0; 3],
            reverse_orientation: false,
            volume_scale: 1.0,
            light,
        }
    }

    /// A selection of two lights, neither at infinity.
    fn selection() -> LightSelection {
        let node = |content: LightContent| LightNode {
            center: [0.0; 3],
            radius2: 1.0,
            strength: 1.0,
            content,
        };
        let contents = [LightContent::Children(1), LightContent::Light(0), LightContent::Light(1)];
        LightSelection {
            infinite: Vec::new(),
            nodes: contents.map(node).to_vec(),
            probability: 1.0,
        }
    }

    /// Returns the queries that stages with the surfaces of two balls, which are the lights, leave to the host.
    fn left_queries(sampler: Sampler) -> Vec<Query> {
        let engine = Engine::new(options()).unwrap().0;
        let integrator = Instance::new(&class("Path"), []).unwrap();
        let ball = class("Sphere");
        let balls = [1.0, 2.0]
            .map(|radius| Instance::new(&ball, [("radius", Value::Float(radius))]).unwrap());
        let emitter = Instance::new(&class("Emissive"), []).unwrap();
        let ways = [0, 1].map(|way| LightSelection::way(way, 1).unwrap());
        let areas = (0..2).map(|light| StageAreaLight {
            program: engine.program(&balls[light]),
            shape: object(engine.program(&balls[light]).block(&balls[light]), ways[light]),
            is_placed: false,
            emitter_program: engine.program(&emitter),
            emitter: &emitter,
            is_weighed: true,
        });
        let lights = StageLights {
            areas: Some(areas.collect()),
            selection: Some(selection()),
            ..StageLights::default()
        };
        let program = engine.program(&integrator);
        let scene = StageScene { lights: &lights, searched: None, camera: None };
        let staged = StagedProgram::new(&program, sampler, scene, ParameterValues::Final).unwrap();
        let balls_program = engine.program(&balls[0]);
        let class = SurfaceClass {
            material: engine.program(&emitter),
            is_own_material: false,
            emitter: Some(engine.program(&emitter)),
            is_sampled: true,
            shape: ShapeClass::new(&balls_program, false, true),
        };
        let surfaces = [0, 1].map(|light| SurfaceObject {
            material: &emitter,
            emitter: Some(&emitter),
            shape: Some(object(balls_program.block(&balls[light]), ways[light])),
        });
        let objects = Arc::new(staged.objects(&integrator, Some(&class), surfaces));
        let class = Arc::new(class);
        let compiler = KernelCompiler::new(options()).unwrap().0;
        let mut left = Vec::new();
        for stage in 0..staged.stages().len() {
            let surface = Some(class.clone());
            let objects = objects.clone();
            let request = StageRequest { stage, surface, objects, mode: CallMode::Stream };
            let (function, ..) = staged.link(&request, true, &compiler).unwrap();
            function.body.for_each_op(&mut |op| {
                if let OpKind::Query(query, _) = &op.kind {
                    left.push(*query);
                }
            });
        }
        left
    }

    /// The queries about lights among these.
    fn of_lights(left: &[Query]) -> Vec<Query> {
        let of_lights = [Query::SampleLight, Query::LightPdf, Query::LightEmission];
        left.iter().copied().filter(|query| of_lights.contains(query)).collect()
    }

    fn sampler(columns: u32) -> Sampler {
        Sampler { kind: SamplerKind::Stratified { jitter: true }, columns, rows: 1, seed: 0 }
    }

    /// Returns the requests of a host in the stage that samples lights which materials name: two spheres, if there is
    /// one.
    fn left_requests(sampler: Sampler) -> Option<usize> {
        let engine = Engine::new(options()).unwrap().0;
        let integrator = Instance::new(&class("Whitted"), []).unwrap();
        let ball = Instance::new(&class("Sphere"), []).unwrap();
        let emitter = Instance::new(&class("Emissive"), []).unwrap();
        let areas = (0..2).map(|light| StageAreaLight {
            program: engine.program(&ball),
            shape: object(engine.program(&ball).block(&ball), light),
            is_placed: false,
            emitter_program: engine.program(&emitter),
            emitter: &emitter,
            is_weighed: true,
        });
        let areas = Some(areas.collect());
        let lights = StageLights { areas, entries: Some(vec![1, 0]), ..StageLights::default() };
        let program = engine.program(&integrator);
        let staged = StagedProgram::of_lights(&program, sampler, &lights, ParameterValues::Final)?;
        let objects = Arc::new(staged.objects(&integrator, None, []));
        let request = StageRequest { stage: 0, surface: None, objects, mode: CallMode::Packet };
        let compiler = KernelCompiler::new(options()).unwrap().0;
        let (function, ..) = staged.link(&request, true, &compiler).unwrap();
        let mut left = 0;
        function.body.for_each_op(&mut |op| left += usize::from(asks_host(&op.kind)));
        Some(left)
    }

    #[test]
    fn lights_that_materials_name_are_sampled_by_a_stage() {
        assert_eq!(left_requests(sampler(4)), Some(0));
        assert_eq!(left_requests(sampler(3)), Some(0));
    }

    #[test]
    fn area_lights_are_sampled_without_the_host() {
        for columns in [4, 3] {
            assert_eq!(of_lights(&left_queries(sampler(columns))), []);
        }
    }
}
