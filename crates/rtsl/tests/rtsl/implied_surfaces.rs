//! Normals that the compiler derives from `intersect`, and derivatives that it derives from texture coordinates,
//! against those that the shapes of the library compute.

use std::sync::Arc;

use glam::Vec3;
use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Compiler, Engine, Instance, Instances, LaneBlock, LaneMask, Method,
    Program, new_state,
};
use rtsl_testing::random::Random;

use crate::common::{component, engines, new, unit};

/// Rays of a call: not a multiple of any width but 1.
const COUNT: usize = 229;

/// A shape with the hits and the texture coordinates of another, and nothing else.
const BARE: &str = "
class Bare : rt_Primitive;
public rt_Primitive base;
void intersect() { hit(base.intersect()); }
void computeTextureCoordinates() { rt_TextureUV = base.computeTextureCoordinates(); }";

/// The shapes. The torus finds its hits by bisection, and the coordinates of the triangle come from scratch.
const SHAPES: [&str; 8] =
    ["Sphere", "Torus", "Cylinder", "Disk", "Cone", "Parallelogram", "Plane", "Triangle"];

/// A ball whose coordinates are computed from a point on it.
const BALL: &str = "
class Ball : rt_Primitive;
scratch vec3 where;
float field(vec3 p) { return dot(p, p) - 1.0; }
void intersect() { FIND }
void computeTextureCoordinates() {
    vec3 p = POINT;
    rt_TextureUV = vec2(0.01 * p.x + 0.004 * p.y * p.y, 3.0 * p.z + p.x);
}
";

/// Ways to find the nearest hit.
const ROOTS: &str = "
    float a = dot(rt_RayDirection, rt_RayDirection), b = dot(rt_RayOrigin, rt_RayDirection);
    float root = b * b - a * (dot(rt_RayOrigin, rt_RayOrigin) - 1.0);
    if (root < 0.0) return;
    for (int side = -1; side <= 1; side += 2) {
        float t = (-b + float(side) * sqrt(root)) / a;
        if (hit(t)) { where = rt_RayOrigin + t * rt_RayDirection; return; }
    }";
/// From a point of the ray that moves with the origin.
const BISECTION: &str = "
    float middle = -dot(rt_RayOrigin, rt_RayDirection) / dot(rt_RayDirection, rt_RayDirection);
    float from = middle - 2.0 / length(rt_RayDirection), to = middle;
    if (field(rt_RayOrigin + to * rt_RayDirection) > 0.0) return;
    for (int i = 0; i < 30; i++) {
        float t = 0.5 * (from + to);
        if (field(rt_RayOrigin + t * rt_RayDirection) > 0.0) from = t; else to = t;
    }
    if (hit(to)) where = rt_RayOrigin + to * rt_RayDirection;";

/// Rays that are called for one instance.
struct Rays {
    program: Arc<Program>,
    instance: Arc<Instance>,
    state: LaneBlock,
    scratch: LaneBlock,
    hits: LaneMask,
}

impl Rays {
    fn new(engine: &Engine, instance: &Arc<Instance>) -> Rays {
        let program = engine.program(instance);
        let scratch = program.new_scratch(COUNT);
        let mut rays = Rays {
            program,
            instance: instance.clone(),
            state: new_state(COUNT),
            scratch,
            hits: LaneMask::new(COUNT),
        };
        rays.begin();
        rays
    }

    /// Sets rays from all around to the middle of the shape.
    fn begin(&mut self) {
        let mut random = Random::new(3);
        let mut vector = |size: f32| Vec3::from_array([0; 3].map(|_| size * random.signed()));
        let (origins, targets): (Vec<_>, Vec<_>) =
            (0..COUNT).map(|_| (vector(4.0), vector(0.9))).unzip();
        let directions: Vec<Vec3> = origins.iter().zip(&targets).map(|(o, t)| *t - *o).collect();
        self.set("rt_RayOrigin", &origins);
        self.set("rt_RayDirection", &directions);
        let inverse: Vec<Vec3> = directions.iter().map(|it| it.recip()).collect();
        self.set("rt_InverseRayDirection", &inverse);
        self.state.floats_mut(component("rt_HitDistance")).fill(f32::INFINITY);
        self.state.floats_mut(component("rt_Epsilon")).fill(1e-4);
        self.call(Method::Intersect);
        let distances = self.state.floats(component("rt_HitDistance")).to_vec();
        let points = origins.iter().zip(&directions).zip(distances);
        let points: Vec<Vec3> = points.map(|((o, d), t)| *o + t.min(1e9) * *d).collect();
        self.set("rt_HitPoint", &points);
        for method in
            [Method::ComputeNormal, Method::ComputeTextureCoordinates, Method::ComputeDerivatives]
        {
            self.call(method);
        }
    }

    fn call(&mut self, method: Method) {
        let Ok(kernel) = self.program.kernel(method, CallMode::Packet) else { return };
        let (mask, accepted) = match method {
            Method::Intersect => (None, Some(&mut self.hits)),
            _ => (Some(&self.hits), None),
        };
        let status = kernel.call(CallArguments {
            state: &mut self.state,
            scratch: &mut self.scratch,
            count: COUNT,
            mask,
            accepted,
            instances: Instances::One(&self.program.block(&self.instance)),
            host: &mut NoHost,
        });
        assert!(!status.budget_exhausted);
    }

    fn set(&mut self, name: &str, values: &[Vec3]) {
        let components = self.state.vectors_mut::<3>(component(name));
        for (axis, array) in components.into_iter().enumerate() {
            array.iter_mut().zip(values).for_each(|(lane, value)| *lane = value[axis]);
        }
    }

