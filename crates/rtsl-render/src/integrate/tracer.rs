//! Tracing a wavefront of paths through the scene.

use rtsl::Method;
use rtsl_bvh::{LANES, LaneMask, lanes_of};

use super::camera_rays::CameraRays;
use super::memory::ThreadMemory;
use super::path_tracer::PathTracer;
use super::rows::all_finite;
use super::shadow_rays::trace_shadow_rays;
use super::wavefront::Path;
use crate::compiled::tracer::Tracer;
use crate::schedule::tile_samples::{TileSamples, packets_of};

impl PathTracer<'_> {
    /// Traces a path for each sample of some tiles, and leaves the results in the memory.
    pub fn trace_samples(&self, memory: &mut ThreadMemory, samples: &[TileSamples]) {
        memory.samples.reset(packets_of(samples).count() * LANES, self.features);
        match &self.scene.integrator.staged {
            Some(staged) => self.run_stages_for_samples(staged, memory, samples),
            None => self.interpret_samples(memory, samples),
        }
    }

    /// The same without machine code: the integrator runs on the interpreter.
    fn interpret_samples(&self, memory: &mut ThreadMemory, samples: &[TileSamples]) {
        self.begin(memory, samples);
        let ThreadMemory { wavefront, integrator, rays, samples, .. } = memory;
        if let Some(integrator) = integrator {
            *rays += self.integrate(wavefront, integrator, 0);
        }
        for (channel, to) in samples.radiance.iter_mut().enumerate() {
            let paths = to.iter_mut().zip(&wavefront.paths);
            paths.for_each(|(to, path)| *to = path.radiance[channel]);
        }
        std::mem::swap(&mut samples.features, &mut wavefront.features);
    }

    /// Begins a wavefront with camera rays.
    fn begin(&self, memory: &mut ThreadMemory, samples: &[TileSamples]) {
        let scene = &self.scene.compiled;
        let ThreadMemory { wavefront, camera: camera_memory, rays: counts, .. } = memory;
        wavefront.paths.clear();
        wavefront.active.clear();
        for (samples, packet) in packets_of(samples) {
            let lanes = samples.lanes(packet, (scene.settings.width, scene.settings.height));
            let of_packet = self.camera_packet(camera_memory, samples, packet);
            let CameraRays { rays, keys, samples, weights, footprints } = &of_packet;
            let begun = wavefront.paths.len() as u32;
            wavefront.active.extend(lanes_of(lanes).map(|lane| begun + lane as u32));
            counts.camera += u64::from(lanes.count_ones());
            wavefront.paths.extend((0..LANES).map(|lane| Path {
                throughput: [0, 1, 2].map(|channel: usize| weights[channel][lane]),
                width: footprints[0][lane],
                spread: footprints[1][lane],
                ..Path::from_ray(rays, lane, keys[lane], samples[lane])
            }));
            for lane in lanes_of(self.lost_by_camera(weights.each_ref().map(|it| &it[..]), lanes)) {
                let path = &mut wavefront.paths[begun as usize + lane];
                (path.radiance, path.is_blamed) = ([f32::NAN; 3], true);
            }
        }
        wavefront.features.reset(wavefront.paths.len(), self.features);
    }

    /// Returns the camera rays whose weights are not finite, and reports their number.
    pub fn lost_by_camera(&self, weights: [&[f32]; 3], lanes: LaneMask) -> LaneMask {
        if weights.iter().all(|channel| all_finite(channel)) {
            return 0;
        }
        let is_lost = |lane: &usize| !weights.iter().all(|channel| channel[*lane].is_finite());
        let lost = lanes_of(lanes).filter(is_lost).fold(0, |lost, lane| lost | 1 << lane);
        let camera = self.scene.camera().name();
        self.report_lost(camera, Method::GenerateRay, u64::from(LaneMask::count_ones(lost)));
        lost
    }

    /// Traces the waiting shadow rays, and notes those that nothing blocks. The rays stay until someone clears them.
    pub fn trace_shadow_rays(&self, memory: &mut ThreadMemory) {
        memory.rays.shadow += memory.shadow_rays.len() as u64;
        memory.reached.clear();
        if self.scene.has_alpha() {
            self.trace_shadows_through_alpha(memory);
        } else {
            let tracer = Tracer { scene: &self.scene.compiled, errors: self.errors };
            let ThreadMemory { shadow_rays, reached, searcher, .. } = memory;
            trace_shadow_rays(&tracer, shadow_rays, searcher, reached);
        }
    }

    /// The same if alpha textures may let rays pass surfaces: the rays form another wavefront.
    fn trace_shadows_through_alpha(&self, memory: &mut ThreadMemory) {
        let ThreadMemory { shadows, shadow_rays, reached, batch, searcher, .. } = memory;
        let epsilon = self.scene.compiled.epsilon;
        let count = shadow_rays.len();
        shadows.paths.clear();
        shadows.paths.extend((0..count).map(|index| shadow_rays.ray(index).path_of(epsilon)));
        shadows.active.clear();
        shadows.active.extend(0..count as u32);
        searcher.are_together = false;
        self.find_hits(shadows, searcher, batch);
        reached.extend_from_slice(&shadows.left);
        // Passing surfaces changes the order, on which sums depend.
        reached.sort_unstable();
    }
}
