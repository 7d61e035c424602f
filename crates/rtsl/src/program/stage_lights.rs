//! The lights of a scene, for the stages of integrators.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl_abi::{InstanceBlock, Layout};
use rtsl_integrate::area_light::{AlphaLink, AreaLightLink, EPSILON};
use rtsl_integrate::chosen_light::{LightClassLink, LightMethods, light_prefix};
use rtsl_integrate::light_selection::LightSelection;
use rtsl_integrate::lights::{ENTRIES, LightLink, LightLinks, MAX_LIGHT_CLASSES, MAX_LIGHTS};
use rtsl_integrate::surface::Places;
use rtsl_spec::Method;

use super::light_part::{ClassMembers, LightKey, are_copied, bound_buffers, have_same_programs};
use super::members::Members;
use super::program::Program;
use super::staged_program::{ParameterValues, joined};
use super::surface_class::{ShapeClass, ShapeObject, add_members, add_part};
use crate::instance::instance::Instance;

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

/// A shape with an emitter.
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
    /// The texture that cuts the shape out, if there is one, with its program.
    pub alpha: Option<(Arc<Program>, &'a Instance)>,
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
    /// The programs of the lights' parts, class by class.
    programs: Vec<Arc<Program>>,
    /// The members of the classes, then those that all lights share.
    layouts: Vec<Layout>,
    /// Their data.
    pub blocks: Vec<InstanceBlock>,
}

/// A class of lights, linked and with its data.
struct LinkedClass {
    link: LightClassLink,
    programs: Vec<Arc<Program>>,
    layout: Layout,
    block: InstanceBlock,
}

impl LinkedLights {
    /// Returns the lights if their methods need nothing of a host.
    pub fn new(lights: &StageLights<'_>, values: ParameterValues) -> Option<LinkedLights> {
        let areas = lights.areas.as_ref().map_or(0, Vec::len);
        if lights.lights.len() + areas > MAX_LIGHTS {
            return None;
        }
        let classes = lights.classes();
        if classes.len() > MAX_LIGHT_CLASSES {
            return None;
        }
        let (mut linked, mut is_complete) = (Vec::new(), lights.areas.is_some());
        for indices in classes {
            let is_shapeless = indices[0] < lights.lights.len();
            match lights.link_class(indices, values) {
                Some(class) => linked.push(class),
                None if is_shapeless => return None,
                None => is_complete = false,
            }
        }
        let sampled = lights.sampled();
        let is_sampled = |class: &&LinkedClass| sampled.contains(&class.link.lights[0]);
        let sampled = linked.iter().filter(is_sampled).count();
        let mut links = LightLinks {
            classes: linked.iter().map(|class| class.link.clone()).collect(),
            sampled,
            is_complete,
            skies: lights.skies.clone(),
            selection: lights.selection.clone(),
            has_entries: lights.entries.is_some() && is_complete,
            entries: Vec::new(),
        };
        let numbers = links.numbers();
        let number_of = |light: usize| numbers.get(&light).copied().unwrap_or(0);
        if is_complete {
            let entries = lights.entries.iter().flatten();
            links.entries = entries.map(|light| number_of(*light)).collect();
        }
        let (layout, block) = lights.shared_members(&links.entries, number_of);
        let programs = linked.iter().flat_map(|class| class.programs.iter().cloned()).collect();
        let (mut layouts, mut blocks): (Vec<_>, Vec<_>) =
            linked.into_iter().map(|class| (class.layout, class.block)).unzip();
        layouts.push(layout);
        blocks.push(block);
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
        self.layouts.iter().for_each(|part| add_part(layout, "", part));
    }
}

/// Groups lights by keys, in the order of the first of each.
fn grouped(lights: Vec<usize>, key: impl Fn(usize) -> LightKey) -> Vec<Vec<usize>> {
    let mut by_key: BTreeMap<LightKey, usize> = BTreeMap::new();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for light in lights {
        let group = *by_key.entry(key(light)).or_insert(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
        }
        groups[group].push(light);
    }
    groups
}

