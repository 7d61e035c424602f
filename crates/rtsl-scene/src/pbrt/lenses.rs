//! The lenses of cameras, as values of the class `Realistic`: surfaces from a file, focused, and the exit pupils
//! through which the film sees the scene.
//!
//! All numbers are computed by additions, multiplications, divisions and roots of binary64, so that they have the same
//! bits everywhere.

use std::io;

use rtsl::{Diagnostic, Numbers, Scalar, Value, diagnostic_codes as codes, encoding};
use rtsl_memory::Amount;

use super::aperture::Aperture;
use super::images::Images;
use crate::description::Entity;
use crate::reader::{Input, Parameter, SceneFiles, unreadable};
use crate::vector::dot;

/// The film's parameter that cameras with lenses need, in millimetres.
pub const DIAGONAL: &str = "diagonal";

/// The parameters of the format.
pub const PARAMETERS: &[&str] =
    &["lensfile", "aperturediameter", "focusdistance", "aperture", DIAGONAL];

/// The greatest number of surfaces: each camera ray meets all of them.
const MAX_SURFACES: usize = 256;

/// The greatest length in the file, in millimetres.
const GREATEST_LENGTH: f64 = 1e6;

/// The rings of the film that have pupils, and the rays sent to find each: rows and columns.
const RINGS: usize = 64;
const PUPIL_ROWS: usize = 128;

/// The values of the class for the lenses that a camera names.
pub fn values(
    entity: &Entity,
    files: SceneFiles<'_>,
    _: &mut Images,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    let Some((name, parameter)) = text(entity, "lensfile") else {
        let message = format!("`{}` names no file of lenses", entity.class);
        let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, message);
        return Err(Box::new(diagnostic.at(entity.class_span, "expected `\"string lensfile\"`")));
    };
    let numbers = read_numbers(name, parameter, files)?;
    let wrong = |message: String, parameter: &Parameter| {
        Box::new(Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, ""))
    };
    let diameter = entity.number("aperturediameter").unwrap_or(1.0) / 1000.0;
    let mut lenses = Lenses::new(&numbers, diameter)
        .ok_or_else(|| wrong(format!("`{name}` does not describe lenses: expected up to {MAX_SURFACES} rows of four numbers, of which the third is a refractive index"), parameter))?;
    let diagonal = entity.number(DIAGONAL).unwrap_or(35.0) / 1000.0;
    let distance = entity.number("focusdistance").unwrap_or(10.0);
    if lenses.focus(distance, diagonal).is_none() {
        let place = entity.parameter("focusdistance").unwrap_or(parameter);
        return Err(wrong(
            format!("the lenses cannot be focused at a distance of {distance}"),
            place,
        ));
    }
    let mut values = vec![
        ("elements".to_owned(), floats(lenses.elements())),
        ("count".to_owned(), Value::Int(lenses.0.len() as i32)),
        ("pupils".to_owned(), floats(lenses.pupils(diagonal))),
        ("rings".to_owned(), Value::Int(RINGS as i32)),
        ("diagonal".to_owned(), Value::Float(diagonal as f32)),
    ];
    let aperture = match text(entity, "aperture") {
        Some((name, parameter)) => Aperture::new(name, parameter, files)?,
        None => Aperture::ROUND,
    };
    let size = [aperture.width, aperture.height].map(|side| Value::Int(side as i32)).to_vec();
    values.push(("aperture".to_owned(), floats(aperture.texels)));
    values.push(("apertureSize".to_owned(), Value::List(size)));
    Ok(values)
}

fn text<'e>(entity: &'e Entity, name: &str) -> Option<(&'e str, &'e Parameter)> {
    entity.text(name).filter(|(text, _)| !text.is_empty())
}

fn floats(numbers: Vec<f64>) -> Value {
    let bits = |number: f64| (number as f32).to_bits();
    let words: Vec<u32> = numbers.into_iter().map(bits).collect();
    Value::Numbers(Numbers::from_words(Scalar::F32, words))
}

/// The numbers of a file, with comments after `#`; those that are not finite are reported with the rows.
fn read_numbers(
    name: &str,
    parameter: &Parameter,
    files: SceneFiles<'_>,
) -> Result<Vec<f64>, Box<Diagnostic>> {
    let path = files.path(name);
    let input = files.read(&path).and_then(|mut input| {
        // A number of eight bytes may come from two bytes of text.
        input.held.grow_to(Amount(input.bytes.len() as u64).times(6))?;
        encoding::check_width(&input.bytes).map_err(io::Error::other)?;
        Ok(input)
    });
    let Input { bytes, held: _held } = input.map_err(|error| {
        Box::new(unreadable(&path, &error).at(parameter.values_span, "named here"))
    })?;
    let text = String::from_utf8_lossy(encoding::without_mark(&bytes));
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or(""));
    let words = lines.flat_map(str::split_whitespace);
    Ok(words.map(|word| word.parse().unwrap_or(f64::NAN)).collect())
}

