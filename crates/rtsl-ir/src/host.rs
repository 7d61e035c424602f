//! What shaders ask of the renderer that runs them.
//!
//! Requests come from up to [`MAX_LANES`] rays at a time. Lane `i` of a request is ray
//! [`LaneSet::base`]` + i` of the call; only lanes whose bit is set in [`LaneSet::active`] ask, and
//! only their answers are read. An answer must depend on its own ray alone, never on which rays
//! asked along with it: that keeps results independent of the SIMD width.

use rtsl_spec::COLOR_COMPONENTS;

/// The greatest number of rays in one request.
pub const MAX_LANES: usize = 16;

/// One f32 for each lane.
pub type LaneFloats = [f32; MAX_LANES];

/// A vector for each lane, component by component.
pub type LaneVectors = [LaneFloats; 3];

/// A colour for each lane, component by component.
pub type LaneColors = [LaneFloats; COLOR_COMPONENTS as usize];

/// Which rays of a call ask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaneSet {
    /// The ray of lane 0, counted within the call.
    pub base: u32,
    /// Bit `i`: lane `i` asks.
    pub active: u32,
}

impl LaneSet {
    /// The lanes that ask, in order.
    pub fn iter(self) -> impl Iterator<Item = usize> {
        (0..MAX_LANES).filter(move |lane| self.active >> lane & 1 != 0)
    }
}

/// Rays, one a lane.
#[repr(C, align(64))]
#[derive(Clone, Debug, Default)]
pub struct RayLanes {
    /// Origins, world space.
    pub origin: LaneVectors,
    /// Directions, world space, any length.
    pub direction: LaneVectors,
    /// Greatest parameters of a hit.
    pub limit: LaneFloats,
    /// Of [`Host::trace`]: the greatest factor that a component of the answer is multiplied with, in absolute value;
    /// 1 where that is not known, and it may be NaN. A host may leave rays untraced of whose light little arrives. For
    /// [`Host::occluded`] it says nothing.
    pub weight: LaneFloats,
}

/// Points that ask for light, one a lane.
#[repr(C, align(64))]
#[derive(Clone, Debug, Default)]
pub struct LightQueryLanes {
    /// The points, world space.
    pub point: LaneVectors,
    /// Axes of the cones, any length.
    pub normal: LaneVectors,
    /// Least cosines between axis and light; -infinity for no cone.
    pub cosine: LaneFloats,
}

/// Samples of a light, one a lane.
#[repr(C, align(64))]
#[derive(Clone, Debug, Default)]
pub struct LightLanes {
    /// Unit vectors towards the light.
    pub direction: LaneVectors,
    /// Distances.
    pub distance: LaneFloats,
    /// Radiance, or the whole contribution where the density is 0.
    pub color: LaneColors,
    /// Densities per solid angle; 0 for a delta.
    pub pdf: LaneFloats,
}

/// A request for the radiance along rays.
pub struct TraceRequest<'a> {
    /// Which rays ask.
    pub lanes: LaneSet,
    /// The rays.
    pub rays: &'a RayLanes,
    /// The answer; zeros so far.
    pub radiance: &'a mut LaneColors,
}

/// A request whether there is anything on rays.
pub struct OcclusionRequest<'a> {
    /// Which rays ask.
    pub lanes: LaneSet,
    /// The rays.
    pub rays: &'a RayLanes,
    /// The answer, bit `i` for lane `i`; zeros so far.
    pub occluded: u32,
}

/// A request for samples of a light.
pub struct LightRequest<'a> {
    /// Which rays ask.
    pub lanes: LaneSet,
    /// The points.
    pub query: &'a LightQueryLanes,
    /// The answer; zeros so far.
    pub light: &'a mut LightLanes,
    /// The lanes that the light reaches; zeros so far.
    pub reached: u32,
}

/// The renderer's side. What a host does not say is answered with zeros: black, unlit, nothing in the way.
///
/// `light_count`, `ambient` and `rand` may be asked on a small stack, of which half a megabyte is left: they must
/// not call kernels.
pub trait Host {
    /// The radiance along new rays; zeros so far.
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        let _ = (lanes, rays, radiance);
    }

    /// Which lanes have anything on their rays before the limit: bit `i` for lane `i`.
    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        let _ = (lanes, rays);
        0
    }

    /// The number of light samples that [`Host::light_sample`] has; the same throughout a call.
    fn light_count(&mut self) -> u32 {
        0
    }

    /// Light sample `index` (less than the count) at points. Returns the lanes that the
    /// light reaches unshadowed from within their cone; only those lanes of `light` are read,
    /// the others read as zeros.
    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let _ = (lanes, index, query, light);
        0
    }

    /// [`Host::trace`] for requests of one call that came together, as many lanes as there may be at a time. All
    /// have lanes of their own. A host that gains by it answers them as one; so for the other two.
    fn trace_together(&mut self, requests: &mut [TraceRequest<'_>]) {
        for TraceRequest { lanes, rays, radiance } in requests {
            self.trace(*lanes, rays, radiance);
        }
    }

    /// [`Host::occluded`] for requests of one call that came together.
    fn occluded_together(&mut self, requests: &mut [OcclusionRequest<'_>]) {
        for OcclusionRequest { lanes, rays, occluded } in requests {
            *occluded = self.occluded(*lanes, rays);
        }
    }

    /// [`Host::light_sample`] for requests of one call that came together.
    fn light_sample_together(&mut self, index: u32, requests: &mut [LightRequest<'_>]) {
        for LightRequest { lanes, query, light, reached } in requests {
            *reached = self.light_sample(*lanes, index, query, light);
        }
    }

    /// The scene's ambient light.
    fn ambient(&mut self) -> [f32; COLOR_COMPONENTS as usize] {
        Default::default()
    }

    /// The next dimension of each ray's sampler, in [0,1); zeros so far.
    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        let _ = (lanes, values);
    }
}

/// A host without a scene: black, unlit, and `rand` is 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoHost;

impl Host for NoHost {}
