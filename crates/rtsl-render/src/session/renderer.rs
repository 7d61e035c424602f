//! The renderer of a session: the interactive one, or an integrator.

use rtsl::{Engine, Messages};
use rtsl_bvh::{LANES, lanes_of};
use rtsl_scene::{Renderer, Scene};

use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::tracer::Tracer;
use crate::compiled::work_counts::WorkCounts;
use crate::compiled::{CompiledScene, SceneBuilder};
use crate::path::{
    BatchMemory, BatchScene, BatchSceneBuilder, PathTracer, SAMPLES_IN_WAVEFRONT,
    tiles_of_wavefront,
};
use crate::statistics::{LaneUse, RayCounts};
use crate::tiles::TileSamples;
use crate::whitted::{TileSample, Workspace, sample_tile, visits_of_sample};

/// A renderer with its scene.
pub enum SessionRenderer {
    /// The interactive renderer.
    Interactive(Box<CompiledScene>),
    /// An integrator on paths.
    Integrator(Box<BatchScene>),
}

/// The memory of one thread.
pub struct ThreadMemory {
    workspace: Workspace,
    /// The memory of paths, if there is an integrator.
    paths: Option<BatchMemory>,
}

/// Samples of a tile, with the use of lanes for them, if it was counted.
pub struct TakenSamples {
    pub samples: Vec<TileSample>,
    pub lane_use: LaneUse,
}

impl SessionRenderer {
    /// Prepares a scene for its integrator if it `has_integrator`, else for the interactive renderer. What did not
    /// change since an earlier state is used again.
    ///
    /// # Errors
    /// As for [`SceneBuilder::build`] and [`BatchSceneBuilder::build`].
    pub fn new(
        scene: &Scene,
        has_integrator: bool,
        engine: &Engine,
        earlier: Option<(&SessionRenderer, &Scene)>,
        messages: &mut Messages,
    ) -> Result<SessionRenderer, Messages> {
        let builder = SceneBuilder::new(engine);
        let builder = match earlier {
            Some((earlier, of)) if scene.has_same_shapes(of) => {
                builder.same_shapes(earlier.compiled())
            }
            Some((earlier, _)) => builder.moved_shapes(earlier.compiled()),
            None => builder,
        };
        if !has_integrator {
            let compiled = builder.build(scene.clone(), messages)?;
            return Ok(SessionRenderer::Interactive(Box::new(compiled)));
        }
        let builder = BatchSceneBuilder::new(builder).changing_values();
        let builder = match earlier {
            Some((SessionRenderer::Integrator(earlier), _)) => builder.earlier(earlier),
            Some((SessionRenderer::Interactive(_), _)) | None => builder,
        };
        Ok(SessionRenderer::Integrator(Box::new(builder.build(scene, messages)?)))
    }

    /// The compiled scene.
    pub fn compiled(&self) -> &CompiledScene {
        match self {
            SessionRenderer::Interactive(compiled) => compiled,
            SessionRenderer::Integrator(scene) => &scene.compiled,
        }
    }

    /// The compiled scene, whose camera and size may be changed.
    pub fn compiled_mut(&mut self) -> &mut CompiledScene {
        match self {
            SessionRenderer::Interactive(compiled) => compiled,
            SessionRenderer::Integrator(scene) => &mut scene.compiled,
        }
    }

    /// True if an integrator makes the picture.
    pub fn has_integrator(&self) -> bool {
        matches!(self, SessionRenderer::Integrator(_))
    }

    /// The name of the integrator, or of the interactive renderer.
    pub fn name(&self) -> &str {
        match self {
            SessionRenderer::Interactive(_) => Renderer::Interactive.name(),
            SessionRenderer::Integrator(scene) => scene.integrator(),
        }
    }

    /// Replaces the values of instances in which `scene` differs from `earlier`. Returns false without any effect if
    /// the scene has to be prepared again.
    pub fn replace_values(&mut self, earlier: &Scene, scene: &Scene, engine: &Engine) -> bool {
        match self {
            SessionRenderer::Interactive(compiled) => {
                compiled.replace_values(earlier, scene, engine)
            }
            SessionRenderer::Integrator(_) => false,
        }
    }

    /// Allocates the memory of a thread.
    pub fn memory(&self) -> ThreadMemory {
        let workspace = Workspace::new(self.compiled());
        let paths = match self {
            SessionRenderer::Interactive(_) => None,
            SessionRenderer::Integrator(scene) => Some(BatchMemory::new(scene)),
        };
        ThreadMemory { workspace, paths }
    }

