//! Intersections. One ray in four has a hit already.

use rtsl::{CallMode, Method};

use crate::kernels::{CommonOriginSphere, QuarticTorus, Sphere, Torus, Triangle, UnitSphere};
use crate::packet::RAYS;
use crate::race::{Parameter, Race, Shader, WrittenForms, independent};
use crate::random::{Random, cross, normalize, subtract};

const ORIGIN: [f32; 3] = [0.2, -0.1, -5.0];
const STATE: &[&str] = &["rt_RayOrigin", "rt_RayDirection", "rt_HitDistance"];

pub fn races() -> Vec<Race> {
    let shader =
        |file, class| Shader { file, class, method: Method::Intersect, mode: CallMode::Packet };
    let race = |name, shader, rays, parameters, written| Race {
        name,
        shader,
        state: STATE,
        others: &[("rt_Epsilon", 1e-4)],
        inputs: 7,
        in_place: true,
        rays,
        parameters,
        written,
    };
    vec![
        race(
            "sphere",
            shader("sphere.rtsl", "Sphere"),
            |random| independent(random, rays_of_any_length),
            sphere(),
            WrittenForms::of::<Sphere>(),
        ),
        race(
            "sphere_unit",
            shader("sphere_unit.rtsl", "UnitSphere"),
            |random| independent(random, |random| unit_rays(random, 1.1, FAR)),
            sphere(),
            WrittenForms::of::<UnitSphere>(),
        ),
        race(
            "sphere_common_origin",
            Shader { mode: CallMode::CommonOrigin, ..shader("sphere_unit.rtsl", "UnitSphere") },
            |random| independent(random, common_origin_rays),
            sphere(),
            WrittenForms::of::<CommonOriginSphere>(),
        ),
        Race {
            others: &[("rt_Epsilon", 1e-6)],
            ..race(
                "triangle",
                shader("triangle.rtsl", "Triangle"),
                |random| independent(random, |random| unit_rays(random, 0.9, FAR)),
                triangle(),
                WrittenForms::of::<Triangle>(),
            )
        },
        race(
            "torus",
            shader("torus.rtsl", "SteppedTorus"),
            |random| independent(random, |random| unit_rays(random, 1.2, 20.0)),
            torus(),
            WrittenForms::of::<Torus>(),
        ),
        race(
            "torus_tile",
            shader("torus.rtsl", "SteppedTorus"),
            tile,
            torus(),
            WrittenForms::of::<Torus>(),
        ),
        race(
            "torus_quartic",
            // The standard library's own.
            shader("../../shaders/primitives/torus.rtsl", "Torus"),
            |random| independent(random, |random| unit_rays(random, 1.2, 20.0)),
            vec![
                Parameter::new("majorRadius", &[1.0]),
                Parameter::new("minorRadius", &[0.4]),
                Parameter::hidden(&[1e-4]),
            ],
            WrittenForms::of::<QuarticTorus>(),
        ),
    ]
}

const FAR: f32 = 1e30;

fn sphere() -> Vec<Parameter> {
    vec![
        Parameter::new("center", &[0.05, -0.02, 0.1]),
        Parameter::new("radius", &[1.0]),
        Parameter::hidden(&[1e-4]),
        Parameter::new("id", &[7.0]),
        Parameter::hidden(&ORIGIN),
    ]
}

fn triangle() -> Vec<Parameter> {
    vec![
        Parameter::new("corner", &[-1.1, -1.0, 0.1]),
        Parameter::new("edge1", &[2.2, 0.1, 0.2]),
        Parameter::new("edge2", &[0.2, 2.1, -0.3]),
        Parameter::new("tolerance", &[1e-6]),
        Parameter::new("id", &[7.0]),
    ]
}

fn torus() -> Vec<Parameter> {
    vec![
        Parameter::new("majorRadius", &[1.0]),
        Parameter::new("minorRadius", &[0.4]),
        Parameter::new("tolerance", &[1e-4]),
        Parameter::new("id", &[7.0]),
    ]
}

fn ray(origin: [f32; 3], direction: [f32; 3], distance: f32) -> Vec<f32> {
    [origin.as_slice(), &direction, &[distance]].concat()
}

fn random_origin(random: &mut Random) -> [f32; 3] {
    [random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-6.0, -4.0)]
}

fn rays_of_any_length(random: &mut Random) -> Vec<f32> {
    let origin = random_origin(random);
    let towards = subtract(random.point(1.1), origin);
    let scale = random.between(0.1, 0.5);
    let distance = if random.once_in(4) { 6.0 } else { FAR };
    ray(origin, towards.map(|component| component * scale), distance)
}

fn unit_rays(random: &mut Random, extent: f32, far: f32) -> Vec<f32> {
    let origin = random_origin(random);
    let direction = normalize(subtract(random.point(extent), origin));
    let distance = if random.once_in(4) { 4.5 } else { far };
    ray(origin, direction, distance)
}

fn common_origin_rays(random: &mut Random) -> Vec<f32> {
    let direction = normalize(subtract(random.point(1.1), ORIGIN));
    let distance = if random.once_in(4) { 4.5 } else { FAR };
    ray(ORIGIN, direction, distance)
}

/// Eight by eight pixels of an image of the torus, 512 pixels wide, seen from above at 40 degrees.
fn tile(random: &mut Random) -> Vec<Vec<f32>> {
    const HALF_EXTENT: f32 = 0.363_97;
    let left = (random.between(14.0, 48.0) as usize * 8) as f32;
    let bottom = (random.between(20.0, 44.0) as usize * 8) as f32;
    let (forward, right) = (normalize([0.0, -2.0, 4.0]), [1.0, 0.0, 0.0]);
    let up = cross(forward, right);
    let pixel = |index: usize| {
        let x = ((left + (index % 8) as f32 + 0.5) / 256.0 - 1.0) * HALF_EXTENT;
        let y = ((bottom + (index / 8) as f32 + 0.5) / 256.0 - 1.0) * HALF_EXTENT;
        let towards = std::array::from_fn(|axis| forward[axis] + x * right[axis] + y * up[axis]);
        ray([0.0, 2.0, -4.0], normalize(towards), 20.0)
    };
    (0..RAYS).map(pixel).collect()
}
