//! Tracing a wavefront of paths through the scene.

use rtsl::Method;
use rtsl_bvh::{LANES, LaneMask, lanes_of};

use super::features::PathFeatures;
use super::memory::BatchMemory;
use super::path_tracer::PathTracer;
use super::rows::are_finite;
use super::shadow_rays::{ShadowRay, trace_shadow_rays};
use super::wavefront::Path;
use crate::compiled::tracer::Tracer;
use crate::tiles::{CameraRays, Tile, camera_rays};

impl PathTracer<'_> {
    /// Traces a path for each of the samples `first..end` of a tile's pixels, sample by sample, and leaves the radiance
    /// in the wavefront's paths. Paths of pixels outside the image have none.
    pub fn trace_samples(&self, memory: &mut BatchMemory, tile: Tile, (first, end): (u32, u32)) {
        self.begin(memory, tile, (first, end));
        let BatchMemory { wavefront, integrator: own, rays, .. } = memory;
        match self.scene.integrator.as_ref().zip(own.as_mut()) {
            Some((integrator, own)) => *rays += self.integrate(integrator, wavefront, own, 0),
            None => self.trace_wavefront(memory, 0),
        }
    }

    /// Traces the paths of a wavefront, whose rays have this depth.
    pub fn trace_wavefront(&self, memory: &mut BatchMemory, mut depth: u32) {
        while !memory.wavefront.active.is_empty() && !self.errors.any() {
            let BatchMemory { wavefront, batch, searcher, rays, .. } = memory;
            rays.traced += if depth > 0 { wavefront.active.len() as u64 } else { 0 };
            searcher.are_together = depth == 0;
            self.find_hits(wavefront, searcher, batch);
            self.add_skies(&mut memory.wavefront, &mut memory.batch);
            memory.wavefront.sort(self.scene.groups.len());
            let mut start = 0;
            for (index, group) in self.scene.groups.iter().enumerate() {
                let end = memory.wavefront.ends[index];
                self.scatter(group, start..end, depth, memory);
                start = end;
            }
            self.add_shadow_rays(memory);
            depth += 1;
        }
    }

    /// Begins a wavefront with camera rays.
    fn begin(&self, memory: &mut BatchMemory, tile: Tile, (first, end): (u32, u32)) {
        let scene = &self.scene.compiled;
        let BatchMemory { wavefront, camera: camera_memory, rays: counts, .. } = memory;
        wavefront.paths.clear();
        wavefront.active.clear();
        wavefront.features.clear();
        let lanes = tile.lanes(scene.settings.width, scene.settings.height);
        let tracer = Tracer { scene, errors: self.errors };
        for sample in first..end {
            let camera = camera_rays(&tracer, camera_memory, tile, sample);
            let CameraRays { rays, context, weights, footprints } = &*camera;
            let begun = wavefront.paths.len() as u32;
            wavefront.active.extend(lanes_of(lanes).map(|lane| begun + lane as u32));
            counts.camera += u64::from(lanes.count_ones());
            wavefront.paths.extend((0..LANES).map(|lane| Path {
                throughput: [0, 1, 2].map(|channel: usize| weights[channel][lane]),
                width: footprints[0][lane],
                spread: footprints[1][lane],
                ..Path::from_ray(rays, lane, context.streams.keys()[lane], sample)
            }));
            camera_memory.keep(camera);
            self.give_up_by_camera(&mut wavefront.paths[begun as usize..], lanes);
        }
        if self.with_features {
            wavefront.features.resize(wavefront.paths.len(), PathFeatures::NONE);
        }
    }

    /// Drops the paths of a sample whose camera weights are not finite.
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

    /// Traces the shadow rays of a wavefront and adds the contributions of unoccluded ones.
    fn add_shadow_rays(&self, memory: &mut BatchMemory) {
        let mut paths = std::mem::take(&mut memory.wavefront.paths);
        self.trace_shadow_rays(memory, &mut |ray| ray.add_to(&mut paths));
        memory.wavefront.paths = paths;
    }

    /// Traces the waiting shadow rays, and calls `reached` with each that nothing blocks, in order.
    pub fn trace_shadow_rays(&self, memory: &mut BatchMemory, reached: &mut dyn FnMut(&ShadowRay)) {
        memory.rays.shadow += memory.shadow_rays.len() as u64;
        if self.scene.has_alpha() {
            self.trace_shadows_through_alpha(memory, reached);
        } else {
            let tracer = Tracer { scene: &self.scene.compiled, errors: self.errors };
            let BatchMemory { shadow_rays, searcher, .. } = memory;
            trace_shadow_rays(&tracer, shadow_rays, searcher, reached);
        }
        memory.shadow_rays.clear();
    }

    /// The same if alpha textures may let rays pass surfaces: the rays form another wavefront.
    fn trace_shadows_through_alpha(
        &self,
        memory: &mut BatchMemory,
        reached: &mut dyn FnMut(&ShadowRay),
    ) {
        let BatchMemory { shadows, shadow_rays, batch, searcher, .. } = memory;
        let epsilon = self.scene.compiled.epsilon;
        shadows.paths.clear();
        shadows.paths.extend(shadow_rays.iter().map(|ray| ray.path_of(epsilon)));
        shadows.active.clear();
        shadows.active.extend(0..shadow_rays.len() as u32);
        searcher.are_together = false;
        self.find_hits(shadows, searcher, batch);
        // Passing surfaces changes the order, on which sums depend.
        shadows.left.sort_unstable();
        for index in &shadows.left {
            reached(&shadow_rays[*index as usize]);
        }
    }
}
