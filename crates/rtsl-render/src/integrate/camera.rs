//! The camera of a scene.

use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    CameraArrays, CameraProgram, CameraView, InstanceBlock, Instances, LaneBlock, Method,
    TieredKernel,
};
use rtsl_bvh::{LANES, LaneMask, RayPacket, lanes_of, moved_packet_by};
use rtsl_math::Affine;

use super::rows::all_finite;
use crate::compiled::calls::Callee;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::variables::variables;
use crate::schedule::tile::Tile;
use crate::schedule::tile_samples::TileSamples;

/// The camera of a scene, with the kernel that computes its rays.
pub struct Camera {
    /// The class with the sampler and the filter.
    pub program: Arc<CameraProgram>,
    kernel: Arc<TieredKernel>,
    /// The data of the class and the view.
    block: InstanceBlock,
}

impl Camera {
    /// Places the camera of a scene.
    pub fn new(
        program: Arc<CameraProgram>,
        kernel: Arc<TieredKernel>,
        scene: &CompiledScene,
    ) -> Camera {
        let block = block(&program, scene);
        Camera { program, kernel, block }
    }

    /// Takes over the place of the scene's camera and the size of the image.
    pub fn place(&mut self, scene: &CompiledScene) {
        self.block = block(&self.program, scene);
    }

    /// Returns the name of the class.
    pub fn name(&self) -> &str {
        &self.program.program().class().name
    }

    /// Computes the rays of packets of samples, one after another, in arrays of state and of stages' scratch.
    pub fn generate<'a>(
        &self,
        scene: &CompiledScene,
        errors: &RuntimeErrors,
        packets: impl Iterator<Item = (&'a TileSamples, usize)>,
        state: &mut LaneBlock,
        scratch: &mut LaneBlock,
    ) {
        let mut count = 0;
        for (samples, packet) in packets {
            self.load(scene.settings.origin(), samples, packet, scratch, count);
            count += LANES;
        }
        let (kernel, instances) = (self.kernel.get(), Instances::One(&self.block));
        let called = if scene.is_traced { count.min(1) } else { count };
        self.callee(errors).call_for_first(kernel, called, instances, state, scratch, &mut NoHost);
        if let Some(motion) = &scene.camera_motion {
            for start in (0..count).step_by(LANES) {
                let rays = rays_of(state, start);
                let moved = moved_packet_by(&rays, LaneMask::MAX, |time| motion.map_at(time));
                set_rays(state, start, &moved);
            }
        }
    }

    /// Returns the rays whose weights are not finite, and reports their number.
    pub fn lost_rays(
        &self,
        errors: &RuntimeErrors,
        weights: [&[f32]; 3],
        lanes: LaneMask,
    ) -> LaneMask {
        if weights.iter().all(|channel| all_finite(channel)) {
            return 0;
        }
        let is_lost = |lane: &usize| !weights.iter().all(|channel| channel[*lane].is_finite());
        let lost = lanes_of(lanes).filter(is_lost).fold(0, |lost, lane| lost | 1 << lane);
        self.callee(errors).report_not_finite(u64::from(LaneMask::count_ones(lost)));
        lost
    }

    fn callee<'a>(&'a self, errors: &'a RuntimeErrors) -> Callee<'a> {
        Callee { class: self.name(), method: Method::GenerateRay, errors }
    }

    /// Loads the pixels and the indices of a packet's samples, from the lane `start` on.
    fn load(
        &self,
        origin: [usize; 2],
        samples: &TileSamples,
        packet: usize,
        scratch: &mut LaneBlock,
        start: usize,
    ) {
        let CameraArrays { pixels: [columns, rows], sample: index, .. } = *self.program.arrays();
        let all = start..start + LANES;
        if samples.count == 1 {
            let places =
                [(columns, samples.tile.x + origin[0]), (rows, samples.tile.y + origin[1])];
            for (axis, (array, first)) in places.into_iter().enumerate() {
                let words = scratch.words_mut(array)[all.clone()].iter_mut();
                words.zip(Tile::PLACES).for_each(|(to, place)| *to = first as u32 + place[axis]);
            }
            return scratch.words_mut(index)[all].fill(samples.first);
        }
        let in_lane = samples.in_lane(packet);
        let corner = [samples.tile.x + origin[0], samples.tile.y + origin[1]];
        for (array, axis) in [(columns, 0), (rows, 1)] {
            let words = scratch.words_mut(array)[all.clone()].iter_mut();
            let first = corner[axis] as u32;
            words.zip(0..).for_each(|(to, lane)| *to = first + Tile::place(in_lane(lane).0)[axis]);
        }
        let indices = scratch.words_mut(index)[all].iter_mut();
        indices.zip(0..).for_each(|(to, lane)| *to = in_lane(lane).1);
    }
}

/// Returns the data of a scene's camera. That of a camera that moves stays in the camera's space.
fn block(program: &CameraProgram, scene: &CompiledScene) -> InstanceBlock {
    let map = match scene.camera_motion {
        Some(_) => Affine::IDENTITY,
        None => scene.camera_to_world,
    };
    let view = CameraView {
        size: scene.settings.whole_size().map(|side| side as u32),
        map: map.columns,
        epsilon: scene.epsilon,
    };
    program.block(&scene.camera.block, &view)
}

/// Returns the rays of a packet that begins at a lane.
pub fn rays_of(state: &LaneBlock, start: usize) -> RayPacket {
    let v = variables();
    let mut rays = RayPacket::default();
    let lanes = |component: usize| {
        let lanes = state.floats(component)[start..].first_chunk();
        *lanes.expect("a packet has all lanes")
    };
    for axis in 0..3 {
        rays.origin[axis] = lanes(v.ray_origin + axis);
        rays.direction[axis] = lanes(v.ray_direction + axis);
    }
    (rays.epsilon, rays.limit) = (lanes(v.epsilon), lanes(v.hit_distance));
    rays.time = lanes(v.time_seed);
    rays
}

/// Stores the origins and the directions of a packet's rays.
fn set_rays(state: &mut LaneBlock, start: usize, rays: &RayPacket) {
    let v = variables();
    for (first, vectors) in [(v.ray_origin, &rays.origin), (v.ray_direction, &rays.direction)] {
        for (axis, lanes) in vectors.iter().enumerate() {
            state.floats_mut(first + axis)[start..start + LANES].copy_from_slice(lanes);
        }
    }
}
