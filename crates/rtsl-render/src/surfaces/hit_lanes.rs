//! The lanes whose surfaces are computed: of a packet, or of a shading batch.

use fearless_simd::{Simd, f32x8};
use rtsl::{LaneBlock, Method};

use super::state::EightRays;
use crate::lanes::eight::{Eight, Vectors};

/// The object that a ray hit.
#[derive(Clone, Copy, Debug)]
pub struct ObjectHit {
    /// The index of the object.
    pub object: u32,
    /// The index of its element.
    pub element: u32,
    /// The index of the instance that places it; `None` for the world.
    pub instance: Option<u32>,
}

/// Hits of objects of one traversal class, by lane.
pub trait HitLanes {
    /// Returns the hit of a lane.
    fn hit(&self, lane: usize) -> ObjectHit;

    /// Returns the time of a lane's ray within the shutter.
    fn time(&self, lane: usize) -> f32;
}

/// Lanes for which surface properties are computed, with the memory blocks of the calls that compute them.
pub trait SurfaceLanes: HitLanes {
    /// Iterates over lanes, eight by eight.
    type Eights<S: Simd>: Iterator<Item = Eight<S>>;

    /// Iterates over all lanes that hit.
    fn eights<S: Simd>(&self, simd: S) -> Self::Eights<S>;

    /// Returns the rays in world space.
    fn rays<S: Simd>(&self, eight: Eight<S>) -> EightRays<S>;

    /// Returns the greatest parameters of hits with which the rays were traced.
    fn limits<S: Simd>(&self, eight: Eight<S>) -> f32x8<S>;

    /// Returns the parameters of the hits.
    fn distances<S: Simd>(&self, eight: Eight<S>) -> f32x8<S>;

    /// Returns the state of calls of the shapes' methods.
    fn state(&mut self) -> &mut LaneBlock;

    /// Returns the scratch of these calls, and the number of its arrays that `intersect` uses.
    fn scratch(&mut self) -> (&mut LaneBlock, usize);

    /// True if the shapes have this method and its results are read; those of `intersect` are its scratch.
    fn needs(&self, method: Method) -> bool;

    /// Calls a method of the shapes if they have it.
    fn call(&mut self, method: Method);

    /// Stores the densities per solid angle with which light samples would have found the hits.
    fn keep_light_densities<S: Simd>(&mut self, eight: Eight<S>, densities: f32x8<S>);

    /// Stores surfaces for the renderer; the state of calls has them already.
    fn keep<S: Simd>(&mut self, eight: Eight<S>, surfaces: &EightSurfaces<S>);
}

/// The surfaces hit by eight rays, in world space.
pub struct EightSurfaces<S: Simd> {
    /// The directions of the rays.
    pub direction: Vectors<S>,
    /// The points hit.
    pub point: Vectors<S>,
    /// The offsets at which rays that leave the surfaces begin.
    pub offset: f32x8<S>,
    /// The geometric normals, of unit length.
    pub geometric_normal: Vectors<S>,
    /// The normals for shading, of unit length.
    pub shading_normal: Vectors<S>,
}