/// A surface between two media, or the diaphragm.
#[derive(Clone, Copy, Debug)]
struct Surface {
    /// The radius of curvature, positive if the centre is on the film's side; 0 for the diaphragm.
    radius: f64,
    /// The distance to the next surface towards the film, or to the film.
    thickness: f64,
    /// The ratio of the refractive indices on the film's side and on the scene's side.
    ratio: f64,
    /// The radius of its rim.
    rim: f64,
}

/// The surfaces of an objective, from the scene to the film, in metres.
struct Lenses(Vec<Surface>);

/// A ray. The film is the plane z = 0, and the scene is towards +z.
#[derive(Clone, Copy)]
struct Ray {
    origin: [f64; 3],
    direction: [f64; 3],
}

impl Lenses {
    /// Reads rows of four numbers: radius of curvature, thickness, refractive index on the film's side (0 for the
    /// diaphragm) and diameter, in millimetres. `diameter` is the diaphragm's, unless that is smaller.
    fn new(numbers: &[f64], diameter: f64) -> Option<Self> {
        let (rows, rest) = numbers.as_chunks::<4>();
        let is_usable = rest.is_empty() && (1..=MAX_SURFACES).contains(&rows.len());
        if !is_usable || !numbers.iter().all(|number| number.abs() <= GREATEST_LENGTH) {
            return None;
        }
        let mut surfaces: Vec<Surface> = Vec::with_capacity(rows.len());
        let mut outside = 1.0;
        for [radius, thickness, index, width] in rows {
            let index = if *index == 0.0 { 1.0 } else { *index };
            let is_stop = *radius == 0.0;
            let width = width / 1000.0;
            surfaces.push(Surface {
                radius: radius / 1000.0,
                thickness: thickness / 1000.0,
                ratio: index / outside,
                rim: 0.5 * if is_stop { width.min(diameter) } else { width },
            });
            outside = index;
        }
        (surfaces.iter().all(|surface| surface.ratio > 0.0)).then_some(Lenses(surfaces))
    }

    /// The distance of a surface from the film.
    fn place(&self, index: usize) -> f64 {
        self.0[index..].iter().map(|surface| surface.thickness).sum()
    }

    /// Sends a ray from the film to the scene.
    fn trace_from_film(&self, ray: Ray) -> Option<Ray> {
        let mut ray = ray;
        let mut place = 0.0;
        for surface in self.0.iter().rev() {
            place += surface.thickness;
            ray = surface.refracted(place, ray, surface.ratio)?;
        }
        Some(ray)
    }

    /// Sends a ray from the scene to the film.
    fn trace_from_scene(&self, ray: Ray) -> Option<Ray> {
        let mut ray = ray;
        let mut place = self.place(0);
        for surface in &self.0 {
            ray = surface.refracted(place, ray, 1.0 / surface.ratio)?;
            place -= surface.thickness;
        }
        Some(ray)
    }

    /// Moves the lenses so that the film sees a plane at `distance` sharp, by the approximation of a thick lens;
    /// returns `None` if that is too near.
    fn focus(&mut self, distance: f64, diagonal: f64) -> Option<()> {
        let height = 0.001 * diagonal;
        let front = Ray { origin: [height, 0.0, self.place(0) + 1.0], direction: [0.0, 0.0, -1.0] };
        let behind = self.place(self.0.len() - 1) - 1.0;
        let rear = Ray { origin: [height, 0.0, behind], direction: [0.0, 0.0, 1.0] };
        // Places of the principal planes and focal points, counted from the film away from the scene as in pbrt.
        let [film_plane, film_focus] = cardinal_points(front, self.trace_from_scene(front)?);
        let [scene_plane, _] = cardinal_points(rear, self.trace_from_film(rear)?);
        let focal_length = film_focus - film_plane;
        let between = scene_plane + distance;
        let square = (between - film_plane) * (between - 4.0 * focal_length - film_plane);
        let moved = (between + film_plane - square.sqrt()) / 2.0;
        let last = self.0.last_mut()?;
        if !(square > 0.0 && (last.thickness + moved) > 0.0) {
            return None;
        }
        last.thickness += moved;
        Some(())
    }