    fn vector(&self, name: &str, lane: usize) -> Vec3 {
        let first = component(name);
        Vec3::from_array([0, 1, 2].map(|axis| self.state.floats(first + axis)[lane]))
    }
}

fn check(shape: &str) {
    let library = rtsl::library::unit_of_class(&Compiler::default(), shape).unwrap();
    let base = Instance::new(library.class(shape).unwrap(), Vec::<(&str, rtsl::Value)>::new());
    let base = base.unwrap();
    let bare = new(&unit(BARE), "Bare", vec![("base", base.clone().into())]);
    let engines = engines();
    let (expected, found) = (Rays::new(&engines[0], &base), Rays::new(&engines[0], &bare));
    let mut hits = 0;
    for lane in (0..COUNT).filter(|lane| expected.hits.get(*lane)) {
        assert!(found.hits.get(lane), "{shape}, {lane}");
        hits += 1;
        let normals = [&expected, &found].map(|it| it.vector("rt_GeometricNormal", lane));
        let [expected_normal, normal] = normals.map(Vec3::normalize);
        let ray = expected.vector("rt_RayDirection", lane);
        assert!(normal.dot(ray) < 0.0, "{shape}, {lane}: the normal faces the ray");
        let sine = expected_normal.cross(normal).length();
        assert!(sine < 2e-3, "{shape}, {lane}: {expected_normal}, found {normal}");
        for name in ["rt_dPdu", "rt_dPdv"] {
            let [expected, found] = [&expected, &found].map(|it| it.vector(name, lane));
            let error = (expected - found).length() / expected.length();
            assert!(error < 1e-2, "{shape}, {lane}, {name}: {expected}, found {found}");
        }
    }
    assert!(hits > 10, "{shape}: {hits} hits");
    check_engines(shape, &bare, &found, &engines[1..]);
}

/// Checks that other engines find the same bits.
fn check_engines(shape: &str, instance: &Arc<Instance>, found: &Rays, engines: &[Engine]) {
    for engine in engines {
        let compiled = Rays::new(engine, instance);
        for name in ["rt_GeometricNormal", "rt_dPdu", "rt_dPdv"] {
            for lane in 0..COUNT {
                let [a, b] = [found, &compiled].map(|it| it.vector(name, lane));
                let width = engine.width();
                assert_eq!(
                    a.to_array().map(f32::to_bits),
                    b.to_array().map(f32::to_bits),
                    "{shape}, {width}, {name}, {lane}: {a}, {b}"
                );
            }
        }
    }
}

#[test]
fn surfaces_have_the_normals_and_derivatives_of_their_shapes() {
    SHAPES.into_iter().for_each(check);
}

/// The derivatives of a surface by coordinates are the same whatever the coordinates are computed from.
#[test]
fn derivatives_reach_all_that_coordinates_are_computed_from() {
    const NORMAL: &str = "void computeNormal() { rt_GeometricNormal = 3.0 * rt_HitPoint; }";
    let ball = |find: &str, point: &str, more: &str| {
        let text = format!("{}{more}", BALL.replace("FIND", find).replace("POINT", point));
        new(&unit(&text), "Ball", vec![])
    };
    let engines = engines();
    let expected = Rays::new(&engines[0], &ball(ROOTS, "rt_HitPoint", ""));
    for (find, point, more) in [
        (ROOTS, "where", ""),
        (ROOTS, "rt_RayOrigin + rt_HitDistance * rt_RayDirection", ""),
        (ROOTS, "rt_GeometricNormal", ""),
        (ROOTS, "rt_ShadingNormal", NORMAL),
        (BISECTION, "where", ""),
        (BISECTION, "rt_RayOrigin + rt_HitDistance * rt_RayDirection", NORMAL),
    ] {
        let instance = ball(find, point, more);
        let found = Rays::new(&engines[0], &instance);
        let mut hits = 0;
        for lane in (0..COUNT).filter(|lane| expected.hits.get(*lane) && found.hits.get(*lane)) {
            let distances =
                [&expected, &found].map(|it| it.state.floats(component("rt_HitDistance"))[lane]);
            // Rays from within: the bisection finds no far side. Where the coordinates hardly change along a line in the
            // surface, differences are worth little.
            let is_flat = expected.vector("rt_dPdv", lane).length() > 2.0;
            if is_flat || (distances[0] - distances[1]).abs() > 1e-3 {
                continue;
            }
            hits += 1;
            for name in ["rt_dPdu", "rt_dPdv"] {
                let [expected, found] = [&expected, &found].map(|it| it.vector(name, lane));
                let error = (expected - found).length() / expected.length();
                assert!(error < 1e-2, "{point}, {lane}, {name}: {expected}, found {found}");
            }
        }
        assert!(hits > 40, "{point}: {hits} hits");
        check_engines(point, &instance, &found, &engines[1..]);
    }
}

/// A shape whose `intersect` finds nothing again faces the ray.
#[test]
fn without_a_hit_the_normal_faces_the_ray() {
    let text =
        "class Nothing : rt_Primitive; void intersect() { if (rt_RayOrigin.x > 1e9) hit(1.0); }";
    let nothing = new(&unit(text), "Nothing", vec![]);
    for engine in engines() {
        let mut rays = Rays::new(&engine, &nothing);
        rays.hits = LaneMask::from_fn(COUNT, |_| true);
        rays.state.floats_mut(component("rt_HitDistance")).fill(2.0);
        rays.call(Method::ComputeNormal);
        for lane in 0..COUNT {
            let normal = rays.vector("rt_GeometricNormal", lane).normalize();
            let toward = -rays.vector("rt_RayDirection", lane).normalize();
            assert!(normal.distance(toward) < 1e-5, "{normal}, {toward}");
        }
    }
}
