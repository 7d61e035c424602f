//! From a scene to an image: waves of all tiles, pass by pass, over all threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rtsl::Messages;
use rtsl_image::{Aov, AovImage, Image};
use rtsl_memory::OutOfMemory;
use rtsl_scene::Renderer;

use super::checkpoints::{CheckpointWriter, Checkpoints, restore};
use super::features::is_feature;
use super::film::BatchFilm;
use super::scene::BatchScene;
use super::tile_order::TileOrder;
use super::tracer::{BatchMemory, PathTracer};
use super::wavefront::SAMPLES_IN_WAVE;
use crate::checkpoint::CheckpointError;
use crate::compiled::object_class_numbers::ObjectClasses;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::progress::TilesDone;
use crate::statistics::{NotFinite, RayCounts};
use crate::tiles::{RenderThreads, TILE};

/// The images of something else than colour that it makes.
const AOVS: [Aov; 8] = [
    Aov::Albedo,
    Aov::Distance,
    Aov::Normal,
    Aov::Object,
    Aov::Class,
    Aov::Samples,
    Aov::Variance,
    Aov::Time,
];

/// How to render.
#[derive(Clone, Copy, Default)]
pub struct BatchOptions<'a> {
    /// How many threads; all processors where `None`.
    pub threads: Option<usize>,
    /// Is told which waves are done, from any thread.
    pub progress: Option<&'a (dyn Fn(TilesDone) + Sync)>,
    /// Ends the render early when it becomes true.
    pub cancel: Option<&'a AtomicBool>,
    /// Ends the render early after this time.
    pub time_limit: Option<Duration>,
    /// Images of something else than colour.
    pub aovs: &'a [Aov],
    /// Tiles take no more samples where their noise is no more than this: standard errors relative to the
    /// tile's luminance.
    pub noise_target: Option<f32>,
    /// Keeps what there is, to go on later.
    pub checkpoints: Option<&'a Checkpoints>,
}

/// An image, and what making it took.
#[derive(Clone, Debug)]
pub struct BatchRendered {
    /// The image; where the render ended early, of the samples that there are.
    pub image: Image,
    /// The images that were asked for besides, in that order.
    pub aovs: Vec<AovImage>,
    /// The classes of the objects, by their numbers in such an image.
    pub object_classes: Vec<String>,
    /// The samples of a pixel, on average.
    pub mean_samples: f64,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples that were not finite.
    pub dropped_samples: u64,
    /// The methods whose values were not finite.
    pub not_finite: Vec<NotFinite>,
    /// The time.
    pub time: Duration,
    /// How many threads there were.
    pub threads: usize,
    /// Whether the render ended early.
    pub cancelled: bool,
    /// Why there is no checkpoint of all that was rendered.
    pub checkpoint_problem: Option<CheckpointError>,
}

/// Renders a scene.
///
/// # Errors
/// If a shader ran past its budget of loop iterations, threads can't be had, it does not make an image that is asked for,
/// or the checkpoint cannot be resumed.
pub fn render(scene: &BatchScene, options: BatchOptions<'_>) -> Result<BatchRendered, Messages> {
    Aov::refuse_others(options.aovs, &AOVS, Renderer::Batch.name()).map_err(Messages::one)?;
    let threads = RenderThreads::new(options.threads)?;
    let job = Job::new(scene, options)?;
    let start = Instant::now();
    let (cancelled, rays) = job.run(&threads, start);
    job.finish(start.elapsed(), cancelled, rays, threads.count())
}

/// A render in progress.
struct Job<'a> {
    scene: &'a BatchScene,
    options: BatchOptions<'a>,
    film: BatchFilm,
    with_features: bool,
    problems: RuntimeErrors,
    writer: Option<CheckpointWriter<'a>>,
    done: AtomicUsize,
    skipped: AtomicUsize,
}

impl<'a> Job<'a> {
    fn new(scene: &'a BatchScene, options: BatchOptions<'a>) -> Result<Self, Messages> {
        let settings = &scene.compiled.settings;
        let with_features = options.aovs.iter().any(|aov| is_feature(*aov));
        let size = (settings.width, settings.height);
        let film = BatchFilm::new(size, with_features, options.noise_target)
            .map_err(|error| Messages::one(error.diagnostic()))?;
        if let Some(checkpoints) = options.checkpoints.filter(|it| it.resume) {
            restore(&film, checkpoints).map_err(|error| Messages::one(error.diagnostic()))?;
        }
        Ok(Job {
            scene,
            options,
            film,
            with_features,
            problems: RuntimeErrors::default(),
            writer: options.checkpoints.map(CheckpointWriter::new),
            done: AtomicUsize::new(0),
            skipped: AtomicUsize::new(0),
        })
    }

