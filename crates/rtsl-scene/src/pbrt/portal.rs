//! Skies that are seen through a window, as values of the class `PortalSky`: the sky over the angles from the window's
//! normal, and sums of its light.
//!
//! Angles are those of `libm`, so that all numbers have the same bits everywhere.

use std::f64::consts::PI;

use rtsl::{Diagnostic, Numbers, Value, diagnostic_codes as codes};
use rtsl_image::Mipmap;
use rtsl_math::Transform;

use super::image_lights::{gain, has_file, illuminance_of};
use super::images::{Images, Use};
use crate::description::Entity;
use crate::reader::{Parameter, SceneFiles, Values};
use crate::vector::{cross, difference, dot, unit};

/// The parameter with the corners of the window.
const PORTAL: &str = "portal";

/// The parameters of the format that are read here.
pub const PARAMETERS: &[&str] = &["filename", "illuminance", PORTAL];

/// The greatest number of columns and of rows of the sums.
const MAX_CELLS: usize = 256;

/// The part of all light by which every cell counts as brighter than it is, so that sums of few dark cells are exact
/// enough.
const LEAST_LIGHT: f64 = 0.05;

/// The greatest cosine between neighbouring sides, and the greatest difference from 1 of that between opposite ones, as
/// in pbrt-v4.
const TOLERANCE: f64 = 1e-3;

/// The arguments of the class for a sky with a portal.
pub fn sky(
    entity: &Entity,
    files: SceneFiles<'_>,
    images: &mut Images,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    let window = Window::of(entity)?;
    let image = match has_file(entity) {
        true => Some(images.of(entity, files, Use::Sky)?),
        false => None,
    };
    let illuminance = entity.number("illuminance").filter(|it| *it > 0.0);
    let image = image.as_ref().map(|converted| &converted.image);
    let mut values = window.values(&Sky::new(image));
    if let Some(illuminance) = illuminance {
        values.push(gain(illuminance, image.map_or(PI, illuminance_of)));
    }
    Ok(values)
}

/// A rectangle in the light's space.
struct Window {
    corner: [f64; 3],
    side1: [f64; 3],
    side2: [f64; 3],
    /// The directions of the sides, and the normal.
    axes: [[f64; 3]; 3],
}

