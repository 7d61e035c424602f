//! The kernels of an integrator's stages for the surface groups of a scene.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{
    CallMode, Diagnostic, Engine, Instance, Objects, StageKernel, StageRequest, StageSurface,
    StagedProgram, SurfaceClass, SurfaceObject,
};
use rtsl_scene::Scene;

use super::super::super::group_plan::{Classes, GroupPlan};
use super::super::super::material::MaterialSource;
use super::super::super::surface_group::GroupKey;
use super::columns::Columns;
use crate::compiled::shaders::is_own_material;

/// An integrator's stages with their kernels.
pub struct StagedIntegrator {
    /// The stages.
    pub program: StagedProgram,
    /// The arrays of their ports.
    pub columns: Columns,
    /// The groups that stages distinguish: none first, then those of surfaces.
    groups: Vec<StageGroup>,
    /// By stage and group; the stages without surfaces have a kernel for no group only.
    kernels: Vec<Vec<StageKernel>>,
    /// For each object of the scene the index of its surface among those of its group.
    surfaces: Vec<u32>,
}

/// The objects for which kernels of a group are called.
struct StageGroup {
    class: Option<Arc<SurfaceClass>>,
    objects: Arc<Objects>,
}

impl StageGroup {
    fn mode(&self) -> CallMode {
        if self.objects.len() == 1 { CallMode::Packet } else { CallMode::Stream }
    }
}

impl StagedIntegrator {
    /// Links and compiles the stages for the groups of a scene.
    ///
    /// # Errors
    /// If linking, splitting or code generation fails.
    pub fn new(
        engine: &Engine,
        program: StagedProgram,
        integrator: &Instance,
        scene: &Scene,
        (classes, plan): (Classes<'_>, &GroupPlan),
    ) -> Result<StagedIntegrator, Diagnostic> {
        let none =
            StageGroup { class: None, objects: Arc::new(program.objects(integrator, None, [])) };
        let mut groups = vec![none];
        let mut surfaces = vec![0; scene.objects.len()];
        for (index, key) in (0..).zip(&plan.keys) {
            let members = (0..).zip(&plan.objects).filter(|(_, entry)| entry.group == index);
            let members = members.map(|(object, _)| object);
            let class = Arc::new(class_of(&classes, key));
            let parts = distinct_surfaces(scene, members, &mut surfaces);
            let objects = program.objects(integrator, Some(&class), parts);
            groups.push(StageGroup { class: Some(class), objects: Arc::new(objects) });
        }
        let kernels = kernels(engine, &program, &groups)?;
        let columns = Columns::new(&program);
        Ok(StagedIntegrator { program, columns, groups, kernels, surfaces })
    }

    /// Returns the kernel of a stage for a group, 0 for none, and its objects.
    pub fn kernel(&self, stage: usize, group: usize) -> (&StageKernel, &Objects) {
        (&self.kernels[stage][group], &self.groups[group].objects)
    }

    /// The number of groups, none included.
    pub fn group_count(&self) -> usize {
        self.groups.len()
    }

    /// Returns the index of an object's surface among those of its group.
    pub fn surface_of(&self, object: u32) -> u32 {
        self.surfaces[object as usize]
    }
}

/// Returns the programs of a group's parts.
fn class_of(classes: &Classes<'_>, key: &GroupKey) -> SurfaceClass {
    let parts = classes.parts_of(key);
    SurfaceClass {
        material: parts.material.0.clone(),
        is_own_material: key.material.0 == MaterialSource::Own,
        emitter: parts.emitter.map(|(program, _)| program.clone()),
        is_sampled: key.is_sampled,
    }
}

/// Returns the surfaces of objects that differ in their parts, and sets the index of each object's.
fn distinct_surfaces<'a>(
    scene: &'a Scene,
    objects: impl Iterator<Item = u32>,
    surfaces: &mut [u32],
) -> Vec<SurfaceObject<'a>> {
    let mut indices: BTreeMap<(usize, usize), u32> = BTreeMap::new();
    let mut distinct = Vec::new();
    for object in objects {
        let parts = &scene.objects[object as usize];
        let material: &Instance = match is_own_material(parts) {
            true => &parts.primitive,
            false => &scene.materials[parts.material as usize],
        };
        let emitter = parts.emitter.map(|emitter| &*scene.materials[emitter as usize]);
        let address = |instance: &Instance| std::ptr::from_ref(instance).addr();
        let next = distinct.len() as u32;
        let key = (address(material), emitter.map_or(0, address));
        let index = *indices.entry(key).or_insert(next);
        if index == next {
            distinct.push(SurfaceObject { material, emitter });
        }
        surfaces[object as usize] = index;
    }
    distinct
}

/// Compiles a kernel for each stage and group.
fn kernels(
    engine: &Engine,
    program: &StagedProgram,
    groups: &[StageGroup],
) -> Result<Vec<Vec<StageKernel>>, Diagnostic> {
    let mut requests = Vec::new();
    let mut counts = Vec::new();
    for (stage, description) in program.stages().iter().enumerate() {
        let count = if description.surface == StageSurface::None { 1 } else { groups.len() };
        counts.push(count);
        requests.extend(groups[..count].iter().map(|group| StageRequest {
            stage,
            surface: group.class.clone(),
            objects: group.objects.clone(),
            mode: group.mode(),
        }));
    }
    let made = engine.stage_kernels(program, &requests);
    let mut made = made.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter();
    Ok(counts.into_iter().map(|count| made.by_ref().take(count).collect()).collect())
}
