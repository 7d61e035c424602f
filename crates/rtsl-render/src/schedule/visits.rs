//! The nodes and leaves that camera rays visit.

use rtsl_bvh::LANES;

use super::tile_samples::TileSamples;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::tracer::Tracer;
use crate::compiled::work_counts::WorkCounts;
use crate::integrate::memory::ThreadMemory;

/// Traces the camera rays of samples of a tile once more. Returns for each pixel the number of nodes and leaves that
/// they visit.
pub fn count_visits(
    scene: &RenderScene,
    errors: &RuntimeErrors,
    memory: &mut ThreadMemory,
    samples: &TileSamples,
) -> [u32; LANES] {
    let CompiledScene { settings, width, .. } = &scene.compiled;
    let tracer = Tracer { scene: &scene.compiled, errors };
    let mut sums = [0; LANES];
    for packet in 0..samples.packets() {
        let lanes = samples.lanes(packet, (settings.width, settings.height));
        let camera = memory.camera.generate_packet(scene, errors, samples, packet);
        let search = &mut memory.searcher.memory;
        search.counts = Some(WorkCounts::new(*width));
        tracer.nearest(search, &camera.rays, lanes);
        let visited = search.counts.take().map_or([0; LANES], |counts| counts.visited);
        for (pixel, of_pixel, _) in samples.of_packet(packet) {
            let of_pixel = of_pixel.filter(|lane| lanes >> lane & 1 != 0);
            sums[pixel] += of_pixel.map(|lane| visited[lane]).sum::<u32>();
        }
    }
    sums
}
