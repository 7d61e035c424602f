//! Faces around a corner: a ray towards the corner, or towards an edge at it, hits at least one of them, at the same
//! distance in every call mode and at every width.

use std::sync::Arc;

use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, Engine, EngineOptions, Instance, Instances,
    LaneBlock, LaneIndices, LaneMask, LeafArguments, LeafTest, Method, Numbers, Objects, Program,
    Value, Variant, host::NoHost, library, lookup_state, new_state,
};
use rtsl_math::sine_and_cosine_of_degrees;
use rtsl_testing::random::Random;
use rtsl_testing::turns::{is_long_run, ways};

type Vector = [f32; 3];

/// The rays towards each corner.
const RAYS: usize = 64;
/// Room for the faces around each corner: one block of objects.
const FACES: usize = 8;

/// Faces of one class around corners.
struct Fans {
    positions: Vec<Vector>,
    /// Of the corners of faces, `FACES` for each fan; faces without area fill up.
    indices: Vec<usize>,
    rays: Vec<Ray>,
}

/// Faces around one corner.
struct Fan {
    corner: usize,
    /// The other ends of the edges at the corner.
    spokes: Vec<usize>,
    /// Faces reach by `scale` along the first vector, by `scale * stretch` along the second, and are seen from the
    /// third.
    frame: [Vector; 3],
    scale: f32,
    stretch: f32,
}

#[derive(Clone, Copy)]
struct Ray {
    origin: Vector,
    direction: Vector,
}

/// The classes whose faces share edges.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Faces {
    Triangles,
    Mesh,
    Gltf,
    Patches,
    Parallelograms,
}

impl Faces {
    fn class(self) -> Arc<Class> {
        let name = match self {
            Faces::Triangles => "Triangle",
            Faces::Mesh => "TriangleMesh",
            Faces::Gltf => "GltfMesh",
            Faces::Patches => "BilinearMesh",
            Faces::Parallelograms => "Parallelogram",
        };
        let unit = library::unit_of_class(&Compiler::default(), name).expect("it has no errors");
        unit.class(name).expect("it is there").clone()
    }

    /// The indices of the face between two of the points around a corner.
    fn face(self, corner: usize, ring: usize, sides: usize, side: usize) -> Vec<usize> {
        let point = |index: usize| ring + index % sides;
        match self {
            Faces::Patches => {
                vec![corner, point(2 * side), point(2 * side + 2), point(2 * side + 1)]
            }
            Faces::Parallelograms => vec![corner, point(side), point(side + 1)],
            _ if side % 2 == 1 => vec![point(side + 1), corner, point(side)],
            _ => vec![corner, point(side), point(side + 1)],
        }
    }

    fn instances(self, fans: &Fans) -> Vec<Arc<Instance>> {
        let class = self.class();
        if self == Faces::Triangles {
            let triangle = |face: &[usize]| {
                let corners = ["a", "b", "c"].into_iter().zip(face);
                let corners = corners.map(|(name, index)| (name, fans.positions[*index].into()));
                Instance::new(&class, corners).expect("these are its parameters")
            };
            return fans.indices.chunks(3).map(triangle).collect();
        }
        if self == Faces::Parallelograms {
            let parallelogram = |face: &[usize]| {
                let [corner, u, v] = [0, 1, 2].map(|it| fans.positions[face[it]]);
                let sides = [u, v].map(|end| combined(end, -1.0, corner).into());
                let [u, v]: [Value; 2] = sides;
                let parameters = [("corner", corner.into()), ("sideU", u), ("sideV", v)];
                Instance::new(&class, parameters).expect("these are its parameters")
            };
            return fans.indices.chunks(3).map(parallelogram).collect();
        }
        let floats = |of: &[Vector]| Value::Numbers(Numbers::floats(of.iter().flatten().copied()));
        let indices = fans.indices.iter().map(|index| *index as i32);
        let mut parameters = vec![
            ("positions", floats(&fans.positions)),
            ("indices", Value::Numbers(Numbers::ints(indices))),
        ];
        for name in ["normals", "uvs", "tangents", "uvs1", "colors"] {
            if class.parameters.iter().any(|parameter| parameter.name == name) {
                parameters.push((name, floats(&[])));
            }
        }
        vec![Instance::new(&class, parameters).expect("these are its parameters")]
    }
}

