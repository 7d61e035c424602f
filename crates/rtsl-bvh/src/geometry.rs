//! What rays are traced against: groups of items, each with its tree.

use std::sync::Arc;

use rayon::prelude::*;
use rtsl_math::{Affine, MovingTransform};

use super::bounds::Bounds;
use super::bvh8::{Bvh8, Item};
use super::packet::{LaneMask, RayPacket};
use super::ray_space::TraversalRay;
use super::traversal::{moved_packet, moved_packet_by, moved_ray};

/// Groups of items: the first is the scene itself, the others are placed by its instances.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// The groups. Instances lie in the first only, and lead to others only.
    pub groups: Vec<Group>,
    /// What the items of the first group with the class [`INSTANCE`] are, in their order.
    pub instances: Vec<Instance>,
    /// The number of the first of those items: they stand behind all others.
    pub first_instance: u32,
}

/// The class of items that are instances.
pub const INSTANCE: u32 = u32::MAX;

/// Items in one space.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// The tree over the items.
    pub tree: Bvh8,
}

/// A group, placed.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The index of the group.
    pub group: u32,
    /// From the scene's space into that group's; of what moves, when the shutter opens.
    pub inverse: Affine,
    /// From the group's space to the scene's for as long as the shutter is open, if it moves.
    pub motion: Option<Arc<MovingTransform>>,
}

impl Instance {
    /// The rays of a packet in the group's space. Of rays that move only those of `lanes` count.
    #[inline(always)]
    pub fn moved_packet(&self, rays: &RayPacket, lanes: LaneMask) -> RayPacket {
        match &self.motion {
            None => moved_packet(rays, &self.inverse),
            Some(motion) => moved_packet_by(rays, lanes, |time| motion.inverse_at(time)),
        }
    }

    /// A ray in the group's space; `None` where it is not finite there.
    #[inline(always)]
    pub fn moved_ray(&self, ray: &TraversalRay) -> Option<TraversalRay> {
        match &self.motion {
            None => moved_ray(ray, &self.inverse),
            Some(motion) => moved_ray(ray, &motion.inverse_at(ray.time)),
        }
    }
}

impl Group {
    /// A group of items, each with its bounds as its class gives them.
    pub fn new(items: impl IntoIterator<Item = Item>) -> Self {
        Group { tree: Bvh8::build(&padded(items)) }
    }

    /// A group of the same items after some of them moved. Nothing is built where that serves as well.
    pub fn moved(&self, items: impl IntoIterator<Item = Item>) -> Self {
        let items = padded(items);
        Group { tree: self.tree.refitted(&items).unwrap_or_else(|| Bvh8::build(&items)) }
    }

    /// The union of all own boxes; `None` where an item has none, or there is no item.
    pub fn bounds(&self) -> Option<Bounds> {
        let is_bounded = self.tree.unbounded().is_empty() && self.tree.root.is_some();
        is_bounded.then_some(self.tree.bounds)
    }

    /// Whether there is nothing to hit.
    pub fn is_empty(&self) -> bool {
        self.tree.blocks.is_empty()
    }
}

/// Items with their own boxes.
fn padded(items: impl IntoIterator<Item = Item>) -> Vec<Item> {
    let mut items: Vec<Item> = items.into_iter().collect();
    items.par_iter_mut().for_each(|item| item.bounds = item.bounds.map(|own| own.padded()));
    items
}
