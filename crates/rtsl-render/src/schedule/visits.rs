//! The nodes and leaves that camera rays visit.

use rtsl_bvh::LANES;

use super::tile_samples::TileSamples;
use crate::compiled::tracer::Tracer;
use crate::compiled::work_counts::WorkCounts;
use crate::integrate::memory::ThreadMemory;
use crate::integrate::path_tracer::PathTracer;

impl PathTracer<'_> {
    /// Traces the camera rays of samples of a tile once more. Returns for each pixel the number of nodes and leaves that
    /// they visit.
    pub fn count_visits(&self, memory: &mut ThreadMemory, samples: &TileSamples) -> [u32; LANES] {
        let scene = &self.scene.compiled;
        let tracer = Tracer { scene, errors: self.errors };
        let mut sums = [0; LANES];
        for packet in 0..samples.packets() {
            let lanes = samples.lanes(packet, (scene.settings.width, scene.settings.height));
            let camera = self.camera_packet(&mut memory.camera, samples, packet);
            let search = &mut memory.searcher.memory;
            search.counts = Some(WorkCounts::new(scene.width));
            tracer.nearest(search, &camera.rays, lanes);
            let visited = search.counts.take().map_or([0; LANES], |counts| counts.visited);
            for (pixel, of_pixel, _) in samples.of_packet(packet) {
                let of_pixel = of_pixel.filter(|lane| lanes >> lane & 1 != 0);
                sums[pixel] += of_pixel.map(|lane| visited[lane]).sum::<u32>();
            }
        }
        sums
    }
}