    /// The numbers of the class's buffer `elements`.
    fn elements(&self) -> Vec<f64> {
        let indices = (0..self.0.len()).rev();
        let numbers = indices.flat_map(|index| {
            let Surface { radius, ratio, rim, .. } = self.0[index];
            [radius, self.place(index), ratio, rim]
        });
        numbers.collect()
    }

    /// The numbers of the class's buffer `pupils`: bounds of the points of the last lens's plane through which rays from
    /// a ring of the film get to the scene; all 0 for a ring from which none does.
    fn pupils(&self, diagonal: f64) -> Vec<f64> {
        let last = self.0.len() - 1;
        let (rear, reach) = (self.place(last), 1.5 * self.0[last].rim);
        let ring = |ring: usize| {
            let mut bounds = [f64::INFINITY, f64::INFINITY, -f64::INFINITY, -f64::INFINITY];
            for index in 0..PUPIL_ROWS * PUPIL_ROWS {
                let (row, column) = (index / PUPIL_ROWS, index % PUPIL_ROWS);
                // Each row and each column meets all parts of the ring.
                let part = ((7 * row + column) % PUPIL_ROWS) as f64 / (PUPIL_ROWS - 1) as f64;
                let origin = [(ring as f64 + part) / RINGS as f64 * diagonal / 2.0, 0.0, 0.0];
                let place =
                    |step: usize| ((step as f64 + 0.5) / PUPIL_ROWS as f64 * 2.0 - 1.0) * reach;
                let target = [place(column), place(row), rear];
                let is_outside =
                    |axis: usize| target[axis] < bounds[axis] || target[axis] > bounds[axis + 2];
                let direction = [0, 1, 2].map(|axis| target[axis] - origin[axis]);
                if (is_outside(0) || is_outside(1))
                    && self.trace_from_film(Ray { origin, direction }).is_some()
                {
                    for axis in 0..2 {
                        bounds[axis] = bounds[axis].min(target[axis]);
                        bounds[axis + 2] = bounds[axis + 2].max(target[axis]);
                    }
                }
            }
            if bounds[0] > bounds[2] {
                return [0.0; 4];
            }
            // Twice the diagonal of a cell, for the rays between those that were sent.
            let margin = 4.0 * reach / PUPIL_ROWS as f64 * 2.0_f64.sqrt();
            [bounds[0] - margin, bounds[1] - margin, bounds[2] + margin, bounds[3] + margin]
        };
        (0..RINGS).flat_map(ring).collect()
    }
}

/// The places, away from the scene, of the principal plane and the focal point on the side that a ray parallel to the
/// axis leaves.
fn cardinal_points(from: Ray, Ray { origin, direction }: Ray) -> [f64; 2] {
    let place = |t: f64| -(origin[2] + t * direction[2]);
    let to_axis = -origin[0] / direction[0];
    let to_height = (from.origin[0] - origin[0]) / direction[0];
    [place(to_height), place(to_axis)]
}

impl Surface {
    /// The ray behind the surface at `place`; `None` if it misses the surface or is reflected totally. `ratio` is that
    /// of the refractive indices before and behind.
    fn refracted(&self, place: f64, Ray { origin, direction }: Ray, ratio: f64) -> Option<Ray> {
        let direction = normalized(direction);
        let point = |t: f64| [0, 1, 2].map(|axis| origin[axis] + t * direction[axis]);
        if self.radius == 0.0 {
            let t = (place - origin[2]) / direction[2];
            let hit = point(t);
            let is_within = t >= 0.0 && self.is_within_rim(hit);
            return is_within.then_some(Ray { origin: hit, direction });
        }
        let centre = place - self.radius;
        let offset = [origin[0], origin[1], origin[2] - centre];
        let along = dot(offset, direction);
        let root = along * along - dot(offset, offset) + self.radius * self.radius;
        if root.is_nan() || root < 0.0 {
            return None;
        }
        let is_nearer = (direction[2] < 0.0) != (self.radius < 0.0);
        let t = if is_nearer { -along - root.sqrt() } else { -along + root.sqrt() };
        let hit = point(t);
        if !(t >= 0.0 && self.is_within_rim(hit)) {
            return None;
        }
        let normal = normalized([hit[0], hit[1], hit[2] - centre]);
        let facing = if dot(normal, direction) > 0.0 { normal.map(|part| -part) } else { normal };
        Some(Ray { origin: hit, direction: refract(direction, facing, ratio)? })
    }

    fn is_within_rim(&self, [x, y, _]: [f64; 3]) -> bool {
        x * x + y * y <= self.rim * self.rim
    }
}