fn combined(a: Vector, part: f32, b: Vector) -> Vector {
    std::array::from_fn(|axis| a[axis] + part * b[axis])
}

fn cross(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|axis| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        a[next] * b[last] - a[last] * b[next]
    })
}

fn unit(v: Vector) -> Vector {
    let length = v.iter().map(|it| it * it).sum::<f32>().sqrt();
    v.map(|it| it / length)
}

fn random_vector(random: &mut Random) -> Vector {
    std::array::from_fn(|_| random.signed())
}

/// A power of ten between two exponents, both from -3 to 3.
fn size(random: &mut Random, least: i32, greatest: i32) -> f32 {
    const POWERS: [f32; 7] = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3];
    let exponent = least + random.below((greatest - least + 1) as u32) as i32;
    POWERS[(exponent + 3) as usize]
}

impl Fans {
    fn new(faces: Faces, count: usize, seed: u64) -> Fans {
        let mut fans = Fans { positions: Vec::new(), indices: Vec::new(), rays: Vec::new() };
        let mut random = Random::new(seed);
        for _ in 0..count {
            let frame = match random.below(4) {
                0 => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                1 => [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
                _ => {
                    let axis = unit(random_vector(&mut random));
                    let across = unit(cross(axis, random_vector(&mut random)));
                    [across, cross(axis, across), axis]
                }
            };
            fans.add(faces, frame, &mut random);
        }
        fans
    }

    /// Adds faces around a corner, all of which are seen from the third vector of the frame, and rays from there.
    fn add(&mut self, faces: Faces, frame: [Vector; 3], random: &mut Random) {
        let scale = size(random, -3, 3);
        let corner = random_vector(random).map(|it| it * scale * size(random, -1, 3));
        // Narrower fans would end within the rounding of what distant rays see: their rims have no neighbours.
        let stretch = size(random, -2, 0);
        let start = self.positions.len();
        self.positions.push(corner);
        let count = if faces == Faces::Patches { 4 } else { 5 + random.below(4) as usize };
        let sides = if faces == Faces::Patches { 2 * count } else { count };
        for side in 0..sides {
            let degrees = 360.0 * (side as f32 + 0.4 * random.unit()) / sides as f32;
            let reach = scale * (0.7 + 0.6 * random.unit());
            let (sine, cosine) = sine_and_cosine_of_degrees(f64::from(degrees));
            let (sine, cosine) = (sine as f32, cosine as f32);
            let local = [cosine, stretch * sine, 0.15 * stretch * random.signed()];
            let point =
                (0..3).fold(corner, |sum, axis| combined(sum, reach * local[axis], frame[axis]));
            self.positions.push(point);
        }
        let first = self.indices.len();
        let each = faces.face(0, 0, sides, 0).len();
        for side in 0..count {
            self.indices.extend(faces.face(start, start + 1, sides, side));
        }
        self.indices.resize(first + FACES * each, start);
        let spokes = (start + 1..=start + sides).step_by(sides / count).collect::<Vec<_>>();
        let fan = Fan { corner: start, spokes, frame, scale, stretch };
        self.add_rays(&fan, random);
    }

    /// Adds rays towards the corner and its edges: a third of them beside edges, by distances at which rounding begins
    /// to decide, some parallel to the frame, some of one origin.
    fn add_rays(&mut self, fan: &Fan, random: &mut Random) {
        let Fan { corner, scale, frame, .. } = *fan;
        let tilted = |random: &mut Random| {
            let tilt = [0.4 * random.signed(), 0.4 * random.signed(), 1.0];
            let way = (0..3).fold([0.0; 3], |sum, axis| combined(sum, tilt[axis], frame[axis]));
            way.map(|it| it * scale)
        };
        let far = size(random, -1, 3);
        let shared = combined(self.positions[corner], far, tilted(random));
        let is_shared = random.below(2) == 0;
        for index in 0..RAYS {
            let at = self.positions[corner];
            let end = self.positions[fan.spokes[random.below(fan.spokes.len() as u32) as usize]];
            let part = if index % 2 == 0 { 0.0 } else { 0.9 * random.unit() };
            let on_edge = combined(at, part, combined(end, -1.0, at));
            let aside = if index % 3 == 0 { 1e-4 * scale * size(random, -3, 1) } else { 0.0 };
            let [x, y] = [random.signed(), fan.stretch * random.signed()].map(|it| it * aside);
            let target = combined(combined(on_edge, x, frame[0]), y, frame[1]);
            let origin = match is_shared {
                true => shared,
                false if index % 4 == 0 => combined(target, far * scale, frame[2]),
                false => combined(target, far, tilted(random)),
            };
            let length = size(random, -2, 2);
            let direction = combined(target, -1.0, origin).map(|it| it * length);
            self.rays.push(Ray { origin, direction });
        }
    }
}

fn component(name: &str) -> usize {
    lookup_state(name).expect("a variable of the language").first_component as usize
}

fn state(rays: &[Ray]) -> LaneBlock {
    let mut state = new_state(rays.len());
    for (lane, ray) in rays.iter().enumerate() {
        for axis in 0..3 {
            state.floats_mut(component("rt_RayOrigin") + axis)[lane] = ray.origin[axis];
            state.floats_mut(component("rt_RayDirection") + axis)[lane] = ray.direction[axis];
        }
        state.floats_mut(component("rt_HitDistance"))[lane] = f32::INFINITY;
    }
    state
}

/// The searches of rays among the faces of their fan.
struct Searches {
    program: Arc<Program>,
    objects: Arc<Objects>,
    fans: Fans,
}

impl Searches {
    fn new(engine: &Engine, faces: Faces, fans: Fans) -> Searches {
        let instances = faces.instances(&fans);
        let program = engine.program(&instances[0]);
        let objects = match faces {
            Faces::Triangles | Faces::Parallelograms => {
                program.objects(instances.iter().map(|it| &**it))
            }
            _ => program.elements(&instances[0]).expect("they are made"),
        };
        Searches { program, objects: Arc::new(objects), fans }
    }

