//! Surfaces of earlier versions as triangles: quadrics about the z axis, and height fields.

use std::f64::consts::{PI, TAU};

use super::parameters::Parameters;
use crate::vector::{cross, unit};

/// A mesh of triangles.
#[derive(Debug, PartialEq)]
pub struct Surface {
    pub positions: Vec<f64>,
    /// None if they are those of the triangles.
    pub normals: Vec<f64>,
    pub uvs: Vec<f64>,
    pub indices: Vec<f64>,
}

/// The number of parts of a full turn, of a profile that is straight, and of one that is not.
const AROUND: usize = 96;
const STRAIGHT: usize = 8;
const CURVED: usize = 32;

/// The greatest number of points of a height field's side.
const MAX_SIDE: f64 = 16_384.0;

pub fn cone(parameters: &Parameters<'_>) -> Option<Surface> {
    let radius = parameters.number("radius").unwrap_or(1.0);
    let height = parameters.number("height").unwrap_or(1.0);
    let point = |v: f64| [radius * (1.0 - v), 0.0, height * v];
    let slope = |_: f64| [-radius, 0.0, height];
    Some(revolved(parameters, STRAIGHT, point, slope))
}

pub fn paraboloid(parameters: &Parameters<'_>) -> Option<Surface> {
    let radius = parameters.number("radius").unwrap_or(1.0);
    let ends = [parameters.number("zmin").unwrap_or(0.0), parameters.number("zmax").unwrap_or(1.0)];
    let (low, high) = (ends[0].min(ends[1]).max(0.0), ends[0].max(ends[1]));
    if high <= 0.0 {
        return None;
    }
    let z = move |v: f64| low + v * (high - low);
    let point = move |v: f64| [radius * (z(v) / high).sqrt(), 0.0, z(v)];
    // Scaled by the radius at the point, which is 0 at the tip.
    let slope = move |v: f64| [radius * radius / (2.0 * high), 0.0, point(v)[0]];
    Some(revolved(parameters, CURVED, point, slope))
}

pub fn hyperboloid(parameters: &Parameters<'_>) -> Option<Surface> {
    let point_of = |name: &str, otherwise: [f64; 3]| match parameters.numbers(name) {
        Some([x, y, z]) => [*x, *y, *z],
        _ => otherwise,
    };
    let mut first = point_of("p1", [0.0, 0.0, 0.0]);
    let mut second = point_of("p2", [1.0, 1.0, 1.0]);
    if second[2] == 0.0 {
        std::mem::swap(&mut first, &mut second);
    }
    let line = [0, 1, 2].map(|axis| second[axis] - first[axis]);
    let point = move |v: f64| [0, 1, 2].map(|axis| first[axis] + v * line[axis]);
    Some(revolved(parameters, CURVED, point, move |_| line))
}

/// The surface that a profile leaves when it turns about the z axis. `slope` is the derivative of the profile.
fn revolved(
    parameters: &Parameters<'_>,
    along: usize,
    point: impl Fn(f64) -> [f64; 3],
    slope: impl Fn(f64) -> [f64; 3],
) -> Surface {
    let sweep = parameters.number("phimax").unwrap_or(360.0).clamp(0.0, 360.0) / 360.0 * TAU;
    let across = ((AROUND as f64 * sweep / TAU).ceil() as usize).max(1);
    grid([across, along], |u, v| {
        let turned = |it: [f64; 3]| {
            let (sine, cosine) = rtsl_math::sine_and_cosine_of_degrees(u * sweep * 180.0 / PI);
            [it[0] * cosine - it[1] * sine, it[0] * sine + it[1] * cosine, it[2]]
        };
        let at = turned(point(v));
        // On the axis the direction around it is that of a point beside it.
        let beside = if at[0] == 0.0 && at[1] == 0.0 { turned([1.0, 0.0, 0.0]) } else { at };
        let normal = cross([-beside[1], beside[0], 0.0], turned(slope(v)));
        (at, Some(unit(normal).unwrap_or(NO_NORMAL)))
    })
}

/// A grid of points over the unit square, by functions of two coordinates.
pub fn grid(
    [across, along]: [usize; 2],
    point: impl Fn(f64, f64) -> ([f64; 3], Option<[f64; 3]>),
) -> Surface {
    let mut surface = Surface {
        positions: Vec::new(),
        normals: Vec::new(),
        uvs: Vec::new(),
        indices: Vec::new(),
    };
    for row in 0..=along {
        for column in 0..=across {
            let (u, v) = (column as f64 / across as f64, row as f64 / along as f64);
            let (position, normal) = point(u, v);
            surface.positions.extend(position);
            surface.normals.extend(normal.into_iter().flatten());
            surface.uvs.extend([u, v]);
        }
    }
    surface.indices = triangles(across, along);
    surface
}

/// The two triangles of each cell of a grid.
fn triangles(across: usize, along: usize) -> Vec<f64> {
    let mut indices = Vec::with_capacity(6 * across * along);
    for row in 0..along {
        for column in 0..across {
            let at = (row * (across + 1) + column) as f64;
            let above = at + across as f64 + 1.0;
            indices.extend([at, at + 1.0, above + 1.0, at, above + 1.0, above]);
        }
    }
    indices
}

