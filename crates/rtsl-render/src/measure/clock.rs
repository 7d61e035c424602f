//! Repeated tracing of the same rays, with timing.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rtsl_bvh::LaneMask;

use super::rays::{Packet, RaySets};
use super::report::{FrameMeasurement, RayMeasurement};
use super::spread::Spread;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::tracer::Tracer;
use crate::integrate::memory::ThreadMemory;
use crate::integrate::path_tracer::PathTracer;
use crate::integrate::wavefront::tiles_of_wavefront;
use crate::schedule::render_threads::RenderThreads;
use crate::schedule::tile::Tile;
use crate::schedule::tile_samples::TileSamples;
use crate::statistics::RayCounts;

/// The number and the duration of repetitions.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// The number of repetitions, if time permits.
    pub repetitions: usize,
    /// The time after which no repetition but the first is started.
    pub time: Duration,
}

/// The subject and the effort of a measurement.
pub struct Clock<'a> {
    pub scene: &'a RenderScene,
    pub errors: &'a RuntimeErrors,
    pub threads: RenderThreads,
    /// The tiles of the image.
    pub tiles: Vec<Tile>,
    pub effort: Effort,
}

/// The number of packets that a thread takes at a time: distributing single packets, and counting their rays, would
/// affect the timing.
const BATCH: usize = 16;

impl Clock<'_> {
    /// Measures each kind of ray that the scene supports.
    pub fn rays(&self) -> Vec<RayMeasurement> {
        let sets = RaySets::new(self.scene, self.errors, &self.tiles);
        let tracer = self.searches();
        let primary = self.measure("primary", self.tiles.len(), |memory, index| {
            let samples = TileSamples { tile: self.tiles[index], first: 0, count: 1 };
            let settings = &tracer.scene.settings;
            let lanes = samples.lanes(0, (settings.width, settings.height));
            let camera = memory.camera.generate_packet(self.scene, self.errors, &samples, 0);
            let hits = tracer.nearest(&mut memory.searcher.memory, &camera.rays, lanes);
            (lanes, hits.lanes(lanes))
        });
        let shadow = self.measure("shadow", sets.shadow.len(), |memory, index| {
            let Packet { rays, lanes } = &sets.shadow[index];
            (*lanes, tracer.any_hit(&mut memory.searcher.memory, rays, *lanes))
        });
        let nearest = |kind: &'static str, packets: &[Packet]| {
            self.measure(kind, packets.len(), |memory, index| {
                let Packet { rays, lanes } = &packets[index];
                let hits = tracer.nearest(&mut memory.searcher.memory, rays, *lanes);
                (*lanes, hits.lanes(*lanes))
            })
        };
        let secondary = nearest("secondary", &sets.secondary);
        let random = nearest("random", &sets.random);
        [primary, shadow, secondary, random].into_iter().flatten().collect()
    }

    /// Measures frames: one sample of each pixel.
    pub fn frame(&self) -> FrameMeasurement {
        let mut rays = RayCounts::default();
        let tiles = self.tiles.len();
        let together = tiles_of_wavefront(1, tiles, self.threads.count());
        let times = self.repeat(|| {
            rays = self.run(tiles.div_ceil(together), |memory, index| {
                let tiles = &self.tiles[index * together..tiles.min((index + 1) * together)];
                let sample = |tile: &Tile| TileSamples { tile: *tile, first: 0, count: 1 };
                let samples: Vec<TileSamples> = tiles.iter().map(sample).collect();
                PathTracer::new(self.scene, self.errors).trace_samples(memory, &samples, None);
            });
        });
        let milliseconds = Spread::of(times.iter().map(|time| time * 1e3));
        FrameMeasurement {
            milliseconds,
            frames_per_second: 1e3 / milliseconds.median,
            rays: rays.total(),
            repetitions: times.len(),
        }
    }

    fn searches(&self) -> Tracer<'_> {
        Tracer { scene: &self.scene.compiled, errors: self.errors }
    }

    /// Calls `trace` for `count` packets; it returns the lanes that it traced and those that hit. Returns `None` if
    /// there are no such rays.
    fn measure(
        &self,
        kind: &'static str,
        count: usize,
        trace: impl Fn(&mut ThreadMemory, usize) -> (LaneMask, LaneMask) + Sync,
    ) -> Option<RayMeasurement> {
        let (rays, hits) = (AtomicU64::new(0), AtomicU64::new(0));
        let times = self.repeat(|| {
            self.run(count.div_ceil(BATCH), |memory, batch| {
                let (mut traced, mut found) = (0, 0);
                for index in batch * BATCH..count.min((batch + 1) * BATCH) {
                    let (lanes, hit) = trace(memory, index);
                    traced += u64::from(lanes.count_ones());
                    found += u64::from(hit.count_ones());
                }
                rays.fetch_add(traced, Ordering::Relaxed);
                hits.fetch_add(found, Ordering::Relaxed);
            });
        });
        let (rays, hits) = (rays.into_inner(), hits.into_inner());
        let each = rays / times.len() as u64;
        (each > 0).then(|| RayMeasurement {
            kind,
            million_rays_per_second: Spread::of(times.iter().map(|time| each as f64 / time / 1e6)),
            rays: each,
            hits: hits as f64 / rays as f64,
            repetitions: times.len(),
        })
    }

    fn run(&self, count: usize, work: impl Fn(&mut ThreadMemory, usize) + Sync) -> RayCounts {
        let proceed = || !self.errors.any();
        let memory = || ThreadMemory::new(self.scene);
        let (_, memories) = self.threads.for_each_tile(0..count, memory, proceed, work);
        let mut rays = RayCounts::default();
        memories.iter().for_each(|memory| rays += memory.rays);
        rays
    }

    /// Returns the seconds of each repetition.
    fn repeat(&self, mut work: impl FnMut()) -> Vec<f64> {
        let start = Instant::now();
        let mut times = Vec::new();
        while times.is_empty()
            || times.len() < self.effort.repetitions && start.elapsed() < self.effort.time
        {
            let begun = Instant::now();
            work();
            times.push(begun.elapsed().as_secs_f64());
        }
        times
    }
}
