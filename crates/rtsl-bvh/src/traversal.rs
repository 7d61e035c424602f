//! The state of searches. The neighbouring modules implement the traversal by packets, single rays and streams.

use super::bounds::Bounds;
use super::geometry::{Geometry, Group, Instance};
use super::hit::{HitId, Hits};
use super::interleaved_traversal::RayStacks;
use super::objects::{Objects, RayLeafTest};
use super::packet::LaneMask;
use super::ray_lists::RayLists;
use super::ray_space::TraversalRay;
use super::space::Serial;
use super::stream::{Pair, PairHit};

/// The kind of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// Finds the closest hit of each ray.
    Closest,
    /// Finds out if each ray has a hit.
    Any,
}

/// The pending visits of searches: empty between searches, kept to reuse its memory.
#[derive(Debug, Default)]
pub struct TraversalStack {
    /// The pending visits of packets, the next last.
    pub(super) packets: Vec<PacketVisit>,
    /// The stacks of interleaved rays.
    pub(super) rays: RayStacks,
    /// The tests of interleaved rays at leaves.
    pub(super) tests: Vec<RayLeafTest>,
    /// Of these, the indices of those whose hits may be the closest.
    pub(super) closer: Vec<u32>,
    /// The pending visits of streams.
    pub(super) lists: RayLists,
    /// For each class, the pairs of a stream that are not tested yet.
    pub(super) pairs: Vec<Vec<Pair>>,
    /// The hits of one call of [`Objects::pairs`].
    pub(super) found: Vec<PairHit>,
}

/// A child that some lanes are to be tested against.
#[derive(Clone, Copy, Debug)]
pub struct PacketVisit {
    /// The node.
    pub node: u32,
    /// The slot of the child.
    pub child: u32,
    /// The lanes.
    pub lanes: LaneMask,
}

/// The state of a search.
pub(super) struct Traversal<'a, O> {
    pub geometry: &'a Geometry,
    pub objects: &'a mut O,
    pub search: Search,
    pub hits: &'a mut Hits,
    pub visits: &'a mut TraversalStack,
    serial: Serial,
    /// A bound of the limits and hit distances of these lanes of the packet; no lanes if it is not known.
    pub farthest: f32,
    pub farthest_of: LaneMask,
}

/// The instance whose group is traversed, with the rays in the scene's space.
pub(super) struct InstanceContext<'a, Space: ?Sized> {
    /// The index of the instance's item in the scene.
    pub item: u32,
    /// The instance's own box, in which hits must lie.
    pub bounds: Bounds,
    /// The rays in the scene's space.
    pub space: &'a Space,
}

impl<Space: ?Sized> InstanceContext<'_, Space> {
    /// Returns the id of an item of the group.
    pub fn id(outer: Option<&Self>, item: u32) -> HitId {
        outer.map_or_else(|| HitId::new(item, 0), |outer| HitId::new(outer.item, item))
    }
}

impl<'a> InstanceContext<'a, [TraversalRay]> {
    /// Returns the context for one of the rays.
    #[inline(always)]
    pub fn of(&self, ray: &TraversalRay) -> InstanceContext<'a, TraversalRay> {
        let of_lane = self.space.iter().find(|outer| outer.lane == ray.lane);
        InstanceContext {
            item: self.item,
            bounds: self.bounds,
            space: of_lane.unwrap_or(&self.space[0]),
        }
    }
}

impl<'a, O: Objects> Traversal<'a, O> {
    /// Begins a search.
    pub fn new(
        geometry: &'a Geometry,
        objects: &'a mut O,
        search: Search,
        hits: &'a mut Hits,
        visits: &'a mut TraversalStack,
    ) -> Self {
        Traversal {
            geometry,
            objects,
            search,
            hits,
            visits,
            serial: 0,
            farthest: f32::INFINITY,
            farthest_of: 0,
        }
    }

    /// Returns a serial number that is unique within this search.
    pub fn next_serial(&mut self) -> Serial {
        self.serial += 1;
        self.serial
    }

    /// Returns the lanes that still search for a hit.
    #[inline(always)]
    pub fn open(&self, lanes: LaneMask) -> LaneMask {
        match self.search {
            Search::Closest => lanes,
            Search::Any => lanes & !self.hits.lanes(lanes),
        }
    }

    /// Returns the instance of an item of the scene and its group.
    pub fn instance(&self, item: u32) -> Option<(&'a Group, &'a Instance)> {
        let index = item.checked_sub(self.geometry.first_instance)?;
        let instance = self.geometry.instances.get(index as usize)?;
        Some((self.geometry.groups.get(instance.group as usize)?, instance))
    }
}
