//! Tracing a wavefront of paths through the scene.

use rtsl::Method;
use rtsl_bvh::{LANES, LaneMask, lanes_of};

use super::features::PathFeatures;
use super::memory::BatchMemory;
use super::path_tracer::PathTracer;
use super::rows::all_finite;
use super::shadow_rays::trace_shadow_rays;
use super::wavefront::Path;
use crate::compiled::tracer::Tracer;
use crate::lanes::eight::LaneVectors;
use crate::tiles::{CameraRays, TileSamples, camera_packet};

impl PathTracer<'_> {
    /// Traces a path for each sample, and leaves the results in the memory.
    pub fn trace_samples(&self, memory: &mut BatchMemory, samples: &TileSamples) {
        memory.samples.reset(samples.packets() * LANES, self.with_features);
        if let Some(integrator) = &self.scene.integrator
            && let Some(staged) = integrator.staged()
        {
            return self.run_stages_for_samples((integrator, staged), memory, samples);
        }
        self.begin(memory, samples);
        let BatchMemory { wavefront, integrator: own, rays, .. } = memory;
        match self.scene.integrator.as_ref().zip(own.as_mut()) {
            Some((integrator, own)) => *rays += self.integrate(integrator, wavefront, own, 0),
            None => self.trace_wavefront(memory, 0),
        }
        let BatchMemory { wavefront, samples, .. } = memory;
        let paths = samples.radiance.iter_mut().zip(&wavefront.paths);
        paths.for_each(|(radiance, path)| *radiance = path.radiance);
        std::mem::swap(&mut samples.features, &mut wavefront.features);
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
    fn begin(&self, memory: &mut BatchMemory, samples: &TileSamples) {
        let scene = &self.scene.compiled;
        let BatchMemory { wavefront, camera: camera_memory, rays: counts, .. } = memory;
        wavefront.paths.clear();
        wavefront.active.clear();
        wavefront.features.clear();
        let tracer = Tracer { scene, errors: self.errors };
        for packet in 0..samples.packets() {
            let lanes = samples.lanes(packet, (scene.settings.width, scene.settings.height));
            let camera = camera_packet(&tracer, camera_memory, samples, packet);
            let CameraRays { rays, context, weights, footprints } = &*camera;
            let begun = wavefront.paths.len() as u32;
            wavefront.active.extend(lanes_of(lanes).map(|lane| begun + lane as u32));
            counts.camera += u64::from(lanes.count_ones());
            wavefront.paths.extend((0..LANES).map(|lane| Path {
                throughput: [0, 1, 2].map(|channel: usize| weights[channel][lane]),
                width: footprints[0][lane],
                spread: footprints[1][lane],
                ..Path::from_ray(rays, lane, context.keys()[lane], context.samples()[lane])
            }));
            for lane in lanes_of(self.lost_by_camera(&camera.weights, lanes)) {
                let path = &mut wavefront.paths[begun as usize + lane];
                (path.radiance, path.is_blamed) = ([f32::NAN; 3], true);
            }
            camera_memory.keep(camera);
        }
        if self.with_features {
            wavefront.features.resize(wavefront.paths.len(), PathFeatures::NONE);
        }
    }

    /// Returns the camera rays whose weights are not finite, and reports their number.
    pub fn lost_by_camera(&self, weights: &LaneVectors, lanes: LaneMask) -> LaneMask {
        if all_finite(weights.as_flattened()) {
            return 0;
        }
        let is_lost = |lane: &usize| !weights.iter().all(|channel| channel[*lane].is_finite());
        let lost = lanes_of(lanes).filter(is_lost).fold(0, |lost, lane| lost | 1 << lane);
        let scene = &self.scene.compiled;
        let camera = &scene.shader(&scene.camera).program.class().name;
        self.report_lost(camera, Method::GenerateRay, u64::from(LaneMask::count_ones(lost)));
        lost
    }

    /// Traces the shadow rays of a wavefront and adds the contributions of unoccluded ones.
    fn add_shadow_rays(&self, memory: &mut BatchMemory) {
        self.trace_shadow_rays(memory);
        let BatchMemory { wavefront, shadow_rays, reached, .. } = memory;
        for index in reached {
            let index = *index as usize;
            let path = &mut wavefront.paths[shadow_rays.paths[index] as usize];
            let color = shadow_rays.color(index);
            (0..3).for_each(|channel| path.radiance[channel] += color[channel]);
        }
        shadow_rays.clear();
    }

    /// Traces the waiting shadow rays, and notes those that nothing blocks. The rays stay until someone clears them.
    pub fn trace_shadow_rays(&self, memory: &mut BatchMemory) {
        memory.rays.shadow += memory.shadow_rays.len() as u64;
        memory.reached.clear();
        if self.scene.has_alpha() {
            self.trace_shadows_through_alpha(memory);
        } else {
            let tracer = Tracer { scene: &self.scene.compiled, errors: self.errors };
            let BatchMemory { shadow_rays, reached, searcher, .. } = memory;
            trace_shadow_rays(&tracer, shadow_rays, searcher, reached);
        }
    }

    /// The same if alpha textures may let rays pass surfaces: the rays form another wavefront.
    fn trace_shadows_through_alpha(&self, memory: &mut BatchMemory) {
        let BatchMemory { shadows, shadow_rays, reached, batch, searcher, .. } = memory;
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
