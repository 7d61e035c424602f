//! A scene for path tracing: surface groups and lights.

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use rtsl::{Diagnostics, Engine, Query, SamplerNumbers};

use super::CompiledScene;
use super::group_plan::Classes;
use super::instance_classes::InstanceClasses;
use super::kernels::KernelMaker;
use super::object_entry::ObjectEntry;
use super::surface_group::{GroupKey, SurfaceGroup};
use crate::film::aov_plan::AovPlan;
use crate::film::features::Features;
use crate::integrate::camera::Camera;
use crate::integrate::integrator::Integrator;
use crate::integrate::shading_methods::ShadingMethods;
use crate::integrate::shading_texts::ShadingTexts;
use crate::integrate::staged::{BlockSizes, StagedMethod};
use crate::integrate::wavefront::{NO_INSTANCE, PathHit};
use crate::lights::Lights;

/// The greatest depth of rays that `trace` traces: each level takes a level of the thread's stack.
const MAX_DEPTH: u32 = 64;

/// A scene ready for path tracing.
pub struct RenderScene {
    /// The compiled scene with the acceleration structure.
    pub compiled: CompiledScene,
    /// The time for compiling kernels.
    pub compile_time: Duration,
    /// The engine, for kernels that only a sample that is not finite needs.
    pub(crate) engine: Engine,
    /// The keys of the groups.
    pub(crate) keys: Vec<GroupKey>,
    /// The groups, with the kernels that the stages of the integrator ask for.
    pub(crate) groups: Vec<SurfaceGroup>,
    /// The groups with all kernels, once they are needed; `None` if these cannot be compiled.
    pub(crate) full_groups: OnceLock<Option<Vec<SurfaceGroup>>>,
    /// The entries of objects.
    pub(crate) objects: Vec<ObjectEntry>,
    /// The materials.
    pub(crate) materials: InstanceClasses,
    /// The alpha textures.
    pub(crate) alpha: InstanceClasses,
    /// The lights.
    pub(crate) lights: Lights,
    /// The numbers of the sampler, for what hosts compute.
    pub(crate) numbers: Arc<SamplerNumbers>,
    /// The texts about surfaces that materials shade, for what hosts compute.
    pub(crate) shading_texts: Arc<ShadingTexts>,
    /// The integrator.
    pub(crate) integrator: Integrator,
    /// The camera, once the stages that follow its rays are compiled.
    pub(super) placed_camera: Option<Camera>,
    /// The methods that shade surfaces and wait for light, if any is called.
    pub(crate) shading_methods: ShadingMethods,
    /// Those that defer light. Stages of the integrator contain most of them.
    pub(crate) own_shades: ShadingMethods,
    /// The AOVs to render.
    pub(crate) aovs: AovPlan,
    /// The titles of the objects in the scene's text, for traces.
    pub(crate) titles: Vec<String>,
}

impl RenderScene {
    /// The features that films of the scene keep.
    pub(crate) fn features(&self) -> &Features {
        &self.aovs.features
    }

    /// The name of the integrator's class.
    pub fn integrator(&self) -> &str {
        self.integrator.name()
    }

    /// Notes in the trace, if there is one, what a search has found.
    pub(crate) fn note_hit(&self, hit: Option<(u32, f32)>) {
        let Some(trace) = &self.engine.options().trace else { return };
        trace.note(|| match hit {
            Some((object, distance)) => {
                let title = self.titles.get(object as usize).map_or("", String::as_str);
                let shape = &self.compiled.objects[object as usize].primitive;
                let class = &self.compiled.shader(shape).program.class().name;
                format!("nearest hit: {class}, {title}, at distance {distance:?}")
            }
            None => "nearest hit: none".to_owned(),
        });
    }

    /// The camera.
    pub(crate) fn camera(&self) -> &Camera {
        self.placed_camera.as_ref().expect("the camera is compiled with the integrator")
    }

    /// Takes over changes of the compiled scene's camera and size.
    pub(crate) fn place_camera(&mut self) {
        if let Some(camera) = &mut self.placed_camera {
            camera.place(&self.compiled);
        }
    }

    /// The addresses of the code of the integrator's stages.
    #[cfg(test)]
    pub(crate) fn code(&self) -> Vec<*const rtsl::TieredKernel> {
        self.stages().flat_map(StagedMethod::code).collect()
    }

