//! Camera rays of a tile, packet by packet.

use rtsl::{LaneBlock, new_state};
use rtsl_bvh::{LANES, Lanes, RayPacket, lanes_of};

use super::camera::rays_of;
use super::memory::ThreadMemory;
use super::wavefront::Path;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::variables::variables;
use crate::schedule::tile_samples::{TileSamples, packets_of};

/// Camera rays with their random numbers and weights.
pub struct CameraRays {
    /// The rays.
    pub rays: RayPacket,
    /// The keys of their random sequences.
    pub keys: [u32; LANES],
    /// The sample indices.
    pub samples: [u32; LANES],
    /// The weights of radiance.
    pub weights: [Lanes; 3],
    /// The widths of the rays at their origins, and the increase of width per unit of length; 0 if no stage reads them.
    pub footprints: [Lanes; 2],
}

/// The memory of one thread for packets of camera rays.
#[derive(Default)]
pub struct CameraMemory {
    /// The state and the scratch, once they are needed.
    blocks: Option<(LaneBlock, LaneBlock)>,
}

impl CameraMemory {
    /// Generates a packet of the camera rays of some samples of a tile.
    pub fn generate_packet(
        &mut self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        samples: &TileSamples,
        packet: usize,
    ) -> CameraRays {
        let camera = scene.camera();
        let arrays = camera.program.scratch_arrays();
        let blocks = || (new_state(LANES), LaneBlock::new(arrays, LANES));
        let (state, scratch) = self.blocks.get_or_insert_with(blocks);
        let packets = std::iter::once((samples, packet));
        camera.generate(&scene.compiled, errors, packets, state, scratch);
        let (v, at) = (variables(), camera.program.arrays());
        let floats = |lanes: &[f32]| *lanes.first_chunk().expect("blocks have all lanes");
        let words = |lanes: &[u32]| *lanes.first_chunk().expect("blocks have all lanes");
        CameraRays {
            rays: rays_of(state, 0),
            keys: words(scratch.words(at.key)),
            samples: words(scratch.words(at.sample)),
            weights: at.weights.map(|array| floats(scratch.floats(array))),
            footprints: [v.ray_width, v.ray_spread]
                .map(|component| floats(state.floats(component))),
        }
    }
}

impl ThreadMemory {
    /// Begins the wavefront with the camera rays of samples of some tiles.
    pub fn begin_samples(
        &mut self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        samples: &[TileSamples],
    ) {
        let settings = &scene.compiled.settings;
        let ThreadMemory { wavefront, camera: camera_memory, rays: counts, .. } = self;
        wavefront.paths.clear();
        wavefront.active.clear();
        for (samples, packet) in packets_of(samples) {
            let lanes = samples.lanes(packet, (settings.width, settings.height));
            let of_packet = camera_memory.generate_packet(scene, errors, samples, packet);
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
            for lane in lanes_of(scene.camera().lost_rays(errors, weights, lanes)) {
                let path = &mut wavefront.paths[begun as usize + lane];
                (path.radiance, path.is_blamed) = ([f32::NAN; 3], true);
            }
        }
    }
}
