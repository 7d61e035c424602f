//! The renderer of a session: a scene with the integrator that makes its picture.

use rtsl::{Engine, Messages};
use rtsl_bvh::{LANES, lanes_of};
use rtsl_scene::{INTERACTIVE, Scene, WHITTED};

use super::tile_sample::TileSample;
use crate::compiled::CompiledScene;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::render_scene_builder::RenderSceneBuilder;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::integrate::camera_rays::CameraRays;
use crate::integrate::memory::ThreadMemory;
use crate::integrate::path_tracer::PathTracer;
use crate::integrate::wavefront::SAMPLES_IN_WAVEFRONT;
use crate::integrate::wavefront::tiles_of_wavefront;
use crate::schedule::tile_samples::TileSamples;
use crate::schedule::visits::count_visits;
use crate::statistics::LaneUse;

/// A renderer with its scene.
pub struct SessionRenderer {
    scene: Box<RenderScene>,
    /// True if the picture is that of the interactive renderer, which no class names.
    is_interactive: bool,
}

/// Samples of a tile, with the use of lanes for them.
pub struct TakenSamples {
    pub samples: Vec<TileSample>,
    pub lane_use: LaneUse,
    /// The object that each pixel's first sample hits first, if these are kept; -1 for none.
    pub objects: Option<[i32; LANES]>,
}

impl SessionRenderer {
    /// Prepares a scene for its integrator. What did not change since an earlier state is used again.
    ///
    /// # Errors
    /// As for [`RenderSceneBuilder::build`].
    pub fn new(
        scene: &Scene,
        engine: &Engine,
        earlier: Option<(&SessionRenderer, &Scene)>,
        messages: &mut Messages,
    ) -> Result<SessionRenderer, Messages> {
        let earlier = earlier.map(|(earlier, of)| (&*earlier.scene, of));
        let builder = RenderSceneBuilder::of_changing(engine, scene, earlier);
        let prepared = builder.keeping_first_hits().build(scene, messages)?;
        let is_interactive =
            scene.integrator.is_none() && scene.settings.integrator == Some(WHITTED);
        Ok(SessionRenderer { scene: Box::new(prepared), is_interactive })
    }

    /// The scene.
    pub fn scene(&self) -> &RenderScene {
        &self.scene
    }

    /// The compiled scene.
    pub fn compiled(&self) -> &CompiledScene {
        &self.scene.compiled
    }

    /// Changes the place of the camera, or the size.
    pub fn change_view(&mut self, change: impl FnOnce(&mut CompiledScene)) {
        change(&mut self.scene.compiled);
        self.scene.place_camera();
    }

    /// Generates the camera rays of a sample of each pixel of a tile.
    pub fn camera_packet(
        &self,
        errors: &RuntimeErrors,
        memory: &mut ThreadMemory,
        samples: &TileSamples,
    ) -> CameraRays {
        memory.camera.generate_packet(&self.scene, errors, samples, 0)
    }

    /// The name of the integrator, or of the interactive renderer.
    pub fn name(&self) -> &str {
        match self.is_interactive {
            true => INTERACTIVE,
            false => self.scene.integrator(),
        }
    }

    /// The number of samples that are taken together of a tile's pixels, of which each has `taken` samples.
    pub fn samples_of_visit(&self, taken: u32) -> u32 {
        let wanted = self.compiled().settings.sampler.samples_per_pixel();
        let samples = SAMPLES_IN_WAVEFRONT - taken % SAMPLES_IN_WAVEFRONT;
        samples.min(wanted.saturating_sub(taken)).max(1)
    }

    /// The number of tiles, among so many for the threads, of which a sample of each pixel is taken together.
    pub fn tiles_of_visit(&self, tiles: usize, threads: usize) -> usize {
        tiles_of_wavefront(1, tiles, threads)
    }

    /// Takes samples of tiles; returns those of each tile. The tiles share the use of lanes.
    pub fn take_samples(
        &self,
        errors: &RuntimeErrors,
        memory: &mut ThreadMemory,
        samples: &[TileSamples],
        keeps_objects: bool,
    ) -> Vec<TakenSamples> {
        // Nobody reads the causes of samples that are not finite.
        let tracer = PathTracer { finds_causes: false, ..PathTracer::new(&self.scene, errors) };
        tracer.trace_samples(memory, samples, keeps_objects.then(|| self.scene.features()));
        let lane_use = std::mem::take(&mut memory.lane_use);
        let mut start = 0;
        let of_tile = |samples: &TileSamples| {
            let end = start + samples.packets() * LANES;
            let results = memory.samples.of_tile(start..end);
            start = end;
            let mut hits = results.first_hits.iter().step_by(samples.count as usize);
            let mut object = |_| hits.next().map_or(-1, |hit| hit.object as i32);
            let objects = keeps_objects.then(|| std::array::from_fn(&mut object));
            let samples = developed(&self.scene, samples, results.radiance);
            TakenSamples { samples, lane_use, objects }
        };
        samples.iter().map(of_tile).collect()
    }

    /// Returns for each pixel the number of nodes and leaves that the camera rays of these samples visit.
    pub fn visits(
        &self,
        errors: &RuntimeErrors,
        memory: &mut ThreadMemory,
        samples: TileSamples,
    ) -> [u32; LANES] {
        count_visits(&self.scene, errors, memory, &samples)
    }
}

/// Returns the colours of a tile's samples, given their radiance, channel by channel.
fn developed(scene: &RenderScene, samples: &TileSamples, radiance: [&[f32]; 3]) -> Vec<TileSample> {
    let settings = &scene.compiled.settings;
    let lanes = samples.tile.lanes(settings.width, settings.height);
    let count = samples.count as usize;
    let sample = |sample: usize| {
        let mut colors = [[0.0; LANES]; 3];
        for lane in lanes_of(lanes) {
            let color = settings.imaging.develop(radiance.map(|it| it[lane * count + sample]));
            (0..3).for_each(|channel| colors[channel][lane] = color[channel]);
        }
        TileSample { lanes, colors }
    };
    (0..count).map(sample).collect()
}
