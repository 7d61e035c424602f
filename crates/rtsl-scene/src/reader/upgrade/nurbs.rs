//! Patches of rational B-splines as triangles.

use super::parameters::Parameters;
use super::surfaces::{NO_NORMAL, Surface, grid};
use crate::vector::{cross, unit};

/// The number of cells along each side, as in earlier versions.
const CELLS: usize = 29;

/// The greatest order, and the greatest number of control points along a side.
const MAX_ORDER: f64 = 16.0;
const MAX_POINTS: f64 = 4096.0;

/// One of the two directions of a patch.
struct Axis {
    points: usize,
    order: usize,
    knots: Vec<f64>,
    range: [f64; 2],
}

impl Axis {
    fn read(parameters: &Parameters<'_>, letter: char) -> Option<Self> {
        let name = |text: &str| text.replace('*', &letter.to_string());
        let whole = |text: &str, least: f64, greatest: f64| {
            let number = parameters.number(&name(text))?;
            let fits = (least..=greatest).contains(&number) && number.fract() == 0.0;
            fits.then_some(number as usize)
        };
        let order = whole("*order", 2.0, MAX_ORDER)?;
        let points = whole("n*", order as f64, MAX_POINTS)?;
        let knots = parameters.numbers(&name("*knots"))?.to_vec();
        let rises = knots.is_sorted() && knots.iter().all(|it| it.is_finite());
        if knots.len() != points + order || !rises {
            return None;
        }
        let [first, last] = [knots[order - 1], knots[points]];
        let range = [
            parameters.number(&name("*0")).unwrap_or(first).clamp(first, last),
            parameters.number(&name("*1")).unwrap_or(last).clamp(first, last),
        ];
        (range[0] < range[1]).then_some(Axis { points, order, knots, range })
    }

    /// The parameter at a part of the range.
    fn at(&self, part: f64) -> f64 {
        self.range[0] + part * (self.range[1] - self.range[0])
    }

    /// The first control point that has an effect at `t`, and the weights of as many as the order, with their
    /// derivatives.
    fn weights(&self, t: f64) -> (usize, Vec<[f64; 2]>) {
        let (order, knots) = (self.order, &self.knots);
        let last = self.points - 1;
        let span =
            (order - 1..=last).rev().find(|at| knots[*at] <= t && knots[*at] < knots[at + 1]);
        let span = span.unwrap_or(order - 1);
        let lower = basis(knots, span, order - 1, t);
        let full = basis(knots, span, order, t);
        let degree = (order - 1) as f64;
        let first = span + 1 - order;
        let derivative = |index: usize| {
            let part = |at: usize, weight: Option<&f64>| {
                let width = knots[at + order - 1] - knots[at];
                weight.filter(|_| width > 0.0).map_or(0.0, |weight| weight / width)
            };
            let at = first + index;
            let before = index.checked_sub(1).and_then(|it| lower.get(it));
            degree * (part(at, before) - part(at + 1, lower.get(index)))
        };
        (first, (0..order).map(|index| [full[index], derivative(index)]).collect())
    }
}

/// The B-splines of an order that are not 0 between the knots `span` and `span + 1`, at `t`.
fn basis(knots: &[f64], span: usize, order: usize, t: f64) -> Vec<f64> {
    let mut values = vec![1.0];
    for degree in 1..order {
        let mut next = vec![0.0; degree + 1];
        for (index, value) in values.iter().enumerate() {
            let start = span + 1 + index - degree;
            let width = knots[start + degree] - knots[start];
            let part = if width > 0.0 { (t - knots[start]) / width } else { 0.0 };
            next[index] += (1.0 - part) * value;
            next[index + 1] += part * value;
        }
        values = next;
    }
    values
}