impl Window {
    fn of(entity: &Entity) -> Result<Window, Box<Diagnostic>> {
        let parameter = entity.parameter(PORTAL);
        let wrong = |parameter: &Parameter, message: &str| {
            let diagnostic = Diagnostic::new(codes::WRONG_VALUE, format!("`{PORTAL}` {message}"));
            Box::new(diagnostic.at(parameter.values_span, ""))
        };
        let Some(parameter) = parameter else {
            let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, "a portal has no corners");
            return Err(Box::new(diagnostic.at(entity.class_span, "")));
        };
        let numbers = match &parameter.values {
            Values::Numbers(numbers) if numbers.len() == 12 => numbers,
            _ => return Err(wrong(parameter, "takes four points")),
        };
        // The corners are in world space.
        let to_light = entity.transform.inverse().unwrap_or(Transform::IDENTITY);
        let point = |index: usize| [0, 1, 2].map(|axis| numbers[3 * index + axis]);
        let [p0, p1, p2, p3] = [0, 1, 2, 3].map(|index| to_light.point(point(index)));
        let sides = [(p0, p1), (p1, p2), (p3, p2), (p0, p3)];
        let [Some(p01), Some(p12), Some(p32), Some(p03)] =
            sides.map(|(from, to)| unit(difference(to, from)))
        else {
            return Err(wrong(parameter, "is not a rectangle"));
        };
        let is_parallel = |one, other| (dot(one, other) - 1.0).abs() <= TOLERANCE;
        if !is_parallel(p01, p32) || !is_parallel(p12, p03) || dot(p01, p12).abs() > TOLERANCE {
            return Err(wrong(parameter, "is not a rectangle"));
        }
        Ok(Window {
            corner: p0,
            side1: difference(p3, p0),
            side2: difference(p1, p0),
            axes: [p03, p01, cross(p03, p01)],
        })
    }

    fn values(&self, sky: &Sky) -> Vec<(String, Value)> {
        let side = sky.resolution();
        // The middle of a texel as an angle from the normal, and its tangent.
        let slope = |at: usize| libm::tan(PI * ((at as f64 + 0.5) / side as f64 - 0.5));
        let slopes: Vec<f64> = (0..side).map(slope).collect();
        let cells = side.min(MAX_CELLS);
        let mut light = vec![0.0; cells * cells];
        let mut texels = Vec::with_capacity(3 * side * side);
        for (row, down) in slopes.iter().enumerate() {
            for (column, across) in slopes.iter().enumerate() {
                let length = (across * across + down * down + 1.0).sqrt();
                let local = [across / length, down / length, 1.0 / length];
                let direction = [0, 1, 2].map(|axis| {
                    (0..3).map(|part| local[part] * self.axes[part][axis]).sum::<f64>()
                });
                let color = sky.radiance(direction);
                texels.extend(color.map(|channel| channel as f32));
                let solid_angle =
                    (1.0 - local[0] * local[0]) * (1.0 - local[1] * local[1]) / local[2];
                let cell = (row * cells / side) * cells + column * cells / side;
                light[cell] += color.iter().sum::<f64>() * solid_angle;
            }
        }
        let numbers = |numbers: [f64; 3]| {
            Value::List(numbers.map(|number| Value::Float(number as f32)).to_vec())
        };
        let pair = |count: usize| Value::List(vec![Value::Int(count as i32); 2]);
        [
            ("texels", Value::Numbers(Numbers::floats(texels))),
            ("size", pair(side)),
            ("sums", Value::Numbers(Numbers::floats(sums(&light, cells)))),
            ("cells", pair(cells)),
            ("corner", numbers(self.corner)),
            ("side1", numbers(self.side1)),
            ("side2", numbers(self.side2)),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .to_vec()
    }
}

/// The sums of the light of all cells of lower columns and rows, at the corners of cells, of which the last is 1.
fn sums(light: &[f64], cells: usize) -> Vec<f32> {
    let mean = light.iter().sum::<f64>() / light.len() as f64;
    let least = if mean > 0.0 { LEAST_LIGHT * mean } else { 1.0 };
    let all = (mean + least) * light.len() as f64;
    let mut above = vec![0.0; cells + 1];
    let mut sums = vec![0.0; cells + 1];
    for row in light.chunks_exact(cells) {
        let mut sum = 0.0;
        for (column, light) in row.iter().enumerate() {
            sum += (light + least) / all;
            above[column + 1] += sum;
        }
        sums.extend(above.iter().map(|sum| *sum as f32));
    }
    sums
}

/// The radiance from all directions in the light's space.
struct Sky {
    /// Columns and rows; a sky without an image has one texel.
    size: [usize; 2],
    colors: Vec<[f32; 3]>,
}

impl Sky {
    fn new(image: Option<&Mipmap>) -> Sky {
        match image {
            Some(image) => {
                Sky { size: [image.width, image.height], colors: image.colors().collect() }
            }
            None => Sky { size: [1, 1], colors: vec![[1.0; 3]] },
        }
    }

    fn resolution(&self) -> usize {
        self.size[1]
    }

