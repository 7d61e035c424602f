//! `cargo bench -p rtsl-bvh [-- SCENE [KIND]]`: the time of searches for rays of a camera, random rays and rays that
//! leave surfaces, with spheres and triangles that are tested in Rust.
//!
//! For each kind of ray it prints the least time of several rounds. A round that counts gives the nodes and leaves that
//! a ray visits, the rays that share a visit, the vectors of object tests for each ray, and the lanes in use in them.
//! Streams do not report visits.

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
    let packets = |kind: &str, packets: &[Packet], search| {
        if !is_measured(kind) {
            return;
        }
        report(scene, kind, &mut |counts| trace_packets(scene, packets, search, counts));
    };
    let streams = |kind: &str, packets: &[Packet], search| {
        if !is_measured(kind) {
            return;
        }
        report(scene, kind, &mut |counts| trace_streams(scene, packets, search, counts));
    };
    packets("camera", &camera, Search::Closest);
    packets("shadow", &shadow, Search::Any);
    packets("secondary", &secondary, Search::Closest);
    packets("random", &random, Search::Closest);
    if scene.geometry.suits_stream(WAVEFRONT) {
        streams("secondary, stream", &secondary, Search::Closest);
        streams("shadow, stream", &shadow, Search::Any);
    }
}

/// The number of rays traced and of those that hit something.
#[derive(Clone, Copy, Default)]
struct Traced {
    rays: usize,
    hits: usize,
}

fn report(scene: &Scene, kind: &str, trace: &mut dyn FnMut(Option<&mut Counts>) -> Traced) {
    let mut counts = Counts::default();
    let Traced { rays, hits } = trace(Some(&mut counts));
    let (mut least, mut round) = (f64::INFINITY, 0);
    let start = Instant::now();
    while round < MIN_ROUNDS || start.elapsed().as_secs_f64() < SECONDS {
        let start = Instant::now();
        trace(None);
        least = least.min(start.elapsed().as_secs_f64());
        round += 1;
    }
    let of_ray = |count: u64| count as f64 / rays as f64;
    let mean = |sum: u64, count: u64| sum as f64 / count.max(1) as f64;
    println!(
        "{:<10} {kind:<18} {:8.1} {:8.2} {:6.1} {:8.2} {:6.1} {:6.3}",
        scene.name,
        least * 1e9 / rays as f64,
        of_ray(counts.rays_of_visits),
        mean(counts.rays_of_visits, counts.visits),
        of_ray(counts.tests),
        mean(counts.lanes_of_tests, counts.tests),
        hits as f64 / rays as f64,
    );
}

fn trace_packets(
    scene: &Scene,
    packets: &[Packet],
    search: Search,
    counts: Option<&mut Counts>,
) -> Traced {
    let tests = Tests::new(&scene.shapes);
    match counts {
        None => trace_packets_with(scene, packets, search, tests),
        Some(counts) => trace_packets_with(scene, packets, search, Counted::new(tests, counts)),
    }
}

fn trace_packets_with(
    scene: &Scene,
    packets: &[Packet],
    search: Search,
    mut objects: impl Objects,
) -> Traced {
    let mut visits = TraversalStack::default();
    let mut traced = Traced::default();
    for Packet { rays, lanes } in packets {
        let hits = match search {
            Search::Closest => {
                scene.geometry.nearest(rays, *lanes, &mut objects, &mut visits).lanes(*lanes)
            }
            Search::Any => scene.geometry.any(rays, *lanes, &mut objects, &mut visits),
        };
        traced.rays += lanes.count_ones() as usize;
        traced.hits += hits.count_ones() as usize;
    }
    traced
}

fn trace_streams(
    scene: &Scene,
    packets: &[Packet],
    search: Search,
    counts: Option<&mut Counts>,
) -> Traced {
    let tests = Tests::new(&scene.shapes);
    match counts {
        None => trace_streams_with(scene, packets, search, tests),
        Some(counts) => trace_streams_with(scene, packets, search, Counted::new(tests, counts)),
    }
}

fn trace_streams_with(
    scene: &Scene,
    packets: &[Packet],
    search: Search,
    mut objects: impl Objects,
) -> Traced {
    let mut visits = TraversalStack::default();
    let mut stream = RayStream::default();
    let mut traced = Traced::default();
    for packets in packets.chunks(WAVEFRONT / LANES) {
        stream.clear();
        packets.iter().for_each(|Packet { rays, lanes }| push(&mut stream, rays, *lanes));
        scene.geometry.search_stream(&mut stream, search, &mut objects, &mut visits);
        traced.rays += stream.len();
        traced.hits += (0..stream.len()).filter(|place| stream.hit(*place).is_some()).count();
    }
    traced
}

fn push(stream: &mut RayStream, rays: &RayPacket, lanes: LaneMask) {
    for lane in lanes_of(lanes) {
        let between = (rays.epsilon[lane], rays.limit[lane]);
        stream.push(rays.origin_of(lane), rays.direction_of(lane), between, rays.time[lane]);
    }
}