    /// True if rays may pass surfaces because of alpha textures.
    pub(crate) fn has_alpha(&self) -> bool {
        !self.alpha.is_empty()
    }

    /// Returns the greatest numbers of arrays of stages: of those of the integrator, and those of methods that shade
    /// surfaces.
    pub(crate) fn block_sizes(&self, integrator: &StagedMethod) -> BlockSizes {
        let of_methods = self.shading_stages().map(StagedMethod::block_sizes);
        of_methods.fold(integrator.block_sizes(), BlockSizes::max)
    }

    /// Has the background optimise the kernels of all stages, if it has not begun. Rendering uses each as soon as it is
    /// ready.
    pub fn optimise(&self) {
        self.stages().for_each(|staged| staged.optimise(&self.engine));
    }

    /// Waits until the background has optimised the kernels of all stages.
    pub fn wait_for_optimised(&self) {
        self.optimise();
        self.stages().for_each(StagedMethod::wait_for_optimised);
    }

    /// The stages of the integrator, and those of the methods that it calls.
    pub(super) fn stages(&self) -> impl Iterator<Item = &StagedMethod> {
        self.integrator.staged.iter().chain(self.shading_stages())
    }

    /// The stages of methods that shade surfaces.
    fn shading_stages(&self) -> impl Iterator<Item = &StagedMethod> {
        self.shading_methods.stages().chain(self.own_shades.stages())
    }

    /// The stage that samples lights for paths that wait for that; `None` if hosts do.
    pub(crate) fn light_stage(&self) -> Option<&StagedMethod> {
        self.shading_methods.lights().or_else(|| self.own_shades.lights())
    }

    /// True if hosts have to know the random sequences of paths on these stages.
    pub(crate) fn needs_rays(&self, staged: &StagedMethod) -> bool {
        let asks_for_lights = staged.samples_lights() && self.light_stage().is_none();
        staged.asks_host() || asks_for_lights || self.has_alpha()
    }

    /// True if rays of this depth are traced.
    pub(crate) fn is_traced_at(&self, depth: u32) -> bool {
        depth <= MAX_DEPTH.min(self.compiled.settings.max_depth)
    }

    /// Returns the hit of a surface by the indices of its object, instance and element, if the scene has such a surface.
    pub(crate) fn hit_of(&self, object: u32, instance: u32, element: u32) -> Option<PathHit> {
        let entry = self.objects.get(object as usize)?;
        self.compiled.class(entry.class).index_of(object, element)?;
        let instances = self.compiled.geometry.instances.len();
        let is_placed = instance == NO_INSTANCE || (instance as usize) < instances;
        is_placed.then_some(PathHit { path: 0, object, element, instance })
    }

    /// Returns the greatest number of scratch arrays of a shader.
    pub(crate) fn scratch_arrays(&self) -> usize {
        self.compiled.scratch_arrays
    }

    /// Returns the classes of the parts of surfaces.
    pub(crate) fn classes(&self) -> Classes<'_> {
        let RenderScene { compiled, materials, alpha, .. } = self;
        Classes { compiled, materials, alpha }
    }

    /// Compiles the kernels of the groups for these queries.
    ///
    /// # Errors
    /// If a kernel cannot be compiled.
    pub(super) fn make_groups(
        &self,
        queries: &BTreeSet<Query>,
    ) -> Result<(Vec<SurfaceGroup>, Diagnostics), Diagnostics> {
        let classes = self.classes();
        KernelMaker::build_with(&self.engine, |maker| {
            let keys = self.keys.iter();
            let group =
                |key: &GroupKey| SurfaceGroup::new(maker, *key, &classes.parts_of(key), queries);
            keys.map(group).collect()
        })
    }

    /// Returns the groups with the kernels that answer every query. They are compiled when they are needed first;
    /// queries of kernels that cannot be compiled have black results.
    pub(crate) fn full_groups(&self) -> &[SurfaceGroup] {
        if self.integrator.staged.is_none() {
            // The interpreter asks every query.
            return &self.groups;
        }
        let make = || self.make_groups(&Query::of_surfaces().collect()).ok();
        let made = self.full_groups.get_or_init(|| make().map(|(groups, _)| groups));
        made.as_deref().unwrap_or(&self.groups)
    }
}
