//! The interface through which shaders query the renderer that runs them.
//!
//! A request carries up to [`MAX_LANES`] rays. Lane `i` of a request is ray [`LaneSet::base`]` + i` of the call. Only
//! lanes whose bit is set in [`LaneSet::active`] are part of the request, and only their answers are read. An answer
//! must depend on its ray alone, never on the other rays of the request: this keeps results independent of the SIMD
//! width.

use rtsl_spec::COLOR_COMPONENTS;

use crate::Query;

pub use crate::plain_host::{PlainHost, PlainLight};

/// The greatest number of rays in one request.
pub const MAX_LANES: usize = 16;

/// One f32 for each lane.
pub type LaneFloats = [f32; MAX_LANES];

/// The bits of one scalar for each lane; of a bool, 0 or 1.
pub type LaneWords = [u32; MAX_LANES];

/// A vector for each lane, component by component.
pub type LaneVectors = [LaneFloats; 3];

/// A colour for each lane, component by component.
pub type LaneColors = [LaneFloats; COLOR_COMPONENTS as usize];

/// The rays of a call that take part in a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaneSet {
    /// The index of lane 0's ray within the call.
    pub base: u32,
    /// Bit `i` is set if lane `i` takes part.
    pub active: u32,
}

impl LaneSet {
    /// Iterates over the active lanes, in ascending order.
    pub fn iter(self) -> impl Iterator<Item = usize> {
        (0..MAX_LANES).filter(move |lane| self.active >> lane & 1 != 0)
    }
}

/// Rays, one a lane.
#[repr(C, align(64))]
#[derive(Clone, Debug, Default)]
pub struct RayLanes {
    /// The origins, world space.
    pub origin: LaneVectors,
    /// The directions, world space, of any length.
    pub direction: LaneVectors,
    /// The greatest ray parameter of a hit.
    pub limit: LaneFloats,
    /// For [`Host::trace`]: the greatest factor that a component of the answer is multiplied with, in absolute value; 1
    /// where it is unknown. May be NaN. A host may skip rays with a small weight. Unused by [`Host::occluded`].
    pub weight: LaneFloats,
}

/// Points at which light is sampled, one per lane.
#[repr(C, align(64))]
#[derive(Clone, Debug, Default)]
pub struct LightQueryLanes {
    /// The points, world space.
    pub point: LaneVectors,
    /// The axes of the cones, of any length.
    pub normal: LaneVectors,
    /// The least cosine between axis and light; -infinity for no cone.
    pub cosine: LaneFloats,
}

/// Samples of a light, one per lane.
#[repr(C, align(64))]
#[derive(Clone, Debug, Default)]
pub struct LightLanes {
    /// Unit vectors towards the light.
    pub direction: LaneVectors,
    /// The distances to the light.
    pub distance: LaneFloats,
    /// The radiance, or the whole contribution where the density is 0.
    pub color: LaneColors,
    /// The densities per solid angle; 0 for a delta light.
    pub pdf: LaneFloats,
}

/// The renderer's side of the interface. The default methods answer with zeros: black, no lights, nothing occluded.
///
/// Kernels and the interpreter call the methods directly, on the stack of the thread that calls them. The methods may
/// call kernels.
pub trait Host {
    /// Computes the radiance along new rays; `radiance` is zero on entry.
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        let _ = (lanes, rays, radiance);
    }

    /// Returns the lanes whose rays hit anything before the limit: bit `i` for lane `i`.
    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        let _ = (lanes, rays);
        0
    }

    /// Returns the number of light samples that [`Host::light_sample`] provides; constant throughout a call.
    fn light_count(&mut self) -> u32 {
        0
    }

    /// Computes light sample `index` (less than the count) at the points. Returns the lanes that the light reaches
    /// unshadowed from within their cone. Only those lanes of `light` are read; the others read as zero.
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

    /// Returns the scene's ambient light.
    fn ambient(&mut self) -> [f32; COLOR_COMPONENTS as usize] {
        Default::default()
    }

    /// Answers a query of an integrator for the ray with index `ray` of the call. Operands and results are bits, in the
    /// order of [`Query::operands`] and [`Query::results`]; the results are zero on entry.
    fn query(&mut self, ray: u32, query: Query, operands: &[u32], results: &mut [u32]) {
        let _ = (ray, query, operands, results);
    }

    /// Answers a query for several rays, with an array of lanes for each operand and result; the results are zero on
    /// entry. A host may override this to answer them together.
    fn query_lanes(
        &mut self,
        lanes: LaneSet,
        query: Query,
        operands: &[LaneWords],
        results: &mut [LaneWords],
    ) {
        let mut answer = vec![0; results.len()];
        for lane in lanes.iter() {
            let of_lane: Vec<u32> = operands.iter().map(|operand| operand[lane]).collect();
            answer.fill(0);
            self.query(lanes.base + lane as u32, query, &of_lane, &mut answer);
            for (result, bits) in results.iter_mut().zip(&answer) {
                result[lane] = *bits;
            }
        }
    }

    /// Returns the next dimension of each ray's sampler, in [0,1); `values` is zero on entry.
    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        let _ = (lanes, values);
    }
}

/// A host without a scene: black, no lights, and `rand` gives 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoHost;

impl Host for NoHost {}
