//! `cargo bench -p rtsl-bvh [-- SCENE [KIND]]`: the time of searches for rays of a camera, random rays and rays that
//! leave surfaces, with spheres and triangles that are tested in Rust.
//!
//! For each kind of ray it prints the time of a ray: the sum of the least times that each part of the rays took in
//! several rounds. Parts are shorter than what a system gives a program at a time, so that others on the machine are
//! not measured. A round that counts gives the nodes and leaves that a ray visits, the rays that share a visit, the
//! vectors of object tests for each ray, and the lanes in use in them. Streams do not report visits.

mod counted;
mod rays;
mod scenes;
mod shapes;

use std::time::Instant;

use rtsl_bvh::{LANES, LaneMask, Objects, RayPacket, RayStream, Search, TraversalStack, lanes_of};

use self::counted::{Counted, Counts};
use self::rays::Packet;
use self::scenes::Scene;
use self::shapes::Tests;

/// The time that is spent on each kind of ray, in seconds, and the least number of rounds.
const SECONDS: f64 = 1.0;
const MIN_ROUNDS: usize = 3;

/// The number of rays of a wavefront.
const WAVEFRONT: usize = 1024;

/// The number of packets in a part: a multiple of those of a wavefront.
const PART: usize = 4 * WAVEFRONT / LANES;

fn main() {
    // Cargo adds options of its own.
    let mut names = std::env::args().skip(1).filter(|argument| !argument.starts_with('-'));
    let (name, kind) = (names.next(), names.next());
    println!(
        "{:<10} {:<18} {:>8} {:>8} {:>6} {:>8} {:>6} {:>6}",
        "scene", "rays", "ns/ray", "visits", "rays", "tests", "lanes", "hits"
    );
    for scene in scenes::NAMES.iter().filter(|it| name.as_ref().is_none_or(|name| name == *it)) {
        measure(&scenes::scene(scene), kind.as_deref());
    }
}

/// Measures the kinds of rays whose names begin with `kind`, or all.
fn measure(scene: &Scene, kind: Option<&str>) {
    let is_measured = |name: &str| kind.is_none_or(|kind| name.starts_with(kind));
    let camera = rays::camera(scene);
    let (secondary, shadow) = rays::from_surfaces(scene, &camera);
    let random = rays::random(scene, secondary.len());
    let measure = |kind: &str, packets: &[Packet], search, is_stream| {
        if is_measured(kind) {
            report(&Searches { scene, packets, search, is_stream }, kind);
        }
    };
    measure("camera", &camera, Search::Closest, false);
    measure("shadow", &shadow, Search::Any, false);
    measure("secondary", &secondary, Search::Closest, false);
    measure("random", &random, Search::Closest, false);
    if scene.geometry.suits_stream(WAVEFRONT) {
        measure("secondary, stream", &secondary, Search::Closest, true);
        measure("shadow, stream", &shadow, Search::Any, true);
    }
}

/// The number of rays traced and of those that hit something.
#[derive(Clone, Copy, Default)]
struct Traced {
    rays: usize,
    hits: usize,
}

fn report(searches: &Searches<'_>, kind: &str) {
    let mut counts = Counts::default();
    let tests = || Tests::new(&searches.scene.shapes);
    let Traced { rays, hits } = searches.trace(Counted::new(tests(), &mut counts));
    let mut parts: Vec<_> =
        searches.packets.chunks(PART).map(|packets| (packets, f64::INFINITY)).collect();
    let mut round = 0;
    let start = Instant::now();
    while round < MIN_ROUNDS || start.elapsed().as_secs_f64() < SECONDS {
        for (packets, least) in &mut parts {
            let start = Instant::now();
            Searches { packets, ..*searches }.trace(tests());
            *least = least.min(start.elapsed().as_secs_f64());
        }
        round += 1;
    }
    let least: f64 = parts.iter().map(|(_, least)| least).sum();
    let of_ray = |count: u64| count as f64 / rays as f64;
    let mean = |sum: u64, count: u64| sum as f64 / count.max(1) as f64;
    println!(
        "{:<10} {kind:<18} {:8.1} {:8.2} {:6.1} {:8.2} {:6.1} {:6.3}",
        searches.scene.name,
        least * 1e9 / rays as f64,
        of_ray(counts.rays_of_visits),
        mean(counts.rays_of_visits, counts.visits),
        of_ray(counts.tests),
        mean(counts.lanes_of_tests, counts.tests),
        hits as f64 / rays as f64,
    );
}

/// The rays that are traced by one call after another.
struct Searches<'a> {
    scene: &'a Scene,
    packets: &'a [Packet],
    search: Search,
    is_stream: bool,
}

impl Searches<'_> {
    fn trace(&self, objects: impl Objects) -> Traced {
        if self.is_stream { self.trace_streams(objects) } else { self.trace_packets(objects) }
    }

    fn trace_packets(&self, mut objects: impl Objects) -> Traced {
        let geometry = &self.scene.geometry;
        let mut visits = TraversalStack::default();
        let mut traced = Traced::default();
        for Packet { rays, lanes } in self.packets {
            let hits = match self.search {
                Search::Closest => {
                    geometry.nearest(rays, *lanes, &mut objects, &mut visits).lanes(*lanes)
                }
                Search::Any => geometry.any(rays, *lanes, &mut objects, &mut visits),
            };
            traced.rays += lanes.count_ones() as usize;
            traced.hits += hits.count_ones() as usize;
        }
        traced
    }

    fn trace_streams(&self, mut objects: impl Objects) -> Traced {
        let geometry = &self.scene.geometry;
        let mut visits = TraversalStack::default();
        let mut stream = RayStream::default();
        let mut traced = Traced::default();
        for packets in self.packets.chunks(WAVEFRONT / LANES) {
            stream.clear();
            packets.iter().for_each(|Packet { rays, lanes }| push(&mut stream, rays, *lanes));
            geometry.search_stream(&mut stream, self.search, &mut objects, &mut visits);
            traced.rays += stream.len();
            traced.hits += (0..stream.len()).filter(|place| stream.hit(*place).is_some()).count();
        }
        traced
    }
}

fn push(stream: &mut RayStream, rays: &RayPacket, lanes: LaneMask) {
    for lane in lanes_of(lanes) {
        let between = (rays.epsilon[lane], rays.limit[lane]);
        stream.push(rays.origin_of(lane), rays.direction_of(lane), between, rays.time[lane]);
    }
}
