//! Finding the nearest hits of packets of rays.
//!
//! # What the hit of a ray is
//!
//! The hit of a ray is a function of the ray and the scene alone: never of the packet the ray
//! travels in, of the SIMD width, or of the order in which a packet meets the objects. Images have
//! the same bits for every width and number of threads because of this, so it is worth an argument.
//! Write *own box* for the padded box of an object, and *entry* for the parameter at which a ray
//! enters a box, as [`SlabTest`] computes it.
//!
//! 1. **Lanes are alone.** A lane is offered to a node, and to an object, only if it passes the
//!    test of that box itself, against its own nearest hit so far. What other lanes do never
//!    offers it anything.
//! 2. **Boxes are monotonic.** The test of a box uses subtraction, multiplication by one finite
//!    factor, and minimum and maximum. Each is monotonic under IEEE rounding and none yields NaN,
//!    so if a box lies inside another then its entry is no less and its exit no greater than the
//!    other's. A node's box is the exact union of the own boxes below it, so a lane that
//!    passes an object's own box passes all boxes above it. The tree decides only how fast an
//!    object is found, not whether.
//! 3. **Culling by the nearest hit is safe.** A lane skips an object if its entry lies beyond the
//!    lane's nearest hit. A hit is accepted only at or behind the entry (else it is undone), so a
//!    skipped object's hit would have lost anyway.
//! 4. **Ties go to the lower id.** An object whose id is less than that of the nearest hit is
//!    given the next greater number as its limit, so that it wins at equal distance whether it
//!    comes first or last.
//! 5. **The order is the lane's own.** At each inner node a lane visits the child that lies first
//!    along its own direction; a packet whose lanes disagree visits one child twice, with different
//!    lanes. So even a primitive whose answer depends on the limit it is given (a height field
//!    marched up to `rt_HitDistance`) sees the same sequence of limits in every packet.
//!
//! By 1 to 4, for primitives that only offer hits, the result is the least (distance, id) over all
//! objects; by 5, for all primitives, it is the same for every packet.
//!
//! Objects without finite bounds stand outside the tree and are tested first, in order.

mod bounds;
mod bvh;
mod packet;
mod slab;
mod traversal;

pub use bounds::Bounds;
pub use bvh::Bvh;
pub use packet::{LANES, LaneMask, Lanes, RayPacket, lanes_of};
pub use slab::SlabTest;
pub use traversal::{Geometry, Group, HitId, Hits, Member, Objects};
