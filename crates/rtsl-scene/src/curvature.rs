//! The attribute `curvature`: the mean curvature of a shape, for shaders that read it of shapes that do not give it.

use std::collections::HashMap;

use rtsl::{Class, Method, Numbers, Scalar, Value};

use crate::attributes::{CURVATURE, GivenAttribute, Spread, WantedAttributes};

/// The patches of a bilinear mesh have their corners in this order: two triangles.
const TRIANGLES_OF_PATCH: [[usize; 3]; 2] = [[0, 1, 3], [0, 3, 2]];
const TRIANGLE: [[usize; 3]; 1] = [[0, 1, 2]];

/// Returns the attribute for a shape of this class with these arguments: for meshes a value for each vertex, for others
/// the derivatives of normals. `None` if no shader reads it, or the class has a member of that name or no normals.
pub fn curvature_of(
    wanted: &WantedAttributes,
    class: &Class,
    arguments: &[(String, Value)],
) -> Option<GivenAttribute> {
    let is_wanted = wanted.iter().any(|(name, scalars)| name == CURVATURE && scalars == 1);
    let is_given = class.attributes.iter().any(|it| it.name == CURVATURE);
    if !is_wanted || is_given || crate::attributes::has_member(class, CURVATURE) {
        return None;
    }
    let (spread, curvatures) = match Mesh::new(class, arguments) {
        Some(mesh) => (Spread::Vertices, mesh.curvatures()),
        None if class.element().is_some() => return None,
        None => (Spread::Hits, Vec::new()),
    };
    if spread == Spread::Hits && !class.methods.contains_key(&Method::ComputeNormal) {
        return None;
    }
    let bits: Vec<u32> = curvatures.into_iter().map(f32::to_bits).collect();
    let numbers = Numbers::from_words(Scalar::F32, bits);
    Some(GivenAttribute { name: CURVATURE.to_owned(), scalars: 1, spread, numbers })
}

type Vector = [f64; 3];

/// The triangles of a mesh. Vertices at the same point are one, whatever their normals and coordinates.
struct Mesh {
    points: Vec<Vector>,
    /// The index of each vertex's point.
    point_of: Vec<usize>,
    triangles: Vec<[usize; 3]>,
    /// The sum of the normals at the corners of each triangle, whose side is outside; 0 for none.
    sides: Vec<Vector>,
}

impl Mesh {
    /// Returns the mesh that a shape of this class is, if it has positions of vertices and faces of three or four.
    fn new(class: &Class, arguments: &[(String, Value)]) -> Option<Mesh> {
        let element = class.element()?;
        let parts: &[[usize; 3]] = match element.stride {
            3 => &TRIANGLE,
            4 => &TRIANGLES_OF_PATCH,
            _ => return None,
        };
        let words = |name: &str| words_of(arguments, name);
        let (points, point_of) = merged(vectors(words("positions")?));
        let normals = words("normals").map_or_else(Vec::new, |it| vectors(it).collect());
        let mut triangles = Vec::new();
        let mut sides = Vec::new();
        for face in words(element.buffer)?.chunks_exact(element.stride as usize) {
            for part in parts {
                let corners = part.map(|corner| face[corner] as usize);
                let points = corners.map(|it| point_of.get(it).copied());
                if let [Some(a), Some(b), Some(c)] = points {
                    triangles.push([a, b, c]);
                    let normals = corners.map(|it| normals.get(it).copied().unwrap_or_default());
                    sides.push(normals.into_iter().fold([0.0; 3], sum));
                }
            }
        }
        Some(Mesh { points, point_of, triangles, sides })
    }

    /// Returns the mean curvature at each vertex, positive where the mesh is convex: the mean of the curvatures along the
    /// edges, weighted by the areas of their triangles (Taubin, "Estimating the Tensor of Curvature of a Surface from a
    /// Polyhedral Approximation", ICCV 1995, section 4).
    fn curvatures(&self) -> Vec<f32> {
        let normals = self.normals();
        let mut sums = vec![0.0; self.points.len()];
        let mut weights = vec![0.0; self.points.len()];
        for triangle in &self.triangles {
            let corners = triangle.map(|corner| self.points[corner]);
            let normal = normal_of(corners);
            let area = dot(normal, normal).sqrt();
            for (from, to) in [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)] {
                let way = difference(corners[from], corners[to]);
                let curvature = 2.0 * dot(normals[triangle[from]], way) / dot(way, way);
                if curvature.is_finite() {
                    sums[triangle[from]] += area * curvature;
                    weights[triangle[from]] += area;
                }
            }
        }
        let means = sums.into_iter().zip(weights);
        let means: Vec<f32> = means
            .map(|(sum, weight)| if weight > 0.0 { (sum / weight) as f32 } else { 0.0 })
            .collect();
        self.point_of.iter().map(|point| means[*point]).collect()
    }

    /// The unit normals of points: the means of those of the triangles around, weighted by area.
    fn normals(&self) -> Vec<Vector> {
        let mut normals = vec![[0.0; 3]; self.points.len()];
        for (triangle, side) in self.triangles.iter().zip(&self.sides) {
            let normal = normal_of(triangle.map(|corner| self.points[corner]));
            let sign = if dot(normal, *side) < 0.0 { -1.0 } else { 1.0 };
            for corner in triangle {
                normals[*corner] = sum(normals[*corner], normal.map(|it| sign * it));
            }
        }
        for normal in &mut normals {
            let length = dot(*normal, *normal).sqrt();
            *normal = normal.map(|it| if length > 0.0 { it / length } else { 0.0 });
        }
        normals
    }
}