/// A grid of heights over the unit square.
pub fn height_field(parameters: &mut Parameters<'_>) -> Option<Surface> {
    let side = |name: &str| {
        parameters.number(name).filter(|it| (2.0..=MAX_SIDE).contains(it)).map(|it| it as usize)
    };
    let (across, along) = (side("nu")?, side("nv")?);
    let heights = parameters.numbers("Pz")?;
    if heights.len() != across.checked_mul(along)? {
        return None;
    }
    let [columns, rows] = [across - 1, along - 1];
    let place = |part: f64, cells: usize| (part * cells as f64).round() as usize;
    let surface = grid([columns, rows], |u, v| {
        let height = heights[place(v, rows) * across + place(u, columns)];
        ([u, v, height], None)
    });
    parameters.remove(&["nu", "nv", "Pz"]);
    Some(surface)
}

/// The normal of a surface that has none at a place.
pub const NO_NORMAL: [f64; 3] = [0.0, 0.0, 1.0];

#[cfg(test)]
mod tests {
    use rtsl::{FileId, Span};

    use super::*;
    use crate::reader::parameter::Parameter;

    /// A surface with parameters of one number or one point each.
    fn made(
        make: impl Fn(&mut Parameters<'_>) -> Option<Surface>,
        given: &[(&str, &[f64])],
    ) -> Option<Surface> {
        let mut list: Vec<Parameter> = Vec::new();
        let mut parameters = Parameters::new(&mut list, Span::new(FileId(0), 0, 0));
        for (name, values) in given {
            match values.len() {
                1 => parameters.set_number(name, values[0]),
                3 => parameters.set_points(name, 3, values.to_vec()),
                _ => parameters.set_points(name, 1, values.to_vec()),
            }
        }
        make(&mut parameters)
    }

    /// Checks that all points have a value of 0, and that normals are those of the triangles around them.
    fn check(surface: &Surface, value: impl Fn([f64; 3]) -> f64) {
        let (points, _) = surface.positions.as_chunks::<3>();
        let (normals, _) = surface.normals.as_chunks::<3>();
        assert_eq!((points.len(), 2 * points.len()), (normals.len(), surface.uvs.len()));
        for (point, normal) in points.iter().zip(normals) {
            assert!(value(*point).abs() < 1e-9, "{point:?}");
            assert!((normal.iter().map(|it| it * it).sum::<f64>() - 1.0).abs() < 1e-9);
        }
        let (triangles, _) = surface.indices.as_chunks::<3>();
        for corners in triangles {
            let [a, b, c] = corners.map(|it| points[it as usize]);
            let edge = |to: [f64; 3]| [0, 1, 2].map(|axis| to[axis] - a[axis]);
            let across = cross(edge(b), edge(c));
            // The two corners of a tip are one point.
            if across.iter().all(|it| it.abs() < 1e-9) {
                continue;
            }
            let along: f64 = (0..3)
                .map(|axis| {
                    unit(across).unwrap_or(NO_NORMAL)[axis] * normals[corners[0] as usize][axis]
                })
                .sum();
            assert!(along > 0.9, "{corners:?}: {along}");
        }
    }

    #[test]
    fn quadrics_have_points_of_their_equations() {
        let surface = made(|it| cone(it), &[("radius", &[2.0]), ("height", &[3.0])]).unwrap();
        check(&surface, |[x, y, z]| (x * x + y * y).sqrt() - 2.0 * (1.0 - z / 3.0));
        let given: [(&str, &[f64]); 3] = [("radius", &[0.5]), ("zmin", &[0.3]), ("zmax", &[1.5])];
        let surface = made(|it| paraboloid(it), &given).unwrap();
        check(&surface, |[x, y, z]| z - 1.5 * (x * x + y * y) / 0.25);
        let surface = made(|it| paraboloid(it), &[]).unwrap();
        assert_eq!(surface.positions[..3], [0.0; 3]);
        // The line from (1, 0, 0) to (1, 1, 1) turns to x^2 + y^2 = 1 + z^2.
        let given: [(&str, &[f64]); 2] = [("p1", &[1.0, 1.0, 1.0]), ("p2", &[1.0, 0.0, 0.0])];
        let surface = made(|it| hyperboloid(it), &given).unwrap();
        check(&surface, |[x, y, z]| x * x + y * y - 1.0 - z * z);
        assert_eq!(surface.positions[..3], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn a_part_of_a_turn_has_fewer_triangles() {
        let surface = made(|it| cone(it), &[("phimax", &[90.0])]).unwrap();
        assert_eq!(surface.indices.len(), 6 * 24 * STRAIGHT);
        let (points, _) = surface.positions.as_chunks::<3>();
        assert!(points.iter().all(|[x, y, _]| *x > -1e-9 && *y > -1e-9));
        assert!(made(|it| cone(it), &[("phimax", &[0.0])]).is_some());
    }

    #[test]
    fn fields_have_a_height_for_each_point() {
        let heights: [f64; 6] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let field = |nu: f64, nv: f64| {
            made(height_field, &[("nu", &[nu]), ("nv", &[nv]), ("Pz", &heights)])
        };
        let surface = field(2.0, 3.0).unwrap();
        assert_eq!(surface.positions[12..], [0.0, 1.0, 4.0, 1.0, 1.0, 5.0]);
        assert!(surface.normals.is_empty());
        for [nu, nv] in [[3.0, 3.0], [1.0, 6.0], [-2.0, -3.0], [1e9, 1e9], [f64::NAN, 2.0]] {
            assert!(field(nu, nv).is_none(), "{nu} {nv}");
        }
    }
}
