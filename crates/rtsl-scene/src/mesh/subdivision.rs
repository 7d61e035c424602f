//! Loop's subdivision surfaces: smooth surfaces that a mesh of triangles controls.
//!
//! Charles Loop, "Smooth Subdivision Surfaces Based on Triangles", 1987; weights and tangents of the limit surface from
//! Hoppe et al., "Piecewise Smooth Surface Reconstruction", SIGGRAPH 1994, as in pbrt's shape `loopsubdiv`.

use std::collections::BTreeMap;

use rtsl_math::sine_and_cosine_of_degrees;
use rtsl_memory::{Amount, InputBudget};

use super::builder::{Mesh, MeshBuilder};
use super::{MeshError, builder};

/// The memory of a face of the finest level: four 32-bit corners and neighbours each of it and of the level before,
/// half a vertex, and the edges of the level before, which are found by their ends.
const FACE: Amount = Amount(160);

/// Subdivides the triangles of `control` `levels` times, moves the vertices to the limit surface, and adds its
/// normals. Edges with one face are boundaries, on which the surface ends along a curve of their own vertices; so are
/// edges at which a third face meets two others, or faces have opposite orders of corners.
///
/// Normals point to the side from which the corners of faces appear clockwise, as in pbrt.
///
/// # Errors
/// If `control` is not a mesh, or the surface has too many faces or would take too much memory.
pub fn subdivide(
    control: MeshBuilder,
    levels: u32,
    budget: &InputBudget,
) -> Result<Mesh, MeshError> {
    // Checks the corners, which are used as indices from here on.
    let MeshBuilder { positions, indices, .. } = control.clone();
    drop(control.finish()?);
    let faces = indices.len() / 3;
    let all = 4usize.checked_pow(levels).and_then(|each| each.checked_mul(faces));
    let numbers = all.and_then(|all| all.checked_mul(3)).unwrap_or(usize::MAX);
    builder::check_size(numbers, 3, "triangles")?;
    let held = budget.hold(FACE.times(numbers / 3))?;
    let mut surface = Surface::new(&positions, &indices);
    for _ in 0..levels {
        surface = surface.subdivided();
    }
    let mesh = surface.limit().finish()?;
    held.keep(mesh.memory());
    Ok(mesh)
}

type Point = [f32; 3];

/// An absent face or vertex.
const NONE: u32 = u32::MAX;

/// Triangles with their neighbours.
struct Surface {
    points: Vec<Point>,
    /// The three vertices of each face.
    corners: Vec<[u32; 3]>,
    /// The three neighbours of each face: across the edges from the first to the second corner, from the second to the
    /// third, and from the third to the first.
    neighbours: Vec<[u32; 3]>,
    /// One of the faces of each vertex; `NONE` if it has none.
    some_face: Vec<u32>,
}

/// The vertices around a vertex.
struct Ring {
    vertices: Vec<u32>,
    /// True if the vertex is on a boundary, whose next vertices are the first and the last of the ring.
    is_open: bool,
}

impl Surface {
    fn new(positions: &[u32], indices: &[u32]) -> Surface {
        let points: Vec<Point> = positions
            .chunks_exact(3)
            .map(|bits| [0, 1, 2].map(|axis| f32::from_bits(bits[axis])))
            .collect();
        let corners: Vec<[u32; 3]> =
            indices.chunks_exact(3).map(|face| [face[0], face[1], face[2]]).collect();
        let mut some_face = vec![NONE; points.len()];
        for (face, corners) in corners.iter().enumerate() {
            corners.iter().for_each(|corner| some_face[*corner as usize] = face as u32);
        }
        let neighbours = neighbours(&corners);
        Surface { points, corners, neighbours, some_face }
    }

    /// The place of a vertex among the corners of a face.
    fn place(&self, face: u32, vertex: u32) -> usize {
        let corners = self.corners[face as usize];
        corners.iter().position(|corner| *corner == vertex).unwrap_or(0)
    }

    /// The face across the edge from `vertex` to the corner after it.
    fn next_face(&self, face: u32, vertex: u32) -> u32 {
        self.neighbours[face as usize][self.place(face, vertex)]
    }

    /// The face across the edge from the corner before `vertex`.
    fn previous_face(&self, face: u32, vertex: u32) -> u32 {
        self.neighbours[face as usize][(self.place(face, vertex) + 2) % 3]
    }