impl StageLights<'_> {
    /// The indices of the lights that are sampled.
    fn sampled(&self) -> BTreeSet<usize> {
        let selected = self.selection.iter().flat_map(LightSelection::lights);
        selected.chain(self.entries.iter().flatten().copied()).collect()
    }

    /// Returns the indices of lights by class; the classes that are sampled come first.
    fn classes(&self) -> Vec<Vec<usize>> {
        let sampled = self.sampled();
        let all = 0..self.lights.len() + self.areas.as_ref().map_or(0, Vec::len);
        let (mut order, others): (Vec<usize>, Vec<usize>) =
            all.partition(|light| sampled.contains(light));
        order.extend(others);
        let alike = grouped(order, |light| self.key(light));
        alike.into_iter().flat_map(|lights| self.with_few_buffers(lights)).collect()
    }

    /// Divides lights with the same code by their buffers, unless these are copied.
    fn with_few_buffers(&self, lights: Vec<usize>) -> Vec<Vec<usize>> {
        let buffers: BTreeMap<usize, Vec<_>> =
            lights.iter().map(|light| (*light, self.buffers(*light))).collect();
        if are_copied(buffers.values().map(Vec::as_slice)) {
            return vec![lights];
        }
        let key = |light: usize| LightKey { bound: buffers[&light].clone(), ..self.key(light) };
        grouped(lights, key)
    }

    fn area(&self, light: usize) -> &StageAreaLight<'_> {
        let areas = self.areas.as_ref().expect("lights that are shapes have indices");
        &areas[light - self.lights.len()]
    }

    fn key(&self, light: usize) -> LightKey {
        match self.lights.get(light) {
            Some(StageLight { program, is_placed, is_weighed, .. }) => {
                LightKey::new(&[program], *is_placed, *is_weighed)
            }
            None => {
                let area = self.area(light);
                let key = LightKey::new(&area.programs(), area.is_placed, area.is_weighed);
                LightKey { is_grouped: area.shape.group.is_some(), ..key }
            }
        }
    }

    /// The addresses and the lengths of a light's buffers.
    fn buffers(&self, light: usize) -> Vec<(usize, usize)> {
        let of = |program: &Program, instance: &Instance| match program.layout().buffers.is_empty()
        {
            true => Vec::new(),
            false => bound_buffers(&program.block(instance)),
        };
        match self.lights.get(light) {
            Some(light) => of(&light.program, light.light),
            None => {
                let area = self.area(light);
                let of_emitter = of(&area.emitter_program, area.emitter);
                let of_alpha = area.alpha.iter().flat_map(|(program, alpha)| of(program, alpha));
                let of_shape = bound_buffers(area.shape.shapes.first()).into_iter();
                of_shape.chain(of_emitter).chain(of_alpha).collect()
            }
        }
    }

    /// Links the lights with these indices, which are of one class; `None` if their methods need a host.
    fn link_class(&self, lights: Vec<usize>, values: ParameterValues) -> Option<LinkedClass> {
        let prefix = light_prefix(lights[0]);
        let (methods, programs, layout, blocks) = match self.lights.get(lights[0]) {
            Some(first) => {
                let link = first.link(prefix.clone());
                let blocks = lights.iter().map(|light| self.lights[*light].block());
                let (layout, blocks) = (first.layout(&link), blocks.collect::<Vec<_>>());
                let programs = vec![first.program.clone()];
                let link = Some(link).filter(LightLink::is_complete)?;
                (LightMethods::Shapeless(link), programs, layout, blocks)
            }
            None => {
                let first = self.area(lights[0]);
                let (shapes, link) = first.link(prefix.clone())?;
                let blocks = lights.iter().map(|light| self.area(*light).block(&shapes));
                let (layout, blocks) = (first.layout(&shapes, &link), blocks.collect::<Vec<_>>());
                let programs = first.programs().into_iter().cloned().collect();
                let link = Some(link).filter(AreaLightLink::is_complete)?;
                (LightMethods::Area(Box::new(link)), programs, layout, blocks)
            }
        };
        let ClassMembers { differing, layout, block } =
            ClassMembers::new(&prefix, &layout, &blocks, values);
        let link = LightClassLink { lights, prefix, methods, differing: Arc::new(differing) };
        Some(LinkedClass { link, programs, layout, block })
    }

    /// Returns the members that lights share. `number_of` returns the numbers of lights with these indices.
    fn shared_members(
        &self,
        entries: &[u32],
        number_of: impl Fn(usize) -> u32,
    ) -> (Layout, InstanceBlock) {
        let mut members = Members::default();
        members.add(EPSILON, [self.epsilon.to_bits()]);
        let selection = self.selection.iter().flat_map(|it| it.members(&number_of));
        selection.for_each(|(name, words)| members.add(name, words));
        if !entries.is_empty() {
            members.add(ENTRIES, entries.iter().copied());
        }
        members.finish()
    }
}

