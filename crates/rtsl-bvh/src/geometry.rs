//! The geometry that rays are traced against: groups of items, each with its tree.

use std::sync::Arc;

use rayon::prelude::*;
use rtsl_math::{Affine, MovingTransform};
use rtsl_memory::on_all_processors;

use super::bounds::Bounds;
use super::bvh8::{Bvh8, Item};
use super::packet::{LaneMask, RayPacket, moved_packet, moved_packet_by};
use super::ray_space::TraversalRay;

/// Groups of items: the first is the scene itself, the others are placed by its instances.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// The groups. Only the first contains instances, and these refer to the other groups.
    pub groups: Vec<Group>,
    /// The instances: the items of the first group with the class [`INSTANCE`](super::INSTANCE), in the order of these
    /// items.
    pub instances: Vec<Instance>,
    /// The index of the first of those items; instances come after all other items.
    pub first_instance: u32,
}

/// Items in one coordinate space.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// The tree over the items.
    pub tree: Bvh8,
}

/// A group with an instance transform.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The index of the group.
    pub group: u32,
    /// The transform from the scene's space to the group's; for moving instances, at shutter open.
    pub inverse: Affine,
    /// The transform from the group's space to the scene's over the shutter interval, if the instance moves.
    pub motion: Option<Arc<MovingTransform>>,
}

impl Instance {
    /// Returns the rays of a packet in the group's space. If the instance moves, only the rays of `lanes` are valid.
    #[inline(always)]
    pub fn moved_packet(&self, rays: &RayPacket, lanes: LaneMask) -> RayPacket {
        match &self.motion {
            None => moved_packet(rays, &self.inverse),
            Some(motion) => moved_packet_by(rays, lanes, |time| motion.inverse_at(time)),
        }
    }

    /// Returns a ray in the group's space, or `None` if it is not finite there.
    #[inline(always)]
    pub fn moved_ray(&self, ray: &TraversalRay) -> Option<TraversalRay> {
        match &self.motion {
            None => ray.moved(&self.inverse),
            Some(motion) => ray.moved(&motion.inverse_at(ray.time)),
        }
    }
}

impl Group {
    /// Builds a group of items, each with the bounds that its class computed.
    pub fn new(items: impl IntoIterator<Item = Item>) -> Self {
        Group { tree: Bvh8::build(&padded(items)) }
    }

    /// Returns the group after some of its items moved. The tree is refitted if that suffices, otherwise rebuilt.
    pub fn moved(&self, items: impl IntoIterator<Item = Item>) -> Self {
        let items = padded(items);
        Group { tree: self.tree.refitted(&items).unwrap_or_else(|| Bvh8::build(&items)) }
    }

    /// Returns the union of all own boxes, or `None` if an item is unbounded or there are no items.
    pub fn bounds(&self) -> Option<Bounds> {
        let is_bounded = self.tree.unbounded().is_empty() && self.tree.root.is_some();
        is_bounded.then_some(self.tree.bounds)
    }

    /// True if the group has no items.
    pub fn is_empty(&self) -> bool {
        self.tree.leaves.is_empty()
    }
}

/// Returns the items with their own (padded) boxes.
fn padded(items: impl IntoIterator<Item = Item>) -> Vec<Item> {
    let mut items: Vec<Item> = items.into_iter().collect();
    let pad = |item: &mut Item| item.bounds = item.bounds.map(|own| own.padded());
    on_all_processors(|| items.par_iter_mut().for_each(pad));
    items
}
