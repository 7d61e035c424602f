//! Tests packets against objects by their classes' `intersect`.

use rtsl::host::NoHost;
use rtsl::{LaneBlock, Method};

use crate::acceleration::{LANES, LaneMask, Lanes, Objects, RayPacket, lanes_of};
use crate::math::{Affine, reciprocal};

use super::compiled::CompiledScene;
use super::variables::{number, set_number, set_vector, variables};
use super::workspace::{CallBlocks, Problems};

/// Runs `intersect`, and keeps the scratch of the nearest hits.
pub struct Intersector<'a> {
    /// The scene.
    pub scene: &'a CompiledScene,
    /// Blocks for the calls.
    pub blocks: &'a mut CallBlocks,
    /// Where scratch of nearest hits goes; `None` for shadow rays, which need none.
    pub kept_scratch: Option<&'a mut LaneBlock>,
    /// Where problems go.
    pub problems: &'a Problems,
    /// The number of scratch arrays to keep of the object tested last.
    pub arrays: usize,
}

impl Objects for Intersector<'_> {
    fn intersect(
        &mut self,
        object: u32,
        rays: &RayPacket,
        lanes: LaneMask,
        distance: &mut Lanes,
    ) -> LaneMask {
        let object = &self.scene.objects[object as usize];
        let Some(call) = self.scene.call(&object.primitive, Method::Intersect, self.problems)
        else {
            return 0;
        };
        let v = variables();
        let count = LANES - lanes.leading_zeros() as usize;
        fill_rays(&mut self.blocks.state, &object.inverse, rays, count);
        self.blocks.state.floats_mut(v.hit_distance)[..count].copy_from_slice(&distance[..count]);
        let accepted = self.blocks.call(&call, lanes, None, &mut NoHost);
        for lane in lanes_of(accepted) {
            distance[lane] = number(&self.blocks.state, v.hit_distance, lane);
        }
        self.arrays = self.scene.shader(&object.primitive).kept_arrays;
        accepted
    }

    fn keep(&mut self, lanes: LaneMask) {
        let Some(kept) = &mut self.kept_scratch else { return };
        for array in 0..self.arrays {
            let (from, to) = (self.blocks.scratch.words(array), kept.words_mut(array));
            for lane in lanes_of(lanes) {
                to[lane] = from[lane];
            }
        }
    }
}

/// Sets the rays of the first `count` lanes, whether they take part or not, taken into an object's
/// space: in whole arrays, which is what packets spend much of their time on.
fn fill_rays(state: &mut LaneBlock, map: &Affine, rays: &RayPacket, count: usize) {
    let v = variables();
    let [x, y, z, origin] = &map.columns;
    let (from_origin, from_direction) = (&rays.origin, &rays.direction);
    for row in 0..3 {
        // The order of operations is that of `Affine::point` and `Affine::vector`.
        let turned = |from: &[Lanes; 3], lane: usize| {
            x[row] * from[0][lane] + y[row] * from[1][lane] + z[row] * from[2][lane]
        };
        let to = &mut state.floats_mut(v.ray_origin + row)[..count];
        for (lane, to) in to.iter_mut().enumerate() {
            *to = turned(from_origin, lane) + origin[row];
        }
        let to = &mut state.floats_mut(v.ray_direction + row)[..count];
        for (lane, to) in to.iter_mut().enumerate() {
            *to = turned(from_direction, lane);
        }
        let to = &mut state.floats_mut(v.inverse_ray_direction + row)[..count];
        for (lane, to) in to.iter_mut().enumerate() {
            *to = 1.0 / turned(from_direction, lane);
        }
    }
    state.floats_mut(v.epsilon)[..count].copy_from_slice(&rays.epsilon[..count]);
    state.floats_mut(v.time_seed)[..count].copy_from_slice(&rays.time[..count]);
}

/// Sets the rays of `lanes`, taken into an object's space, with what comes with them.
pub fn set_rays(state: &mut LaneBlock, map: &Affine, rays: &RayPacket, lanes: LaneMask) {
    let v = variables();
    for lane in lanes_of(lanes) {
        let origin = map.point(rays.origin_of(lane));
        let direction = map.vector(rays.direction_of(lane));
        set_vector(state, v.ray_origin, lane, origin);
        set_vector(state, v.ray_direction, lane, direction);
        set_vector(state, v.inverse_ray_direction, lane, reciprocal(direction));
        set_number(state, v.epsilon, lane, rays.epsilon[lane]);
        set_number(state, v.time_seed, lane, rays.time[lane]);
    }
}
