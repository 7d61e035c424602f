//! The scenes: those that `make_scene` of the benchmarks of the whole renderer makes, and one of instances.

use rtsl_bvh::{Bounds, Geometry, Group, HitId, INSTANCE, Instance, Item};
use rtsl_math::Transform;

use super::shapes::{Shape, Shapes};

/// The names of the scenes.
pub const NAMES: [&str; 5] = ["metals", "1k", "10k", "instances", "terrain"];

/// A scene.
pub struct Scene {
    /// The name.
    pub name: &'static str,
    /// The shapes.
    pub shapes: Shapes,
    /// The hierarchy over them.
    pub geometry: Geometry,
    /// The places of the instances.
    pub places: Vec<[f32; 3]>,
    /// The camera's place and target, and its field of view in degrees.
    pub camera: ([f32; 3], [f32; 3], f32),
}

/// Half the side of the cube that contains the objects.
const HALF_SIDE: f32 = 10.0;

/// Makes a scene.
pub fn scene(name: &'static str) -> Scene {
    let (shapes, camera) = match name {
        "instances" => return instances(),
        "metals" => (metals(), ([0.0, 2.2, 8.0], [0.0, 0.9, 0.0], 45.0)),
        "1k" => (spheres(1000, 0.8), ([0.0, 0.0, 32.0], [0.0; 3], 40.0)),
        "10k" => (spheres(10_000, 0.4), ([0.0, 0.0, 32.0], [0.0; 3], 40.0)),
        _ => (terrain(708), ([0.0, 9.0, 17.0], [0.0; 3], 45.0)),
    };
    let group = Group::new(shapes.iter().map(item));
    let first_instance = shapes.len() as u32;
    Scene {
        name,
        shapes: Shapes::new(&group.tree, &shapes),
        geometry: Geometry { groups: vec![group], instances: Vec::new(), first_instance },
        places: Vec::new(),
        camera,
    }
}

/// Returns the item of a shape. Spheres are one class, triangles another.
fn item(shape: &Shape) -> Item {
    Item { bounds: bounds(shape), class: shape.class() }
}

/// Makes a scene of a thousand instances of a hundred spheres.
fn instances() -> Scene {
    let mut numbers = Numbers(5);
    let shapes: Vec<Shape> = spheres(100, 2.0).iter().map(|sphere| sphere.scaled(0.1)).collect();
    let group = Group::new(shapes.iter().map(item));
    let places: Vec<[f32; 3]> =
        (0..1000).map(|_| [0; 3].map(|_| numbers.around_zero() * HALF_SIDE)).collect();
    let placed = |place: &[f32; 3]| {
        let transform = Transform::translate(place.map(f64::from));
        group.bounds().and_then(|bounds| bounds.transformed(transform))
    };
    let world = places.iter().map(|place| Item { bounds: placed(place), class: INSTANCE });
    let inverse = |place: &[f32; 3]| Transform::translate(place.map(|it| -f64::from(it))).affine();
    let instance = |place: &[f32; 3]| Instance { group: 1, inverse: inverse(place), motion: None };
    Scene {
        name: "instances",
        shapes: Shapes::new(&group.tree, &shapes),
        geometry: Geometry {
            groups: vec![Group::new(world), group.clone()],
            instances: places.iter().map(instance).collect(),
            first_instance: 0,
        },
        places,
        camera: ([0.0, 0.0, 32.0], [0.0; 3], 40.0),
    }
}

impl Scene {
    /// Returns the normal at a hit, on the side that the ray came from.
    pub fn normal(&self, id: HitId, point: [f32; 3], direction: [f32; 3]) -> [f32; 3] {
        match self.places.get(id.outer() as usize) {
            Some(place) => {
                let moved = [0, 1, 2].map(|axis| point[axis] - place[axis]);
                self.shapes.normal(id.inner(), moved, direction)
            }
            None => self.shapes.normal(id.outer(), point, direction),
        }
    }
}

/// Random numbers between 0 and 1.
pub struct Numbers(pub u64);

impl Numbers {
    /// Returns the next number.
    pub fn next(&mut self) -> f32 {
        const FACTOR: u64 = 6_364_136_223_846_793_005;
        self.0 = self.0.wrapping_mul(FACTOR).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// Returns a number between -1 and 1.
    pub fn around_zero(&mut self) -> f32 {
        2.0 * self.next() - 1.0
    }
}

fn bounds(shape: &Shape) -> Option<Bounds> {
    // Wide enough for the rounding of the tests.
    const PAD: f32 = 1e-5;
    let (min, max) = match shape {
        Shape::Sphere { center, radius } => {
            (center.map(|it| it - radius), center.map(|it| it + radius))
        }
        Shape::Triangle([a, b, c]) => {
            let least = |axis: usize| a[axis].min(b[axis]).min(c[axis]);
            let greatest = |axis: usize| a[axis].max(b[axis]).max(c[axis]);
            ([0, 1, 2].map(least), [0, 1, 2].map(greatest))
        }
    };
    let pad = |it: f32| PAD * (1.0 + it.abs());
    Bounds::new(min.map(|it| it - pad(it)), max.map(|it| it + pad(it)))
}

fn metals() -> Vec<Shape> {
    let spheres = [-2.2, 0.0, 2.2].map(|x| Shape::Sphere { center: [x, 1.0, 0.0], radius: 1.0 });
    let corner = |x: f32, z: f32| [20.0 * x, 0.0, 20.0 * z];
    let ground = [
        Shape::Triangle([corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, -1.0)]),
        Shape::Triangle([corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)]),
    ];
    spheres.into_iter().chain(ground).collect()
}

fn spheres(count: usize, largest: f32) -> Vec<Shape> {
    let mut numbers = Numbers(42);
    let sphere = |_| {
        let center = [0; 3].map(|_| numbers.around_zero() * HALF_SIDE);
        Shape::Sphere { center, radius: largest * (0.25 + 0.75 * numbers.next()) }
    };
    (0..count).map(sphere).collect()
}

fn terrain(side: u32) -> Vec<Shape> {
    let at = |index: u32| 20.0 * index as f32 / side as f32 - HALF_SIDE;
    let vertex = |x: u32, z: u32| [at(x), height(at(x), at(z)), at(z)];
    let square = |index: u32| {
        let (x, z) = (index % side, index / side);
        let [corner, right] = [vertex(x, z), vertex(x + 1, z)];
        let [below, opposite] = [vertex(x, z + 1), vertex(x + 1, z + 1)];
        [[corner, below, right], [right, below, opposite]].map(Shape::Triangle)
    };
    (0..side * side).flat_map(square).collect()
}

/// Hills of three sizes, superimposed.
#[expect(clippy::disallowed_methods, reason = "times do not depend on the last bit of a height")]
fn height(x: f32, z: f32) -> f32 {
    let hills = 1.2 * (0.9 * x).sin() * (0.7 * z).cos();
    let mounds = 0.4 * (3.1 * x + 1.0).sin() * (2.7 * z).sin();
    let bumps = 0.1 * (11.0 * x).sin() * (13.0 * z).cos();
    hills + mounds + bumps
}
