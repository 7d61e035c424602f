//! Packets on their way through the hierarchy. The module above says why the answer does not
//! depend on the way.

use crate::math::Affine;

use super::bounds::Bounds;
use super::bvh::{Bvh, NodeKind};
use super::packet::{LANES, LaneMask, Lanes, RayPacket, lanes_of};
use super::slab::SlabTest;

/// Groups of objects: the first is the scene itself, the others are placed by its instances.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// The groups. Instances lie in the first only, and lead to others only.
    pub groups: Vec<Group>,
}

/// Objects and instances in one space.
#[derive(Clone, Debug, Default)]
pub struct Group {
    members: Vec<Member>,
    own_boxes: Vec<Option<Bounds>>,
    unbounded: Vec<u32>,
    bvh: Bvh,
}

/// A part of a group.
#[derive(Clone, Copy, Debug)]
pub enum Member {
    /// An object, by its index.
    Object(u32),
    /// A group, placed.
    Instance {
        /// The index of the group.
        group: u32,
        /// From this group's space into that group's.
        inverse: Affine,
    },
}

impl Group {
    /// A group of members with their boxes; those without a box are unbounded.
    pub fn new(members: Vec<(Member, Option<Bounds>)>) -> Self {
        let own_boxes: Vec<Option<Bounds>> =
            members.iter().map(|(_, bounds)| bounds.map(|bounds| bounds.padded())).collect();
        let indexed = || own_boxes.iter().enumerate();
        let boxed: Vec<(Bounds, u32)> =
            indexed().filter_map(|(index, own)| own.map(|own| (own, index as u32))).collect();
        let unbounded =
            indexed().filter(|(_, own)| own.is_none()).map(|(index, _)| index as u32).collect();
        let bvh = Bvh::build(&boxed);
        Group {
            members: members.into_iter().map(|(member, _)| member).collect(),
            own_boxes,
            unbounded,
            bvh,
        }
    }

    /// The union of all boxes; `None` where a member has none, or there is no member.
    pub fn bounds(&self) -> Option<Bounds> {
        if self.unbounded.is_empty() {
            self.bvh.nodes.first().map(|root| root.bounds)
        } else {
            None
        }
    }

    /// The members.
    pub fn members(&self) -> &[Member] {
        &self.members
    }
}

/// Which object was hit: the member of the scene, and for an instance the member of its group.
/// Ordered: the lower id wins ties.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct HitId(u64);

impl HitId {
    /// No object; greater than every object's.
    pub const NONE: HitId = HitId(u64::MAX);

    fn new(outer: u32, inner: u32) -> Self {
        HitId(u64::from(outer) << 32 | u64::from(inner))
    }

    /// The member of the scene.
    pub fn outer(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The member of the instance's group, where the member of the scene is an instance.
    pub fn inner(self) -> u32 {
        self.0 as u32
    }
}

/// The nearest hits of a packet.
#[derive(Clone, Debug)]
pub struct Hits {
    /// The parameters; where nothing is hit the ray's limit.
    pub distance: Lanes,
    /// The objects.
    pub id: [HitId; LANES],
}

impl Hits {
    /// No hits of the rays.
    pub fn new(rays: &RayPacket) -> Self {
        Hits { distance: rays.limit, id: [HitId::NONE; LANES] }
    }

    /// The lanes of `mask` that hit something.
    pub fn lanes(&self, mask: LaneMask) -> LaneMask {
        lanes_of(mask)
            .filter(|lane| self.id[*lane] != HitId::NONE)
            .fold(0, |hits, lane| hits | 1 << lane)
    }
}

/// What tests single objects.
pub trait Objects {
    /// Tests the rays of `lanes`, in the space of the object's group. `distance` holds the
    /// lanes' limits and receives the parameters of hits below them; returns the lanes that hit.
    fn intersect(
        &mut self,
        object: u32,
        rays: &RayPacket,
        lanes: LaneMask,
        distance: &mut Lanes,
    ) -> LaneMask;

    /// The hits of `lanes` that the last call of [`Objects::intersect`] found are their
    /// nearest so far: what is known of them is to be kept.
    fn keep(&mut self, lanes: LaneMask);
}

/// Nearest hits, or any hit.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Search {
    Nearest,
    Any,
}

impl Geometry {
    /// Finds the nearest hits of the rays of `lanes`.
    pub fn nearest(&self, rays: &RayPacket, lanes: LaneMask, objects: &mut dyn Objects) -> Hits {
        self.search(rays, lanes, objects, Search::Nearest)
    }

    /// The rays of `lanes` that hit anything before their limits. Every object is tested against
    /// the ray's own limit, so the order of tests does not matter.
    pub fn any(&self, rays: &RayPacket, lanes: LaneMask, objects: &mut dyn Objects) -> LaneMask {
        self.search(rays, lanes, objects, Search::Any).lanes(lanes)
    }

