//! Repeated tracing of the same rays, with timing.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rtsl_bvh::LaneMask;

use super::rays::{Packet, RaySets};
use super::report::{FrameMeasurement, RayMeasurement};
use super::spread::Spread;
use crate::compiled::tracer::Tracer;
use crate::statistics::RayCounts;
use crate::tiles::{RenderThreads, Tile, camera_rays};
use crate::whitted::{Workspace, rays_of, sample_tile};

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
    pub tracer: Tracer<'a>,
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
        let sets = RaySets::new(&self.tracer, &self.tiles);
        let primary = self.measure("primary", self.tiles.len(), |workspace, index| {
            let (tile, settings) = (self.tiles[index], &self.tracer.scene.settings);
            let lanes = tile.lanes(settings.width, settings.height);
            let camera = camera_rays(&self.tracer, &mut workspace.camera, tile, 0);
            let hits = self.tracer.nearest(&mut workspace.search, &camera.rays, lanes).lanes(lanes);
            workspace.camera.keep(camera);
            (lanes, hits)
        });
        let shadow = self.measure("shadow", sets.shadow.len(), |workspace, index| {
            let Packet { rays, lanes } = &sets.shadow[index];
            (*lanes, self.tracer.any_hit(&mut workspace.search, rays, *lanes))
        });
        let nearest = |kind: &'static str, packets: &[Packet]| {
            self.measure(kind, packets.len(), |workspace, index| {
                (packets[index].lanes, self.nearest(workspace, &packets[index]))
            })
        };
        let secondary = nearest("secondary", &sets.secondary);
        let random = nearest("random", &sets.random);
        [primary, shadow, secondary, random].into_iter().flatten().collect()
    }

    /// Measures frames.
    pub fn frame(&self) -> FrameMeasurement {
        let mut rays = RayCounts::default();
        let times = self.repeat(|| {
            rays = self.run(self.tiles.len(), |workspace, index| {
                sample_tile(&self.tracer, workspace, self.tiles[index], 0);
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

    fn nearest(&self, workspace: &mut Workspace, Packet { rays, lanes }: &Packet) -> LaneMask {
        self.tracer.nearest(&mut workspace.search, rays, *lanes).lanes(*lanes)
    }

    /// Calls `trace` for `count` packets; it returns the lanes that it traced and those that hit. Returns `None` if
    /// there are no such rays.
    fn measure(
        &self,
        kind: &'static str,
        count: usize,
        trace: impl Fn(&mut Workspace, usize) -> (LaneMask, LaneMask) + Sync,
    ) -> Option<RayMeasurement> {
        let (rays, hits) = (AtomicU64::new(0), AtomicU64::new(0));
        let times = self.repeat(|| {
            self.run(count.div_ceil(BATCH), |workspace, batch| {
                let (mut traced, mut found) = (0, 0);
                for index in batch * BATCH..count.min((batch + 1) * BATCH) {
                    let (lanes, hit) = trace(workspace, index);
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

    fn run(&self, count: usize, work: impl Fn(&mut Workspace, usize) + Sync) -> RayCounts {
        let proceed = || !self.tracer.errors.any();
        let memory = || Workspace::new(self.tracer.scene);
        let (_, workspaces) = self.threads.for_each_tile((0, count), memory, proceed, work);
        rays_of(&workspaces)
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
