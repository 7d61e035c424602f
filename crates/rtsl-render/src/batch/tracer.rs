//! A wave of paths on its way through the scene.

use rtsl::Method;
use rtsl_bvh::{LANES, LaneMask, RayPacket, lanes_of};

use super::features::PathFeatures;
use super::lights::LightMemory;
use super::scene::BatchScene;
use super::searcher::Searcher;
use super::shade::ShadeMemory;
use super::shading_batch::{ShadingBatch, are_finite};
use super::shadow_rays::{ShadowRay, trace_shadow_rays};
use super::wavefront::{Path, Wavefront};
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::tracer::Tracer;
use crate::statistics::RayCounts;
use crate::tiles::{CameraMemory, CameraRays, Tile, camera_rays};

/// What paths are traced with.
#[derive(Clone, Copy)]
pub struct PathTracer<'a> {
    /// The scene.
    pub scene: &'a BatchScene,
    /// Where problems go.
    pub problems: &'a RuntimeErrors,
    /// Whether the first surfaces of paths are wanted.
    pub with_features: bool,
}

/// The memory of one thread.
pub struct BatchMemory {
    /// The paths.
    pub wave: Wavefront,
    /// Surfaces that are worked on.
    pub chunk: Box<ShadingBatch>,
    /// Samples of lights.
    pub light: Box<LightMemory>,
    /// Shadow rays as paths, where rays may pass what they hit.
    shadows: Wavefront,
    /// Rays towards samples of lights that were not yet traced.
    pub shadow_rays: Vec<ShadowRay>,
    /// For searches.
    pub searcher: Searcher,
    /// For camera rays.
    pub camera: CameraMemory,
    /// For materials that shade, if there are any.
    pub shade: Option<Box<ShadeMemory>>,
    /// Rays traced so far.
    pub rays: RayCounts,
}

impl BatchMemory {
    /// For paths in a scene.
    pub fn new(scene: &BatchScene) -> Self {
        let sampler = scene.compiled.settings.sampler;
        let scratch = scene.scratch_arrays();
        BatchMemory {
            wave: Wavefront::default(),
            shadows: Wavefront::default(),
            chunk: ShadingBatch::new(scratch, sampler),
            light: LightMemory::new(scratch, sampler),
            shadow_rays: Vec::new(),
            searcher: Searcher::new(scene),
            camera: CameraMemory::new(&scene.compiled).with_footprints(scene.has_footprints()),
            shade: scene.has_shade().then(|| Box::new(ShadeMemory::new(&scene.compiled))),
            rays: RayCounts::default(),
        }
    }
}

impl PathTracer<'_> {
    /// Traces a path for each of the samples `first..end` of a tile's pixels, sample by sample: afterwards the wave's
    /// paths have the radiance that they bring back. Pixels outside the image have paths that bring nothing.
    pub fn trace_samples(&self, memory: &mut BatchMemory, tile: Tile, (first, end): (u32, u32)) {
        self.begin(memory, tile, (first, end));
        self.trace_wave(memory, 0);
    }

    /// Traces the paths of a wave, whose rays were spawned `depth` times.
    pub fn trace_wave(&self, memory: &mut BatchMemory, mut depth: u32) {
        while !memory.wave.active.is_empty() && !self.problems.any() {
            let BatchMemory { wave, chunk, searcher, rays, .. } = memory;
            rays.traced += if depth > 0 { wave.active.len() as u64 } else { 0 };
            searcher.are_together = depth == 0;
            self.find_hits(wave, searcher, chunk);
            self.add_skies(&mut memory.wave, &mut memory.chunk);
            memory.wave.sort(self.scene.groups.len());
            let mut start = 0;
            for (number, group) in self.scene.groups.iter().enumerate() {
                let end = memory.wave.ends[number];
                self.scatter(group, start..end, depth, memory);
                start = end;
            }
            self.trace_shadow_rays(memory);
            depth += 1;
        }
    }

    /// Begins a wave with camera rays.
    fn begin(&self, memory: &mut BatchMemory, tile: Tile, (first, end): (u32, u32)) {
        let scene = &self.scene.compiled;
        let BatchMemory { wave, camera: camera_memory, rays: counts, .. } = memory;
        wave.paths.clear();
        wave.active.clear();
        wave.features.clear();
        let lanes = tile.lanes(scene.settings.width, scene.settings.height);
        let tracer = Tracer { scene, problems: self.problems };
        for sample in first..end {
            let camera = camera_rays(&tracer, camera_memory, tile, sample);
            let CameraRays { rays, context, weights, footprints } = &*camera;
            let begun = wave.paths.len() as u32;
            wave.active.extend(lanes_of(lanes).map(|lane| begun + lane as u32));
            counts.camera += u64::from(lanes.count_ones());
            wave.paths.extend((0..LANES).map(|lane| Path {
                throughput: [0, 1, 2].map(|channel: usize| weights[channel][lane]),
                width: footprints[0][lane],
                spread: footprints[1][lane],
                ..Path::from_ray(rays, lane, context.streams.keys()[lane], sample)
            }));
            camera_memory.keep(camera);
            self.give_up_by_camera(&mut wave.paths[begun as usize..], lanes);
        }
        if self.with_features {
            wave.features.resize(wave.paths.len(), PathFeatures::NONE);
        }
    }

    /// Gives up those of a sample's paths whose weights are not finite.
    fn give_up_by_camera(&self, paths: &mut [Path], lanes: LaneMask) {
        let mut lost = 0;
        for lane in lanes_of(lanes) {
            let path = &mut paths[lane];
            if !are_finite(&path.throughput) {
                (path.radiance, path.is_blamed) = ([f32::NAN; 3], true);
                lost += 1;
            }
        }
        let scene = &self.scene.compiled;
        let camera = &scene.shader(&scene.camera).program.class().name;
        self.report_lost(camera, Method::GenerateRay, lost);
    }

    /// Traces the shadow rays of a wave and adds what they are for.
    fn trace_shadow_rays(&self, memory: &mut BatchMemory) {
        memory.rays.shadow += memory.shadow_rays.len() as u64;
        if self.scene.has_cut_outs() {
            self.trace_shadows_of_cut_outs(memory);
        } else {
            let tracer = Tracer { scene: &self.scene.compiled, problems: self.problems };
            trace_shadow_rays(&tracer, memory);
        }
        memory.shadow_rays.clear();
    }

    /// The same where rays may pass what they hit: as rays of a wave of their own.
    fn trace_shadows_of_cut_outs(&self, memory: &mut BatchMemory) {
        let BatchMemory { wave, shadows, shadow_rays, chunk, searcher, .. } = memory;
        let epsilon = self.scene.compiled.epsilon;
        shadows.paths.clear();
        shadows.paths.extend(shadow_rays.iter().map(|ray| ray.path_of(epsilon)));
        shadows.active.clear();
        shadows.active.extend(0..shadow_rays.len() as u32);
        searcher.are_together = false;
        self.find_hits(shadows, searcher, chunk);
        for index in &shadows.left {
            shadow_rays[*index as usize].add_to(&mut wave.paths);
        }
    }
}

impl Path {
    /// A path that begins with a lane's ray.
    pub fn from_ray(rays: &RayPacket, lane: usize, key: u32, sample: u32) -> Self {
        Path {
            origin: rays.origin_of(lane),
            epsilon: rays.epsilon[lane],
            direction: rays.direction_of(lane),
            distance: rays.limit[lane],
            limit: rays.limit[lane],
            time: rays.time[lane],
            key,
            sample,
            ..Path::NOWHERE
        }
    }
}