fn words_of<'a>(arguments: &'a [(String, Value)], name: &str) -> Option<&'a [u32]> {
    arguments.iter().find_map(|(given, value)| match value {
        Value::Numbers(numbers) if given == name => Some(&numbers.words()[..]),
        _ => None,
    })
}

fn vectors(words: &[u32]) -> impl Iterator<Item = Vector> {
    let float = |word: u32| f64::from(f32::from_bits(word));
    words.chunks_exact(3).map(move |it| [float(it[0]), float(it[1]), float(it[2])])
}

/// Returns the points without those that are there already, and the index of each among them.
fn merged(vertices: impl Iterator<Item = Vector>) -> (Vec<Vector>, Vec<usize>) {
    let mut ids = HashMap::new();
    let mut points = Vec::new();
    let point_of = vertices.map(|vertex| {
        // Adding 0 makes one zero of two.
        let bits = vertex.map(|it| (it + 0.0).to_bits());
        *ids.entry(bits).or_insert_with(|| {
            points.push(vertex);
            points.len() - 1
        })
    });
    let point_of = point_of.collect();
    (points, point_of)
}

/// The normal of a triangle, as long as twice its area.
fn normal_of([a, b, c]: [Vector; 3]) -> Vector {
    let (u, v) = (difference(b, a), difference(c, a));
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn sum(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn difference(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[cfg(test)]
mod tests {
    #![expect(clippy::disallowed_methods, reason = "the expected values allow for the last bits")]

    use super::*;

    /// The mesh of a grid of points on a closed surface around the z axis, whose vertices at the seam are double.
    fn revolved(profile: impl Fn(f64) -> [f64; 2], outward: f64) -> Mesh {
        const AROUND: usize = 48;
        const ALONG: usize = 24;
        let vertex = |column: usize, row: usize| {
            let angle = std::f64::consts::TAU * column as f64 / AROUND as f64;
            let [radius, z] = profile(row as f64 / ALONG as f64);
            // The ends of a profile are on the axis.
            let radius = if radius.abs() < 1e-9 { 0.0 } else { radius };
            [radius * angle.cos(), radius * angle.sin(), z]
        };
        let at = |column: usize, row: usize| column * (ALONG + 1) + row;
        let grid = (0..=AROUND).flat_map(|column| (0..=ALONG).map(move |row| (column, row)));
        let (points, point_of) = merged(grid.map(|(column, row)| vertex(column % AROUND, row)));
        let mut triangles = Vec::new();
        for (column, row) in (0..AROUND).flat_map(|column| (0..ALONG).map(move |row| (column, row)))
        {
            let [a, b, c, d] = [
                at(column, row),
                at(column + 1, row),
                at(column + 1, row + 1),
                at(column, row + 1),
            ];
            triangles.extend([[a, b, c], [a, c, d]].map(|it| it.map(|corner| point_of[corner])));
        }
        let outside = |triangle: &[usize; 3]| {
            let [x, y, _] = triangle.iter().fold([0.0; 3], |all, it| sum(all, points[*it]));
            [outward * x, outward * y, 0.0]
        };
        let sides = triangles.iter().map(outside).collect();
        Mesh { points, point_of, triangles, sides }
    }

    #[test]
    fn balls_have_one_curvature() {
        let half_turn = std::f64::consts::PI;
        let profile = |at: f64| [2.0 * (half_turn * at).sin(), 2.0 * (half_turn * at).cos()];
        for (outward, expected) in [(1.0, 0.5), (-1.0, -0.5)] {
            let curvatures = revolved(profile, outward).curvatures();
            let ends = |curvature: &f32| (f64::from(*curvature) - expected).abs() < 0.03;
            assert!(curvatures.iter().all(ends), "{curvatures:?}");
        }
    }

    #[test]
    fn vertices_at_one_point_have_one_curvature() {
        let mesh = revolved(|at| [3.0, 20.0 * at], 1.0);
        let curvatures = mesh.curvatures();
        assert_eq!(curvatures[..25], curvatures[curvatures.len() - 25..]);
        // Tubes are bent in one direction; edges run along, around and across.
        assert!(curvatures[1..24].iter().all(|it| (0.08..0.25).contains(it)), "{curvatures:?}");
    }

    #[test]
    fn triangles_without_area_count_for_nothing() {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [f64::NAN; 3]];
        let mesh = Mesh {
            point_of: vec![0, 1, 2, 3, 0],
            points,
            triangles: vec![[0, 1, 2], [0, 0, 1], [1, 1, 1], [0, 1, 3]],
            sides: vec![[0.0; 3]; 4],
        };
        assert_eq!(mesh.curvatures(), [0.0; 5]);
    }
}