    fn ring(&self, vertex: u32) -> Ring {
        let start = self.some_face[vertex as usize];
        let after = |face: u32| self.corners[face as usize][(self.place(face, vertex) + 1) % 3];
        let before = |face: u32| self.corners[face as usize][(self.place(face, vertex) + 2) % 3];
        let mut ring = Ring { vertices: Vec::new(), is_open: false };
        if start == NONE {
            return ring;
        }
        // Each edge has one face on either side, so the walk returns to its start or ends at a boundary.
        let mut face = start;
        loop {
            ring.vertices.push(after(face));
            let next = self.next_face(face, vertex);
            if next == start {
                return ring;
            }
            if next == NONE {
                break;
            }
            face = next;
        }
        ring.is_open = true;
        ring.vertices.clear();
        ring.vertices.push(after(face));
        while face != NONE {
            ring.vertices.push(before(face));
            face = self.previous_face(face, vertex);
        }
        ring
    }

    /// The mean of a vertex and its ring, whose vertices have the weight `each`.
    fn inner_mean(&self, vertex: u32, ring: &Ring, each: f32) -> Point {
        let rest = 1.0 - ring.vertices.len() as f32 * each;
        let sum = scaled(self.points[vertex as usize], rest);
        ring.vertices.iter().fold(sum, |sum, it| added(sum, scaled(self.point(*it), each)))
    }

    /// The mean of a vertex of a boundary and the two next to it on the boundary, which have the weight `each`.
    fn boundary_mean(&self, vertex: u32, ring: &Ring, each: f32) -> Point {
        let own = scaled(self.point(vertex), 1.0 - 2.0 * each);
        let ends = [ring.vertices.first(), ring.vertices.last()];
        ends.into_iter().flatten().fold(own, |sum, it| added(sum, scaled(self.point(*it), each)))
    }

    fn point(&self, vertex: u32) -> Point {
        self.points[vertex as usize]
    }

    /// The surface with each face split into four. Vertices keep their numbers; those on edges come after them. The
    /// parts of face `f` are the faces from `4 f` on: those at its corners, and the one in the middle.
    fn subdivided(&self) -> Surface {
        let mut points = self.moved_points();
        let mut some_face: Vec<u32> = Vec::with_capacity(2 * points.len());
        for (vertex, face) in (0u32..).zip(&self.some_face) {
            let part = |face: u32| 4 * face + self.place(face, vertex) as u32;
            some_face.push(if *face == NONE { NONE } else { part(*face) });
        }
        let mut middles = vec![[NONE; 3]; self.corners.len()];
        for face in 0..self.corners.len() as u32 {
            for edge in 0..3 {
                if middles[face as usize][edge] != NONE {
                    continue;
                }
                let middle = points.len() as u32;
                middles[face as usize][edge] = middle;
                if let Some((other, place)) = self.across(face, edge) {
                    middles[other as usize][place] = middle;
                }
                points.push(self.edge_point(face, edge));
                some_face.push(4 * face + 3);
            }
        }
        let (corners, neighbours) = self.parts(&middles);
        Surface { points, corners, neighbours, some_face }
    }

    /// The vertices, moved by the rule of one subdivision.
    fn moved_points(&self) -> Vec<Point> {
        let moved = (0..self.points.len() as u32).map(|vertex| {
            let ring = self.ring(vertex);
            match (ring.vertices.len(), ring.is_open) {
                (0, _) => self.point(vertex),
                (_, true) => self.boundary_mean(vertex, &ring, 1.0 / 8.0),
                (valence, false) => self.inner_mean(vertex, &ring, inner_weight(valence)),
            }
        });
        moved.collect()
    }

    /// The neighbour across an edge, and the place of the edge in it.
    fn across(&self, face: u32, edge: usize) -> Option<(u32, usize)> {
        let other = self.neighbours[face as usize][edge];
        let end = self.corners[face as usize][(edge + 1) % 3];
        // The neighbour has the edge in the opposite direction.
        (other != NONE).then(|| (other, self.place(other, end)))
    }

    /// The vertex that subdivision adds on an edge.
    fn edge_point(&self, face: u32, edge: usize) -> Point {
        let corners = self.corners[face as usize];
        let opposite = self.point(corners[(edge + 2) % 3]);
        let ends = added(self.point(corners[edge]), self.point(corners[(edge + 1) % 3]));
        match self.across(face, edge) {
            None => scaled(ends, 0.5),
            Some((other, place)) => {
                let beyond = self.point(self.corners[other as usize][(place + 2) % 3]);
                added(scaled(ends, 3.0 / 8.0), scaled(added(opposite, beyond), 1.0 / 8.0))
            }
        }
    }

