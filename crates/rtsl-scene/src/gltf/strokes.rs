//! Points and lines as small bodies, whose size the file does not tell.

use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::Checked;

use crate::mesh::MeshError;
use crate::mesh::gltf::{GltfFile, listed};
use crate::vector::{cross, unit};

/// The points or lines of a primitive, as its vertices.
#[derive(Clone, Debug)]
pub enum Strokes {
    Points(Vec<u32>),
    Segments(Vec<[u32; 2]>),
}

/// The bodies of points and lines.
pub struct Bodies {
    pub positions: Vec<[f32; 3]>,
    /// The vertex of the points or lines to which each vertex belongs.
    pub vertices: Vec<u32>,
    pub corners: Vec<u32>,
}

/// The radius of bodies, as a part of the box around all of them.
const PART: f64 = 0.004;

/// The corners of a tetrahedron.
const TETRAHEDRON: [[f64; 3]; 4] =
    [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];

/// The faces of a tetrahedron, and of a prism with three sides, without its ends.
const FACES: [[u32; 3]; 4] = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
const SIDES: [[u32; 3]; 6] = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]];

impl Strokes {
    /// Reads the points or lines of a primitive.
    ///
    /// # Errors
    /// If its indices are invalid.
    pub fn read(
        file: &GltfFile<'_>,
        primitive: &Primitive,
        vertices: usize,
    ) -> Result<Self, MeshError> {
        let listed = listed(file, primitive, vertices)?;
        let pairs = || listed.windows(2).map(|pair| [pair[0], pair[1]]);
        Ok(match primitive.mode {
            Checked::Valid(Mode::Lines) => {
                Strokes::Segments(listed.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
            }
            Checked::Valid(Mode::LineStrip) => Strokes::Segments(pairs().collect()),
            Checked::Valid(Mode::LineLoop) => {
                let closing =
                    listed.last().zip(listed.first()).map(|(last, first)| [*last, *first]);
                Strokes::Segments(pairs().chain(closing).collect())
            }
            _ => Strokes::Points(listed),
        })
    }

    /// The vertices of their bodies.
    pub fn vertices(&self) -> usize {
        match self {
            Strokes::Points(points) => points.len().saturating_mul(4),
            Strokes::Segments(segments) => segments.len().saturating_mul(6),
        }
    }

    /// The corners of their triangles.
    pub fn corners(&self) -> usize {
        self.vertices().saturating_mul(3)
    }

    /// Makes their bodies.
    pub fn bodies(&self, positions: &[[f32; 3]]) -> Bodies {
        let radius = PART * extent(positions);
        let mut bodies = Bodies {
            positions: Vec::with_capacity(self.vertices()),
            vertices: Vec::with_capacity(self.vertices()),
            corners: Vec::with_capacity(self.corners()),
        };
        let place = |vertex: u32| positions[vertex as usize].map(f64::from);
        match self {
            Strokes::Points(points) => {
                for point in points {
                    let center = place(*point);
                    let corners = TETRAHEDRON.map(|corner| (*point, along(center, corner, radius)));
                    bodies.add(&corners, &FACES);
                }
            }
            Strokes::Segments(segments) => {
                for [from, to] in segments {
                    let (start, end) = (place(*from), place(*to));
                    let Some([first, second]) = across(start, end) else { continue };
                    // A triangle of this radius around the line.
                    let third: [f64; 3] = std::array::from_fn(|axis| -first[axis] - second[axis]);
                    let corner = |vertex: u32, middle, way| (vertex, along(middle, way, radius));
                    let [a, b, c] = [first, second, third];
                    let ends = [
                        corner(*from, start, a),
                        corner(*from, start, b),
                        corner(*from, start, c),
                        corner(*to, end, a),
                        corner(*to, end, b),
                        corner(*to, end, c),
                    ];
                    bodies.add(&ends, &SIDES);
                }
            }
        }
        bodies
    }
}

impl Bodies {
    fn add(&mut self, vertices: &[(u32, [f32; 3])], faces: &[[u32; 3]]) {
        let first = self.positions.len() as u32;
        for (vertex, position) in vertices {
            self.positions.push(*position);
            self.vertices.push(*vertex);
        }
        self.corners.extend(faces.iter().flatten().map(|corner| first + corner));
    }
}

/// Half of the diagonal of the box around points; 1 if they are one.
fn extent(positions: &[[f32; 3]]) -> f64 {
    let square: f64 = (0..3)
        .map(|axis| {
            let numbers = positions.iter().map(|it| f64::from(it[axis]));
            let (least, greatest) = numbers
                .fold((f64::INFINITY, f64::NEG_INFINITY), |range, it| {
                    (range.0.min(it), range.1.max(it))
                });
            (greatest - least) * (greatest - least)
        })
        .sum();
    if square > 0.0 { 0.5 * square.sqrt() } else { 1.0 }
}

fn along(start: [f64; 3], way: [f64; 3], distance: f64) -> [f32; 3] {
    std::array::from_fn(|axis| (start[axis] + distance * way[axis]) as f32)
}

/// Two unit vectors across a line that are a third of a turn apart; `None` if it has no length.
fn across(start: [f64; 3], end: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let way = unit(std::array::from_fn(|axis| end[axis] - start[axis]))?;
    let other = if way[0].abs() < 0.5 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let first = unit(cross(way, other))?;
    let side = cross(way, first);
    const COSINE: f64 = -0.5;
    const SINE: f64 = 0.866_025_403_784_438_6;
    let second = std::array::from_fn(|axis| COSINE * first[axis] + SINE * side[axis]);
    Some([first, second])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the volume that faces enclose; positive if they face outwards.
    fn volume(bodies: &Bodies) -> f64 {
        let corner = |index: u32| bodies.positions[index as usize].map(f64::from);
        let faces = bodies.corners.chunks_exact(3);
        faces
            .map(|face| {
                let [a, b, c] = [corner(face[0]), corner(face[1]), corner(face[2])];
                let normal = cross(b, c);
                (0..3).map(|axis| a[axis] * normal[axis]).sum::<f64>()
            })
            .sum()
    }

    #[test]
    fn bodies_face_outwards_around_their_strokes() {
        let positions = [[0.0, 0.0, 0.0], [0.0, 0.0, 10.0]];
        let points = Strokes::Points(vec![0]).bodies(&positions);
        assert!(volume(&points) > 0.0);
        let lines = Strokes::Segments(vec![[0, 1], [1, 1]]);
        let bodies = lines.bodies(&positions);
        // A line without length has no body.
        assert_eq!((bodies.vertices.len(), lines.vertices()), (6, 12));
        assert_eq!(bodies.vertices, [0, 0, 0, 1, 1, 1]);
        assert!(volume(&bodies) > 0.0);
        let radius = PART * 5.0;
        for [x, y, _] in &bodies.positions {
            assert!((f64::from(x * x + y * y).sqrt() - radius).abs() < 1e-6);
        }
    }
}