/// The triangles of a patch; `None` if its parameters are not those of one.
pub fn patch(parameters: &mut Parameters<'_>) -> Option<Surface> {
    let (u, v) = (Axis::read(parameters, 'u')?, Axis::read(parameters, 'v')?);
    let (each, points) = match (parameters.numbers("P"), parameters.numbers("Pw")) {
        (Some(points), _) => (3, points),
        (None, Some(points)) => (4, points),
        (None, None) => return None,
    };
    if points.len() != each * u.points * v.points {
        return None;
    }
    // Homogeneous coordinates, whose fourth one is 1 where it is not given.
    let control = |row: usize, column: usize| -> [f64; 4] {
        let at = each * (row * u.points + column);
        std::array::from_fn(|part| if part < each { points[at + part] } else { 1.0 })
    };
    let mut surface = grid([CELLS, CELLS], |across, along| {
        let (left, columns) = u.weights(u.at(across));
        let (bottom, rows) = v.weights(v.at(along));
        // The point, and its derivatives by u and v.
        let mut sums = [[0.0; 4]; 3];
        for (row, [weight_v, slope_v]) in rows.iter().enumerate() {
            for (column, [weight_u, slope_u]) in columns.iter().enumerate() {
                let point = control(bottom + row, left + column);
                let weights = [weight_u * weight_v, slope_u * weight_v, weight_u * slope_v];
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    (0..4).for_each(|part| sum[part] += weight * point[part]);
                }
            }
        }
        let [sum, by_u, by_v] = sums;
        let position = [0, 1, 2].map(|axis| sum[axis] / sum[3]);
        let slope =
            |by: [f64; 4]| [0, 1, 2].map(|axis| (by[axis] - position[axis] * by[3]) / sum[3]);
        (position, Some(unit(cross(slope(by_u), slope(by_v))).unwrap_or(NO_NORMAL)))
    });
    // Texture coordinates are those of the knots.
    for pair in surface.uvs.chunks_exact_mut(2) {
        (pair[0], pair[1]) = (u.at(pair[0]), v.at(pair[1]));
    }
    if surface.positions.iter().any(|it| !it.is_finite()) {
        return None;
    }
    let names = ["nu", "nv", "uorder", "vorder", "uknots", "vknots", "u0", "v0", "u1", "v1"];
    parameters.remove(&names);
    parameters.remove(&["P", "Pw"]);
    Some(surface)
}

#[cfg(test)]
mod tests {
    use rtsl::{FileId, Span};

    use super::*;
    use crate::reader::parameter::Parameter;

    /// A quarter of a cylinder of radius 1 about the z axis, from 0 to 1, by rational curves.
    fn quarter(change: impl Fn(&mut Parameters<'_>)) -> Option<Surface> {
        let w = 0.5_f64.sqrt();
        let row = |z: f64| [1.0, 0.0, z, 1.0, w, w, z * w, w, 0.0, 1.0, z, 1.0];
        let mut list: Vec<Parameter> = Vec::new();
        let mut parameters = Parameters::new(&mut list, Span::new(FileId(0), 0, 0));
        for (name, number) in [("nu", 3.0), ("uorder", 3.0), ("nv", 2.0), ("vorder", 2.0)] {
            parameters.set_number(name, number);
        }
        parameters.set_points("uknots", 1, vec![0.0, 0.0, 0.0, 2.0, 2.0, 2.0]);
        parameters.set_points("vknots", 1, vec![0.0, 0.0, 1.0, 1.0]);
        parameters.set_points("Pw", 4, [row(0.0), row(1.0)].concat());
        change(&mut parameters);
        patch(&mut parameters)
    }

    #[test]
    fn rational_curves_are_circles() {
        let surface = quarter(|_| {}).unwrap();
        let (points, _) = surface.positions.as_chunks::<3>();
        let (normals, _) = surface.normals.as_chunks::<3>();
        assert_eq!(points.len(), (CELLS + 1) * (CELLS + 1));
        for (point, normal) in points.iter().zip(normals) {
            let [x, y, _] = point;
            assert!((x * x + y * y - 1.0).abs() < 1e-12, "{point:?}");
            // Outwards, as u leads around the axis and v along it.
            assert!((point[0] * normal[0] + point[1] * normal[1] - 1.0).abs() < 1e-9, "{normal:?}");
        }
        assert_eq!(points[0], [1.0, 0.0, 0.0]);
        let last = points[points.len() - 1];
        assert!(last[0].abs() < 1e-12 && last[2] == 1.0, "{last:?}");
        assert_eq!(surface.uvs[surface.uvs.len() - 2..], [2.0, 1.0]);
    }

    #[test]
    fn a_part_of_the_knots_is_a_part_of_the_patch() {
        let surface = quarter(|it| it.set_number("v1", 0.25)).unwrap();
        let (points, _) = surface.positions.as_chunks::<3>();
        assert_eq!(points[points.len() - 1][2], 0.25);
    }

    #[test]
    fn what_is_no_patch_is_none() {
        let cases: [fn(&mut Parameters<'_>); 7] = [
            |it| it.set_number("nu", 4.0),
            |it| it.set_number("uorder", 1.0),
            |it| it.set_number("nv", 1e9),
            |it| it.set_number("vorder", 1.5),
            |it| it.set_points("uknots", 1, vec![0.0, 0.0, 3.0, 2.0, 2.0, 2.0]),
            |it| it.set_points("uknots", 1, vec![1.0; 6]),
            |it| it.remove(&["Pw"]),
        ];
        for case in cases {
            assert!(quarter(case).is_none());
        }
    }
}
