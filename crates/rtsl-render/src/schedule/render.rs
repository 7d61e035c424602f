//! Rendering an image: wavefronts of all tiles, pass by pass, on all threads.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rtsl::Messages;
use rtsl_bvh::LANES;

use super::checkpoints::{CheckpointWriter, Checkpoints, restore};
use super::partial_render::{Part, PartialRender};
use super::render_threads::RenderThreads;
use super::tile::TILE;
use super::tile_order::TileOrder;
use super::tile_samples::TileSamples;
use super::visits::count_visits;
use crate::checkpoint::CheckpointError;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::execution::{Execution, Optimise, Rendered};
use crate::film::sample_film::{SampleFilm, TileWork};
use crate::integrate::memory::ThreadMemory;
use crate::integrate::path_tracer::PathTracer;
use crate::integrate::wavefront::{SAMPLES_IN_WAVEFRONT, tiles_of_wavefront};
use crate::progress::TilesDone;
use crate::statistics::RayCounts;

/// Options of a render.
#[derive(Clone, Copy, Default)]
pub struct RenderOptions<'a> {
    /// The course of the render.
    pub execution: Execution<'a>,
    /// Called with the progress, from any thread.
    pub progress: Option<&'a (dyn Fn(TilesDone) + Sync)>,
    /// The noise at which tiles take no more samples: standard errors relative to the tile's luminance.
    pub noise_target: Option<f32>,
    /// Checkpoint options, to resume the render later.
    pub checkpoints: Option<&'a Checkpoints>,
}

/// An image with statistics of its render.
#[derive(Clone, Debug)]
pub struct RenderedImage {
    /// The image, and what every renderer counts.
    pub rendered: Rendered,
    /// The average number of samples per pixel.
    pub mean_samples: f64,
    /// The error if there is no checkpoint of all that was rendered.
    pub checkpoint_error: Option<CheckpointError>,
}

/// Renders a scene.
///
/// # Errors
/// If a shader exceeds its budget of loop iterations, threads cannot be started, or the checkpoint cannot be resumed.
pub fn render(scene: &RenderScene, options: RenderOptions<'_>) -> Result<RenderedImage, Messages> {
    let threads = RenderThreads::new(options.execution.threads)?;
    let mut partial = PartialRender::new(scene, 0, options.noise_target)?;
    if let Some(checkpoints) = options.checkpoints.filter(|it| it.resume) {
        restore(partial.film(), checkpoints).map_err(|error| Messages::one(error.diagnostic()))?;
    }
    let whole = partial.whole(scene);
    let writer = options.checkpoints.map(CheckpointWriter::new);
    let cancelled = partial.render_on(&threads, scene, &whole, options, writer.as_ref())?;
    let is_kept = |writer: &&CheckpointWriter<'_>| cancelled || writer.is_periodic();
    let checkpoint_error =
        writer.as_ref().filter(is_kept).and_then(|it| it.write_last(partial.film()).err());
    Ok(RenderedImage { checkpoint_error, ..partial.rendered(scene)? })
}

/// The time after which the rest of a render is estimated.
const JUDGED_AFTER: Duration = Duration::from_millis(50);

/// The rest of a render that repays optimised kernels, in times for compiling the first ones. With optimised stages a
/// render takes 0.7 of the time where kernels search, and 0.93 where hierarchies do. They take about one and a half
/// times as long to compile as all before them (Zen 5).
const LONG_REST: f64 = 5.0;

/// A part in progress.
pub struct Job<'a> {
    pub scene: &'a RenderScene,
    pub options: RenderOptions<'a>,
    pub film: &'a SampleFilm,
    pub errors: &'a RuntimeErrors,
    /// The writer of checkpoints, if there are any.
    pub writer: Option<&'a CheckpointWriter<'a>>,
    /// The number of wavefronts done.
    pub done: AtomicUsize,
    /// The number of those that were not needed.
    pub skipped: AtomicUsize,
}

