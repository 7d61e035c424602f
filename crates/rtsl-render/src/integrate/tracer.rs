//! Tracing a wavefront of paths through the scene.

use rtsl_bvh::{LANES, lanes_of};

use super::camera_rays::CameraRays;
use super::memory::ThreadMemory;
use super::path_tracer::PathTracer;
use super::wavefront::Path;
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
            let of_packet = camera_memory.generate_packet(self.scene, self.errors, samples, packet);
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
            let weights = weights.each_ref().map(|it| &it[..]);
            for lane in lanes_of(self.scene.camera().lost_rays(self.errors, weights, lanes)) {
                let path = &mut wavefront.paths[begun as usize + lane];
                (path.radiance, path.is_blamed) = ([f32::NAN; 3], true);
            }
        }
        wavefront.features.reset(wavefront.paths.len(), self.features);
    }
}