    /// Corners and neighbours of the parts of all faces.
    fn parts(&self, middles: &[[u32; 3]]) -> (Vec<[u32; 3]>, Vec<[u32; 3]>) {
        let mut corners = Vec::with_capacity(4 * self.corners.len());
        let mut neighbours = Vec::with_capacity(4 * self.corners.len());
        for (face, (old, [first, second, third])) in (0u32..).zip(self.corners.iter().zip(middles))
        {
            let own = 4 * face;
            // The part of the neighbour across an edge that is at this face's corner `at`.
            let outside = |edge: usize, at: usize| {
                let other = self.neighbours[face as usize][edge];
                if other == NONE { NONE } else { 4 * other + self.place(other, old[at]) as u32 }
            };
            corners.extend([
                [old[0], *first, *third],
                [*first, old[1], *second],
                [*third, *second, old[2]],
                [*first, *second, *third],
            ]);
            neighbours.extend([
                [outside(0, 0), own + 3, outside(2, 0)],
                [outside(0, 1), outside(1, 1), own + 3],
                [own + 3, outside(1, 2), outside(2, 2)],
                [own + 1, own + 2, own],
            ]);
        }
        (corners, neighbours)
    }

    /// The mesh with its vertices on the limit surface, and with normals.
    fn limit(&self) -> MeshBuilder {
        let rings = || (0..self.points.len() as u32).map(|vertex| (vertex, self.ring(vertex)));
        let on_limit = rings().map(|(vertex, ring)| match (ring.vertices.len(), ring.is_open) {
            (0, _) => self.point(vertex),
            (_, true) => self.boundary_mean(vertex, &ring, 1.0 / 5.0),
            (valence, false) => self.inner_mean(vertex, &ring, limit_weight(valence)),
        });
        let points: Vec<Point> = on_limit.collect();
        let mut builder = MeshBuilder::default();
        let bits = |vector: Point| vector.map(f32::to_bits);
        builder.positions = points.iter().flat_map(|point| bits(*point)).collect();
        let limit =
            Surface { points, corners: Vec::new(), neighbours: Vec::new(), some_face: Vec::new() };
        builder.normals =
            rings().flat_map(|(vertex, ring)| bits(limit.normal(vertex, &ring))).collect();
        builder.indices = self.corners.iter().flatten().copied().collect();
        builder
    }

    /// The normal at a vertex: the cross product of two tangents.
    fn normal(&self, vertex: u32, ring: &Ring) -> Point {
        let valence = ring.vertices.len();
        let weighed = |weight: &dyn Fn(usize) -> f64| {
            let points = ring.vertices.iter().enumerate();
            points.fold([0.0; 3], |sum, (index, it)| {
                added(sum, scaled(self.point(*it), weight(index) as f32))
            })
        };
        if !ring.is_open {
            let step = 360.0 / valence as f64;
            let angle = |index: usize| sine_and_cosine_of_degrees(step * index as f64);
            return cross(weighed(&|index| angle(index).1), weighed(&|index| angle(index).0));
        }
        let last = valence - 1;
        let along = weighed(&|index| match index {
            0 => -1.0,
            index if index == last => 1.0,
            _ => 0.0,
        });
        let own = self.point(vertex);
        let inward = match valence {
            2 => added(weighed(&|_| 1.0), scaled(own, -2.0)),
            3 => added(weighed(&|index| f64::from(u8::from(index == 1))), scaled(own, -1.0)),
            4 => added(weighed(&|index| [-1.0, 2.0, 2.0, -1.0][index]), scaled(own, -2.0)),
            _ => {
                let step = 180.0 / last as f64;
                let (sine, cosine) = sine_and_cosine_of_degrees(step);
                scaled(
                    weighed(&|index| {
                        if index == 0 || index == last {
                            return sine;
                        }
                        (2.0 * cosine - 2.0) * sine_and_cosine_of_degrees(step * index as f64).0
                    }),
                    -1.0,
                )
            }
        };
        cross(along, inward)
    }
}

/// The neighbours of faces. An edge joins two faces that have it in opposite directions; where more do, the first two.
fn neighbours(corners: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut neighbours = vec![[NONE; 3]; corners.len()];
    // Edges whose second face is not found yet.
    let mut open: BTreeMap<(u32, u32), (u32, usize)> = BTreeMap::new();
    for (face, corners) in (0u32..).zip(corners) {
        for edge in 0..3 {
            let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
            match open.remove(&(to, from)) {
                Some((other, place)) if other != face => {
                    neighbours[face as usize][edge] = other;
                    neighbours[other as usize][place] = face;
                }
                Some(_) | None => {
                    open.entry((from, to)).or_insert((face, edge));
                }
            }
        }
    }
    neighbours
}

/// The weight of each vertex around an inner vertex in a subdivision (Warren's).
fn inner_weight(valence: usize) -> f32 {
    match valence {
        3 => 3.0 / 16.0,
        _ => 3.0 / (8.0 * valence as f32),
    }
}

/// The same on the limit surface.
fn limit_weight(valence: usize) -> f32 {
    1.0 / (valence as f32 + 3.0 / (8.0 * inner_weight(valence)))
}

fn added(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|axis| a[axis] + b[axis])
}

