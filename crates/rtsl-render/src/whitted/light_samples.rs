//! Samples of a light for the requesting points, all lanes of a packet at once.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use rtsl::host::LightRequest;
use rtsl_bvh::{LANES, LaneMask, Lanes, RayPacket};

use crate::lanes::eight::{Eight, LaneVectors, Vectors, dots, eights_alone, scaled, select};
use crate::lanes::request_lanes::{from_packet, mask_of, request_bits, to_packet};

/// The points that request light, and their samples.
pub struct LightSamples {
    /// The requesting lanes.
    pub lanes: LaneMask,
    /// Rays from the points along unit vectors towards the samples, in world space.
    pub rays: RayPacket,
    /// Axes of the points' cones, any length.
    normal: LaneVectors,
    /// Least cosines between axis and light; -infinity for no cone.
    cosine: Lanes,
    /// Distances of the samples.
    pub distance: Lanes,
    /// Radiance, or the whole contribution where the density is 0.
    pub color: LaneVectors,
    /// Densities per solid angle; 0 for a delta.
    pub pdf: Lanes,
}

impl LightSamples {
    /// Creates samples without requests.
    pub fn new() -> Self {
        LightSamples {
            lanes: 0,
            rays: RayPacket::default(),
            normal: [[0.0; LANES]; 3],
            cosine: [0.0; LANES],
            distance: [0.0; LANES],
            color: [[0.0; LANES]; 3],
            pdf: [0.0; LANES],
        }
    }

    /// Starts with the requests at these times. The fields of the samples are undefined except that distances are 0.
    #[inline(always)]
    pub fn begin(&mut self, requests: &[LightRequest<'_>], epsilon: f32, time: &Lanes) {
        self.lanes = 0;
        self.distance = [0.0; LANES];
        self.rays.epsilon = [epsilon; LANES];
        self.rays.time = *time;
        for LightRequest { lanes, query, .. } in requests {
            self.lanes |= mask_of(*lanes);
            for axis in 0..3 {
                to_packet(*lanes, &query.point[axis], &mut self.rays.origin[axis]);
                to_packet(*lanes, &query.normal[axis], &mut self.normal[axis]);
            }
            to_packet(*lanes, &query.cosine, &mut self.cosine);
        }
    }

    /// Returns the lanes of `lanes` whose samples lie within their cones.
    #[inline(always)]
    pub fn within_cones<S: Simd>(&self, simd: S, lanes: LaneMask) -> LaneMask {
        let mut within = 0;
        for eight in eights_alone(simd, lanes) {
            let least = eight.floats(&self.cosine);
            let mut inside = least.simd_eq(f32::NEG_INFINITY);
            if eight.lanes(!inside) != 0 {
                let zero = eight.splat_vector([0.0; 3]);
                let axis = eight.normalized_or(&eight.vectors(&self.normal), &zero);
                let cosine = dots(&axis, &eight.vectors(&self.rays.direction));
                inside |= cosine.simd_ge(least);
            }
            within |= eight.lanes(inside);
        }
        within
    }

    /// Returns normals on the side of the surface for which light is requested: flipped if the cone points behind the
    /// surface, so that environment lights sample around them.
    #[inline(always)]
    pub fn on_their_side<S: Simd>(
        &self,
        eight: Eight<S>,
        [geometric, shading]: [Vectors<S>; 2],
    ) -> [Vectors<S>; 2] {
        let has_cone = !eight.floats(&self.cosine).simd_eq(f32::NEG_INFINITY);
        let is_behind = dots(&geometric, &eight.vectors(&self.normal)).simd_lt(0.0);
        let turned = has_cone & is_behind;
        [geometric, shading].map(|it| select(turned, &scaled(&it, eight.splat(-1.0)), &it))
    }

    /// Answers requests: `reached` are the lanes that the light reaches.
    #[inline(always)]
    pub fn answer(&self, reached: LaneMask, requests: &mut [LightRequest<'_>]) {
        for LightRequest { lanes, light, reached: answer, .. } in requests {
            *answer = request_bits(*lanes, reached);
            for axis in 0..3 {
                from_packet(*lanes, &self.rays.direction[axis], &mut light.direction[axis]);
                from_packet(*lanes, &self.color[axis], &mut light.color[axis]);
            }
            from_packet(*lanes, &self.distance, &mut light.distance);
            from_packet(*lanes, &self.pdf, &mut light.pdf);
        }
    }
}
