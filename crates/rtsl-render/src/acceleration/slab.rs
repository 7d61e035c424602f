//! The test of rays against a box, by its three slabs.

use super::bounds::Bounds;
use super::packet::{LANES, LaneMask, Lanes, RayPacket};

/// Lanes are tested so many at a time: a whole number of SIMD registers of any machine.
const CHUNK: usize = 16;

/// Parameters are widened by this part, so that a hit that rounding moved before the box counts
/// as inside even where the box is flat and far away.
const SLACK: f32 = 1.0 / 4096.0;

/// What the test of a packet needs, computed once for each packet.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub struct SlabTest {
    origin: [Lanes; 3],
    /// One over the directions, held finite: see [`SlabTest::new`].
    inverse: [Lanes; 3],
    epsilon: Lanes,
    /// The directions' signs: bit set where negative.
    negative: [LaneMask; 3],
}

impl SlabTest {
    /// For the rays of a packet; lanes that are not finite must not be tested.
    ///
    /// The reciprocal of a component near 0 is held to the greatest finite number, so that no
    /// product is NaN: a ray along a slab's face counts as inside, and everything stays monotonic.
    pub fn new(rays: &RayPacket) -> Self {
        let inverse = rays.direction.map(|lanes| {
            lanes.map(|component| {
                let magnitude = (1.0 / component.abs()).min(f32::MAX);
                magnitude.copysign(component)
            })
        });
        let negative = rays.direction.map(|lanes| {
            let bits = lanes.iter().enumerate();
            bits.fold(0, |mask, (lane, x)| mask | u64::from(x.is_sign_negative()) << lane)
        });
        SlabTest { origin: rays.origin, inverse, epsilon: rays.epsilon, negative }
    }

    /// The lanes whose direction along `axis` is negative.
    pub fn negative(&self, axis: usize) -> LaneMask {
        self.negative[axis]
    }

    /// The lanes of `mask` that meet the box before their `limit`, and in `entry` where, at the
    /// earliest, they do.
    pub fn test(
        &self,
        bounds: &Bounds,
        mask: LaneMask,
        limit: &Lanes,
        entry: &mut Lanes,
    ) -> LaneMask {
        let mut passed = 0;
        for chunk in 0..LANES / CHUNK {
            let start = chunk * CHUNK;
            if mask >> start & ((1 << CHUNK) - 1) != 0 {
                passed |= self.test_chunk(bounds, start, limit, entry) << start;
            }
        }
        passed & mask
    }

    fn test_chunk(
        &self,
        bounds: &Bounds,
        start: usize,
        limit: &Lanes,
        entry: &mut Lanes,
    ) -> LaneMask {
        let mut near = [f32::NEG_INFINITY; CHUNK];
        let mut far = [f32::INFINITY; CHUNK];
        for axis in 0..3 {
            let origin = &self.origin[axis][start..start + CHUNK];
            let inverse = &self.inverse[axis][start..start + CHUNK];
            for lane in 0..CHUNK {
                let first = (bounds.min[axis] - origin[lane]) * inverse[lane];
                let second = (bounds.max[axis] - origin[lane]) * inverse[lane];
                near[lane] = greater(near[lane], lesser(first, second));
                far[lane] = lesser(far[lane], greater(first, second));
            }
        }
        let limit = &limit[start..start + CHUNK];
        let epsilon = &self.epsilon[start..start + CHUNK];
        let entry = &mut entry[start..start + CHUNK];
        let mut passed = [0_u32; CHUNK];
        for lane in 0..CHUNK {
            let near = widen_down(near[lane]);
            let far = widen_up(far[lane]);
            entry[lane] = near;
            passed[lane] = u32::from(near <= far)
                & u32::from(far >= epsilon[lane])
                & u32::from(near <= limit[lane]);
        }
        passed.iter().enumerate().fold(0, |mask, (lane, bit)| mask | u64::from(*bit) << lane)
    }
}

fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Less by a part of its size; monotonic, since either factor is positive and they meet at 0.
fn widen_down(x: f32) -> f32 {
    x * if x > 0.0 { 1.0 - SLACK } else { 1.0 + SLACK }
}

fn widen_up(x: f32) -> f32 {
    x * if x > 0.0 { 1.0 + SLACK } else { 1.0 - SLACK }
}
