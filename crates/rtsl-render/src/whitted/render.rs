//! Rendering an image from a compiled scene: tiles on all threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rtsl::Messages;
use rtsl_bvh::{LANES, lanes_of};
use rtsl_image::{Aov, AovImage, Image};
use rtsl_memory::OutOfMemory;

use super::tile_aovs::{TileAovs, TileValues, TileWork};
use super::tile_sample::{mean, sample_tile};
use super::workspace::{Workspace, rays_of};
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::object_classes::ObjectClasses;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::compiled::specialisation::SPECIALISE_AFTER;
use crate::compiled::tracer::Tracer;
use crate::compiled::work_counts::WorkCounts;
use crate::execution::{Execution, Rendered};
use crate::statistics::{LaneUse, RayCounts};
use crate::tiles::Tile;
use crate::tiles::{RenderThreads, tiles_of};

/// The AOVs that this renderer supports.
pub const AOVS: [Aov; 8] = [
    Aov::Distance,
    Aov::Normal,
    Aov::Object,
    Aov::Class,
    Aov::Samples,
    Aov::Time,
    Aov::Nodes,
    Aov::Lanes,
];

/// Options of a render.
#[derive(Clone, Copy, Default)]
pub struct RenderOptions<'a> {
    /// The course of the render.
    pub execution: Execution<'a>,
    /// Called with the number of tiles done and of all tiles, from any thread.
    pub progress: Option<&'a (dyn Fn(usize, usize) + Sync)>,
    /// The AOVs to render.
    pub aovs: &'a [Aov],
}

/// Renders a scene.
///
/// # Errors
/// If a shader exceeds its budget of loop iterations, threads cannot be started, or an AOV is not supported.
pub fn render(scene: &CompiledScene, options: RenderOptions<'_>) -> Result<Rendered, Messages> {
    Aov::refuse_others(options.aovs, &AOVS, "interactive").map_err(Messages::one)?;
    let threads = RenderThreads::new(options.execution.threads)?;
    let job = Job::new(scene, options).map_err(|error| Messages::one(error.diagnostic()))?;
    let _span = tracing::debug_span!("render", threads = threads.count()).entered();
    let start = Instant::now();
    let rays = job.run(&threads, start);
    job.finish(start.elapsed(), rays, threads.count())
}

/// A render in progress.
struct Job<'a> {
    scene: &'a CompiledScene,
    options: RenderOptions<'a>,
    tiles: Vec<Tile>,
    errors: RuntimeErrors,
    images: Mutex<Images>,
    object_classes: ObjectClasses,
    done: AtomicUsize,
    dropped: AtomicU64,
    stopped: AtomicBool,
}

/// The image and the AOVs.
struct Images {
    image: Image,
    aovs: Vec<AovImage>,
}

impl<'a> Job<'a> {
    fn new(scene: &'a CompiledScene, options: RenderOptions<'a>) -> Result<Self, OutOfMemory> {
        let (width, height) = (scene.settings.width, scene.settings.height);
        let aovs = options.aovs.iter().map(|aov| AovImage::new(*aov, width, height));
        let image = Image::new(width, height)?;
        let images = Images { image, aovs: aovs.collect::<Result<_, _>>()? };
        Ok(Job {
            scene,
            options,
            tiles: tiles_of(width, height),
            errors: RuntimeErrors::default(),
            images: Mutex::new(images),
            object_classes: ObjectClasses::of(scene),
            done: AtomicUsize::new(0),
            dropped: AtomicU64::new(0),
            stopped: AtomicBool::new(false),
        })
    }

    fn run(&self, threads: &RenderThreads, start: Instant) -> RayCounts {
        let proceed = || {
            let stop = self.must_stop(start);
            if stop {
                self.stopped.store(true, Ordering::Relaxed);
            } else if !self.options.execution.general_kernels_only
                && start.elapsed() > SPECIALISE_AFTER
            {
                self.scene.specialise();
            }
            !stop
        };
        let render = |workspace: &mut Workspace, tile: usize| {
            self.render_tile(workspace, self.tiles[tile], start);
        };
        let tiles = (0, self.tiles.len());
        let memory = || Workspace::new(self.scene);
        let (_, workspaces) = threads.for_each_tile(tiles, memory, proceed, render);
        rays_of(&workspaces)
    }

    fn must_stop(&self, start: Instant) -> bool {
        self.options.execution.must_stop(start) || self.errors.any()
    }

    fn render_tile(&self, workspace: &mut Workspace, tile: Tile, start: Instant) {
        let tracer = Tracer { scene: self.scene, errors: &self.errors };
        let samples = self.scene.settings.sampler.samples_per_pixel();
        let begun = Instant::now();
        let counts_lanes = self.options.aovs.contains(&Aov::Lanes);
        workspace.search.counts = counts_lanes.then(|| WorkCounts::new(self.scene.width));
        let mut sums = [[0.0; 3]; LANES];
        let mut taken = 0;
        let mut dropped = 0;
        for sample in 0..samples {
            // A tile that was started gets at least one sample, so that it is not black.
            if sample > 0 && self.must_stop(start) {
                self.stopped.store(true, Ordering::Relaxed);
                break;
            }
            taken += 1;
            dropped += sample_tile(&tracer, workspace, tile, sample).add_to(&mut sums);
        }
        let counts = workspace.search.counts.take();
        let lane_use = counts.map_or(LaneUse::default(), |counts| counts.lane_use);
        let work = TileWork { time: begun.elapsed(), lane_use };
        let aovs = self.tile_aovs(workspace, &tracer, tile, taken);
        self.keep_tile(tile, &sums.map(|sum| mean(sum, taken)), |aov| {
            aovs.values(aov, work, taken)
        });
        self.dropped.fetch_add(dropped, Ordering::Relaxed);
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(progress) = self.options.progress {
            progress(done, self.tiles.len());
        }
    }

    /// Traces the camera rays of a tile's first `samples` samples again, if an AOV needs their hits.
    fn tile_aovs(
        &self,
        workspace: &mut Workspace,
        tracer: &Tracer<'_>,
        tile: Tile,
        samples: u32,
    ) -> TileAovs {
        let mut aovs = TileAovs::new();
        if self.options.aovs.iter().any(|aov| !matches!(aov, Aov::Samples | Aov::Time | Aov::Lanes))
        {
            for sample in 0..samples {
                aovs.add(tracer, workspace, &self.object_classes, tile, sample);
            }
        }
        aovs
    }

    fn keep_tile(&self, tile: Tile, colors: &TileValues, values: impl Fn(Aov) -> TileValues) {
        let Ok(mut images) = self.images.lock() else { return };
        let Images { image, aovs } = &mut *images;
        let (width, height) = (image.width, image.height);
        let keep = |pixels: &mut [[f32; 3]], values: &TileValues| {
            for lane in lanes_of(tile.lanes(width, height)) {
                let (x, y) = tile.pixel(lane);
                pixels[y * width + x] = values[lane];
            }
        };
        keep(&mut image.pixels, colors);
        for aov in aovs {
            keep(&mut aov.pixels, &values(aov.aov));
        }
    }

    fn finish(self, time: Duration, rays: RayCounts, threads: usize) -> Result<Rendered, Messages> {
        if self.errors.any() {
            return Err(exhausted_budgets(self.scene, &self.errors));
        }
        let images = self.images.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        Ok(Rendered {
            image: images.image,
            aovs: images.aovs,
            object_classes: self.object_classes.names,
            rays,
            dropped_samples: self.dropped.into_inner(),
            not_finite: self.errors.not_finite(),
            time,
            threads,
            cancelled: self.stopped.into_inner(),
        })
    }
}
