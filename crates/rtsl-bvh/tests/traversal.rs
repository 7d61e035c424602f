//! The hit of a ray depends on the ray and the scene alone: random scenes of spheres and instances, traversed in random
//! packets, compared with a plain loop over all objects.

use std::sync::Arc;

use fearless_simd::Simd;
use proptest::prelude::*;
use rtsl_bvh::{
    Bounds, Geometry, Group, HitId, Hits, INSTANCE, Instance, Item, LANES, LaneMask, Lanes, Leaf,
    LoadedRay, Objects, PacketSpace, Pair, PairHit, RayLeafTest, RayPacket, RayStream, Search,
    TraversalRay, TraversalStack, lanes_of,
};
use rtsl_math::{Affine, MovingTransform, Transform, dot};

#[derive(Clone, Copy, Debug)]
struct Sphere {
    center: [f32; 3],
    radius: f32,
}

impl Sphere {
    fn bounds(&self) -> Option<Bounds> {
        Bounds::new(self.center.map(|x| x - self.radius), self.center.map(|x| x + self.radius))
    }

    /// Returns the first hit between the limits, as a shader that offers both roots finds it.
    fn hit(&self, origin: [f32; 3], direction: [f32; 3], epsilon: f32, limit: f32) -> Option<f32> {
        let to_origin: [f32; 3] = std::array::from_fn(|axis| origin[axis] - self.center[axis]);
        let a = dot(direction, direction);
        let b = dot(to_origin, direction);
        let c = dot(to_origin, to_origin) - self.radius * self.radius;
        let root = (b * b - a * c).sqrt();
        [(-b - root) / a, (-b + root) / a].into_iter().find(|t| epsilon < *t && *t < limit)
    }
}

struct Spheres<'a> {
    spheres: &'a [Sphere],
    distance: Lanes,
    tests: usize,
}

impl<'a> Spheres<'a> {
    fn new(spheres: &'a [Sphere]) -> Self {
        Spheres { spheres, distance: [0.0; LANES], tests: 0 }
    }
}

