//! The memory of one thread.

use super::camera_rays::CameraMemory;
use super::drawn_numbers::DrawnNumbers;
use super::integrator_memory::IntegratorMemory;
use super::searcher::Searcher;
use super::shading_batch::ShadingBatch;
use super::shading_texts::ShadingCalls;
use super::shadow_rays::ShadowRays;
use super::spawned_paths::SpawnedPaths;
use super::suspect::Suspect;
use super::wavefront::Wavefront;
use crate::compiled::render_scene::RenderScene;
use crate::film::samples::Samples;
use crate::lights::LightMemory;
use crate::statistics::{LaneUse, RayCounts};

/// The memory of one thread.
pub struct ThreadMemory {
    /// The paths.
    pub wavefront: Wavefront,
    /// The batch that is being shaded.
    pub batch: Box<ShadingBatch>,
    /// Light samples.
    pub light: Box<LightMemory>,
    /// Shadow rays as paths, used if alpha textures may let them pass surfaces.
    pub shadows: Wavefront,
    /// Shadow rays that are not traced yet.
    pub shadow_rays: ShadowRays,
    /// The indices of those that nothing blocks, once they are traced.
    pub reached: Vec<u32>,
    /// Methods whose values were not finite, with the calls of methods that shade surfaces in which they were found.
    pub suspects: Vec<(u32, Suspect)>,
    /// Paths that others have spawned, and that are not integrated yet.
    pub spawned: SpawnedPaths,
    /// The numbers of the sampler.
    pub drawn_numbers: DrawnNumbers,
    /// The texts about surfaces that materials shade.
    pub shading_calls: ShadingCalls,
    /// The memory of searches.
    pub searcher: Searcher,
    /// The memory of camera rays.
    pub camera: CameraMemory,
    /// The memory of the integrator; `None` in the memory of its queries.
    pub integrator: Option<Box<IntegratorMemory>>,
    /// The results of the last samples.
    pub samples: Samples,
    /// The number of rays traced so far.
    pub rays: RayCounts,
    /// The use of lanes in calls of the integrator's stages so far.
    pub lane_use: LaneUse,
}

impl ThreadMemory {
    /// Allocates the memory for a scene.
    pub fn new(scene: &RenderScene) -> Self {
        let integrator = Some(Box::new(IntegratorMemory::new(scene)));
        ThreadMemory { integrator, ..ThreadMemory::for_queries(scene) }
    }

    /// Allocates the memory for the queries of an integrator.
    pub fn for_queries(scene: &RenderScene) -> Self {
        let scratch = scene.scratch_arrays();
        ThreadMemory {
            wavefront: Wavefront::default(),
            shadows: Wavefront::default(),
            batch: ShadingBatch::new(scratch, &scene.numbers),
            light: LightMemory::new(scratch, &scene.numbers),
            shadow_rays: ShadowRays::default(),
            reached: Vec::new(),
            suspects: Vec::new(),
            spawned: SpawnedPaths::default(),
            drawn_numbers: DrawnNumbers::new(&scene.numbers),
            shading_calls: ShadingCalls::new(&scene.shading_texts),
            searcher: Searcher::new(scene),
            camera: CameraMemory::default(),
            integrator: None,
            samples: Samples::default(),
            rays: RayCounts::default(),
            lane_use: LaneUse::NONE,
        }
    }
}
