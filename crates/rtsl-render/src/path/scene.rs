//! A scene for path tracing: surface groups and lights.

use std::collections::BTreeSet;
use std::sync::OnceLock;
use std::time::Duration;

use rtsl::{Diagnostics, Engine, Query};
use rtsl_image::Aov;

use super::features::is_feature;
use super::group_plan::Classes;
use super::instance_classes::InstanceClasses;
use super::integrator::Integrator;
use super::kernels::KernelMaker;
use super::lights::Lights;
use super::object_entry::ObjectEntry;
use super::surface_group::{GroupKey, SurfaceGroup};
use crate::compiled::CompiledScene;

/// A scene ready for path tracing.
pub struct BatchScene {
    /// The compiled scene with the acceleration structure.
    pub compiled: CompiledScene,
    /// The time for compiling kernels.
    pub compile_time: Duration,
    /// The engine, for kernels that only a sample that is not finite needs.
    pub(super) engine: Engine,
    /// The keys of the groups.
    pub(super) keys: Vec<GroupKey>,
    /// The groups, with the kernels that the stages of the integrator ask for.
    pub(super) groups: Vec<SurfaceGroup>,
    /// The groups with all kernels, once they are needed; `None` if these cannot be compiled.
    pub(super) full_groups: OnceLock<Option<Vec<SurfaceGroup>>>,
    /// The entries of objects.
    pub(super) objects: Vec<ObjectEntry>,
    /// The materials.
    pub(super) materials: InstanceClasses,
    /// The alpha textures.
    pub(super) alpha: InstanceClasses,
    /// The lights.
    pub(super) lights: Lights,
    /// The integrator.
    pub(super) integrator: Integrator,
    /// The AOVs to render.
    pub(super) aovs: Vec<Aov>,
}

impl BatchScene {
    /// The name of the integrator's class.
    pub fn integrator(&self) -> &str {
        self.integrator.name()
    }

    /// The addresses of the code of the integrator's stages.
    #[cfg(test)]
    pub(crate) fn code(&self) -> Vec<*const rtsl::Kernel> {
        self.integrator.staged.as_ref().map_or_else(Vec::new, |staged| staged.code())
    }

    /// True if the features of first surfaces are needed.
    pub(super) fn has_features(&self) -> bool {
        self.aovs.iter().any(|aov| is_feature(*aov))
    }

    /// True if rays may pass surfaces because of alpha textures.
    pub(super) fn has_alpha(&self) -> bool {
        !self.alpha.is_empty()
    }

    /// True if any material has only `shade`, or the integrator calls `shade` of all of them.
    pub(super) fn calls_shade(&self) -> bool {
        let is_shaded = |key: &GroupKey| key.is_shaded(&self.classes());
        self.integrator.calls_shade || self.keys.iter().any(is_shaded)
    }

    /// Returns the greatest number of scratch arrays of a shader.
    pub(super) fn scratch_arrays(&self) -> usize {
        self.compiled.scratch_arrays
    }

    /// Returns the classes of the parts of surfaces.
    pub(super) fn classes(&self) -> Classes<'_> {
        let BatchScene { compiled, materials, alpha, .. } = self;
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
    pub(super) fn full_groups(&self) -> &[SurfaceGroup] {
        if self.integrator.staged.is_none() {
            // The interpreter asks every query.
            return &self.groups;
        }
        let make = || self.make_groups(&Query::of_surfaces().collect()).ok();
        let made = self.full_groups.get_or_init(|| make().map(|(groups, _)| groups));
        made.as_deref().unwrap_or(&self.groups)
    }
}
