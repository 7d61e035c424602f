//! Lights with images: skies, goniometric lights, projectors, and shapes that glow as an image.

use rtsl::{Diagnostic, Numbers, Value};
use rtsl_image::{Mipmap, Picture};

use super::images::{Images, Use};
use crate::description::Entity;
use crate::reader::{Parameter, SceneFiles, Values};

/// The arguments of a class, or the error of a file.
type Made = Result<Vec<(String, Value)>, Box<Diagnostic>>;

/// The parameters of skies that [`sky`] reads.
pub const SKY: &[&str] =
    &["filename", "illuminance", "encoding", "filter", "maxanisotropy", "wrap", "mapping"];

/// The parameters of other lights with images that are read here.
pub const LIGHT: &[&str] = &["filename", "power"];

/// The parameters of area lights that [`glow`] and [`given_power`] read.
pub const GLOW: &[&str] = &["filename", "power"];

/// The arguments of a sky.
pub fn sky(entity: &Entity, files: SceneFiles<'_>, images: &mut Images) -> Made {
    let sky = images.of(entity, files, Use::Sky)?;
    let mut values = sky.values.clone();
    if let Some(illuminance) = entity.number("illuminance").filter(|it| *it > 0.0) {
        values.push(gain(illuminance, illuminance_of(&sky.image)));
    }
    Ok(values)
}

/// The arguments of the texture of a goniometric light, and the light's gain.
pub fn goniometric(entity: &Entity, files: SceneFiles<'_>, images: &mut Images) -> Made {
    let power = entity.number("power").filter(|it| *it > 0.0);
    if !has_file(entity) {
        return Ok(power.map(|power| gain(power, SPHERE)).into_iter().collect());
    }
    let image = images.of(entity, files, Use::Light)?;
    let mut values = slide(&image.values, true);
    if let Some(power) = power {
        let means = image
            .image
            .colors()
            .map(|color| color.iter().map(|it| f64::from(*it)).sum::<f64>() / 3.0);
        let mean = means.sum::<f64>() / texels(&image.image);
        values.push(gain(power, SPHERE * mean));
    }
    Ok(values)
}

/// The arguments of the texture of a projector, and the projector's shape and gain.
pub fn projection(entity: &Entity, files: SceneFiles<'_>, images: &mut Images) -> Made {
    let image = images.of(entity, files, Use::Light)?;
    let mut values = slide(&image.values, true);
    let aspect = image.image.width as f64 / image.image.height as f64;
    values.push(("aspect".to_owned(), Value::Float(aspect as f32)));
    if let Some(power) = entity.number("power").filter(|it| *it > 0.0) {
        let fov = entity.number("fov").unwrap_or(90.0);
        values.push(gain(power, power_of_slide(&image.image, aspect, fov)));
    }
    Ok(values)
}

/// The arguments of the texture of a shape that glows as an image.
pub fn glow(entity: &Entity, files: SceneFiles<'_>, images: &mut Images) -> Made {
    if !has_file(entity) {
        return Ok(Vec::new());
    }
    Ok(slide(&images.of(entity, files, Use::Light)?.values, false))
}

/// The power that an area light is given on each face of its shape.
pub fn given_power(light: &Entity) -> Option<f64> {
    light.number("power").filter(|power| *power > 0.0)
}

impl Images {
    /// Returns the luminance of an area light's image, or 1, for each side that glows.
    pub fn mean_glow(&mut self, light: &Entity, files: SceneFiles<'_>) -> f64 {
        let is_two_sided = |it: &Parameter| match &it.values {
            Values::Booleans(values) => {
                it.name.eq_ignore_ascii_case("twosided") && values.first() == Some(&true)
            }
            Values::Numbers(_) | Values::Texts(_) | Values::Buffer(_) => false,
        };
        let sides = if light.parameters.iter().any(is_two_sided) { 2.0 } else { 1.0 };
        // The error of an image that cannot be read is reported where the light is made.
        let image = has_file(light).then(|| self.of(light, files, Use::Light).ok()).flatten();
        let mean = |it: &Mipmap| it.colors().map(luminance).sum::<f64>() / texels(it);
        sides * image.map_or(1.0, |converted| mean(&converted.image))
    }
}