impl StageAreaLight<'_> {
    /// The programs of shape, emitter and alpha texture.
    fn programs(&self) -> Vec<&Arc<Program>> {
        let alpha = self.alpha.iter().map(|(program, _)| program);
        [&self.program, &self.emitter_program].into_iter().chain(alpha).collect()
    }

    /// Returns the shape's class, and the methods; the names of members begin with `prefix`.
    fn link(&self, prefix: String) -> Option<(ShapeClass, AreaLightLink)> {
        let of_shape = format!("{prefix}shape.");
        let mut shapes = ShapeClass::with_prefix(&self.program, of_shape, self.is_placed, true)?;
        if self.shape.group.is_some() {
            shapes = shapes.in_groups();
        }
        let alpha = match &self.alpha {
            Some((program, _)) => {
                let lookup = program.method(Method::Lookup).ok()?;
                Some(AlphaLink { prefix: format!("{prefix}alpha."), lookup })
            }
            None => None,
        };
        let link = AreaLightLink {
            shape: shapes.links().clone(),
            generate: self.program.method(Method::GenerateSample).ok()?,
            emitter: format!("{prefix}emitter."),
            emission: self.emitter_program.method(Method::Emission).ok()?,
            alpha,
            is_weighed: self.is_weighed,
        };
        Some((shapes, link))
    }

    /// The layout of the members.
    fn layout(&self, shapes: &ShapeClass, link: &AreaLightLink) -> Layout {
        let mut layout = Layout::default();
        shapes.add_to(&mut layout);
        add_part(&mut layout, &link.emitter, self.emitter_program.layout());
        for (AlphaLink { prefix, .. }, (program, _)) in link.alpha.iter().zip(&self.alpha) {
            add_part(&mut layout, prefix, program.layout());
        }
        layout
    }

    /// The data, in the order of the layout.
    fn block(&self, shapes: &ShapeClass) -> InstanceBlock {
        let mut blocks = shapes.runs(&self.shape).map(|run| run.first().clone()).to_vec();
        blocks.push(self.emitter_program.block(self.emitter));
        blocks.extend(self.alpha.iter().map(|(program, alpha)| program.block(alpha)));
        joined(&blocks)
    }
}

impl StageLight<'_> {
    fn link(&self, prefix: String) -> LightLink {
        let method = |method: Method| self.program.method(method).ok();
        let illumination = method(Method::Illumination);
        let emission = method(Method::Emission);
        // The directions of rays that leave the scene are weighed against samples of the same light.
        let density = method(Method::EvaluatePdf).filter(|_| self.is_weighed);
        LightLink {
            prefix,
            illumination,
            emission,
            density,
            is_placed: self.is_placed,
            is_weighed: self.is_weighed,
            places: Places::Members { are_grouped: false },
        }
    }

    /// The layout of the members.
    fn layout(&self, link: &LightLink) -> Layout {
        let mut layout = Layout::default();
        add_part(&mut layout, &link.prefix, self.program.layout());
        add_members(&mut layout, [link.inverse(), link.forward()].map(|name| (name, 12)));
        layout
    }

    /// The data, in the order of the layout.
    fn block(&self) -> InstanceBlock {
        let maps = [self.inverse, self.forward].concat();
        let words: Vec<u32> = maps.into_iter().map(f32::to_bits).collect();
        joined(&[self.program.block(self.light), InstanceBlock::new(&words, Vec::new())])
    }
}

#[cfg(test)]
mod tests {
    use rtsl_abi::{CallMode, InstanceRun};
    use rtsl_integrate::light_selection::{LightContent, LightNode};
    use rtsl_integrate::stage::asks_host;
    use rtsl_ir::class::Class;
    use rtsl_ir::{OpKind, Query};
    use rtsl_math::sampling::{Sampler, SamplerKind};

    use super::*;
    use crate::codegen::kernel_compiler::KernelCompiler;
    use crate::program::staged_program::{StageRequest, StageScene, StagedProgram};
    use crate::program::surface_class::{GroupPlace, SurfaceClass, SurfaceObject};
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
            shapes: InstanceRun::new(shape, 1),
            inverse: IDENTITY,
            forward: IDENTITY,
            sizes: IDENTITY,
            extents: vec![[1.0; 3]],
            reverse_orientation: false,
            volume_scale: 1.0,
            group: None,
            ways: vec![light],
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

    /// Returns the queries that stages with the surfaces of two balls, which are the lights, leave to the host. Textures
    /// may cut them out, and an instance may place their group.
    fn left_queries(sampler: Sampler, are_cut: bool, are_grouped: bool) -> Vec<Query> {
        let engine = Engine::new(options()).unwrap().0;
        let integrator = Instance::new(&class("Path"), []).unwrap();
        let ball = class("Sphere");
        let balls = [1.0, 2.0]
            .map(|radius| Instance::new(&ball, [("radius", Value::Float(radius))]).unwrap());
        let emitter = Instance::new(&class("Emissive"), []).unwrap();
        let checks = Instance::new(&class("Checker"), []).unwrap();
        let group = GroupPlace { inverse: IDENTITY, forward: IDENTITY, volume_scale: 1.0 };
        let group = are_grouped.then_some(group);
        let ways = [0, 1].map(|way| LightSelection::way(way, 1).unwrap());
        let areas = (0..2).map(|light| StageAreaLight {
            program: engine.program(&balls[light]),
            shape: ShapeObject {
                group,
                ..object(engine.program(&balls[light]).block(&balls[light]), ways[light])
            },
            is_placed: false,
            emitter_program: engine.program(&emitter),
            emitter: &emitter,
            alpha: are_cut.then(|| (engine.program(&checks), &*checks)),
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
            alpha: None,
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
            for (are_cut, are_grouped) in [(false, false), (true, false), (false, true)] {
                let left = left_queries(sampler(columns), are_cut, are_grouped);
                assert_eq!(of_lights(&left), [], "{are_cut} {are_grouped}");
            }
        }
    }
}