    fn variant(&self, mode: CallMode) -> Variant {
        Variant::new(mode).of_objects(self.objects.form().clone())
    }

    /// The bits of the distances of the nearest hits, and how many rays hit nothing.
    fn distances(&self, mode: CallMode) -> (Vec<u32>, usize) {
        let fans = self.fans.rays.chunks(RAYS).enumerate();
        let nearest = fans.flat_map(|(fan, rays)| match mode {
            CallMode::Leaf => self.in_leaf(fan, rays),
            CallMode::CommonOrigin if rays.iter().any(|ray| ray.origin != rays[0].origin) => {
                self.one_by_one(CallMode::Packet, fan, rays)
            }
            _ => self.one_by_one(mode, fan, rays),
        });
        let nearest: Vec<f32> = nearest.collect();
        let lost = nearest.iter().filter(|distance| !distance.is_finite()).count();
        (nearest.into_iter().map(f32::to_bits).collect(), lost)
    }

    fn in_leaf(&self, fan: usize, rays: &[Ray]) -> Vec<f32> {
        let kernel = self.program.kernel(Method::Intersect, self.variant(CallMode::Leaf)).unwrap();
        let kernel = kernel.for_leaves(self.objects.clone());
        let (mut state, mut scratch) = (state(rays), self.program.new_scratch(RAYS));
        let first = (FACES * fan) as u32;
        let mut tests: Vec<_> = (0..RAYS as u32).map(|ray| LeafTest::new(ray, first)).collect();
        let _ = kernel.call(LeafArguments {
            state: &mut state,
            scratch: &mut scratch,
            count: FACES as u32,
            tests: &mut tests,
            host: &mut NoHost,
        });
        state.floats(component("rt_HitDistance"))[..RAYS].to_vec()
    }