    /// The number of samples that are taken together of a tile's pixels, of which each has `taken` samples.
    pub fn samples_of_visit(&self, taken: u32) -> u32 {
        let wanted = self.compiled().settings.sampler.samples_per_pixel();
        match self {
            SessionRenderer::Interactive(_) => 1,
            SessionRenderer::Integrator(_) => {
                let samples = SAMPLES_IN_WAVEFRONT - taken % SAMPLES_IN_WAVEFRONT;
                samples.min(wanted.saturating_sub(taken)).max(1)
            }
        }
    }

    /// The number of tiles, among so many for the threads, of which a sample of each pixel is taken together.
    pub fn tiles_of_visit(&self, tiles: usize, threads: usize) -> usize {
        match self {
            SessionRenderer::Interactive(_) => 1,
            SessionRenderer::Integrator(_) => tiles_of_wavefront(1, tiles, threads),
        }
    }

    /// Takes samples of tiles; returns those of each tile.
    pub fn take_samples(
        &self,
        errors: &RuntimeErrors,
        memory: &mut ThreadMemory,
        samples: &[TileSamples],
        counts_lanes: bool,
    ) -> Vec<TakenSamples> {
        let ThreadMemory { workspace, paths } = memory;
        if let (SessionRenderer::Integrator(scene), Some(memory)) = (self, paths) {
            return trace_samples(scene, errors, memory, samples);
        }
        let tracer = Tracer { scene: self.compiled(), errors };
        let of_tile = |TileSamples { tile, first, count }: &TileSamples| {
            workspace.search.counts = counts_lanes.then(|| WorkCounts::new(self.compiled().width));
            let samples = *first..first + count;
            let samples = samples.map(|sample| sample_tile(&tracer, workspace, *tile, sample));
            let samples = samples.collect();
            let counts = workspace.search.counts.take();
            let lane_use = counts.map_or(LaneUse::NONE, |counts| counts.lane_use);
            TakenSamples { samples, lane_use }
        };
        samples.iter().map(of_tile).collect()
    }

    /// Returns the number of nodes and leaves that the camera rays of these samples visit.
    pub fn visits(
        &self,
        errors: &RuntimeErrors,
        memory: &mut ThreadMemory,
        TileSamples { tile, first, count }: TileSamples,
    ) -> [u32; LANES] {
        let tracer = Tracer { scene: self.compiled(), errors };
        let mut sum = [0; LANES];
        for sample in first..first + count {
            let visits = visits_of_sample(&tracer, &mut memory.workspace, tile, sample);
            sum.iter_mut().zip(visits).for_each(|(sum, visits)| *sum += visits);
        }
        sum
    }
}

impl ThreadMemory {
    /// The number of rays traced with it.
    pub fn rays(&self) -> RayCounts {
        let mut rays = self.workspace.rays;
        self.paths.iter().for_each(|paths| rays += paths.rays);
        rays
    }
}

/// Takes samples by the integrator of a scene. The tiles share the use of lanes.
fn trace_samples(
    scene: &BatchScene,
    errors: &RuntimeErrors,
    memory: &mut BatchMemory,
    samples: &[TileSamples],
) -> Vec<TakenSamples> {
    // Nobody reads the causes of samples that are not finite.
    let tracer = PathTracer { finds_causes: false, ..PathTracer::new(scene, errors) };
    tracer.trace_samples(memory, samples);
    let lane_use = std::mem::take(&mut memory.lane_use);
    let mut start = 0;
    let of_tile = |samples: &TileSamples| {
        let end = start + samples.packets() * LANES;
        let radiance = &memory.samples.radiance[start..end];
        start = end;
        TakenSamples { samples: developed(scene, samples, radiance), lane_use }
    };
    samples.iter().map(of_tile).collect()
}

/// Returns the colours of a tile's samples, given their radiance.
fn developed(scene: &BatchScene, samples: &TileSamples, radiance: &[[f32; 3]]) -> Vec<TileSample> {
    let settings = &scene.compiled.settings;
    let lanes = samples.tile.lanes(settings.width, settings.height);
    let count = samples.count as usize;
    let sample = |sample: usize| {
        let mut colors = [[0.0; LANES]; 3];
        for lane in lanes_of(lanes) {
            let color = settings.imaging.develop(radiance[lane * count + sample]);
            (0..3).for_each(|channel| colors[channel][lane] = color[channel]);
        }
        TileSample { lanes, colors }
    };
    (0..count).map(sample).collect()
}