    fn search(
        &self,
        rays: &RayPacket,
        lanes: LaneMask,
        objects: &mut dyn Objects,
        search: Search,
    ) -> Hits {
        let mut hits = Hits::new(rays);
        let lanes = rays.finite_lanes(lanes);
        if let Some(scene) = self.groups.first() {
            let mut traversal = Traversal { geometry: self, objects, search, hits: &mut hits };
            traversal.visit_group(scene, rays, lanes, None, &[f32::NEG_INFINITY; LANES]);
        }
        hits
    }
}

struct Traversal<'a> {
    geometry: &'a Geometry,
    objects: &'a mut dyn Objects,
    search: Search,
    hits: &'a mut Hits,
}

impl Traversal<'_> {
    /// `outer` is the instance whose group this is, and `outer_entry` where its box is entered.
    fn visit_group(
        &mut self,
        group: &Group,
        rays: &RayPacket,
        lanes: LaneMask,
        outer: Option<u32>,
        outer_entry: &Lanes,
    ) {
        for member in &group.unbounded {
            self.visit_member(group, *member, rays, self.open(lanes), outer, outer_entry);
        }
        if group.bvh.nodes.is_empty() {
            return;
        }
        let slabs = SlabTest::new(rays);
        let mut entry = [0.0; LANES];
        let mut stack = vec![(0_u32, lanes)];
        while let Some((index, lanes)) = stack.pop() {
            let node = &group.bvh.nodes[index as usize];
            let lanes = slabs.test(&node.bounds, self.open(lanes), &self.hits.distance, &mut entry);
            if lanes == 0 {
                continue;
            }
            match node.kind {
                NodeKind::Inner { axis, lower, upper } => {
                    let backward = slabs.negative(axis as usize) & lanes;
                    let forward = lanes & !backward;
                    // The last is visited first. Lanes that disagree meet `upper` together.
                    push(&mut stack, lower, backward);
                    push(&mut stack, upper, lanes);
                    push(&mut stack, lower, forward);
                }
                NodeKind::Leaf { first, count } => {
                    let items = &group.bvh.items[first as usize..(first + count) as usize];
                    for member in items {
                        let Some(own) = &group.own_boxes[*member as usize] else { continue };
                        let lanes =
                            slabs.test(own, self.open(lanes), &self.hits.distance, &mut entry);
                        let mut entry = entry;
                        for lane in lanes_of(lanes) {
                            entry[lane] = entry[lane].max(outer_entry[lane]);
                        }
                        self.visit_member(group, *member, rays, lanes, outer, &entry);
                    }
                }
            }
        }
    }

    fn visit_member(
        &mut self,
        group: &Group,
        member: u32,
        rays: &RayPacket,
        lanes: LaneMask,
        outer: Option<u32>,
        entry: &Lanes,
    ) {
        if lanes == 0 {
            return;
        }
        match &group.members[member as usize] {
            Member::Object(object) => {
                let id =
                    HitId::new(outer.unwrap_or(member), if outer.is_some() { member } else { 0 });
                self.test_object(*object, id, rays, lanes, entry);
            }
            Member::Instance { group, inverse } => {
                // Instances lie in the scene only, so this nests once.
                if let (Some(group), None) = (self.geometry.groups.get(*group as usize), outer) {
                    let rays = rays.transformed(inverse, lanes);
                    let lanes = rays.finite_lanes(lanes);
                    self.visit_group(group, &rays, lanes, Some(member), entry);
                }
            }
        }
    }

    fn test_object(
        &mut self,
        object: u32,
        id: HitId,
        rays: &RayPacket,
        lanes: LaneMask,
        entry: &Lanes,
    ) {
        let mut distance = self.hits.distance;
        for lane in lanes_of(lanes) {
            // The lower id wins a tie, whichever comes first.
            if id < self.hits.id[lane] && self.hits.id[lane] != HitId::NONE {
                distance[lane] = distance[lane].next_up();
            }
        }
        let hit = self.objects.intersect(object, rays, lanes, &mut distance) & lanes;
        let behind_entry = |lane: &usize| distance[*lane] >= entry[*lane];
        let kept = lanes_of(hit).filter(behind_entry).fold(0, |kept, lane| kept | 1 << lane);
        for lane in lanes_of(kept) {
            self.hits.id[lane] = id;
            if self.search == Search::Nearest {
                self.hits.distance[lane] = distance[lane];
            }
        }
        if kept != 0 {
            self.objects.keep(kept);
        }
    }

    /// The lanes that still look for a hit.
    fn open(&self, lanes: LaneMask) -> LaneMask {
        match self.search {
            Search::Nearest => lanes,
            Search::Any => lanes & !self.hits.lanes(lanes),
        }
    }
}

fn push(stack: &mut Vec<(u32, LaneMask)>, node: u32, lanes: LaneMask) {
    if lanes != 0 {
        stack.push((node, lanes));
    }
}
