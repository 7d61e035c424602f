//! Bounding volume hierarchies over opaque items, and the search for closest hits of packets, single rays and streams.
//!
//! # Definition of the hit
//!
//! The hit of a ray is a function of the ray and the scene alone. It does not depend on the packet that contains the
//! ray, on the SIMD width or on the order in which objects are tested, and therefore images have the same bits for
//! every width and number of threads. In the argument below, the *own box* of an object is its padded box, and the
//! *entry* is the parameter at which a ray enters a box, as the module `box_test` computes it.
//!
//! 1. **Objects are pure.** An object is always tested against the ray's own limit, never against that of an earlier
//!    hit, so its result depends on the ray and the object alone.
//! 2. **A hit counts** if the ray meets the object's own box with an entry not beyond the hit, and, within an instance,
//!    likewise the instance's own box. Every hit of an object with correct bounds counts; for an object with wrong
//!    bounds the rule ensures that all traversal orders find the same hits.
//! 3. **Culling is safe.** A node's box is the exact union of the own boxes below it, and the box test is monotonic: if
//!    a ray has a hit that counts at `t`, it meets all boxes above the object, with entries not beyond `t`. A node is
//!    skipped only if the ray misses it, and then it contains no hit that counts, or if its entry lies beyond the
//!    closest hit so far, and then so do all its hits. Tests of many rays at once skip no box that one of the rays
//!    would meet.
//! 4. **Ties go to the lower id.**
//!
//! The own box of a moving object contains it over the whole shutter interval, and the transform into its space is
//! evaluated at the ray's time: both are functions of the ray and the scene.
//!
//! The result is therefore the least (distance, id) of all hits that count, in every traversal order. The traversal is
//! free to choose the fastest: see the module `traversal`.
//!
//! # Performance
//!
//! Coherent rays are traced as packets of 64: one visit of a node and one call of an object's `intersect` serve all.
//! Incoherent rays use interleaved traversal: each visits nodes in the order that suits it, with one test for eight
//! boxes, and one call of `intersect` tests all rays that are at leaves against up to eight objects each. A packet is
//! split into single rays where few of its rays remain active, and at once if their directions have little in common.
//!
//! Streams of a thousand incoherent rays traverse trees of moderate size together, node by node, and are paired with
//! the objects whose boxes they meet: see the module `stream_traversal`.

mod bounds;
mod box_test;
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
mod search;
mod space;
mod stream;
mod stream_traversal;
mod traversal;

pub use bounds::Bounds;
pub use box_test::SLACK;
pub use bvh8::{Boxes, Bvh8, Child, INSTANCE, Item, Leaf, LeafHead, Node8};
pub use geometry::{Geometry, Group, Instance};
pub use hit::{HitId, Hits};
pub use interleaved_traversal::MAX_INTERLEAVED;
pub use objects::{LoadedRay, Objects, RayLeafTest};
pub use packet::{
    LANES, LaneMask, Lanes, LanesOf, RayPacket, lanes_of, moved_packet, moved_packet_by,
};
pub use ray_space::{RayFrame, TraversalRay};
pub use space::{PacketSpace, Serial};
pub use stream::{Pair, PairHit, RAYS_OF_STREAM, RayStream, StreamLine, StreamRay};
pub use traversal::{Search, TraversalStack};