    /// The radiance in a direction, between the four nearest texels.
    fn radiance(&self, direction: [f64; 3]) -> [f64; 3] {
        let [width, height] = self.size;
        let is_octahedral = width == height;
        let [u, v] = if is_octahedral { to_square(direction) } else { to_latitudes(direction) };
        let (x, y) = (u * width as f64 - 0.5, v * height as f64 - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (right_part, bottom_part) = (x - left, y - top);
        let mut sum = [0.0; 3];
        for (column, row, weight) in [
            (0, 0, (1.0 - right_part) * (1.0 - bottom_part)),
            (1, 0, right_part * (1.0 - bottom_part)),
            (0, 1, (1.0 - right_part) * bottom_part),
            (1, 1, right_part * bottom_part),
        ] {
            let at = [left as i64 + column, top as i64 + row];
            let [column, row] =
                if is_octahedral { folded(at, width as i64) } else { self.wrapped(at) };
            let color = self.colors[row * width + column];
            sum.iter_mut().zip(color).for_each(|(sum, it)| *sum += weight * f64::from(it));
        }
        sum
    }

    /// The texel of a place that may be beyond the edges of a map of latitudes.
    fn wrapped(&self, [column, row]: [i64; 2]) -> [usize; 2] {
        let [width, height] = self.size.map(|side| side as i64);
        [column.rem_euclid(width) as usize, row.clamp(0, height - 1) as usize]
    }
}

/// The texel of a place that may be beyond the edges of an octahedral map: the map goes on at the other half of the
/// edge, mirrored.
fn folded([mut column, mut row]: [i64; 2], side: i64) -> [usize; 2] {
    if column < 0 || column >= side {
        column = if column < 0 { -1 - column } else { 2 * side - 1 - column };
        row = side - 1 - row;
    }
    if row < 0 || row >= side {
        row = if row < 0 { -1 - row } else { 2 * side - 1 - row };
        column = side - 1 - column;
    }
    [column, row].map(|place| place.clamp(0, side - 1) as usize)
}

/// The place of a direction on the square whose areas are solid angles (Clarberg, "Fast Equal-Area Mapping of the
/// (Hemi)Sphere using SIMD", 2008).
fn to_square(direction: [f64; 3]) -> [f64; 2] {
    let [x, y, z] = direction.map(f64::abs);
    let radius = (1.0 - z).max(0.0).sqrt();
    let part = libm::atan2(y, x) * (2.0 / PI) * radius;
    let (mut u, mut v) = (radius - part, part);
    if direction[2] < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    [0.5 + 0.5 * u.copysign(direction[0]), 0.5 + 0.5 * v.copysign(direction[1])]
}

/// The place of a direction on a map of longitudes and latitudes, whose rows begin at the upper pole.
fn to_latitudes([x, y, z]: [f64; 3]) -> [f64; 2] {
    let around = libm::atan2(y, x) / (2.0 * PI);
    let down = libm::acos(z.clamp(-1.0, 1.0)) / PI;
    [if around < 0.0 { around + 1.0 } else { around }, down]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_of_the_sphere_have_the_axes_of_pbrt() {
        assert_eq!(to_square([0.0, 0.0, 1.0]), [0.5, 0.5]);
        assert_eq!(to_square([1.0, 0.0, 0.0]), [1.0, 0.5]);
        assert_eq!(to_square([0.0, 1.0, 0.0]), [0.5, 1.0]);
        assert_eq!(to_latitudes([0.0, 0.0, 1.0])[1], 0.0);
        assert_eq!(to_latitudes([0.0, -1.0, 0.0]), [0.75, 0.5]);
    }

    #[test]
    fn places_beyond_an_edge_are_on_its_other_half() {
        assert_eq!(folded([-1, 0], 4), [0, 3]);
        assert_eq!(folded([4, 1], 4), [3, 2]);
        assert_eq!(folded([1, 4], 4), [2, 3]);
        assert_eq!(folded([2, 2], 4), [2, 2]);
    }

    #[test]
    fn sums_grow_from_nothing_to_all() {
        let light = [1.0, 0.0, 3.0, 4.0];
        let sums = sums(&light, 2);
        assert_eq!(&sums[..3], [0.0; 3]);
        assert!((sums[8] - 1.0).abs() < 1e-6, "{sums:?}");
        let cell = sums[8] - sums[7] - sums[5] + sums[4];
        assert!((f64::from(cell) - (4.0 + 0.1) / (8.0 + 0.4)).abs() < 1e-6, "{sums:?}");
        // A black sky has sums, too: samples need a density.
        assert!(super::sums(&[0.0; 4], 2)[8] > 0.99);
    }
}
