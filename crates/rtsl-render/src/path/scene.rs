//! A scene for path tracing: surface groups and lights.

use std::time::Duration;

use super::instance_classes::InstanceClasses;
use super::integrator::Integrator;
use super::lights::Lights;
use super::object_entry::ObjectEntry;
use super::surface_group::SurfaceGroup;
use crate::compiled::CompiledScene;

/// A scene ready for path tracing.
pub struct BatchScene {
    /// The compiled scene with the acceleration structure.
    pub compiled: CompiledScene,
    /// The time for compiling kernels.
    pub compile_time: Duration,
    /// The groups.
    pub(super) groups: Vec<SurfaceGroup>,
    /// The entries of objects.
    pub(super) objects: Vec<ObjectEntry>,
    /// The materials.
    pub(super) materials: InstanceClasses,
    /// The alpha textures.
    pub(super) alpha: InstanceClasses,
    /// The lights.
    pub(super) lights: Lights,
    /// The integrator written in RTSL, if the scene names one.
    pub(super) integrator: Option<Integrator>,
}

impl BatchScene {
    /// True if rays may pass surfaces because of alpha textures.
    pub(super) fn has_alpha(&self) -> bool {
        !self.alpha.is_empty()
    }

    /// True if any material has only `shade`, or the integrator calls `shade` of all of them.
    pub(super) fn calls_shade(&self) -> bool {
        self.integrator.as_ref().is_some_and(|integrator| integrator.calls_shade)
            || self.groups.iter().any(|group| group.material.shade.is_some())
    }

    /// True if any surface reads the ray's footprint.
    pub(super) fn has_footprints(&self) -> bool {
        match &self.integrator {
            Some(integrator) => integrator.reads_widths(),
            None => self.groups.iter().any(|group| group.needs.footprints),
        }
    }

    /// Returns the greatest number of scratch arrays of a shader.
    pub(super) fn scratch_arrays(&self) -> usize {
        self.compiled.scratch_arrays
    }
}