    /// Renders all passes; whether it ended early, and the rays traced.
    fn run(&self, threads: &RenderThreads, start: Instant) -> (bool, RayCounts) {
        let settings = &self.scene.compiled.settings;
        let samples = settings.sampler.samples_per_pixel();
        let tiles = self.film.tiles().len();
        let order = TileOrder::new(tiles, settings.width.div_ceil(TILE));
        let count = samples.div_ceil(SAMPLES_IN_WAVE) as usize * tiles;
        let (next, memories) = threads.for_each_tile(
            (0, count),
            || BatchMemory::new(self.scene),
            || !self.must_stop(start),
            |memory, index| {
                // Pass by pass over the whole image, so that it is even wherever it ends.
                let (pass, tile) = (index / tiles, order.tile(index % tiles));
                let first = pass as u32 * SAMPLES_IN_WAVE;
                let wave = (first, samples.min(first + SAMPLES_IN_WAVE));
                let was_needed = self.render_wave(memory, tile, wave);
                self.tell(was_needed, count);
            },
        );
        let mut rays = RayCounts::default();
        memories.iter().for_each(|memory| rays += memory.rays);
        (next < count, rays)
    }

    /// Tells that one more of so many waves is done.
    fn tell(&self, was_needed: bool, of: usize) {
        let skipped = self.skipped.fetch_add(usize::from(!was_needed), Ordering::Relaxed)
            + usize::from(!was_needed);
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(progress) = self.options.progress {
            progress(TilesDone { done, of, skipped });
        }
    }

    /// Renders the samples `first..end` of a tile, as far as it needs them, and tells whether it does.
    fn render_wave(&self, memory: &mut BatchMemory, tile: usize, (first, end): (u32, u32)) -> bool {
        let Some(first) = self.film.taken(tile).map(|taken| taken.max(first)) else { return false };
        if first >= end {
            return false;
        }
        let begun = Instant::now();
        let Job { scene, problems, with_features, .. } = self;
        let tracer = PathTracer { scene, problems, with_features: *with_features };
        tracer.trace_samples(memory, self.film.tiles()[tile], (first, end));
        // Samples that were cut short are none.
        if !self.problems.any() {
            self.film.add(tile, first, &memory.wave, begun.elapsed());
            if let Some(writer) = &self.writer {
                writer.write_if_due(&self.film);
            }
        }
        true
    }

    fn must_stop(&self, start: Instant) -> bool {
        let cancelled = self.options.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed));
        let late = self.options.time_limit.is_some_and(|limit| start.elapsed() >= limit);
        cancelled || late || self.problems.any()
    }

    fn finish(
        self,
        time: Duration,
        cancelled: bool,
        rays: RayCounts,
        threads: usize,
    ) -> Result<BatchRendered, Messages> {
        let Job { scene, options, film, problems, writer, .. } = self;
        let scene = &scene.compiled;
        if problems.any() {
            return Err(exhausted_budgets(scene, &problems));
        }
        let is_kept = |writer: &&CheckpointWriter<'_>| cancelled || writer.is_periodic();
        let checkpoint_problem =
            writer.as_ref().filter(is_kept).and_then(|writer| writer.write_last(&film).err());
        let classes = ObjectClasses::of(scene);
        let numbers: Vec<f32> = scene.objects.iter().map(|it| classes.number(it)).collect();
        let aovs = options.aovs.iter().map(|aov| film.aov(*aov, &numbers));
        let no_memory = |error: OutOfMemory| Messages::one(error.diagnostic());
        Ok(BatchRendered {
            image: film.image().map_err(no_memory)?,
            aovs: aovs.collect::<Result<_, _>>().map_err(no_memory)?,
            object_classes: classes.names,
            mean_samples: film.mean_samples(),
            rays,
            dropped_samples: film.dropped(),
            not_finite: problems.not_finite(),
            time,
            threads,
            cancelled,
            checkpoint_problem,
        })
    }
}
