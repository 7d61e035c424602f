//! The lights of a scene as stages take them.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{
    Engine, GroupPlace, InstanceRun, MAX_STAGE_LIGHTS, Method, ShapeObject, StageAreaLight,
    StageLight, StageLights,
};
use rtsl_math::Affine;
use rtsl_scene::{Scene, SceneObject};

use super::staged_method::StageParts;
use crate::compiled::CompiledScene;
use crate::compiled::placement::Placement;
use crate::integrate::wavefront::PathHit;
use crate::lights::LightEntry;

/// Returns the lights of a scene.
pub fn stage_lights<'a>(
    engine: &Engine,
    scene: &'a Scene,
    parts: &StageParts<'_>,
) -> StageLights<'a> {
    let StageParts { classes, lights, .. } = parts;
    let compiled = classes.compiled;
    let shapeless = shapeless_lights(engine, scene, compiled);
    // Indices of lights in the scene, then those of area lights in the order of their entries.
    let (mut indices, mut areas) = (Vec::new(), Vec::new());
    let is_of_object = |one: &LightEntry, other: &LightEntry| {
        (one.hit().object, one.hit().instance) == (other.hit().object, other.hit().instance)
            && lights.shapes_of(one).is_some() == lights.shapes_of(other).is_some()
    };
    let is_few = lights.entries.len() <= MAX_STAGE_LIGHTS;
    let entries = if is_few { lights.entries.as_slice() } else { &[] };
    for of_object in entries.chunk_by(is_of_object) {
        let first = shapeless.len() + areas.len();
        match lights.shapes_of(&of_object[0]) {
            None => indices.extend(of_object.iter().map(|entry| entry.hit().object as usize)),
            Some(_) => {
                indices.extend(first..first + of_object.len());
                areas.extend(area_lights(engine, scene, parts, of_object));
            }
        }
    }
    let selection = is_few.then(|| lights.selection(&indices));
    let areas = areas.into_iter().collect::<Option<Vec<_>>>().filter(|_| is_few);
    StageLights {
        lights: shapeless,
        areas,
        skies: lights.skies.iter().map(|sky| sky.light as usize).collect(),
        selection,
        epsilon: compiled.epsilon,
        entries: is_few.then_some(indices),
    }
}

/// Returns the lights without a shape.
fn shapeless_lights<'a>(
    engine: &Engine,
    scene: &'a Scene,
    compiled: &CompiledScene,
) -> Vec<StageLight<'a>> {
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
    all.collect()
}

/// Returns the area lights of an object with these entries, its elements in order; `None` for each if an instance moves
/// them.
fn area_lights<'a>(
    engine: &Engine,
    scene: &'a Scene,
    parts: &StageParts<'_>,
    entries: &[LightEntry],
) -> Vec<Option<StageAreaLight<'a>>> {
    let lights = || {
        let shapes = parts.lights.shapes_of(&entries[0])?;
        let class = parts.classes.compiled.class(shapes.class());
        let PathHit { object, instance, .. } = *entries[0].hit();
        let placement = parts.classes.compiled.placement(instance);
        if placement.as_ref().is_some_and(Placement::moves) {
            return None;
        }
        let group = placement.map(|it| group_place(&it));
        let SceneObject { emitter, alpha, .. } = &scene.objects[object as usize];
        let emitter = &*scene.materials[(*emitter)? as usize];
        let emitter_program = engine.program(emitter);
        let alpha = alpha.as_deref().filter(|_| shapes.has_alpha());
        let alpha = alpha.map(|alpha| (engine.program(alpha), alpha));
        let light = |shape| StageAreaLight {
            program: class.program().clone(),
            shape: ShapeObject { group, ..shape },
            is_placed: class.is_placed(),
            emitter_program: emitter_program.clone(),
            emitter,
            alpha: alpha.clone(),
            is_weighed: !shapes.is_invisible(),
        };
        let shapes = shape_object(scene, parts, object)?;
        Some(shapes.elements().map(light).map(Some).collect::<Vec<_>>())
    };
    lights()
        .filter(|lights| lights.len() == entries.len())
        .unwrap_or_else(|| vec![None; entries.len()])
}

/// Returns the place of a group that an instance places, which does not move.
fn group_place(placement: &Placement<'_>) -> GroupPlace {
    GroupPlace {
        inverse: columns(&placement.inverse_at(0.0)),
        forward: columns(&placement.map_at(0.0)),
        volume_scale: placement.volume_scale(0.0) as f32,
    }
}

/// Returns the shape of an object in the world or its group, or its elements in order; `None` if these have no data.
pub fn shape_object(scene: &Scene, parts: &StageParts<'_>, object: u32) -> Option<ShapeObject> {
    let compiled = parts.classes.compiled;
    let placed = &compiled.objects[object as usize];
    let SceneObject { primitive, elements, .. } = &scene.objects[object as usize];
    let program = compiled.class(parts.objects[object as usize].class).program();
    let shapes = match elements {
        Some(_) => program.elements(primitive).ok()?.run(),
        None => InstanceRun::new(program.block(primitive), 1),
    };
    let elements = 0..shapes.count() as u32;
    let way = |element| parts.lights.way_to(object, element).unwrap_or_default();
    Some(ShapeObject {
        shapes,
        inverse: columns(&placed.inverse),
        forward: columns(&placed.forward),
        sizes: columns(&placed.sizes),
        extents: elements.clone().map(|it| compiled.extents.lengths(object, it)).collect(),
        reverse_orientation: placed.reverse_orientation,
        volume_scale: placed.volume_scale,
        group: None,
        ways: elements.map(way).collect(),
    })
}

/// Returns a map by its columns.
fn columns(map: &Affine) -> [f32; 12] {
    let columns = map.columns;
    std::array::from_fn(|index| columns[index / 3][index % 3])
}
