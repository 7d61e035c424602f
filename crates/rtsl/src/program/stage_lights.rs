//! The lights of a scene, for the stages of integrators.

use std::sync::Arc;

use rtsl_abi::{InstanceBlock, Layout};
use rtsl_math::sampling::Sampler;
use rtsl_spec::Method;

use super::program::Program;
use super::surface_class::add_part;
use crate::instance::instance::Instance;
use crate::link::lights::{LightLink, LightLinks, LightSelection, MAX_LIGHTS};

/// The lights of a scene without shapes.
#[derive(Clone, Default)]
pub struct StageLights<'a> {
    /// The lights.
    pub lights: Vec<StageLight<'a>>,
    /// The lights that rays find when they leave the scene, by their indices, in the order of queries.
    pub skies: Vec<usize>,
    /// The selection of lights for samples; `None` if it depends on the point, or there are other lights.
    pub selection: Option<LightSelection>,
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
    /// The data of each light, then its maps.
    pub blocks: Vec<InstanceBlock>,
}

impl LinkedLights {
    /// Returns the lights if their methods need nothing of a host.
    pub fn new(lights: &StageLights<'_>, sampler: &Sampler) -> Option<LinkedLights> {
        if lights.lights.len() > MAX_LIGHTS {
            return None;
        }
        let links = lights.lights.iter().enumerate().map(|(index, it)| it.link(index));
        let links = LightLinks {
            lights: links.collect(),
            skies: lights.skies.clone(),
            selection: lights.selection.clone(),
        };
        if !links.lights.iter().all(|light| light.is_complete(sampler)) {
            return None;
        }
        let blocks = lights.lights.iter().flat_map(StageLight::blocks).collect();
        let programs = lights.lights.iter().map(|light| light.program.clone()).collect();
        Some(LinkedLights { links: Arc::new(links), programs, blocks })
    }

    /// Adds the members of the lights to the layout of an integrator.
    pub fn add_to(&self, layout: &mut Layout) {
        for (light, program) in self.links.lights.iter().zip(&self.programs) {
            add_part(layout, &light.prefix, program.layout());
            for name in [light.inverse(), light.forward()] {
                layout.members.insert(name, layout.block_words);
                layout.block_words += 12;
            }
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
