//! Finding the nearest hits of packets of rays.
//!
//! # What the hit of a ray is
//!
//! The hit of a ray is a function of the ray and the scene alone: never of the packet the ray
//! travels in, of the SIMD width, or of the order in which objects are met. Images have
//! the same bits for every width and number of threads because of this, so it is worth an argument.
//! Write *own box* for the padded box of an object, and *entry* for the parameter at which a ray
//! enters a box, as the module `space` computes it.
//!
//! 1. **Objects are pure.** An object is always tested against the ray's own limit, never against that
//!    of a hit found before: what it answers depends on the ray and on it alone.
//! 2. **A hit counts** if the ray meets the object's own box, with an entry not behind the hit; and,
//!    within an instance, that instance's own box likewise. For bounds that bound this is always so; for
//!    others it makes sure that no way through the tree finds what another does not.
//! 3. **Culling is safe.** A node's box is the exact union of the own boxes below it, and the test of
//!    boxes is monotonic: where a ray has a hit that counts at `t`, it meets all boxes above the object,
//!    with entries not behind `t`. So a node is left out only if the ray misses it, which has no hit that
//!    counts there, or if its entry lies behind the nearest hit so far, and then all its hits do.
//!    Tests of many rays at once leave out no box that one of the rays would meet.
//! 4. **Ties go to the lower id.**
//!
//! What moves has the box that holds it for as long as the shutter is open, and the map into its space is
//! that of the ray's own time: both are functions of ray and scene too.
//!
//! So the result is the least (distance, id) of all hits that count, whichever way and in whatever
//! company a ray is sent. This leaves the traversal free to do what is fast: see the module `traversal`.
//!
//! # What is fast
//!
//! Rays that stay together go as packets of 64, with one visit of a node, one call of an object's
//! `intersect` for all. Rays that do not take turns: each visits nodes on its own, with one test for eight
//! boxes, and one call of `intersect` tests all that are at leaves, each with up to eight objects. A
//! packet becomes single rays wherever few of its rays are left, and at once where their directions have
//! little in common.
//!
//! Streams of a thousand rays of all directions go through trees of a moderate size together, node by node, and
//! are paired with the objects whose boxes they meet: see the module `stream_traversal`.

mod bounds;
mod build;
mod bvh8;
mod collapse;
mod geometry;
mod hit;
mod interleaved_traversal;
mod objects;
mod packet;
mod packet_traversal;
mod ray_lists;
mod ray_space;
mod ray_traversal;
mod space;
mod stream;
mod stream_traversal;
mod traversal;

pub use bounds::Bounds;
pub use bvh8::{Boxes, Bvh8, Child, Item, Leaf, LeafHead, Node8};
pub use geometry::{Geometry, Group, INSTANCE, Instance};
pub use hit::{HitId, Hits};
pub use interleaved_traversal::MAX_IN_TURN;
pub use objects::{BlockTest, Objects};
pub use packet::{LANES, LaneMask, Lanes, LanesOf, RayPacket, lanes_of};
pub use ray_space::{RayFrame, TraversalRay};
pub use space::{PacketSpace, Serial};
pub use stream::{Pair, PairHit, RAYS_OF_STREAM, RayStream, StreamLine, StreamRay};
pub use traversal::{Search, TraversalStack, moved_packet, moved_packet_by};
