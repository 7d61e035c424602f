//! Searches of groups and instances. The neighbouring modules implement the traversal by packets, single rays and
//! streams.

use fearless_simd::{Level, Simd, dispatch};
use rtsl_math::Affine;

use super::bounds::Bounds;
use super::geometry::{Geometry, Group, Instance};
use super::hit::{HitId, Hits};
use super::interleaved_traversal::StackEntry;
use super::objects::Objects;
use super::packet::{LANES, LaneMask, RayPacket, lanes_of};
use super::packet_traversal::PacketVisit;
use super::ray_lists::RayLists;
use super::ray_space::TraversalRay;
use super::space::{PacketSpace, Serial, finite_lanes};
use super::stream::{Pair, PairHit};

/// The kind of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// Finds the closest hit of each ray.
    Closest,
    /// Finds out if each ray has a hit.
    Any,
}

impl Geometry {
    /// Finds the closest hits of the rays of `lanes`.
    pub fn nearest<O: Objects>(
        &self,
        rays: &RayPacket,
        lanes: LaneMask,
        objects: &mut O,
        visits: &mut TraversalStack,
    ) -> Hits {
        self.search(rays, lanes, objects, visits, Search::Closest)
    }

    /// Returns the rays of `lanes` that hit anything before their limits.
    pub fn any<O: Objects>(
        &self,
        rays: &RayPacket,
        lanes: LaneMask,
        objects: &mut O,
        visits: &mut TraversalStack,
    ) -> LaneMask {
        self.search(rays, lanes, objects, visits, Search::Any).lanes(lanes)
    }

    fn search<O: Objects>(
        &self,
        rays: &RayPacket,
        lanes: LaneMask,
        objects: &mut O,
        visits: &mut TraversalStack,
        search: Search,
    ) -> Hits {
        let mut hits = Hits::new(rays);
        if let Some(scene) = self.groups.first() {
            let mut traversal = Traversal {
                geometry: self,
                objects,
                search,
                hits: &mut hits,
                visits,
                serial: 0,
                farthest: f32::INFINITY,
                farthest_of: 0,
            };
            dispatch!(Level::new(), simd => traversal.visit_scene(simd, scene, rays, lanes));
        }
        hits
    }
}

/// The pending visits of searches: empty between searches, kept to reuse its memory.
#[derive(Debug, Default)]
pub struct TraversalStack {
    /// The pending visits of packets, the next last.
    pub(super) packets: Vec<PacketVisit>,
    /// Memory for the stacks of interleaved rays.
    pub(super) rays: Vec<StackEntry>,
    /// The length of the part of `rays` that is in use.
    pub(super) rays_in_use: usize,
    /// The pending visits of streams.
    pub(super) lists: RayLists,
    /// For each class, the pairs of a stream that are not tested yet.
    pub(super) pairs: Vec<Vec<Pair>>,
    /// The hits of one call of [`Objects::pairs`].
    pub(super) found: Vec<PairHit>,
}

/// The state of a search.
pub(super) struct Traversal<'a, O> {
    pub geometry: &'a Geometry,
    pub objects: &'a mut O,
    pub search: Search,
    pub hits: &'a mut Hits,
    pub visits: &'a mut TraversalStack,
    serial: Serial,
    /// The greatest limit or hit distance of these lanes of the packet; no lanes if it is not known.
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
    #[inline(always)]
    fn visit_scene<S: Simd>(
        &mut self,
        simd: S,
        scene: &'a Group,
        rays: &RayPacket,
        lanes: LaneMask,
    ) {
        let lanes = finite_lanes(simd, rays, lanes);
        if lanes != 0 {
            let space = PacketSpace::new(simd, rays, lanes, self.next_serial());
            self.visit_group_with_packet(simd, scene, &space, lanes, None);
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

/// Transforms the rays of a packet.
#[inline(always)]
pub fn moved_packet(rays: &RayPacket, map: &Affine) -> RayPacket {
    let [x, y, z, origin] = &map.columns;
    let mut moved = rays.clone();
    for row in 0..3 {
        // The order of operations is that of `Affine::point` and `Affine::vector`.
        let turned = |from: &[[f32; LANES]; 3], lane: usize| {
            x[row] * from[0][lane] + y[row] * from[1][lane] + z[row] * from[2][lane]
        };
        for lane in 0..LANES {
            moved.origin[row][lane] = turned(&rays.origin, lane) + origin[row];
            moved.direction[row][lane] = turned(&rays.direction, lane);
        }
    }
    moved
}

/// Transforms the rays of `lanes`, each by the transform at its time; others stay as they are.
pub fn moved_packet_by(
    rays: &RayPacket,
    lanes: LaneMask,
    map_at: impl Fn(f32) -> Affine,
) -> RayPacket {
    let mut moved = rays.clone();
    for lane in lanes_of(lanes) {
        let map = map_at(rays.time[lane]);
        moved.set(lane, map.point(rays.origin_of(lane)), map.vector(rays.direction_of(lane)));
    }
    moved
}

/// Transforms a ray; returns `None` if it is not finite afterwards.
pub(super) fn moved_ray(ray: &TraversalRay, map: &Affine) -> Option<TraversalRay> {
    ray.moved(map.point(ray.origin), map.vector(ray.direction))
}