    /// Each face in a call of its own, or at `Stream` each ray with a face of its own in turn.
    fn one_by_one(&self, mode: CallMode, fan: usize, rays: &[Ray]) -> Vec<f32> {
        let kernel = self.program.kernel(Method::Intersect, self.variant(mode)).unwrap();
        let mut nearest = vec![f32::INFINITY; RAYS];
        let mut numbers = LaneIndices::new(RAYS);
        for face in 0..FACES {
            for (lane, number) in numbers.as_mut_slice().iter_mut().enumerate() {
                *number = (FACES * fan + (face + lane) % FACES) as u32;
            }
            let instances = match mode {
                CallMode::Stream => Instances::Many(&self.objects, &numbers),
                _ => Instances::Object(&self.objects, (FACES * fan + face) as u32),
            };
            let (mut state, mut scratch) = (state(rays), self.program.new_scratch(RAYS));
            let _ = kernel.call(CallArguments {
                state: &mut state,
                scratch: &mut scratch,
                count: RAYS,
                mask: None,
                accepted: Some(&mut LaneMask::new(RAYS)),
                instances,
                host: &mut NoHost,
            });
            let found = state.floats(component("rt_HitDistance"));
            nearest
                .iter_mut()
                .zip(found)
                .for_each(|(nearest, found)| *nearest = nearest.min(*found));
        }
        nearest
    }
}

/// Tests rays towards `count` corners, in every call mode of many rays and of many objects.
#[track_caller]
fn check(faces: Faces, width: u32, count: usize, seed: u64) {
    let options = EngineOptions { backend: Backend::Jit, width: Some(width), ..Default::default() };
    let Ok((engine, _)) = Engine::new(options) else { return };
    let searches = Searches::new(&engine, faces, Fans::new(faces, count, seed));
    let (expected, lost) = searches.distances(CallMode::Leaf);
    assert_eq!(lost, 0, "{faces:?} at width {width}: of {} rays", expected.len());
    for mode in [CallMode::Packet, CallMode::CommonOrigin, CallMode::Stream] {
        assert!(searches.distances(mode).0 == expected, "{faces:?} at width {width}: {mode:?}");
    }
}

/// The number of turns of the test, each with other faces and rays, and that of corners. Long runs have a hundred
/// million rays.
fn effort() -> (u64, usize) {
    if is_long_run() { (8, 10_000) } else { (1, 200) }
}

const ALL: [Faces; 5] =
    [Faces::Triangles, Faces::Mesh, Faces::Gltf, Faces::Patches, Faces::Parallelograms];

/// In ordinary runs each class at one width.
#[test]
fn no_ray_passes_between_faces() {
    let (rounds, corners) = effort();
    for round in 0..rounds {
        for (index, faces) in ALL.into_iter().enumerate() {
            for width in ways(&[8, 1, 4, 16], index) {
                let seed = 1000 * round + 16 * index as u64 + u64::from(width);
                check(faces, width, corners, seed);
            }
        }
    }
}

#[test]
fn the_interpreter_finds_the_same() {
    for faces in ALL {
        let found = [(Backend::Interpreter, 1), (Backend::Interpreter, 8), (Backend::Jit, 8)];
        let found = found.map(|(backend, width)| {
            let options = EngineOptions { backend, width: Some(width), ..Default::default() };
            let (engine, _) = Engine::new(options).ok()?;
            let searches = Searches::new(&engine, faces, Fans::new(faces, 3, 7));
            Some(searches.distances(CallMode::Leaf))
        });
        let mut found = found.into_iter().flatten();
        let expected = found.next().expect("there is an interpreter");
        assert_eq!(expected.1, 0, "{faces:?}");
        assert!(found.all(|it| it == expected), "{faces:?}");
    }
}