impl Job<'_> {
    /// Renders all passes of a part. Returns true if it ended early, and the number of rays traced.
    pub fn run(&self, part: &Part, threads: &RenderThreads, start: Instant) -> (bool, RayCounts) {
        let settings = &self.scene.compiled.settings;
        let Part { tiles: Range { start: first_tile, end: end_tile }, samples: of_part } = part;
        assert!(*end_tile <= self.film.tiles().len(), "the picture has these tiles");
        let samples = of_part.end.saturating_sub(of_part.start);
        let tiles = end_tile.saturating_sub(*first_tile);
        let row = settings.width.div_ceil(TILE);
        let order = TileOrder::new(tiles, if tiles.is_multiple_of(row) { row } else { 1 });
        let together = tiles_of_wavefront(samples, tiles, threads.count());
        let groups = tiles.div_ceil(together);
        let count = samples.div_ceil(SAMPLES_IN_WAVEFRONT) as usize * groups;
        let (next, memories) = threads.for_each_tile(
            0..count,
            || ThreadMemory::new(self.scene),
            || {
                if self.repays_optimising(start, count) {
                    self.scene.optimise();
                }
                !self.must_stop(start)
            },
            |memory, index| {
                // Each pass covers the whole image, so that it has uniform quality wherever the render ends.
                let (pass, group) = (index / groups, index % groups);
                let first = of_part.start + pass as u32 * SAMPLES_IN_WAVEFRONT;
                let wavefront = first..of_part.end.min(first + SAMPLES_IN_WAVEFRONT);
                let places = group * together..tiles.min((group + 1) * together);
                let tiles: Vec<usize> =
                    places.map(|place| first_tile + order.tile(place)).collect();
                let was_needed = self.render_wavefront(memory, &tiles, wavefront);
                self.tell(was_needed, count);
            },
        );
        let mut rays = RayCounts::default();
        memories.iter().for_each(|memory| rays += memory.rays);
        (next < count, rays)
    }

    /// True if the rest of so many wavefronts, at the pace of those done, repays kernels optimised in the background.
    fn repays_optimising(&self, start: Instant, count: usize) -> bool {
        if self.options.execution.optimise != Optimise::Background {
            return false;
        }
        let (elapsed, done) = (start.elapsed(), self.done.load(Ordering::Relaxed));
        let rest = elapsed.as_secs_f64() * (count - done) as f64 / done.max(1) as f64;
        elapsed >= JUDGED_AFTER && rest >= LONG_REST * self.scene.compile_time.as_secs_f64()
    }

    /// Reports that one more of so many wavefronts is done.
    fn tell(&self, was_needed: bool, of: usize) {
        let skipped = self.skipped.fetch_add(usize::from(!was_needed), Ordering::Relaxed)
            + usize::from(!was_needed);
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(progress) = self.options.progress {
            progress(TilesDone { done, of, skipped });
        }
    }

    /// Renders the samples of a wavefront of those tiles that need them; returns true if any did.
    fn render_wavefront(
        &self,
        memory: &mut ThreadMemory,
        tiles: &[usize],
        Range { start: first, end }: Range<u32>,
    ) -> bool {
        let needed = tiles.iter().filter_map(|index| {
            let first = self.film.taken(*index)?.max(first);
            let tile = self.film.tiles()[*index];
            (first < end).then(|| (*index, TileSamples { tile, first, count: end - first }))
        });
        let (indices, samples): (Vec<usize>, Vec<TileSamples>) = needed.unzip();
        if samples.is_empty() {
            return false;
        }
        let _span = tracing::trace_span!("wavefront", ?indices, first, end).entered();
        let begun = Instant::now();
        let Job { scene, errors, .. } = self;
        let features = Some(scene.features());
        PathTracer::new(scene, errors).trace_samples(memory, &samples, features);
        // Samples that were aborted are not added.
        if !self.errors.any() {
            let time = begun.elapsed() / samples.len() as u32;
            let lane_use = std::mem::take(&mut memory.lane_use);
            let mut start = 0;
            for (index, samples) in indices.into_iter().zip(&samples) {
                let end = start + samples.packets() * LANES;
                if scene.aovs.counts_work() {
                    let visits = count_visits(scene, errors, memory, samples);
                    let work = TileWork { visits, samples: samples.count, lane_use };
                    self.film.add_work(index, &work);
                }
                self.film.add(index, samples.first, memory.samples.of_tile(start..end), time);
                start = end;
            }
            if let Some(writer) = self.writer {
                writer.write_if_due(self.film);
            }
        }
        true
    }

    fn must_stop(&self, start: Instant) -> bool {
        self.options.execution.must_stop(start) || self.errors.any()
    }
}