/// Snell's law, for unit vectors; `None` for total reflection.
fn refract(direction: [f64; 3], normal: [f64; 3], ratio: f64) -> Option<[f64; 3]> {
    let cosine = -dot(direction, normal);
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    let bend = ratio * cosine - square.sqrt();
    (square > 0.0).then(|| [0, 1, 2].map(|axis| ratio * direction[axis] + bend * normal[axis]))
}

fn normalized(vector: [f64; 3]) -> [f64; 3] {
    let length = dot(vector, vector).sqrt();
    vector.map(|part| part / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric lens of crown glass, 2 mm thick, with a diaphragm before it.
    const SINGLET: [f64; 12] = [0.0, 2.0, 0.0, 20.0, 50.0, 2.0, 1.5, 20.0, -50.0, 50.0, 1.0, 20.0];

    #[test]
    fn a_lens_is_focused_by_the_equation_of_thick_lenses() {
        let mut lenses = Lenses::new(&SINGLET, 0.02).unwrap();
        lenses.focus(1.0, 0.035).unwrap();
        // 1/f = (n - 1) (2/R - (n - 1) d / (n R^2)), and the principal planes lie f (n - 1) d / (n R) within the lens.
        let focal_length = 1.0 / (0.5 * (2.0 / 0.05 - 0.5 * 0.002 / (1.5 * 0.05 * 0.05)));
        let inset = focal_length * 0.5 * 0.002 / (1.5 * 0.05);
        let back = lenses.place(2) + inset;
        let front = 1.0 - (lenses.place(1) - inset);
        assert!((1.0 / back + 1.0 / front - 1.0 / focal_length).abs() < 0.02, "{back} {front}");
        // Rays near the axis from the film's centre meet at that distance.
        for height in [1e-4, 2e-4] {
            let ray = Ray { origin: [0.0; 3], direction: [height, 0.0, lenses.place(2)] };
            let Ray { origin, direction } = lenses.trace_from_film(ray).unwrap();
            let meets = origin[2] - origin[0] / direction[0] * direction[2];
            assert!((meets - 1.0).abs() < 0.005, "{meets}");
        }
        assert!(lenses.focus(0.06, 0.035).is_none(), "nearer than the focal length");
    }

    #[test]
    fn rays_return_the_way_they_came() {
        let lenses = Lenses::new(&SINGLET, 0.02).unwrap();
        let direction = normalized([0.002, 0.004, 0.05]);
        let start = Ray { origin: [0.003, -0.002, 0.0], direction };
        let Ray { origin, direction } = lenses.trace_from_film(start).unwrap();
        let back = Ray { origin, direction: direction.map(|part| -part) };
        let Ray { origin, direction } = lenses.trace_from_scene(back).unwrap();
        let t = -origin[2] / direction[2];
        for axis in 0..2 {
            assert!((origin[axis] + t * direction[axis] - start.origin[axis]).abs() < 1e-12);
        }
    }

    #[test]
    fn pupils_bound_the_rays_that_get_through() {
        let lenses = Lenses::new(&SINGLET, 0.006).unwrap();
        let pupils = lenses.pupils(0.035);
        assert_eq!(pupils.len(), 4 * RINGS);
        let (rear, mut through) = (lenses.place(2), 0);
        for ring in [0, 20, 63] {
            let origin = [(ring as f64 + 0.37) / RINGS as f64 * 0.0175, 0.0, 0.0];
            for step in 0..10_000 {
                let target =
                    [step % 100, step / 100].map(|place| (f64::from(place) / 99.0 - 0.5) * 0.03);
                let direction = [target[0] - origin[0], target[1], rear];
                if lenses.trace_from_film(Ray { origin, direction }).is_some() {
                    through += 1;
                    let bounds = &pupils[4 * ring..];
                    assert!(bounds[0] <= target[0] && target[0] <= bounds[2], "{ring}");
                    assert!(bounds[1] <= target[1] && target[1] <= bounds[3], "{ring}");
                }
            }
        }
        assert!(through > 500, "{through}");
        // The diaphragm has a diameter of 6 mm, and the lens makes it appear little larger.
        assert!(pupils[2] - pupils[0] < 0.01, "{}", pupils[2] - pupils[0]);
    }

    #[test]
    fn what_describes_no_lenses_is_refused() {
        assert!(Lenses::new(&[], 0.01).is_none());
        assert!(Lenses::new(&[1.0, 2.0, 1.5], 0.01).is_none());
        assert!(Lenses::new(&[1.0, 2.0, f64::NAN, 3.0], 0.01).is_none());
        assert!(Lenses::new(&[1.0, 2.0, -1.5, 3.0], 0.01).is_none());
        assert!(Lenses::new(&vec![1.0; 4 * 300], 0.01).is_none());
    }
}
