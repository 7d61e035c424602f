//! A host that knows nothing but random numbers.

use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};

/// A random number in [0,1), the same in every run.
pub fn random(ray: u64, dimension: u32) -> f32 {
    let mut word = (ray << 8 | u64::from(dimension)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((word ^ word >> 31) >> 40) as f32 / (1 << 24) as f32
}

/// `rand()` for the rays of one batch; it traces nothing and has no lights.
pub struct RandomHost {
    /// The number of the batch's first ray.
    first: u64,
    /// For each ray, how often it asked.
    requests: Vec<u32>,
}

impl RandomHost {
    pub fn new(first: u64, count: usize) -> RandomHost {
        RandomHost { first, requests: vec![0; count] }
    }
}

impl Host for RandomHost {
    fn trace(&mut self, _: LaneSet, _: &RayLanes, _: &mut LaneColors) {
        unreachable!("sampling traces no rays")
    }

    fn occluded(&mut self, _: LaneSet, _: &RayLanes) -> u32 {
        unreachable!("sampling traces no rays")
    }

    fn light_sample(&mut self, _: LaneSet, _: u32, _: &LightQueryLanes, _: &mut LightLanes) -> u32 {
        unreachable!("there are no lights")
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        for lane in lanes.iter() {
            let ray = lanes.base as usize + lane;
            // Dimensions from 8 on: those before are the test's own.
            values[lane] = random(self.first + ray as u64, 8 + self.requests[ray]);
            self.requests[ray] += 1;
        }
    }
}
