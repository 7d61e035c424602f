//! Areas of shapes, by which lights have a given power.

use std::f64::consts::PI;

use rtsl::Instance;
use rtsl_math::Transform;

/// Returns the area of a shape, or the mean area of the faces of a mesh; `None` for shapes whose area is not known.
///
/// As in pbrt-v4, faces are measured in the world, and spheres, disks and cylinders in their own space.
pub fn face_area(shape: &Instance, to_world: Transform) -> Option<f64> {
    let number = |name: &str| shape.member(name)?.first().map(|it| f64::from(f32::from_bits(*it)));
    let vector = |name: &str| vector_at(shape.member(name)?, 0);
    let triangle = |corners: [[f64; 3]; 3]| triangle_area(corners.map(|it| to_world.point(it)));
    match shape.class().name.as_str() {
        "Sphere" => Some(4.0 * PI * square(number("radius")?)),
        "Disk" => Some(PI * (square(number("radius")?) - square(number("innerRadius")?))),
        "Cylinder" => {
            Some(2.0 * PI * number("radius")? * (number("yMax")? - number("yMin")?).abs())
        }
        "PartialSphere" => {
            let radius = number("radius")?;
            let [from, to] = [number("yMin")?, number("yMax")?].map(|y| y.clamp(-radius, radius));
            Some(number("sweep")?.to_radians() * radius * (to - from).abs())
        }
        "PartialDisk" => {
            let rings = square(number("radius")?) - square(number("innerRadius")?);
            Some(0.5 * number("sweep")?.to_radians() * rings)
        }
        "PartialCylinder" => {
            let height = (number("yMax")? - number("yMin")?).abs();
            Some(number("sweep")?.to_radians() * number("radius")? * height)
        }
        "Parallelogram" => {
            let (corner, u, v) = (vector("corner")?, vector("sideU")?, vector("sideV")?);
            let other = |side: [f64; 3]| std::array::from_fn(|axis| corner[axis] + side[axis]);
            Some(2.0 * triangle([corner, other(u), other(v)]))
        }
        "Triangle" => Some(triangle([vector("a")?, vector("b")?, vector("c")?])),
        "TriangleMesh" => mean_area(shape, 3, |corners| {
            Some(triangle([*corners.first()?, *corners.get(1)?, *corners.get(2)?]))
        }),
        "BilinearMesh" => mean_area(shape, 4, |corners| {
            let [a, b, c, d] = *corners else { return None };
            Some(triangle([a, b, c]) + triangle([b, d, c]))
        }),
        _ => None,
    }
}

fn square(x: f64) -> f64 {
    x * x
}

fn mean_area(
    shape: &Instance,
    corners: usize,
    area: impl Fn(&[[f64; 3]]) -> Option<f64>,
) -> Option<f64> {
    let (positions, indices) = (shape.buffer("positions")?, shape.buffer("indices")?);
    let faces = indices.chunks_exact(corners);
    let count = faces.len();
    let areas = faces.filter_map(|face| {
        let found = face.iter().map(|index| vector_at(positions, *index as usize));
        area(&found.collect::<Option<Vec<_>>>()?)
    });
    (count > 0).then(|| areas.sum::<f64>() / count as f64)
}

fn vector_at(words: &[u32], index: usize) -> Option<[f64; 3]> {
    let words = words.get(index.checked_mul(3)?..)?.first_chunk::<3>()?;
    Some(words.map(|word| f64::from(f32::from_bits(word))))
}

fn triangle_area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let side = |end: [f64; 3]| -> [f64; 3] { std::array::from_fn(|axis| end[axis] - a[axis]) };
    let (u, v) = (side(b), side(c));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    0.5 * cross.iter().map(|it| it * it).sum::<f64>().sqrt()
}
