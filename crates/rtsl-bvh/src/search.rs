//! Searches by packets.

use fearless_simd::{Level, Simd, dispatch};

use super::geometry::{Geometry, Group};
use super::hit::Hits;
use super::objects::Objects;
use super::packet::{LaneMask, RayPacket};
use super::space::{PacketSpace, finite_lanes};
use super::traversal::{Search, Traversal, TraversalStack};

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
            let mut traversal = Traversal::new(self, objects, search, &mut hits, visits);
            dispatch!(Level::new(), simd => traversal.visit_scene(simd, scene, rays, lanes));
        }
        hits
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
}
