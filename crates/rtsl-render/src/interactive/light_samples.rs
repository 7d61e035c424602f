//! Points that ask for light, and what a light gives them: all lanes of a packet at a time.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use rtsl::host::LightRequest;

use crate::acceleration::{LANES, LaneMask, Lanes, RayPacket};

use super::eight::{LaneVectors, dots, eights_alone};
use super::request_lanes::{from_packet, mask_of, request_bits, to_packet};

/// Points that ask for light.
pub struct LightQuery {
    /// The lanes that ask.
    pub lanes: LaneMask,
    /// The points, world space.
    pub point: LaneVectors,
    /// Axes of the cones, any length.
    normal: LaneVectors,
    /// Least cosines between axis and light; -infinity for no cone.
    cosine: Lanes,
}

/// Samples of a light.
pub struct LightSamples {
    /// Unit vectors towards the light.
    pub direction: LaneVectors,
    /// Distances.
    pub distance: Lanes,
    /// Radiance, or the whole contribution where the density is 0.
    pub color: LaneVectors,
    /// Densities per solid angle; 0 for a delta.
    pub pdf: Lanes,
}

impl LightQuery {
    /// What requests ask for.
    pub fn of_requests(requests: &[LightRequest<'_>]) -> Self {
        let mut query = LightQuery {
            lanes: 0,
            point: [[0.0; LANES]; 3],
            normal: [[0.0; LANES]; 3],
            cosine: [f32::NEG_INFINITY; LANES],
        };
        for LightRequest { lanes, query: from, .. } in requests {
            query.lanes |= mask_of(*lanes);
            for axis in 0..3 {
                to_packet(*lanes, &from.point[axis], &mut query.point[axis]);
                to_packet(*lanes, &from.normal[axis], &mut query.normal[axis]);
            }
            to_packet(*lanes, &from.cosine, &mut query.cosine);
        }
        query
    }

    /// The lanes of `lanes` whose samples lie within their cones.
    #[inline(always)]
    pub fn within_cones<S: Simd>(
        &self,
        simd: S,
        lanes: LaneMask,
        samples: &LightSamples,
    ) -> LaneMask {
        let mut within = 0;
        for eight in eights_alone(simd, lanes) {
            let least = eight.numbers(&self.cosine);
            let mut inside = least.simd_eq(f32::NEG_INFINITY);
            if eight.lanes(!inside) != 0 {
                let zero = eight.splat_vector([0.0; 3]);
                let axis = eight.normalized_or(&eight.vectors(&self.normal), &zero);
                let cosine = dots(&axis, &eight.vectors(&samples.direction));
                inside |= cosine.simd_ge(least);
            }
            within |= eight.lanes(inside);
        }
        within
    }

    /// Rays from the points towards the samples, which end at `limit`.
    pub fn rays(
        &self,
        samples: &LightSamples,
        epsilon: f32,
        limit: Lanes,
        time: &Lanes,
    ) -> RayPacket {
        RayPacket {
            origin: self.point,
            direction: samples.direction,
            epsilon: [epsilon; LANES],
            limit,
            time: *time,
        }
    }
}

impl LightSamples {
    /// Nothing.
    pub const NONE: LightSamples = LightSamples {
        direction: [[0.0; LANES]; 3],
        distance: [0.0; LANES],
        color: [[0.0; LANES]; 3],
        pdf: [0.0; LANES],
    };

    /// Answers requests: `reached` are the lanes that the light reaches.
    pub fn answer(&self, reached: LaneMask, requests: &mut [LightRequest<'_>]) {
        for LightRequest { lanes, light, reached: answer, .. } in requests {
            *answer = request_bits(*lanes, reached);
            for axis in 0..3 {
                from_packet(*lanes, &self.direction[axis], &mut light.direction[axis]);
                from_packet(*lanes, &self.color[axis], &mut light.color[axis]);
            }
            from_packet(*lanes, &self.distance, &mut light.distance);
            from_packet(*lanes, &self.pdf, &mut light.pdf);
        }
    }
}
