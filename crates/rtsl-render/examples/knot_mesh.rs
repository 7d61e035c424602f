//! Writes a knotted tube as a PLY file: `scenes/knot.ply`, or meshes of any size for measurements.
//!
//!     cargo run --release --example knot_mesh -- knot.ply 192 16
//!
//! The numbers say how many rings of vertices the tube has and how many vertices each ring; twice their
//! product is the number of triangles.

use std::fs::File;
use std::io::{self, BufWriter, Write};

use rtsl_math::sine_and_cosine_of_degrees;

fn main() -> io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (Some(path), Some(rings), Some(sides)) =
        (arguments.first(), number(&arguments, 1), number(&arguments, 2))
    else {
        return Err(io::Error::other("expected a file, the rings and the vertices of a ring"));
    };
    let mut file = BufWriter::new(File::create(path)?);
    write_header(&mut file, rings, sides)?;
    for ring in 0..=rings {
        for side in 0..=sides {
            write_vertex(
                &mut file,
                f64::from(ring) / f64::from(rings),
                f64::from(side) / f64::from(sides),
            )?;
        }
    }
    for ring in 0..rings {
        for side in 0..sides {
            write_face(&mut file, ring * (sides + 1) + side, sides)?;
        }
    }
    file.flush()
}

/// A count that closes the tube.
fn number(arguments: &[String], index: usize) -> Option<u32> {
    arguments.get(index)?.parse().ok().filter(|count| (3..=10_000).contains(count))
}

fn write_header(file: &mut impl Write, rings: u32, sides: u32) -> io::Result<()> {
    writeln!(file, "ply\nformat binary_little_endian 1.0\ncomment made by the example knot_mesh")?;
    // The seams have their vertices twice, since texture coordinates differ.
    writeln!(file, "element vertex {}", (rings + 1) * (sides + 1))?;
    for property in ["x", "y", "z", "nx", "ny", "nz", "u", "v"] {
        writeln!(file, "property float {property}")?;
    }
    writeln!(file, "element face {}", rings * sides)?;
    writeln!(file, "property list uchar int vertex_indices\nend_header")
}

/// The vertex at `u` of the way along the tube and `v` of the way around it.
fn write_vertex(file: &mut impl Write, u: f64, v: f64) -> io::Result<()> {
    const RADIUS: f64 = 0.38;
    let middle = curve(u);
    let along = unit(subtract(curve(u + 1e-4), curve(u - 1e-4)));
    let side = unit(cross(along, [0.0, 0.0, 1.0]));
    let up = cross(side, along);
    let (sine, cosine) = sine_and_cosine_of_degrees(360.0 * v);
    let normal: [f64; 3] = std::array::from_fn(|axis| cosine * side[axis] + sine * up[axis]);
    let position = std::array::from_fn(|axis| middle[axis] + RADIUS * normal[axis]);
    let numbers = [position, normal].concat().into_iter().chain([24.0 * u, 4.0 * v]);
    numbers.map(|number| (number as f32).to_le_bytes()).try_for_each(|bytes| file.write_all(&bytes))
}

/// The trefoil knot.
fn curve(u: f64) -> [f64; 3] {
    let (sine3, cosine3) = sine_and_cosine_of_degrees(360.0 * 3.0 * u);
    let (sine2, cosine2) = sine_and_cosine_of_degrees(360.0 * 2.0 * u);
    let distance = 1.4 + 0.6 * cosine3;
    [distance * cosine2, distance * sine2, 0.6 * sine3]
}

/// The quadrilateral whose first corner is `first`.
fn write_face(file: &mut impl Write, first: u32, sides: u32) -> io::Result<()> {
    let next = first + sides + 1;
    file.write_all(&[4])?;
    [first, first + 1, next + 1, next]
        .iter()
        .try_for_each(|corner| file.write_all(&corner.to_le_bytes()))
}

fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().fold(0.0, |sum, x| sum + x * x).sqrt();
    v.map(|x| x / length)
}
