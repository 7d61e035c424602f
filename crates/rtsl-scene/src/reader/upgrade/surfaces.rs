//! Surfaces of earlier versions as triangles: quadrics about the z axis, and height fields.

use std::f64::consts::{PI, TAU};

use super::parameters::Parameters;

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
        (at, Some(unit(normal)))
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

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The vector of length 1 in a direction, or the z axis if there is none.
pub fn unit(vector: [f64; 3]) -> [f64; 3] {
    let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
    if length > 0.0 { vector.map(|part| part / length) } else { [0.0, 0.0, 1.0] }
}