impl Objects for Spheres<'_> {
    fn packet<S: Simd>(
        &mut self,
        _: S,
        space: &PacketSpace<'_>,
        leaf: &Leaf,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask {
        self.tests += 1;
        let sphere = self.spheres[leaf.items[index] as usize];
        let mut hits = 0;
        for lane in lanes_of(lanes) {
            let rays = &space.rays;
            let (origin, direction) = (rays.origin_of(lane), rays.direction_of(lane));
            let hit = sphere.hit(origin, direction, rays.epsilon[lane], rays.limit[lane]);
            if let Some(t) = hit {
                self.distance[lane] = t;
                hits |= 1 << lane;
            }
        }
        hits
    }

    fn distance(&self) -> &Lanes {
        &self.distance
    }

    fn load_packet<S: Simd>(&mut self, _: S, _: &PacketSpace<'_>) {}

    fn load_ray(&mut self, _: &TraversalRay) {}

    fn pairs(&mut self, stream: &RayStream, _: u32, pairs: &[Pair], found: &mut Vec<PairHit>) {
        for (index, pair) in pairs.iter().enumerate() {
            let ([x, y, z, epsilon], [along_x, along_y, along_z, limit]) =
                (stream.rays()[pair.ray as usize].start, stream.lines()[pair.ray as usize].along);
            self.tests += 1;
            let sphere = self.spheres[pair.item as usize];
            let hit = sphere.hit([x, y, z], [along_x, along_y, along_z], epsilon, limit);
            found.extend(hit.map(|distance| PairHit { pair: index as u32, distance }));
        }
    }

    fn leaves(&mut self, rays: &[LoadedRay], leaves: &[Leaf], tests: &mut [RayLeafTest]) {
        for test in tests {
            let (ray, leaf) = (&rays[test.ray as usize], &leaves[test.leaf as usize]);
            let hits = (0..u32::from(test.head.count)).filter_map(|index| {
                Some((index, self.ray_against_one(ray, leaf, index as usize)?))
            });
            let nearest = hits.min_by(|(_, one), (_, other)| one.total_cmp(other));
            (test.nearest, test.distance) = nearest.unwrap_or((RayLeafTest::NO_ITEM, 0.0));
        }
    }

    fn ray_against_one(&mut self, ray: &LoadedRay, leaf: &Leaf, index: usize) -> Option<f32> {
        self.tests += 1;
        let sphere = self.spheres[leaf.items[index] as usize];
        sphere.hit(ray.origin, ray.direction, ray.epsilon, ray.limit)
    }
}

fn sphere() -> impl Strategy<Value = Sphere> {
    // Coarse grids of positions and sizes give many exact ties.
    (prop::array::uniform3(-4_i32..=4), 1_i32..=4).prop_map(|(center, radius)| Sphere {
        center: center.map(|x| x as f32),
        radius: radius as f32 * 0.5,
    })
}

fn ray() -> impl Strategy<Value = ([f32; 3], [f32; 3], f32)> {
    let origin = prop::array::uniform3(-8_i32..=8).prop_map(|p| p.map(|x| x as f32));
    let along = prop::array::uniform3(-2_i32..=2).prop_map(|d| d.map(|x| x as f32));
    let any = prop::array::uniform3(-1.0_f32..1.0);
    let limit = prop_oneof![Just(f32::INFINITY), 0.0_f32..10.0];
    (origin, prop_oneof![along, any], limit)
}

type Ray = ([f32; 3], [f32; 3], f32);

fn packet(rays: &[Ray], order: &[usize]) -> RayPacket {
    let mut packet = RayPacket::default();
    for (lane, ray) in order.iter().enumerate() {
        let (origin, direction, limit) = rays[*ray];
        packet.set(lane, origin, direction);
        packet.epsilon[lane] = 1e-3;
        packet.limit[lane] = limit;
        packet.time[lane] = *ray as f32 / LANES as f32;
    }
    packet
}

fn mask(count: usize) -> LaneMask {
    if count == LANES { LaneMask::MAX } else { (1 << count) - 1 }
}

/// Items of two classes.
fn items(spheres: &[Sphere]) -> Vec<Item> {
    let item = |(index, sphere): (usize, &Sphere)| Item {
        bounds: sphere.bounds(),
        class: index as u32 % 2,
    };
    spheres.iter().enumerate().map(item).collect()
}

fn scene(spheres: &[Sphere]) -> Geometry {
    let group = Group::new(items(spheres));
    let place = Transform::translate([3.0, 0.0, 0.0]).after(Transform::scale([0.5, 0.5, 0.5]));
    let inverse = place.inverse().map_or(Affine::IDENTITY, Transform::affine);
    let placed = group.bounds().and_then(|bounds| bounds.transformed(place));
    let way = Transform::rotate(70.0, [1.0, 2.0, 0.5]).unwrap_or(Transform::IDENTITY);
    let way = Transform::translate([-3.0, 1.0, 2.0]).after(way);
    let motion = MovingTransform::new(place, way, [0.0, 1.0]).map(Arc::new);
    let moving = group.bounds().zip(motion.as_ref()).and_then(|(own, motion)| own.moved(motion));
    let mut world = items(spheres);
    // One object without a box.
    world[0].bounds = None;
    world.push(Item { bounds: placed, class: INSTANCE });
    world.push(Item { bounds: moving, class: INSTANCE });
    Geometry {
        groups: vec![Group::new(world), group],
        instances: vec![
            Instance { group: 1, inverse, motion: None },
            Instance { group: 1, inverse, motion },
        ],
        first_instance: spheres.len() as u32,
    }
}

fn flat(spheres: &[Sphere]) -> Geometry {
    Geometry {
        groups: vec![Group::new(items(spheres))],
        instances: Vec::new(),
        first_instance: spheres.len() as u32,
    }
}

/// Returns the same rays repeated, as a stream of hundreds.
fn stream(rays: &[Ray], order: &[usize], times: usize) -> RayStream {
    let mut stream = RayStream::default();
    for ray in order.iter().cycle().take(order.len() * times) {
        let (origin, direction, limit) = rays[*ray];
        stream.push(origin, direction, (1e-3, limit), 0.0);
    }
    stream
}

fn key(hits: &Hits, lane: usize) -> (u32, HitId) {
    (hits.distance[lane].to_bits(), hits.id[lane])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn hits_do_not_depend_on_the_packet(
        spheres in prop::collection::vec(sphere(), 1..40),
        rays in prop::collection::vec(ray(), LANES),
        order in Just((0..LANES).collect::<Vec<_>>()).prop_shuffle(),
        split in 1..LANES,
    ) {
        let geometry = scene(&spheres);
        let mut objects = Spheres::new(&spheres);
        let (first, second) = order.split_at(split);
        for part in [first, second] {
            let together = geometry.nearest(&packet(&rays, part), mask(part.len()), &mut objects, &mut TraversalStack::default());
            let any = geometry.any(&packet(&rays, part), mask(part.len()), &mut objects, &mut TraversalStack::default());
            for (lane, ray) in part.iter().enumerate() {
                let alone = geometry.nearest(&packet(&rays, &[*ray]), 1, &mut objects, &mut TraversalStack::default());
                prop_assert_eq!(key(&together, lane), key(&alone, 0));
                prop_assert_eq!(any >> lane & 1 != 0, together.id[lane] != HitId::NONE);
            }
        }
    }

    #[test]
    fn hits_are_those_of_a_loop_over_all_objects(
        spheres in prop::collection::vec(sphere(), 1..40),
        rays in prop::collection::vec(ray(), LANES),
    ) {
        let geometry = flat(&spheres);
        let order: Vec<usize> = (0..LANES).collect();
        let mut objects = Spheres::new(&spheres);
        let hits = geometry.nearest(&packet(&rays, &order), LaneMask::MAX, &mut objects, &mut TraversalStack::default());
        for (lane, (origin, direction, limit)) in rays.iter().enumerate() {
            let all = spheres.iter().enumerate().filter_map(|(index, sphere)| {
                sphere.hit(*origin, *direction, 1e-3, *limit).map(|t| (t, index as u32))
            });
            let expected = all.min_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
            let found = (hits.id[lane] != HitId::NONE).then(|| (hits.distance[lane], hits.id[lane].outer()));
            prop_assert_eq!(found, expected);
        }
    }
}

/// Rays from one place, or from places close to each other, towards the spheres. Their directions have the same signs:
/// a packet of them stays together until few rays are left at nodes and leaves.
fn coherent_rays() -> impl Strategy<Value = Vec<Ray>> {
    let side = prop_oneof![Just(-1.0_f32), Just(1.0)];
    let towards = (prop::array::uniform3(side), prop::array::uniform3(2.0_f32..8.0));
    let apart = prop_oneof![Just(0.0_f32), Just(0.25)];
    (towards, apart, 0.0_f32..0.9).prop_flat_map(|((sides, places), apart, spread)| {
        let start: [f32; 3] = std::array::from_fn(|axis| sides[axis] * places[axis]);
        let offset = prop::array::uniform3(-1.0_f32..1.0);
        let limit = prop_oneof![4 => Just(f32::INFINITY), 1 => 0.0_f32..20.0];
        let ray = (offset.clone(), offset, limit).prop_map(move |(from, turn, limit)| {
            let origin = std::array::from_fn(|axis| start[axis] + apart * from[axis]);
            let direction = std::array::from_fn(|axis| -start[axis] * (1.0 + spread * turn[axis]));
            (origin, direction, limit)
        });
        prop::collection::vec(ray, LANES)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn hits_of_coherent_packets_are_those_of_each_ray(
        spheres in prop::collection::vec(sphere(), 1..300),
        rays in coherent_rays(),
        is_flat in any::<bool>(),
    ) {
        let geometry = if is_flat { flat(&spheres) } else { scene(&spheres) };
        let mut objects = Spheres::new(&spheres);
        let mut visits = TraversalStack::default();
        let order: Vec<usize> = (0..LANES).collect();
        let together = packet(&rays, &order);
        let hits = geometry.nearest(&together, LaneMask::MAX, &mut objects, &mut visits);
        let any = geometry.any(&together, LaneMask::MAX, &mut objects, &mut visits);
        for lane in 0..LANES {
            let alone = packet(&rays, &[lane]);
            let alone = geometry.nearest(&alone, 1, &mut objects, &mut visits);
            prop_assert_eq!(key(&hits, lane), key(&alone, 0));
            prop_assert_eq!(any >> lane & 1 != 0, hits.id[lane] != HitId::NONE);
            if is_flat {
                let (origin, direction, limit) = rays[lane];
                let all = spheres.iter().enumerate().filter_map(|(index, sphere)| {
                    sphere.hit(origin, direction, 1e-3, limit).map(|t| (t, index as u32))
                });
                let expected = all.min_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
                let found = (hits.id[lane] != HitId::NONE)
                    .then(|| (hits.distance[lane], hits.id[lane].outer()));
                prop_assert_eq!(found, expected);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn hits_of_streams_are_those_of_packets(
        spheres in prop::collection::vec(sphere(), 1..200),
        rays in prop::collection::vec(ray(), LANES),
        order in Just((0..LANES).collect::<Vec<_>>()).prop_shuffle(),
        count in 1..=LANES,
        times in 1..6_usize,
    ) {
        let mut world = items(&spheres);
        world[0].bounds = None;
        let groups = vec![Group::new(world)];
        let geometry = Geometry { groups, instances: Vec::new(), first_instance: spheres.len() as u32 };
        let mut objects = Spheres::new(&spheres);
        let order = &order[..count];
        let hits = geometry.nearest(&packet(&rays, order), mask(count), &mut objects, &mut TraversalStack::default());
        let mut visits = TraversalStack::default();
        for search in [Search::Closest, Search::Any] {
            let mut stream = stream(&rays, order, times);
            geometry.search_stream(&mut stream, search, &mut objects, &mut visits);
            for place in 0..stream.len() {
                let lane = place % count;
                let is_hit = hits.id[lane] != HitId::NONE;
                match search {
                    Search::Closest => {
                        let found = stream.hit(place).map(|(distance, id)| (distance.to_bits(), id));
                        prop_assert_eq!(found, is_hit.then(|| key(&hits, lane)));
                    }
                    Search::Any => prop_assert_eq!(stream.hit(place).is_some(), is_hit),
                }
            }
        }
    }
}

#[test]
fn rays_of_a_stream_that_are_not_finite_hit_nothing() {
    let spheres = [Sphere { center: [0.0; 3], radius: 1.0 }];
    let mut stream = RayStream::default();
    for bad in [f32::NAN, f32::INFINITY] {
        stream.push([bad, 0.0, 0.0], [1.0, 0.0, 0.0], (1e-3, f32::INFINITY), 0.0);
        stream.push([0.0, 0.0, 0.0], [1.0, bad, 0.0], (1e-3, f32::INFINITY), 0.0);
    }
    stream.push([-3.0, 0.0, 0.0], [1.0, 0.0, 0.0], (1e-3, f32::INFINITY), 0.0);
    let mut objects = Spheres::new(&spheres);
    flat(&spheres).search_stream(
        &mut stream,
        Search::Closest,
        &mut objects,
        &mut TraversalStack::default(),
    );
    let hits: Vec<bool> = (0..5).map(|place| stream.hit(place).is_some()).collect();
    assert_eq!(hits, [false, false, false, false, true]);
    assert_eq!(objects.tests, 1);
}

#[test]
fn the_tree_saves_tests() {
    let spheres: Vec<Sphere> = (0..1000)
        .map(|index| Sphere {
            center: [(index % 10) as f32, (index / 10 % 10) as f32, (index / 100) as f32],
            radius: 0.3,
        })
        .collect();
    let geometry = flat(&spheres);
    let mut objects = Spheres::new(&spheres);
    let rays = [([4.0, 4.0, -5.0], [0.0, 0.0, 1.0], f32::INFINITY)];
    let hits =
        geometry.nearest(&packet(&rays, &[0]), 1, &mut objects, &mut TraversalStack::default());
    assert_eq!((hits.distance[0], hits.id[0].outer()), (4.7, 44));
    assert!(objects.tests <= 24, "{}", objects.tests);
}
