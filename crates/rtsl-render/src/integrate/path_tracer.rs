//! The inputs of path tracing.

use rtsl::Method;

use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::surface_group::SurfaceGroup;
use crate::film::features::Features;

/// The inputs of path tracing.
#[derive(Clone, Copy)]
pub struct PathTracer<'a> {
    /// The scene.
    pub scene: &'a RenderScene,
    /// Its surface groups, with the kernels for the queries that are asked.
    pub groups: &'a [SurfaceGroup],
    /// The record of runtime errors.
    pub errors: &'a RuntimeErrors,
    /// The features that are kept, if any.
    pub features: Option<&'a Features>,
    /// True if the causes of radiance that is not finite are reported.
    pub finds_causes: bool,
}

impl<'a> PathTracer<'a> {
    /// Creates the inputs without features.
    pub fn new(scene: &'a RenderScene, errors: &'a RuntimeErrors) -> Self {
        let groups = &scene.groups;
        PathTracer { scene, groups, errors, features: None, finds_causes: true }
    }

    /// Keeps the features of the scene's AOVs.
    #[must_use]
    pub fn with_features(self) -> Self {
        let features = Some(&self.scene.aovs.features);
        PathTracer { features: features.filter(|features| !features.is_empty()), ..self }
    }

    /// True if first hits are kept.
    pub fn keeps_first_hits(&self) -> bool {
        self.features.is_some_and(|features| features.first_hits)
    }

    /// Reports the number of paths for which a method of a class returned values that are not finite.
    pub fn report_lost(&self, class: &str, method: Method, lost: u64) {
        if lost > 0 {
            self.errors.report_not_finite(class, method, lost);
        }
    }
}
