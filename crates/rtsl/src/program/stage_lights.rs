//! The lights of a scene, for the stages of integrators.

use std::sync::Arc;

use rtsl_abi::{InstanceBlock, Layout};
use rtsl_math::sampling::Sampler;
use rtsl_spec::Method;

use super::program::Program;
use super::surface_class::{ShapeClass, ShapeObject, add_members, add_part};
use crate::instance::instance::Instance;
use crate::link::area_light::{AreaLightLink, EPSILON};
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
}

/// A shape in the world with an emitter.
#[derive(Clone)]
pub struct StageAreaLight<'a> {
    /// The program of the shape.
    pub program: Arc<Program>,
    /// The shape.
    pub shape: ShapeObject<'a>,
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
    programs: Vec<Arc<Program>>,
    /// The shapes and the programs of the emitters of lights that are shapes.
    areas: Vec<(ShapeClass, Arc<Program>)>,
    /// The data of each light, then its maps; then what all share.
    pub blocks: Vec<InstanceBlock>,
}

impl LinkedLights {
    /// Returns the lights if their methods need nothing of a host.
    pub fn new(lights: &StageLights<'_>, sampler: &Sampler) -> Option<LinkedLights> {
        if lights.lights.len() > MAX_LIGHTS {
            return None;
        }
        let links = lights.lights.iter().enumerate().map(|(index, it)| it.link(index));
        let links: Vec<LightLink> = links.collect();
        if !links.iter().all(|light| light.is_complete(sampler)) {
            return None;
        }
        let linked = LinkedAreaLights::new(lights, sampler);
        let of_areas = lights.areas.iter().flatten().zip(linked.iter().flat_map(|it| &it.areas));
        let of_areas = of_areas.flat_map(|(light, (shapes, _))| light.blocks(shapes));
        let blocks = lights.lights.iter().flat_map(StageLight::blocks).chain(of_areas);
        let blocks = blocks.chain([lights.shared_block()]).collect();
        let programs = lights.lights.iter().map(|light| light.program.clone()).collect();
        let (of_areas, areas) = linked.map(|it| (it.links, it.areas)).unzip();
        let links = LightLinks {
            lights: links,
            areas: of_areas,
            skies: lights.skies.clone(),
            selection: lights.selection.clone(),
        };
        let areas = areas.unwrap_or_default();
        Some(LinkedLights { links: Arc::new(links), programs, areas, blocks })
    }

    /// Adds the members of the lights to the layout of an integrator.
    pub fn add_to(&self, layout: &mut Layout) {
        for (light, program) in self.links.lights.iter().zip(&self.programs) {
            add_part(layout, &light.prefix, program.layout());
            add_members(layout, [light.inverse(), light.forward()].map(|name| (name, 12)));
        }
        let areas = self.links.areas.iter().flatten().zip(&self.areas);
        for (light, (shapes, emitter)) in areas {
            shapes.add_to(layout);
            add_part(layout, &light.emitter, emitter.layout());
        }
        let selection = self.links.selection.as_ref();
        let nodes = selection.map_or(0, |selection| selection.scalars().len() as u32);
        // No two members begin at the same word.
        let shared = [(EPSILON, 1), (NODES, nodes)].into_iter().filter(|(_, scalars)| *scalars > 0);
        add_members(layout, shared.map(|(name, scalars)| (name.to_owned(), scalars)));
    }
}

/// The lights of a scene that are shapes, linked.
struct LinkedAreaLights {
    links: Vec<AreaLightLink>,
    /// The shapes and the programs of the emitters.
    areas: Vec<(ShapeClass, Arc<Program>)>,
}

impl LinkedAreaLights {
    /// Returns the lights if their methods need nothing of a host.
    fn new(lights: &StageLights<'_>, sampler: &Sampler) -> Option<LinkedAreaLights> {
        let areas = lights.areas.as_ref()?;
        let mut linked = LinkedAreaLights { links: Vec::new(), areas: Vec::new() };
        for (index, light) in (lights.lights.len()..).zip(areas) {
            let (shapes, link) = light.link(index)?;
            if !link.is_complete(sampler) {
                return None;
            }
            linked.links.push(link);
            linked.areas.push((shapes, light.emitter_program.clone()));
        }
        Some(linked)
    }
}

impl StageLights<'_> {
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
        let prefix = format!("light.{index}.shape.");
        let shapes = ShapeClass::with_prefix(&self.program, prefix, (self.is_placed, true))?;
        let link = AreaLightLink {
            shape: shapes.links().clone(),
            generate: self.program.method(Method::GenerateSample).ok()?,
            emitter: format!("light.{index}.emitter."),
            emission: self.emitter_program.method(Method::Emission).ok()?,
            is_weighed: self.is_weighed,
        };
        Some((shapes, link))
    }

    /// Returns the data in the order of the layout.
    fn blocks(&self, shapes: &ShapeClass) -> Vec<InstanceBlock> {
        let [shape, place] = shapes.blocks(&self.shape);
        vec![shape, place, self.emitter_program.block(self.emitter)]
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
            prefix: format!("light.{index}."),
            illumination,
            emission,
            density,
            is_placed: self.is_placed,
            is_weighed: self.is_weighed,
        }
    }

    /// Returns the data in the order of the layout.
    fn blocks(&self) -> [InstanceBlock; 2] {
        let maps = [self.inverse, self.forward].concat();
        let words: Vec<u32> = maps.into_iter().map(f32::to_bits).collect();
        [self.program.block(self.light), InstanceBlock::new(&words, Vec::new())]
    }
}
