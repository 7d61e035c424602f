//! The lights of a scene as stages take them.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{Engine, Method, StageLight, StageLights};
use rtsl_math::Affine;
use rtsl_scene::Scene;

use super::super::super::lights::Lights;
use crate::compiled::CompiledScene;

/// Returns the lights of a scene. Without area lights, and if at most one light has a place, their selection for
/// samples does not depend on the point.
pub fn stage_lights<'a>(
    engine: &Engine,
    scene: &'a Scene,
    compiled: &CompiledScene,
    lights: &Lights,
) -> StageLights<'a> {
    let programs: Vec<_> = scene.lights.iter().map(|light| engine.program(&light.light)).collect();
    // Lights of one class are transformed together.
    let mut placed: BTreeMap<usize, bool> = BTreeMap::new();
    for (program, light) in programs.iter().zip(&compiled.lights) {
        *placed.entry(Arc::as_ptr(program) as usize).or_default() |= !light.forward.is_identity();
    }
    let all = scene.lights.iter().zip(&programs).zip(&compiled.lights);
    let all = all.map(|((light, program), place)| StageLight {
        program: program.clone(),
        light: &light.light,
        inverse: columns(&place.inverse),
        forward: columns(&place.forward),
        is_placed: placed[&(Arc::as_ptr(program) as usize)],
        is_weighed: [Method::Illumination, Method::Emission, Method::EvaluatePdf]
            .into_iter()
            .all(|method| program.has(method)),
    });
    StageLights {
        lights: all.collect(),
        skies: lights.skies.iter().map(|sky| sky.light as usize).collect(),
        selection: lights.simple_selection(),
    }
}

/// Returns a map by its columns.
pub fn columns(map: &Affine) -> [f32; 12] {
    let columns = map.columns;
    std::array::from_fn(|index| columns[index / 3][index % 3])
}
