//! From a scene to an image: waves of all tiles, pass by pass, over all threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::compiled::problems::{Problems, exhausted_budgets};
use crate::film::Image;
use crate::messages::Messages;
use crate::statistics::RayCounts;
use crate::tiles::RenderThreads;

use super::film::BatchFilm;
use super::scene::BatchScene;
use super::tracer::{BatchMemory, PathTracer};

/// Samples of a pixel that a wave takes: with 64 pixels a thousand paths, whose memory caches hold.
const SAMPLES_IN_WAVE: u32 = 16;

/// How to render.
#[derive(Clone, Copy, Default)]
pub struct BatchOptions<'a> {
    /// How many threads; all processors where `None`.
    pub threads: Option<usize>,
    /// Is told how many of how many waves are done, from any thread.
    pub progress: Option<&'a (dyn Fn(usize, usize) + Sync)>,
    /// Ends the render early when it becomes true.
    pub cancel: Option<&'a AtomicBool>,
    /// Ends the render early after this time.
    pub time_limit: Option<Duration>,
}

/// An image, and what making it took.
#[derive(Clone, Debug)]
pub struct BatchRendered {
    /// The image; where the render ended early, of the samples that there are.
    pub image: Image,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples that were not finite.
    pub dropped_samples: u64,
    /// The time.
    pub time: Duration,
    /// How many threads there were.
    pub threads: usize,
    /// Whether the render ended early.
    pub cancelled: bool,
}

/// Renders a scene.
///
/// # Errors
/// If a shader ran past its budget of loop iterations, or threads can't be had.
pub fn render(scene: &BatchScene, options: BatchOptions<'_>) -> Result<BatchRendered, Messages> {
    let threads = RenderThreads::new(options.threads)?;
    let settings = &scene.compiled.settings;
    let film = BatchFilm::new(settings.width, settings.height);
    let job =
        Job { scene, options, film, problems: Problems::default(), done: AtomicUsize::new(0) };
    let start = Instant::now();
    let (cancelled, rays) = job.run(&threads, start);
    let time = start.elapsed();
    if job.problems.any() {
        return Err(exhausted_budgets(&scene.compiled, &job.problems));
    }
    Ok(BatchRendered {
        image: job.film.image(),
        rays,
        dropped_samples: job.film.dropped(),
        time,
        threads: threads.count(),
        cancelled,
    })
}

/// A render in progress.
struct Job<'a> {
    scene: &'a BatchScene,
    options: BatchOptions<'a>,
    film: BatchFilm,
    problems: Problems,
    done: AtomicUsize,
}

impl Job<'_> {
    /// Renders all passes; whether it ended early, and the rays traced.
    fn run(&self, threads: &RenderThreads, start: Instant) -> (bool, RayCounts) {
        let samples = self.scene.compiled.settings.sampler.samples_per_pixel();
        let passes = samples.div_ceil(SAMPLES_IN_WAVE) as usize;
        let tiles = self.film.tiles().len();
        let count = passes * tiles;
        let tracer = PathTracer { scene: self.scene, problems: &self.problems };
        let (next, memories) = threads.for_each_tile(
            (0, count),
            || BatchMemory::new(self.scene),
            || !self.must_stop(start),
            |memory, index| {
                let (pass, tile) = (index / tiles, index % tiles);
                let first = pass as u32 * SAMPLES_IN_WAVE;
                let end = samples.min(first + SAMPLES_IN_WAVE);
                tracer.trace_samples(memory, self.film.tiles()[tile], (first, end));
                // Samples that were cut short are none.
                if !self.problems.any() {
                    self.film.add(tile, first, &memory.wave.paths);
                }
                let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
                if let Some(progress) = self.options.progress {
                    progress(done, count);
                }
            },
        );
        let mut rays = RayCounts::default();
        memories.iter().for_each(|memory| rays += memory.rays);
        (next < count, rays)
    }

    fn must_stop(&self, start: Instant) -> bool {
        let cancelled = self.options.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed));
        let late = self.options.time_limit.is_some_and(|limit| start.elapsed() >= limit);
        cancelled || late || self.problems.any()
    }
}
