//! The opening of a camera's diaphragm: pbrt's shapes by name, or a picture.

use rtsl::Diagnostic;
use rtsl_image::{Encoding, Picture, PictureError};
use rtsl_math::{exponential, sine_and_cosine_of_degrees};

use crate::reader::{Parameter, SceneFiles, unreadable};

/// The part of light that an opening lets through, over the square around the diaphragm.
pub struct Aperture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row from the bottom; scaled so that as much light passes as through a round hole.
    pub texels: Vec<f64>,
}

/// The sides of the pictures of shapes.
const RESOLUTION: usize = 256;

impl Aperture {
    /// A round hole, which needs no texels.
    pub const ROUND: Aperture = Aperture { width: 0, height: 0, texels: Vec::new() };

    /// The shape with this name, or the picture in this file.
    ///
    /// # Errors
    /// If the picture cannot be read.
    pub fn new(
        name: &str,
        parameter: &Parameter,
        files: SceneFiles<'_>,
    ) -> Result<Self, Box<Diagnostic>> {
        let aperture = match name {
            "gaussian" => drawn(gaussian),
            "square" => drawn(|[x, y]| if x.abs() < 0.5 && y.abs() < 0.5 { 1.0 } else { 0.0 }),
            "pentagon" => drawn(inside(polygon(5, |_| 0.8, 90.0))),
            "star" => drawn(star()),
            _ => read(name, parameter, files)?,
        };
        Ok(aperture.normalized())
    }

    /// The same with a mean of pi / 4, the area of a disk in its square.
    fn normalized(mut self) -> Self {
        let sum: f64 = self.texels.iter().sum();
        if sum > 0.0 {
            let scale = std::f64::consts::FRAC_PI_4 * self.texels.len() as f64 / sum;
            self.texels.iter_mut().for_each(|texel| *texel *= scale);
        }
        self
    }
}

/// A picture of a function over the square from -1 to 1.
fn drawn(shape: impl Fn([f64; 2]) -> f64) -> Aperture {
    let place = |step: usize| (step as f64 + 0.5) / RESOLUTION as f64 * 2.0 - 1.0;
    let rows = 0..RESOLUTION;
    // The shapes of pbrt point down in its pictures, whose rows it then reverses.
    let texels =
        rows.flat_map(|row| (0..RESOLUTION).map(move |column| [place(column), -place(row)]));
    Aperture { width: RESOLUTION, height: RESOLUTION, texels: texels.map(shape).collect() }
}

fn gaussian([x, y]: [f64; 2]) -> f64 {
    (exponential(-(x * x + y * y)) - exponential(-1.0)).max(0.0)
}

fn star() -> impl Fn([f64; 2]) -> f64 {
    let inner = cosine(72.0) / cosine(36.0);
    inside(polygon(10, |corner| if corner % 2 == 1 { 1.0 } else { inner }, 0.0))
}

fn cosine(degrees: f64) -> f64 {
    sine_and_cosine_of_degrees(degrees).1
}

/// The corners of a polygon, of which the first lies in the direction `first`, in degrees.
fn polygon(corners: usize, radius: impl Fn(usize) -> f64, first: f64) -> Vec<[f64; 2]> {
    let corner = |index: usize| {
        let (sine, cosine) =
            sine_and_cosine_of_degrees(first + 360.0 * index as f64 / corners as f64);
        [radius(index) * cosine, radius(index) * sine]
    };
    (0..corners).map(corner).collect()
}

/// 1 inside a polygon that does not meet itself, 0 outside: the number of its edges to the right of a point is odd.
fn inside(corners: Vec<[f64; 2]>) -> impl Fn([f64; 2]) -> f64 {
    move |[x, y]| {
        let next = corners.iter().cycle().skip(1);
        let is_right = |(from, to): (&[f64; 2], &[f64; 2])| {
            let crosses = (from[1] <= y) != (to[1] <= y);
            crosses && x < from[0] + (y - from[1]) / (to[1] - from[1]) * (to[0] - from[0])
        };
        let count = corners.iter().zip(next).filter(|edge| is_right(*edge)).count();
        if count % 2 == 1 { 1.0 } else { 0.0 }
    }
}

/// The mean of the colours of a picture.
fn read(
    name: &str,
    parameter: &Parameter,
    files: SceneFiles<'_>,
) -> Result<Aperture, Box<Diagnostic>> {
    let path = files.path(name);
    let named_here =
        |diagnostic: Diagnostic| Box::new(diagnostic.at(parameter.values_span, "named here"));
    let input = files.read(&path).map_err(|error| named_here(unreadable(&path, &error)))?;
    let read = Picture::read(&input.bytes, Encoding::Srgb, files.budget);
    let (picture, _held) = read.map_err(|error| {
        named_here(match error {
            PictureError::Malformed(problem) => unreadable(&path, &std::io::Error::other(problem)),
            PictureError::OverBudget(error) => error.diagnostic(path.display()),
        })
    })?;
    let (width, height) = (picture.width, picture.height);
    let grey = |color: [f32; 3]| color.iter().map(|part| f64::from(*part)).sum::<f64>() / 3.0;
    let greys: Vec<f64> = picture.colors().map(grey).collect();
    // Rows of pictures count from the top.
    let texels = greys.chunks(width.max(1)).rev().flatten().copied().collect();
    Ok(Aperture { width, height, texels })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(aperture: &Aperture, x: f64, y: f64) -> f64 {
        let texel = |place: f64| ((place + 1.0) / 2.0 * RESOLUTION as f64) as usize;
        aperture.texels[texel(y) * RESOLUTION + texel(x)]
    }

    #[test]
    fn shapes_let_as_much_light_through_as_a_disk() {
        let shapes = [
            drawn(gaussian),
            drawn(inside(polygon(5, |_| 0.8, 90.0))),
            drawn(star()),
            drawn(|_| 1.0),
        ];
        for shape in shapes {
            let shape = shape.normalized();
            let mean = shape.texels.iter().sum::<f64>() / shape.texels.len() as f64;
            assert!((mean - std::f64::consts::FRAC_PI_4).abs() < 1e-9);
        }
    }

    #[test]
    fn a_pentagon_has_five_corners_and_a_star_five_points() {
        let pentagon = drawn(inside(polygon(5, |_| 0.8, 90.0)));
        // The corner is below because pbrt turns its pictures around.
        assert_eq!((at(&pentagon, 0.0, -0.75), at(&pentagon, 0.0, 0.75)), (1.0, 0.0));
        let area = pentagon.texels.iter().sum::<f64>() / (RESOLUTION * RESOLUTION) as f64;
        // 5/2 r^2 sin 72 degrees of the square's 4.
        assert!((area - 2.5 * 0.64 * 0.951_056_5 / 4.0).abs() < 2e-3, "{area}");
        let star = drawn(star());
        assert_eq!((at(&star, -0.9, 0.0), at(&star, 0.9, 0.0)), (1.0, 0.0));
    }
}