/// The solid angle of the sphere.
const SPHERE: f64 = 4.0 * std::f64::consts::PI;

pub fn has_file(entity: &Entity) -> bool {
    entity.parameter("filename").is_some()
}

/// The factor from what a light has to what it should have; 1 if it has nothing.
pub fn gain(expected: f64, found: f64) -> (String, Value) {
    let factor = (expected / found) as f32;
    ("gain".to_owned(), Value::Float(if factor.is_finite() { factor } else { 1.0 }))
}

/// The arguments of a texture that ends at its edges, taken texel by texel or smoothed.
fn slide(values: &[(String, Value)], is_sharp: bool) -> Vec<(String, Value)> {
    let mut values = values.to_vec();
    values.push(("wrap".to_owned(), Value::Int(1)));
    values.push(("filtering".to_owned(), Value::Int(i32::from(is_sharp))));
    values
}

fn texels(image: &Mipmap) -> f64 {
    (image.width * image.height) as f64
}

fn luminance([red, green, blue]: [f32; 3]) -> f64 {
    0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
}

/// Cumulative distributions of a sky's light. Square images are octahedral maps, others latitude-longitude maps.
pub fn distributions(picture: &Picture) -> [(String, Value); 3] {
    let latitudes = picture.width != picture.height;
    let height = picture.height as f64;
    // A parabola through both poles and the equator approximates the sine; it only affects the sampling density.
    let width_of = |row: usize| {
        let down = (row as f64 + 0.5) / height;
        if latitudes { 4.0 * down * (1.0 - down) } else { 1.0 }
    };
    let (rows, columns) = picture.sums(width_of);
    [
        ("rows".to_owned(), Value::Numbers(Numbers::floats(rows))),
        ("columns".to_owned(), Value::Numbers(Numbers::floats(columns))),
        ("latitudes".to_owned(), Value::Bool(latitudes)),
    ]
}

/// The illuminance of a sky's upper half by pbrt-v4's formula, which is half of that on a surface that faces up.
pub fn illuminance_of(image: &Mipmap) -> f64 {
    let (width, height) = (image.width, image.height);
    let latitudes = width != height;
    let weight = |index: usize| {
        let (x, y) = (index % width, index / width);
        let place = |at: usize, of: usize| (at as f64 + 0.5) / of as f64;
        if latitudes {
            let (sine, cosine) = rtsl_math::sine_and_cosine_of_degrees(180.0 * place(y, height));
            // The solid angle of a texel over that of an octahedral map's.
            cosine.max(0.0) * sine * std::f64::consts::FRAC_PI_2
        } else {
            let [u, v] = [place(x, width), place(y, height)].map(|it| (2.0 * it - 1.0).abs());
            let inside = 1.0 - u - v;
            let radius = 1.0 - inside.abs();
            if inside > 0.0 { 1.0 - radius * radius } else { 0.0 }
        }
    };
    let colors = image.colors().enumerate();
    let sum: f64 = colors.map(|(index, color)| luminance(color) * weight(index)).sum();
    0.5 * SPHERE * sum / texels(image)
}

/// The power of a projector: the integral of its slide over the solid angle.
fn power_of_slide(image: &Mipmap, aspect: f64, fov: f64) -> f64 {
    let (sine, cosine) = rtsl_math::sine_and_cosine_of_degrees(0.5 * fov);
    let tangent = sine / cosine;
    let sides = if aspect > 1.0 { [aspect, 1.0] } else { [1.0, 1.0 / aspect] };
    let area = 4.0 * tangent * tangent * sides[0] * sides[1];
    let weight = |index: usize| {
        let place = |at: usize, of: usize| 2.0 * (at as f64 + 0.5) / of as f64 - 1.0;
        let x = place(index % image.width, image.width) * sides[0] * tangent;
        let y = place(index / image.width, image.height) * sides[1] * tangent;
        let square = 1.0 + x * x + y * y;
        1.0 / (square * square.sqrt())
    };
    let colors = image.colors().enumerate();
    let sum: f64 = colors.map(|(index, color)| luminance(color) * weight(index)).sum();
    area * sum / texels(image)
}