fn scaled(a: Point, factor: f32) -> Point {
    a.map(|coordinate| coordinate * factor)
}

fn cross([ax, ay, az]: Point, [bx, by, bz]: Point) -> Point {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn control(positions: &[f32], indices: &[u32]) -> MeshBuilder {
        MeshBuilder {
            positions: positions.iter().map(|x| x.to_bits()).collect(),
            indices: indices.to_vec(),
            ..MeshBuilder::default()
        }
    }

    fn subdivided(
        positions: &[f32],
        indices: &[u32],
        levels: u32,
    ) -> (Vec<Point>, Vec<Point>, Mesh) {
        let mesh = subdivide(control(positions, indices), levels, &InputBudget::default()).unwrap();
        let points = |numbers: &rtsl::Numbers| -> Vec<Point> {
            let bits = numbers.words().chunks_exact(3);
            bits.map(|bits| [0, 1, 2].map(|axis| f32::from_bits(bits[axis]))).collect()
        };
        (points(&mesh.positions), points(&mesh.normals), mesh)
    }

    const OCTAHEDRON: [f32; 18] =
        [1., 0., 0., -1., 0., 0., 0., 1., 0., 0., -1., 0., 0., 0., 1., 0., 0., -1.];
    const EIGHT: [u32; 24] =
        [0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5];

    fn length(a: Point) -> f32 {
        a.iter().map(|x| x * x).sum::<f32>().sqrt()
    }

    #[test]
    fn an_octahedron_becomes_almost_a_sphere() {
        let (points, normals, mesh) = subdivided(&OCTAHEDRON, &EIGHT, 3);
        assert_eq!(mesh.triangles(), 8 * 64);
        assert_eq!(points.len(), 2 + 4 * 64);
        let radii: Vec<f32> = points.iter().map(|point| length(*point)).collect();
        let (least, most) =
            radii.iter().fold((f32::MAX, 0.0f32), |(a, b), r| (a.min(*r), b.max(*r)));
        // The weight of the ring, whose vertices cancel, is a half.
        assert_eq!(most, 0.5);
        assert!(least > 0.41, "{least}");
        for (point, normal) in points.iter().zip(&normals) {
            let cosine = (0..3).map(|axis| point[axis] * normal[axis]).sum::<f32>()
                / (length(*point) * length(*normal));
            // The corners appear counterclockwise from outside.
            assert!(cosine < -0.95, "{point:?}: {cosine}");
        }
    }

    #[test]
    fn the_limit_does_not_depend_on_the_number_of_levels() {
        let (coarse, ..) = subdivided(&OCTAHEDRON, &EIGHT, 0);
        let (fine, ..) = subdivided(&OCTAHEDRON, &EIGHT, 4);
        for (a, b) in coarse.iter().zip(&fine) {
            let difference = length(added(*a, scaled(*b, -1.0)));
            assert!(difference < 1e-5, "{a:?} and {b:?}");
        }
    }

    #[test]
    fn boundaries_are_curves_of_their_own_vertices() {
        // A square of two triangles, and one with a vertex in the middle, lifted: their boundaries are the same.
        let square = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];
        let (flat, normals, _) = subdivided(&square, &[0, 1, 2, 0, 2, 3], 2);
        assert!(flat.iter().all(|point| point[2] == 0.0));
        assert!(normals.iter().all(|normal| normal[2] < 0.0 && normal[0] == 0.0));
        let roof = [&square[..], &[0.5, 0.5, 1.0]].concat();
        let (lifted, ..) = subdivided(&roof, &[0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4], 2);
        for corner in 0..4 {
            assert_eq!(flat[corner], lifted[corner]);
        }
        assert!(lifted[4][2] > 0.3);
    }

    #[test]
    fn faces_that_do_not_fit_are_boundaries() {
        // Three faces at one edge, two of them in the same order, a face with one corner twice, a vertex without a face.
        let positions = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 1., 1., 1., 5., 5., 5.];
        let faces = [0, 1, 2, 0, 1, 3, 1, 0, 4, 2, 2, 3];
        let (points, normals, mesh) = subdivided(&positions, &faces, 3);
        assert_eq!(mesh.triangles(), 4 * 64);
        assert_eq!(points[5], [5.0; 3]);
        assert!(points.iter().chain(&normals).flatten().all(|x| x.is_finite()));
    }

    #[test]
    fn levels_without_bound_are_refused() {
        let budget = InputBudget::default();
        for levels in [12, 40, u32::MAX] {
            let error = subdivide(control(&OCTAHEDRON, &EIGHT), levels, &budget).unwrap_err();
            let text = error.to_string();
            assert!(text.contains("more than") || text.contains("memory"), "{levels}: {text}");
        }
    }
}
